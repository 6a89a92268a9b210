layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 reflectance;
layout(location = 3) in vec3 indirect_radiance;
layout(location = 4) in vec3 open_sky_irradiance;
centroid out vec3 surface_position;
centroid out vec3 surface_normal;
centroid out vec3 surface_reflectance;
centroid out vec3 surface_indirect;
centroid out vec3 surface_open_sky;
void main() {
  surface_position = position;
  surface_normal = normal;
  surface_reflectance = reflectance;
  surface_indirect = indirect_radiance;
  surface_open_sky = open_sky_irradiance;
  gl_Position = clip_position(position);
}
