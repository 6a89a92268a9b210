// What every pass of a picture knows, for vertices. Positions are metres relative to the renderer's origin.
layout(std140, binding = 3) uniform Frame {
  mat4 clip_from_scene;
  vec4 eye;                             // xyz
  vec4 ray_corner, ray_right, ray_down; // xyz: through pixel (x, y) goes corner + x right + y down, from the eye
  vec4 sphere;                          // around the objects: xyz centre, w radius
  vec4 sun_normal_irradiance;           // rgb
} frame;

// One triangle over the whole picture, at a depth that marks pixels (marks.glsl).
vec4 whole_picture(float depth) {
  return vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, depth, 1.0);
}
