// The point of the room that a pixel shows, tile by tile, where it may be in a shadow of the objects: those pixels are
// marked by their depth.
layout(binding = 0) uniform sampler2D room_ids;         // per pixel, from 1; 0: none
layout(binding = 6) uniform samplerBuffer room_planes;  // per triangle: dot(xyz, x) + w = 0, unit
layout(binding = 7) uniform samplerBuffer room_numbers; // per triangle: the same for those of one plane, from 1
layout(location = 0) out vec4 point_offset;             // w: number of the surface
layout(location = 1) out vec4 point_normal;

// False when the sphere shadows the point from no light of the group: seen from it, it lies outside the group's cone.
bool group_may_be_shadowed(vec4 cone, vec2 width, vec3 offset) {
  float distance = length(offset), s = min(sphere.w / distance, 1.0), c = sqrt(1.0 - s * s); // of the sphere's half angle
  bool all_around = width.x < 0.0 && s >= width.y;
  return distance <= sphere.w || all_around || -dot(cone.xyz, offset) >= distance * (c * width.x - s * width.y);
}

// False when no ray from x that meets the sphere leaves through a window: the sphere is outside of a plane through x
// and one of the edges. Those planes are n h(x) - m d(x), n and m of edge and window, h and d of x (windows.glsl).
bool stands_before_window(vec3 x, vec3 offset) {
  bool before = false;
  for (int w = 0; w < QUADS; ++w) {
    vec4 m = window_plane[w];
    float h = dot(m.xyz, x) + m.w;
    bool inside = h > 0.0; // edges of windows with more than four are asked four by four: too many pass, none is lost
    for (int e = 4 * w; e < 4 * w + 4; ++e) {
      vec3 across = window_edge[e].xyz * h - m.xyz * (dot(window_edge[e].xyz, x) + window_edge[e].w);
      inside = inside && -dot(across, offset) >= -1.0001 * sphere.w * length(across);
    }
    before = before || inside;
  }
  return before;
}

void main() {
  ivec2 pixel = tile_pixel(ivec2(gl_FragCoord.xy));
  if (any(greaterThanEqual(pixel, textureSize(room_ids, 0))))
    discard; // tiles of a picture of odd size are not all full
  float id = texelFetch(room_ids, pixel, 0).r;
  vec4 plane = texelFetch(room_planes, max(int(id) - 1, 0));
  vec3 ray = pixel_ray(pixel);
  float height = dot(plane.xyz, eye.xyz) + plane.w;
  vec3 x = eye.xyz - ray * (height / dot(plane.xyz, ray)), offset = x - sphere.xyz;
  if (id <= 0.0 || !stands_before_window(x, offset) ||
      !(group_may_be_shadowed(sky_cone, cone_width.xy, offset) || group_may_be_shadowed(sun_cone, cone_width.zw, offset)))
    discard;
  point_offset = vec4(offset, texelFetch(room_numbers, max(int(id) - 1, 0)).r);
  point_normal = vec4(height < 0.0 ? -plane.xyz : plane.xyz, 0.0);
}
