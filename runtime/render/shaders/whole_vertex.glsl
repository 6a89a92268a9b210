// Hands the frame to the fragments as flat values: software drivers read those once for many pixels, and uniform blocks
// lane by lane.
flat out vec4 eye, ray_corner, ray_right, ray_down, sphere, sky_cone, sun_cone, sun_normal_irradiance;
flat out vec4 cone_width; // cosine and sine of the half angles of the sky's and of the sun's cone
flat out ivec4 tile; // xy: size, zw: which
uniform ivec2 this_tile;
uniform int pass; // 0: over all marked pixels, 1: marks pixels itself, 2: over those that several surfaces fill

// Of a group without lights: nothing lies within.
vec2 width_of(vec4 cone) { return cone.w < 0.0 ? vec2(2.0, -2.0) : vec2(cos(cone.w), sin(cone.w)); }

void main() {
  gl_Position = whole_picture(pass == 0 ? kAllMarked : pass == 1 ? kWholeMark : kMixedOnly);
  eye = frame.eye;
  ray_corner = frame.ray_corner;
  ray_right = frame.ray_right;
  ray_down = frame.ray_down;
  sphere = frame.sphere;
  sky_cone = frame.sky_cone;
  sun_cone = frame.sun_cone;
  cone_width = vec4(width_of(frame.sky_cone), width_of(frame.sun_cone));
  sun_normal_irradiance = frame.sun_normal_irradiance;
  tile = ivec4(frame.tile_size.xy, this_tile);
  HAND_ON_WINDOWS
}
