// The objects' radiance. Where parts of a pixel show different things, each sample takes the light of the point nearby
// that lies on the same piece of surface (subpixel reconstruction: Chajdas et al. 2011): edges are averaged, and still
// every pixel asks the lights once.
#if IDS_BY_PROCESSOR
layout(binding = 0) uniform sampler2D object_ids; // one channel per sample
float id_at(ivec2 pixel, int s) { return texelFetch(object_ids, pixel, 0)[s]; }
#else
layout(binding = 0) uniform sampler2DMS object_ids;
float id_at(ivec2 pixel, int s) { return texelFetch(object_ids, pixel, s).r; }
#endif
layout(binding = 1) uniform sampler2D point_offset; // w: 1 where there is a point
layout(binding = 2) uniform sampler2D point_normal;
layout(binding = 3) uniform samplerBuffer object_light; // rgb: indirect and open sky, front; the same, back
layout(binding = 6) uniform sampler2D sky_unblocked;
layout(binding = 7) uniform sampler2D sky_lost;
layout(binding = 8) uniform sampler2D sky_past_room;
layout(binding = 9) uniform sampler2D sun_lost;
layout(binding = 10) uniform sampler2D sun_past_room;
layout(location = 0) out vec4 object_radiance; // a: coverage

struct Received {
  vec3 sky_share, sun;
};
Received received_at(ivec2 pixel) {
  vec3 whole = texelFetch(sky_unblocked, pixel, 0).rgb, past = whole;
#if ROOM_OCCLUDES
  past = texelFetch(sky_past_room, pixel, 0).rgb;
#endif
  Received r = Received(share(past - texelFetch(sky_lost, pixel, 0).rgb, whole, 1.0), vec3(0.0));
  if (sun_normal_irradiance.rgb != vec3(0.0))
    r.sun = texelFetch(sun_past_room, pixel, 0).rgb - texelFetch(sun_lost, pixel, 0).rgb;
  return r;
}

vec3 radiance(ObjectPoint p, Received r) {
  const float kPi = 3.14159265358979;
  int side = p.back ? 2 : 0;
  vec3 direct = weighted(object_light, 4, side + 1, p) * r.sky_share + r.sun;
  return weighted(object_light, 4, side, p) + weighted(object_vertices, 3, 2, p) / kPi * direct;
}

#if MIXED
const int kNear = 5;
const ivec2 kStep[kNear] = ivec2[](ivec2(0, 0), ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1));

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(point_offset, 0) - 1;
  vec4 offset[kNear];
  vec3 normal[kNear];
  Received received[kNear];
  for (int k = 0; k < kNear; ++k) {
    ivec2 near = clamp(pixel + kStep[k], ivec2(0), last);
    offset[k] = texelFetch(point_offset, near, 0);
    normal[k] = texelFetch(point_normal, near, 0).xyz;
    received[k] = received_at(near);
  }
  object_radiance = vec4(0.0);
  for (int s = 0; s < SAMPLES; ++s) {
    float id = id_at(pixel, s);
    ObjectPoint p = object_point(max(id, 1.0), pixel);
    Received best = received[0];
    float least = 1e30;
    for (int k = 0; k < kNear; ++k) {
      float apart = distance(p.offset, offset[k].xyz) + sphere.w * max(0.9 - dot(p.normal, normal[k]), 0.0) +
                    (offset[k].w > 0.0 ? 0.0 : 1e20);
      best.sky_share = apart < least ? received[k].sky_share : best.sky_share;
      best.sun = apart < least ? received[k].sun : best.sun;
      least = min(least, apart);
    }
    object_radiance += id > 0.0 ? vec4(radiance(p, best), 1.0) / float(SAMPLES) : vec4(0.0);
  }
}
#else
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ObjectPoint p = object_point(id_at(pixel, 0), pixel);
  object_radiance = vec4(radiance(p, received_at(pixel)), 1.0);
}
#endif
