// The surface of the objects, by number of the triangle.
layout(binding = 4) uniform usamplerBuffer object_triangles; // rgb: vertices
layout(binding = 5) uniform samplerBuffer object_vertices;   // rgb: position, normal, reflectance

struct ObjectPoint {
  uvec3 vertex;
  vec3 weight; // barycentric
  vec3 offset; // from the sphere's centre
  vec3 normal; // of the side that is seen
  bool back;   // the inside of a thin shell: the winding decides, interpolated normals turn away at silhouettes
};

vec3 weighted(samplerBuffer list, int stride, int which, ObjectPoint p) {
  return p.weight.x * texelFetch(list, stride * int(p.vertex.x) + which).rgb +
         p.weight.y * texelFetch(list, stride * int(p.vertex.y) + which).rgb +
         p.weight.z * texelFetch(list, stride * int(p.vertex.z) + which).rgb;
}

// Where the ray through a pixel's centre meets the triangle, or the nearest to it that the triangle has where only
// another part of the pixel shows it (Moeller and Trumbore 1997: exact for triangles much smaller than their distance).
ObjectPoint object_point(float id, ivec2 pixel) {
  ObjectPoint p;
  p.vertex = texelFetch(object_triangles, int(id) - 1).rgb;
  vec3 a = texelFetch(object_vertices, 3 * int(p.vertex.x)).rgb;
  vec3 ab = texelFetch(object_vertices, 3 * int(p.vertex.y)).rgb - a;
  vec3 ac = texelFetch(object_vertices, 3 * int(p.vertex.z)).rgb - a;
  vec3 ray = pixel_ray(pixel), from = eye.xyz - a, across = cross(ray, ac);
  float whole = dot(ab, across); // positive where the front is seen
  vec2 part = vec2(dot(from, across), dot(ray, cross(from, ab))) * (whole < 0.0 ? -1.0 : 1.0);
  p.weight = max(vec3(abs(whole) - part.x - part.y, part), vec3(-0.5 * abs(whole)));
  float sum = p.weight.x + p.weight.y + p.weight.z;
  p.weight = sum > 0.0 ? p.weight / sum : vec3(1.0 / 3.0);
  p.back = whole < 0.0;
  p.offset = (a - sphere.xyz) + p.weight.y * ab + p.weight.z * ac;
  p.normal = normalize(weighted(object_vertices, 3, 1, p)) * (p.back ? -1.0 : 1.0);
  return p;
}
