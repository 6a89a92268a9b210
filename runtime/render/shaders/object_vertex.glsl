layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 reflectance;
layout(location = 3) in vec3 indirect_front;
layout(location = 4) in vec3 open_sky_front;
layout(location = 5) in vec3 indirect_back;
layout(location = 6) in vec3 open_sky_back;
centroid out vec3 surface_offset; // from the sphere. Short: interpolation in software drivers is relative to its size, off by mm over metres
centroid out vec3 surface_normal;
centroid out vec3 surface_reflectance;
centroid out vec3 surface_indirect[2]; // front, back
centroid out vec3 surface_open_sky[2];
uniform vec3 sphere_centre;
void main() {
  surface_offset = position - sphere_centre;
  surface_normal = normal;
  surface_reflectance = reflectance;
  surface_indirect[0] = indirect_front;
  surface_indirect[1] = indirect_back;
  surface_open_sky[0] = open_sky_front;
  surface_open_sky[1] = open_sky_back;
  gl_Position = clip_position(position);
}
