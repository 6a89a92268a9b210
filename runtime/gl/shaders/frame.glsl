// What every pass of a picture knows. Positions are metres relative to the renderer's origin.
layout(std140, binding = 0) uniform Frame {
  mat4 clip_from_scene;
  vec4 eye;                             // xyz
  vec4 ray_corner, ray_right, ray_down; // xyz: through pixel (x, y) goes corner + x right + y down, from the eye
  vec4 sphere;                          // around the objects: xyz centre, w radius
  vec4 sky_cone, sun_cone;              // hold the lights: xyz axis, w cosine of the half angle, 2 without lights
  vec4 sun_normal_irradiance;           // rgb
  vec4 maps;                            // x: side of a shadow map in texels; y: half the depth range of the room's
  ivec4 lights;                         // x: of the sky, which come first; y: of sky and sun
} frame;

vec3 pixel_ray(ivec2 pixel) {
  return frame.ray_corner.xyz + float(pixel.x) * frame.ray_right.xyz + float(pixel.y) * frame.ray_down.xyz;
}
