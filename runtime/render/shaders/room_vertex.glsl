layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
centroid out vec3 surface_position;
flat out vec3 surface_normal;
void main() {
  surface_position = position;
  surface_normal = normal;
  gl_Position = clip_position(position);
}
