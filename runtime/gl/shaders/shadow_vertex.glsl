// Parallel projection along one light onto the bounding sphere's disc; depth 0 nearest to the light.
layout(location = 0) in vec3 position;
uniform vec3 right, up, toward;
uniform vec3 sphere_centre;
uniform float sphere_radius, depth_extent;
void main() {
  vec3 q = position - sphere_centre;
  gl_Position = vec4(dot(right, q) / sphere_radius, dot(up, q) / sphere_radius, 0.5 - 0.5 * dot(toward, q) / depth_extent,
                     1.0);
}
