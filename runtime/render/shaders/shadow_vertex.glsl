// Parallel projection along one light onto the bounding sphere's disc; depth 0 nearest to the light.
layout(location = 0) in vec3 position;
struct Light {
  vec4 right, up, toward, irradiance;
};
layout(std140, binding = 0) uniform Lights { Light lights[MAX_LIGHTS]; };
uniform int light_index;
uniform vec3 sphere_centre;
uniform float sphere_radius, depth_extent;
void main() {
  vec3 q = position - sphere_centre;
  Light light = lights[light_index];
  gl_Position = vec4(dot(light.right.xyz, q) / sphere_radius, dot(light.up.xyz, q) / sphere_radius,
                     0.5 - 0.5 * dot(light.toward.xyz, q) / depth_extent, 1.0);
}
