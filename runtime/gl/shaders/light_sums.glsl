// Direct light at a point, past room and objects: runtime/sky/direct_light.h with visibility from shadow maps (Williams
// 1978), filtered between four texels (Reeves et al. 1987).
layout(binding = 2) uniform sampler2DArrayShadow object_maps;
layout(binding = 3) uniform sampler2DArrayShadow room_maps;

struct LightSums {
  vec3 unblocked, past_room, past_both; // irradiance
};

// False where no light of the cone can reach the point through the objects' sphere, of which it lies `offset` metres
// from the centre. With the sphere seen under the half angle asin(r / d): cos(angle to the axis) < cos(sum of angles).
bool may_be_shadowed(vec4 cone, vec3 offset) {
  float r = frame.sphere.w, squared = dot(offset, offset), tangent = sqrt(max(squared - r * r, 0.0));
  float sine = sqrt(max(1.0 - cone.w * cone.w, 0.0));
  bool all_around = tangent <= 0.0 || (cone.w < 0.0 && r * r >= sine * sine * squared);
  return cone.w <= 1.0 && (all_around || -dot(cone.xyz, offset) >= tangent * cone.w - r * sine);
}

// 1 where light reaches a point, 0 behind an occluder, between at filtered edges. p: the point along the light's axes,
// from the sphere's centre. half_depth: of the map, metres; bias: metres towards the light.
float map_visibility(sampler2DArrayShadow maps, int layer, vec3 p, float half_depth, float bias) {
  float depth = clamp(0.5 - 0.5 / half_depth * (p.z + bias), 0.0, 1.0);
  return texture(maps, vec4(0.5 + 0.5 / frame.sphere.w * p.xy, float(layer), depth));
}

// Sum over lights first .. last - 1 at x with unit normal n.
LightSums sum_lights(int first, int last, vec3 x, vec3 n, bool on_object) {
  LightSums sums = LightSums(vec3(0.0), vec3(0.0), vec3(0.0));
  float radius = frame.sphere.w, texel = 2.0 * radius / frame.maps.x;
  vec3 offset = x - frame.sphere.xyz;
  for (int j = first; j < last; ++j) {
    vec3 e = received(lights[j], x, n);
    mat3 axes = light_axes(lights[j].direction);
    // A texel of the map is flat: a surface tilted by angle t differs by tan t within it, so the receiver is moved
    // along its normal, where a tilt moves the look-up sideways off the surface.
    float c = dot(n, axes[2]);
    vec3 lifted = (offset + n * (texel * (0.3 + 0.6 * sqrt(max(1.0 - c * c, 0.0))))) * axes;
    vec3 p = on_object ? lifted : offset * axes;
    bool in_map = on_object || (max(abs(p.x), abs(p.y)) < radius && p.z < radius);
    sums.unblocked += e;
#if ROOM_OCCLUDES
    e *= in_map ? map_visibility(room_maps, j, lifted, frame.maps.y, texel) : 1.0;
#endif
    sums.past_room += e;
    sums.past_both += in_map ? e * map_visibility(object_maps, j, p, radius, on_object ? 0.5 * texel : 0.0) : e;
  }
  return sums;
}
