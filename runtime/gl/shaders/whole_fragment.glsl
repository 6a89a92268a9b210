// The frame (frame.glsl) in passes over the whole picture.
flat in vec4 eye, ray_corner, ray_right, ray_down, sphere, sun_normal_irradiance;
vec3 pixel_ray(ivec2 p) { return ray_corner.xyz + float(p.x) * ray_right.xyz + float(p.y) * ray_down.xyz; }
