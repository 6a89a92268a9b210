// One point of the objects per pixel, where its light is asked for. Marks the pixel by its depth: farther where parts
// of it show something else.
#if IDS_BY_PROCESSOR
layout(binding = 0) uniform sampler2D object_shown; // TriangleRaster::find_shown
#else
layout(binding = 0) uniform sampler2DMS object_ids;
layout(binding = 1) uniform sampler2DMS object_depths; // near plane by distance
uniform float near_plane;
#endif
layout(location = 0) out vec4 point_offset;            // w: 1
layout(location = 1) out vec4 point_normal; // w: 1 where parts of the pixel show something else

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
#if IDS_BY_PROCESSOR
  float shown = texelFetch(object_shown, pixel, 0).r, id = abs(shown);
  bool mixed = shown < 0.0;
#else
  float id = 0.0, nearest = 0.0, farthest = 1e30;
  bool all_covered = true;
  for (int s = 0; s < SAMPLES; ++s) {
    float other = texelFetch(object_ids, pixel, s).r, depth = texelFetch(object_depths, pixel, s).r;
    id = id > 0.0 ? id : other;
    all_covered = all_covered && other > 0.0;
    nearest = max(nearest, depth);
    farthest = min(farthest, depth);
  }
  bool mixed = !all_covered || near_plane * (nearest - farthest) > APART_SHARE * sphere.w * nearest * farthest;
#endif
  if (id <= 0.0)
    discard;
  ObjectPoint p = object_point(id, pixel);
  point_offset = vec4(p.offset, 1.0);
  point_normal = vec4(p.normal, mixed ? 1.0 : 0.0);
  gl_FragDepth = mixed ? kMixedMark : kWholeMark;
}
