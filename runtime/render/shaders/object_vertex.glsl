layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 reflectance;
layout(location = 3) in vec3 indirect_radiance;
centroid out vec3 surface_position;
centroid out vec3 surface_normal;
centroid out vec3 surface_reflectance;
centroid out vec3 surface_indirect;
void main() {
  surface_position = position;
  surface_normal = normal;
  surface_reflectance = reflectance;
  surface_indirect = indirect_radiance;
  gl_Position = clip_position(position);
}
