// Direct daylight at a point: the GPU form of runtime/light/direct_light.h. Positions are metres relative to the
// renderer's origin, directions are unit and point towards the light.

struct Light {
  vec4 right, up; // xyz: basis of the shadow map, unit
  vec4 toward;    // xyz: direction
  vec4 irradiance;
};
struct Aperture {
  vec4 plane; // dot(plane.xyz, x) + plane.w: distance on the inner side
  vec4 transmittance; // w: refractive index of clear glass, 0: none
  ivec4 edge_range; // first edge, one past the last
};
// Uniform blocks, not storage buffers: software drivers read those lane by lane.
layout(std140, binding = 0) uniform Lights { Light lights[MAX_LIGHTS]; };
layout(std140, binding = 1) uniform Apertures { Aperture apertures[MAX_APERTURES]; };
layout(std140, binding = 2) uniform ApertureEdges { vec4 aperture_edges[MAX_APERTURE_EDGES]; }; // inside positive

layout(binding = 0) uniform sampler2DArrayShadow object_sky_maps;
layout(binding = 1) uniform sampler2DArrayShadow object_sun_maps;
layout(binding = 2) uniform sampler2DArrayShadow room_sky_maps;
layout(binding = 3) uniform sampler2DArrayShadow room_sun_maps;

uniform int sky_lights, sun_lights, aperture_count;
uniform int room_occludes; // 0: nothing of the room stands between the object and the apertures
uniform vec3 sphere_centre;
uniform float sphere_radius, room_extent;
uniform vec4 sky_cone, sun_cone; // xyz: axis around the directions of a group of lights, w: half angle

// Sum over lights of e_j, of e_j past the room, and of e_j past room and object.
struct DirectSums {
  vec3 unblocked, past_room, past_both;
};

// Fresnel slab with all internal reflections (scene/glass.h): mean over both polarisations of 2ab / (a^2 + b^2).
float clear_slab(float cos_in, float index) {
  if (index <= 0.0)
    return 1.0;
  float cos_glass = sqrt(max(1.0 - (1.0 - cos_in * cos_in) / (index * index), 0.0));
  vec2 a = vec2(cos_in, index * cos_in), b = vec2(index * cos_glass, cos_glass), t = 2.0 * a * b / (a * a + b * b);
  return 0.5 * (t.x + t.y);
}

// Product of the panes that the ray from x crosses; zero when it leaves through none.
vec3 aperture_transmittance(vec3 x, vec3 w) {
  vec3 product = vec3(1.0);
  bool crossed = false;
  for (int a = 0; a < aperture_count; ++a) {
    float height = dot(apertures[a].plane.xyz, x) + apertures[a].plane.w;
    float approach = -dot(apertures[a].plane.xyz, w);
    if (height <= 0.0 || approach <= 0.0)
      continue;
    vec3 p = x + w * (height / approach);
    bool inside = true;
    for (int e = apertures[a].edge_range.x; e < apertures[a].edge_range.y; ++e)
      inside = inside && dot(aperture_edges[e].xyz, p) + aperture_edges[e].w >= 0.0;
    if (inside) {
      crossed = true;
      product *= apertures[a].transmittance.rgb * clear_slab(approach, apertures[a].transmittance.w);
    }
  }
  return crossed ? product : vec3(0.0);
}

// 1 where light reaches q (relative to the sphere's centre), 0 behind an occluder, between at filtered edges.
// extent: half the depth range of the map, metres; bias: metres towards the light.
float map_visibility(sampler2DArrayShadow maps, int layer, Light light, vec3 q, float extent, float bias) {
  vec2 uv = 0.5 + 0.5 * vec2(dot(light.right.xyz, q), dot(light.up.xyz, q)) / sphere_radius;
  float depth = 0.5 - 0.5 * (dot(light.toward.xyz, q) + bias) / extent;
  return texture(maps, vec4(uv, float(layer), clamp(depth, 0.0, 1.0)));
}

// False when the sphere shadows x from no light of the group: seen from x it lies outside the group's cone.
bool group_may_be_shadowed(vec4 cone, vec3 x) {
  vec3 d = sphere_centre - x;
  float distance = length(d);
  if (distance <= sphere_radius)
    return true;
  return acos(clamp(dot(cone.xyz, d) / distance, -1.0, 1.0)) <= cone.w + asin(sphere_radius / distance);
}

bool may_be_shadowed(Light light, vec3 q) {
  vec2 s = vec2(dot(light.right.xyz, q), dot(light.up.xyz, q));
  return max(abs(s.x), abs(s.y)) < sphere_radius && dot(light.toward.xyz, q) < sphere_radius;
}

// Some light of the group that faces n is taken from x by the object, whether or not the room lets it through. Far
// cheaper than the sums, which only the pixels that pass this test need.
bool object_shadows(int first, int count, sampler2DArrayShadow object_maps, vec3 x, vec3 n) {
  vec3 q = x - sphere_centre;
  for (int k = 0; k < count; ++k) {
    Light light = lights[first + k];
    if (dot(n, light.toward.xyz) > 0.0 && may_be_shadowed(light, q) &&
        map_visibility(object_maps, k, light, q, sphere_radius, 0.0) < 1.0)
      return true;
  }
  return false;
}

// Lights [first, first + count) with the maps of their group. own_shadow: the point lies on the object itself.
DirectSums sum_lights(int first, int count, sampler2DArrayShadow object_maps, sampler2DArrayShadow room_maps, vec3 x,
                      vec3 n, bool own_shadow) {
  DirectSums sums = DirectSums(vec3(0.0), vec3(0.0), vec3(0.0));
  float texel = 2.0 * sphere_radius / float(textureSize(object_maps, 0).x);
  for (int k = 0; k < count; ++k) {
    Light light = lights[first + k];
    float c = dot(n, light.toward.xyz);
    if (c <= 0.0)
      continue;
    vec3 e = light.irradiance.rgb * c * aperture_transmittance(x, light.toward.xyz);
    if (e == vec3(0.0))
      continue;
    vec3 q = x - sphere_centre;
    float room = 1.0, object = 1.0;
    if (may_be_shadowed(light, q)) {
      // A texel of the map is flat: a surface tilted by angle t differs by tan t within it, so the receiver is moved
      // along its normal, where a tilt moves the look-up sideways off the surface.
      float tilt = sqrt(max(1.0 - c * c, 0.0));
      vec3 lifted = q + n * (texel * (0.3 + 0.6 * tilt));
      if (room_occludes != 0)
        room = map_visibility(room_maps, k, light, lifted, room_extent, texel);
      object = own_shadow ? map_visibility(object_maps, k, light, lifted, sphere_radius, 0.5 * texel)
                          : map_visibility(object_maps, k, light, q, sphere_radius, 0.0);
    }
    sums.unblocked += e;
    sums.past_room += e * room;
    sums.past_both += e * room * object;
  }
  return sums;
}

const float kPi = 3.14159265358979;

// Part of a whole, 1 where there is no whole.
vec3 share(vec3 part, vec3 whole) {
  return vec3(whole.r > 0.0 ? part.r / whole.r : 1.0, whole.g > 0.0 ? part.g / whole.g : 1.0,
              whole.b > 0.0 ? part.b / whole.b : 1.0);
}
