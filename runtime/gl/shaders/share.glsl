// Part of a whole, `otherwise` where there is no whole.
vec3 share(vec3 part, vec3 whole, float otherwise) {
  return vec3(whole.r > 0.0 ? part.r / whole.r : otherwise, whole.g > 0.0 ? part.g / whole.g : otherwise,
              whole.b > 0.0 ? part.b / whole.b : otherwise);
}
