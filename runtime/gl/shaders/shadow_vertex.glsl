// Parallel projection along a light: the disc of the objects' sphere fills the map, the near plane is at the light.
layout(location = 0) in vec3 position;
uniform vec3 toward_light;
uniform float half_depth; // metres
void main() {
  vec3 p = (position - frame.sphere.xyz) * light_axes(toward_light);
  gl_Position = vec4(p.xy / frame.sphere.w, 0.5 - 0.5 / half_depth * p.z, 1.0);
}
