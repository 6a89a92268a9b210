// Columns: right and up of a light's shadow map, and the unit direction w towards the light (Duff et al. 2017, "Building
// an Orthonormal Basis, Revisited").
mat3 light_axes(vec3 w) {
  float s = w.z < 0.0 ? -1.0 : 1.0, a = -1.0 / (s + w.z), b = w.x * w.y * a;
  return mat3(vec3(1.0 + s * w.x * w.x * a, s * b, -s * w.x), vec3(b, s + w.y * w.y * a, -w.y), w);
}
