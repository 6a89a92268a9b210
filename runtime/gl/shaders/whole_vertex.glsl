// Hands the frame to the fragments as flat values: software drivers read those once for many pixels, and uniform blocks
// lane by lane.
flat out vec4 eye, ray_corner, ray_right, ray_down, sphere, sun_normal_irradiance;
uniform bool mixed_only; // else all marked pixels; of no importance where the pass marks pixels itself

void main() {
  gl_Position = whole_picture(mixed_only ? kMixedOnly : kAllMarked);
  eye = frame.eye;
  ray_corner = frame.ray_corner;
  ray_right = frame.ray_right;
  ray_down = frame.ray_down;
  sphere = frame.sphere;
  sun_normal_irradiance = frame.sun_normal_irradiance;
}
