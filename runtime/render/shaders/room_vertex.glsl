layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
centroid out vec3 surface_offset; // from the sphere. Short: interpolation in software drivers is relative to its size, off by mm over metres
flat out vec3 surface_normal;
uniform vec3 sphere_centre;
void main() {
  surface_offset = position - sphere_centre;
  surface_normal = normal;
  gl_Position = clip_position(position);
}
