// The lighting pass: every pixel evaluates all lights, once for the room and once for the objects, at edges of the
// objects once per sample.
layout(binding = 0) uniform sampler2D room_ids; // from 1
layout(binding = 1) uniform sampler2DMS object_ids;
layout(binding = 4) uniform sampler2DMS object_depths; // near plane by distance
layout(std430, binding = 3) readonly buffer RoomPlanes { vec4 room_planes[]; };
uniform float near_plane;
layout(location = 0) out vec4 object_radiance; // a: coverage
layout(location = 1) out vec4 lost_sky;        // as RenderedFrame
layout(location = 2) out vec4 room_light;      // received and lost_sun (all channels alike), w: id of the room's triangle

vec3 fraction(vec3 part, vec3 whole) { return mix(vec3(1.0), part / max(whole, vec3(1e-30)), greaterThan(whole, vec3(0.0))); }

// Parts of the pixel show different things, or lie further apart in depth than a fraction of the objects' radius.
bool is_edge(ivec2 pixel) {
  float nearest = 0.0, farthest = 1e30;
  bool any = false, all = true;
  for (int s = 0; s < SAMPLES; ++s) {
    bool covered = texelFetch(object_ids, pixel, s).r > 0.0;
    float depth = texelFetch(object_depths, pixel, s).r;
    any = any || covered;
    all = all && covered;
    nearest = max(nearest, depth);
    farthest = min(farthest, depth);
  }
  return any && (!all || near_plane * (nearest - farthest) > APART * frame.sphere.w * nearest * farthest);
}

vec3 object_radiance_at(uint id, ivec2 pixel) {
  const float kPi = 3.14159265358979;
  ObjectPoint p = object_point(id, pixel);
  LightSums sky = sum_lights(0, frame.lights.x, p.position, p.normal, true);
  LightSums sun = sum_lights(frame.lights.x, frame.lights.y, p.position, p.normal, true);
  uint side = p.back ? 2u : 0u;
  bool below = dot(p.sharp_facet, frame.sun_cone.xyz) < 0.0;
  vec3 direct = interpolated_light(p, side + 1u) * fraction(sky.past_both, sky.unblocked) +
                (below ? vec3(0.0) : sun.past_both);
  return interpolated_light(p, side) + interpolated(p, 2u) / kPi * direct;
}

void light_objects(ivec2 pixel) {
  object_radiance = vec4(0.0);
  int samples = is_edge(pixel) ? SAMPLES : 1;
  for (int s = 0; s < samples; ++s) {
    uint id = uint(texelFetch(object_ids, pixel, s).r);
    if (id > 0u)
      object_radiance += vec4(object_radiance_at(id, pixel), 1.0) / float(samples);
  }
}

void light_room(ivec2 pixel) {
  uint id = uint(texelFetch(room_ids, pixel, 0).r);
  float open = id > 0u ? 1.0 - object_radiance.a : 0.0; // part of the pixel that shows the room
  lost_sky = vec4(0.0, 0.0, 0.0, open);
  room_light = vec4(open, 0.0, 0.0, float(id));
  if (open <= 0.0)
    return;
  vec4 plane = room_planes[id - 1u];
  vec3 ray = pixel_ray(pixel);
  float height = dot(plane.xyz, frame.eye.xyz) + plane.w; // of the eye above the plane
  vec3 x = frame.eye.xyz - height / dot(plane.xyz, ray) * ray, n = height < 0.0 ? -plane.xyz : plane.xyz;
  vec3 offset = x - frame.sphere.xyz;
  if (may_be_shadowed(frame.sky_cone, offset) || may_be_shadowed(frame.sun_cone, offset)) {
    LightSums sky = sum_lights(0, frame.lights.x, x, n, false);
    LightSums sun = sum_lights(frame.lights.x, frame.lights.y, x, n, false);
    vec3 before = fraction(sky.past_room, sky.unblocked), after = fraction(sky.past_both, sky.unblocked);
    float whole_sun = max(dot(frame.sun_normal_irradiance.rgb, vec3(1.0)), 1e-30);
    lost_sky.rgb = open * (before - after);
    room_light.xyz = open * vec3(dot(before, vec3(1.0 / 3.0)), dot(sun.past_room, vec3(1.0)) / whole_sun,
                                 dot(sun.past_room - sun.past_both, vec3(1.0)) / whole_sun);
  }
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  light_objects(pixel);
  light_room(pixel);
}
