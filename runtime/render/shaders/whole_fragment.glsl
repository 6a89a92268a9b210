// The frame (frame.glsl) in passes over the whole picture.
flat in vec4 eye, ray_corner, ray_right, ray_down, sphere, sky_cone, sun_cone, sun_normal_irradiance, cone_width;
flat in ivec4 tile;
vec3 pixel_ray(ivec2 p) { return ray_corner.xyz + float(p.x) * ray_right.xyz + float(p.y) * ray_down.xyz; }

// Pixels that ask the same lights lie together: every second pixel of every second row is a tile, and the four tiles
// stand in two columns and two rows.
const ivec2 kTiles = ivec2(2, 2);
ivec2 tile_place(ivec2 pixel) { return (pixel & (kTiles - 1)) * tile.xy + pixel / kTiles; }
ivec2 tile_pixel(ivec2 place) { return (place - tile.zw * tile.xy) * kTiles + tile.zw; }
