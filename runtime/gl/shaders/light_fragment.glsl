// Direct daylight at points: the GPU form of runtime/light/direct_light.h.
flat in vec4 sphere;
layout(binding = 0) uniform sampler2D point_offset; // xyz: from the sphere's centre
layout(binding = 1) uniform sampler2D point_normal;
layout(binding = 2) uniform sampler2DArrayShadow object_maps;
layout(binding = 3) uniform sampler2DArrayShadow room_maps;
uniform vec2 map_texels; // x: side of the maps in texels, y: half the depth range of the room's, metres

// Sum over lights of e_j, of e_j past the room, and of what of that the objects take.
layout(location = 0) out vec4 unblocked;
layout(location = 1) out vec4 lost;
layout(location = 2) out vec4 past_room; // as unblocked where nothing of the room can block: then not written

// 1 where light reaches a point, 0 behind an occluder, between at filtered edges. p: the point, from the sphere's centre
// along right, up and toward. extent: half the depth range of the map, metres; bias: metres towards the light.
float map_visibility(sampler2DArrayShadow maps, float layer, vec3 p, float extent, float bias) {
  return texture(maps, vec4(0.5 + 0.5 / sphere.w * p.xy, layer, clamp(0.5 - 0.5 / extent * (p.z + bias), 0.0, 1.0)));
}
#define ALONG(K, Q) vec3(dot(right[K].xyz, Q), dot(up[K].xyz, Q), dot(toward[K].xyz, Q))

void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec3 offset = texelFetch(point_offset, place, 0).xyz, n = texelFetch(point_normal, place, 0).xyz, x = offset + sphere.xyz;
  vec3 e[LIGHTS];
  bool inside[LIGHTS], crossed[LIGHTS];
#define START(K)                                                                                                       \
  e[K] = irradiance[K].rgb * max(dot(n, toward[K].xyz), 0.0);                                                          \
  inside[K] = true;                                                                                                    \
  crossed[K] = false;
  EACH_LIGHT(START)
  for (int w = 0; w < QUADS; ++w) {
    float h = dot(window_plane[w].xyz, x) + window_plane[w].w;
    vec4 d = vec4(dot(window_edge[4 * w].xyz, x), dot(window_edge[4 * w + 1].xyz, x),
                  dot(window_edge[4 * w + 2].xyz, x), dot(window_edge[4 * w + 3].xyz, x)) +
             vec4(window_edge[4 * w].w, window_edge[4 * w + 1].w, window_edge[4 * w + 2].w, window_edge[4 * w + 3].w);
#define PASS(K)                                                                                                        \
  {                                                                                                                    \
    vec4 passed = d + slope[QUADS * K + w] * h;                                                                        \
    inside[K] = inside[K] && h > 0.0 && min(min(passed.x, passed.y), min(passed.z, passed.w)) >= 0.0;                  \
    bool ends = pane[QUADS * K + w].w > 0.0, through = ends && inside[K];                                              \
    e[K] *= through ? pane[QUADS * K + w].rgb : vec3(1.0);                                                             \
    crossed[K] = crossed[K] || through;                                                                                \
    inside[K] = inside[K] || ends;                                                                                     \
  }
    EACH_LIGHT(PASS)
  }
  unblocked = lost = past_room = vec4(0.0);
  // A texel of the map is flat: a surface tilted by angle t differs by tan t within it, so the receiver is moved along
  // its normal, where a tilt moves the look-up sideways off the surface.
  float texel = 2.0 * sphere.w / map_texels.x;
#define ADD(K)                                                                                                         \
  {                                                                                                                    \
    vec3 arrives = crossed[K] ? e[K] : vec3(0.0);                                                                      \
    float c = dot(n, toward[K].xyz);                                                                                   \
    vec3 lifted = offset + n * (texel * (0.3 + 0.6 * sqrt(max(1.0 - c * c, 0.0))));                                    \
    vec3 p = OWN_SHADOW ? ALONG(K, lifted) : ALONG(K, offset);                                                         \
    bool reached = OWN_SHADOW || (max(abs(p.x), abs(p.y)) < sphere.w && p.z < sphere.w);                               \
    unblocked.rgb += arrives;                                                                                          \
    ROOM_SHADOW(K)                                                                                                     \
    float object = map_visibility(object_maps, toward[K].w, p, sphere.w, OWN_SHADOW ? 0.5 * texel : 0.0);              \
    lost.rgb += arrives * (reached ? 1.0 - object : 0.0);                                                              \
  }
#if ROOM_SHADOWS
#define ROOM_SHADOW(K)                                                                                                 \
  float room = map_visibility(room_maps, right[K].w, ALONG(K, lifted), map_texels.y, texel);                           \
  arrives *= reached ? room : 1.0;                                                                                     \
  past_room.rgb += arrives;
#elif ROOM_OCCLUDES
#define ROOM_SHADOW(K) past_room.rgb += arrives;
#else
#define ROOM_SHADOW(K)
#endif
  EACH_LIGHT(ADD)
}
