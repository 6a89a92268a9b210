// Up to four edges of a window at a time. A ray from x towards light w passes the inside of an edge (n, d) of a window
// in plane (m, e) when dot(n, p) + d >= 0 where it crosses the plane, h = dot(m, x) + e away from it; that is
// dot(n, x) + d + slope h >= 0 with slope = -dot(n, w) / dot(m, w).
#define WINDOW_MEMBERS                                                                                                 \
  vec4 window_plane[QUADS];                                                                                            \
  vec4 window_edge[4 * QUADS];
#if VERTEX
layout(std140, binding = 1) uniform Windows { WINDOW_MEMBERS } windows;
#if FLAT
flat out vec4 window_plane[QUADS], window_edge[4 * QUADS];
#define HAND_ON_WINDOWS                                                                                                \
  window_plane = windows.window_plane;                                                                                 \
  window_edge = windows.window_edge;
#else
#define HAND_ON_WINDOWS
#endif
#elif FLAT
flat in vec4 window_plane[QUADS], window_edge[4 * QUADS];
#else
layout(std140, binding = 1) uniform Windows { WINDOW_MEMBERS };
#endif
