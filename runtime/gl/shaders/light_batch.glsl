// A few lights, written out one by one: the place of every value is then known when the program is compiled.
#define BATCH_MEMBERS                                                                                                  \
  vec4 right[LIGHTS];         /* xyz: of the shadow map, unit, w: layer of the room's maps */                          \
  vec4 up[LIGHTS];                                                                                                     \
  vec4 toward[LIGHTS];        /* xyz: direction, unit, w: layer of the objects' maps */                                \
  vec4 irradiance[LIGHTS];    /* rgb */                                                                                \
  vec4 pane[LIGHTS * QUADS];  /* rgb: what a window lets through, at the light's angle; w: 1 with its last edges */    \
  vec4 slope[LIGHTS * QUADS]; /* of the window's edges; -1e30 where the light does not lead out */
#if VERTEX
layout(std140, binding = 0) uniform LightBatch { BATCH_MEMBERS } batch;
#if FLAT
flat out vec4 right[LIGHTS], up[LIGHTS], toward[LIGHTS], irradiance[LIGHTS], pane[LIGHTS * QUADS],
    slope[LIGHTS * QUADS];
#define HAND_ON_BATCH                                                                                                  \
  right = batch.right;                                                                                                 \
  up = batch.up;                                                                                                       \
  toward = batch.toward;                                                                                               \
  irradiance = batch.irradiance;                                                                                       \
  pane = batch.pane;                                                                                                   \
  slope = batch.slope;
#else
#define HAND_ON_BATCH
#endif
#elif FLAT
flat in vec4 right[LIGHTS], up[LIGHTS], toward[LIGHTS], irradiance[LIGHTS], pane[LIGHTS * QUADS], slope[LIGHTS * QUADS];
#else
layout(std140, binding = 0) uniform LightBatch { BATCH_MEMBERS };
#endif
