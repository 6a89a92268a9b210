// Phantom geometry: not drawn, but it receives the shadow of the object. Only new shadows count: a light that the room
// itself blocks takes nothing away. Shares refer to the unshadowed light, which the caller knows per point.
centroid in vec3 surface_offset;
flat in vec3 surface_normal;
layout(location = 0) out vec4 object_radiance;
layout(location = 1) out vec4 lost_sky_share; // of the open sky; a = 1: share of the pixel that shows the room
// r: received share of the open sky; g, b: irradiance received and lost from the sun, as shares of its normal irradiance
layout(location = 2) out vec4 room_shares;
uniform vec3 eye, sun_normal_irradiance;
void main() {
  vec3 x = surface_offset + sphere_centre;
  vec3 n = dot(surface_normal, eye - x) < 0.0 ? -surface_normal : surface_normal;
  object_radiance = vec4(0.0);
  lost_sky_share = vec4(0.0, 0.0, 0.0, 1.0);
  room_shares = vec4(1.0, 0.0, 0.0, 0.0);
  bool sky_lost = group_may_be_shadowed(sky_cone, x) && object_shadows(0, sky_lights, object_sky_maps, x, n);
  bool sun_lost = group_may_be_shadowed(sun_cone, x) && object_shadows(sky_lights, sun_lights, object_sun_maps, x, n);
  if (!sky_lost && !sun_lost)
    return;
  DirectSums sky = sum_lights(0, sky_lights, object_sky_maps, room_sky_maps, x, n, false);
  DirectSums sun = sum_lights(sky_lights, sun_lights, object_sun_maps, room_sun_maps, x, n, false);
  lost_sky_share.rgb = share(sky.past_room, sky.unblocked) - share(sky.past_both, sky.unblocked);
  float whole_sun = dot(sun_normal_irradiance, vec3(1.0));
  if (whole_sun > 0.0)
    room_shares.yz = vec2(dot(sun.past_room, vec3(1.0)), dot(sun.past_room - sun.past_both, vec3(1.0))) / whole_sun;
  room_shares.x = dot(share(sky.past_room, sky.unblocked), vec3(1.0 / 3.0));
}
