centroid in vec3 surface_position;
centroid in vec3 surface_normal;
centroid in vec3 surface_reflectance;
centroid in vec3 surface_indirect;
centroid in vec3 surface_open_sky;
layout(location = 0) out vec4 object_radiance; // a = 1: coverage after the samples are averaged
layout(location = 1) out vec4 lost_sky_share;
layout(location = 2) out vec4 room_shares;
uniform vec3 eye;
void main() {
  vec3 x = surface_position, n = normalize(surface_normal);
  if (dot(n, eye - x) < 0.0 && !gl_FrontFacing)
    n = -n; // the inside of a thin shell
  DirectSums sky = sum_lights(0, sky_lights, object_sky_maps, room_sky_maps, x, n, true);
  DirectSums sun = sum_lights(sky_lights, sun_lights, object_sun_maps, room_sun_maps, x, n, true);
  vec3 direct = surface_open_sky * share(sky.past_both, sky.unblocked) + sun.past_both;
  object_radiance = vec4(surface_indirect + surface_reflectance / kPi * direct, 1.0);
  lost_sky_share = vec4(0.0);
  room_shares = vec4(0.0);
}
