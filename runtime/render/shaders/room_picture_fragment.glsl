// What the room loses at marked pixels, tile by tile, as RenderedFrame has it.
layout(binding = 1) uniform sampler2D sky_unblocked; // a: number of the surface
layout(binding = 2) uniform sampler2D sky_lost;
layout(binding = 3) uniform sampler2D sky_past_room;
layout(binding = 4) uniform sampler2D sun_lost;
layout(binding = 5) uniform sampler2D sun_past_room;
uniform ivec3 shared_lights; // x: 1 when a pixel's sums hold a quarter of the sky's lights, its neighbours' the others;
                             // yz: the picture's last pixel
layout(location = 0) out vec4 lost_sky_share; // of the open sky; a: 1
// r: received share of the open sky; g, b: irradiance received and lost from the sun, as shares of its normal irradiance
layout(location = 1) out vec4 room_shares;

// Only new shadows count: a light that the room itself blocks takes nothing away. Shares refer to the unshadowed light,
// which the caller knows per point. Every two by two pixels hold each light once (interleaved sampling: Keller and
// Heidrich 2001, Segovia et al. 2006), and each set of lights is interpolated between the pixels that asked it: those
// that show another surface are left out, and so are their lights.
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy), pixel = tile_pixel(place), last = shared_lights.yz;
  vec3 unblocked = vec3(0.0), lost = vec3(0.0), past_room = vec3(0.0);
  float surface = texelFetch(sky_unblocked, place, 0).a;
  for (int k = 0; k < 9; ++k) {
    ivec2 step = ivec2(k % 3, k / 3) - 1, near = clamp(pixel + step, ivec2(0), last);
    ivec2 neighbour = shared_lights.x == 1 ? tile_place(near) : place;
    vec4 sum = texelFetch(sky_unblocked, neighbour, 0);
    float counts = sum.a == surface ? 1.0 / float((1 + abs(step.x)) * (1 + abs(step.y))) : 0.0;
    unblocked += counts * sum.rgb;
    lost += counts * texelFetch(sky_lost, neighbour, 0).rgb;
#if ROOM_OCCLUDES
    past_room += counts * texelFetch(sky_past_room, neighbour, 0).rgb;
#endif
  }
#if !ROOM_OCCLUDES
  past_room = unblocked;
#endif
  lost_sky_share = vec4(share(lost, unblocked, 0.0), 1.0);
  room_shares = vec4(dot(share(past_room, unblocked, 1.0), vec3(1.0 / 3.0)), 0.0, 0.0, 0.0);
  float whole_sun = dot(sun_normal_irradiance.rgb, vec3(1.0));
  if (whole_sun > 0.0)
    room_shares.yz = vec2(dot(texelFetch(sun_past_room, place, 0).rgb, vec3(1.0)),
                          dot(texelFetch(sun_lost, place, 0).rgb, vec3(1.0))) / whole_sun;
}
