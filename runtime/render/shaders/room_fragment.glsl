// Phantom geometry: not drawn, but it receives the shadow of the object. Only new shadows count: a light that the room
// itself blocks takes nothing away.
centroid in vec3 surface_position;
flat in vec3 surface_normal;
layout(location = 0) out vec4 object_radiance;
layout(location = 1) out vec4 lost_irradiance;     // a = 1: share of the pixel that shows the room
layout(location = 2) out vec4 received_irradiance; // direct, without the object
uniform vec3 eye;
void main() {
  vec3 x = surface_position;
  vec3 n = dot(surface_normal, eye - x) < 0.0 ? -surface_normal : surface_normal;
  object_radiance = vec4(0.0);
  lost_irradiance = vec4(0.0, 0.0, 0.0, 1.0);
  received_irradiance = vec4(0.0);
  if (!group_may_be_shadowed(sky_cone, x) && !group_may_be_shadowed(sun_cone, x))
    return;
  DirectSums sky = sum_lights(0, sky_lights, object_sky_maps, room_sky_maps, x, n, false);
  DirectSums sun = sum_lights(sky_lights, sun_lights, object_sun_maps, room_sun_maps, x, n, false);
  if (sky.past_both == sky.past_room && sun.past_both == sun.past_room)
    return;
  vec3 open = open_sky_irradiance(x, n);
  vec3 past_room = share(sky.past_room, sky.unblocked);
  lost_irradiance.rgb = open * (past_room - share(sky.past_both, sky.unblocked)) + sun.past_room - sun.past_both;
  received_irradiance.rgb = open * past_room + sun.past_room;
}
