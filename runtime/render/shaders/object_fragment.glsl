centroid in vec3 surface_offset;
centroid in vec3 surface_normal;
centroid in vec3 surface_reflectance;
centroid in vec3 surface_indirect[2]; // front, back
centroid in vec3 surface_open_sky[2];
layout(location = 0) out vec4 object_radiance; // a = 1: coverage after the samples are averaged
layout(location = 1) out vec4 lost_sky_share;
layout(location = 2) out vec4 room_shares;
uniform vec3 eye;
void main() {
  vec3 x = surface_offset + sphere_centre, n = normalize(surface_normal);
  // The inside of a thin shell. The winding decides, not the normal: interpolated normals turn away at silhouettes.
  bool back = !gl_FrontFacing;
  if (back)
    n = -n;
  DirectSums sky = sum_lights(0, sky_lights, object_sky_maps, room_sky_maps, x, n, true);
  DirectSums sun = sum_lights(sky_lights, sun_lights, object_sun_maps, room_sun_maps, x, n, true);
  vec3 open_sky = back ? surface_open_sky[1] : surface_open_sky[0];
  vec3 direct = open_sky * share(sky.past_both, sky.unblocked) + sun.past_both;
  vec3 indirect = back ? surface_indirect[1] : surface_indirect[0];
  object_radiance = vec4(indirect + surface_reflectance / kPi * direct, 1.0);
  lost_sky_share = vec4(0.0);
  room_shares = vec4(0.0);
}
