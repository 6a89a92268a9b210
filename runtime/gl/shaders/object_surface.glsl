// The surface of the objects, by id of the triangle.
layout(std430, binding = 4) readonly buffer ObjectTriangles { uint object_triangles[]; }; // 3 vertices each
layout(std430, binding = 5) readonly buffer ObjectVertices { float object_vertices[]; };  // position, normal, reflectance
// Indirect radiance and open sky irradiance, front; the same, back.
layout(std430, binding = 6) readonly buffer ObjectLight { float object_light[]; };

struct ObjectPoint {
  uvec3 vertex;
  vec3 weight; // barycentric
  vec3 position, normal; // of the side that is seen
  bool back;   // the inside of a thin shell: the winding decides, interpolated normals turn away at silhouettes
  vec3 sharp_facet; // as in PixelSurface (runtime/shading/visibility.h)
};

vec3 vertex_value(uint vertex, uint which) {
  uint i = 9u * vertex + 3u * which;
  return vec3(object_vertices[i], object_vertices[i + 1u], object_vertices[i + 2u]);
}
vec3 interpolated(ObjectPoint p, uint which) {
  return p.weight.x * vertex_value(p.vertex.x, which) + p.weight.y * vertex_value(p.vertex.y, which) +
         p.weight.z * vertex_value(p.vertex.z, which);
}
vec3 interpolated_light(ObjectPoint p, uint which) {
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 3; ++k) {
    uint i = 12u * p.vertex[k] + 3u * which;
    sum += p.weight[k] * vec3(object_light[i], object_light[i + 1u], object_light[i + 2u]);
  }
  return sum;
}

// Where the ray through a pixel's centre meets the triangle, or the nearest to it that the triangle has where only
// another part of the pixel shows it (Moeller and Trumbore 1997: exact for triangles much smaller than their distance).
ObjectPoint object_point(uint id, ivec2 pixel) {
  ObjectPoint p;
  uint i = 3u * (id - 1u);
  p.vertex = uvec3(object_triangles[i], object_triangles[i + 1u], object_triangles[i + 2u]);
  vec3 a = vertex_value(p.vertex.x, 0u), ab = vertex_value(p.vertex.y, 0u) - a, ac = vertex_value(p.vertex.z, 0u) - a;
  vec3 ray = pixel_ray(pixel), from = frame.eye.xyz - a, across = cross(ray, ac);
  float whole = dot(ab, across); // positive where the front is seen
  vec2 part = vec2(dot(from, across), dot(ray, cross(from, ab))) * (whole < 0.0 ? -1.0 : 1.0);
  p.weight = max(vec3(abs(whole) - part.x - part.y, part), vec3(-0.5 * abs(whole)));
  float sum = p.weight.x + p.weight.y + p.weight.z;
  p.weight = sum > 0.0 ? p.weight / sum : vec3(1.0 / 3.0);
  p.position = interpolated(p, 0u);
  vec3 n = interpolated(p, 1u), facet = cross(ab, ac);
  p.normal = normalize(dot(n, n) > 0.0 ? n : facet);
  p.back = whole < 0.0;
  p.normal = p.back ? -p.normal : p.normal;
  p.sharp_facet = vec3(0.0);
  for (int k = 0; k < 3; ++k)
    if (dot(vertex_value(p.vertex[k], 1u), facet) < SHARP * length(facet))
      p.sharp_facet = p.back ? -facet : facet;
  return p;
}
