// The lights of a frame and the portal clip planes that they come through: as runtime/shading/portal_lights.h has them.
struct PortalLight {
  vec3 direction;
  uint first_portal;
  vec3 irradiance;
  uint last_portal;
};
struct Portal {
  vec3 transmittance;
  uint first_plane, last_plane;
};
layout(std430, binding = 0) readonly buffer PortalLights { PortalLight lights[]; };
layout(std430, binding = 1) readonly buffer Portals { Portal portals[]; };
layout(std430, binding = 2) readonly buffer PortalPlanes { vec4 portal_planes[]; };

// Irradiance at x with normal n: E max(0, n.w) x transmittances of the apertures crossed, 0 where none is.
vec3 received(PortalLight light, vec3 x, vec3 n) {
  vec3 e = light.irradiance * max(dot(n, light.direction), 0.0);
  bool crossed = false;
  for (uint p = light.first_portal; p < light.last_portal; ++p) {
    float depth = 1.0;
    for (uint i = portals[p].first_plane; i < portals[p].last_plane; ++i)
      depth = min(depth, dot(portal_planes[i], vec4(x, 1.0)));
    bool inside = depth >= 0.0;
    e *= inside ? portals[p].transmittance : vec3(1.0);
    crossed = crossed || inside;
  }
  return crossed ? e : vec3(0.0);
}
