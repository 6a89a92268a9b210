// Irradiance at a point of a room: light that was reflected inside, from a baked volume under a sky.
// Usage: room_light room.volume sky.toml|sky.exr X Y Z     (metres, z up; prints what a level surface receives, r g b)

#include <cstdio>
#include <cstdlib>

#include "scene/sky/sky.h"
#include "scene/volume/indirect_light.h"
#include "scene/volume/volume_file.h"

namespace {

/// Errors are values: what, where, and what to do next.
int fail(const daylit::Error& error) {
  std::fprintf(stderr, "room_light: %s\n", error.message().c_str());
  return 1;
}

} // namespace

int main(int argc, char** argv) {
  if (argc != 6)
    return std::fputs("usage: room_light room.volume SKY X Y Z\n", stderr), 2;
  const auto volume = daylit::read_volume(argv[1]);
  if (!volume)
    return fail(volume.error());
  const auto opened = daylit::open_sky({.file = argv[2]});
  if (!opened)
    return fail(opened.error());
  const auto surfaces = daylit::rays_of_light(*volume);
  if (!surfaces)
    return fail(surfaces.error());
  // The radiance L_i of each sky region, sum of L_i L_lm^(i) at the probes, interpolated; and the surfaces near by.
  const auto indirect = daylit::IndirectLight::make(*volume, *surfaces, opened->sky);
  if (!indirect)
    return fail(indirect.error());
  const auto light = indirect->at({std::atof(argv[3]), std::atof(argv[4]), std::atof(argv[5])});
  if (!light)
    return std::fputs("room_light: the point is outside the room\n", stderr), 1;
  const daylit::Rgb e = daylit::irradiance(*light, {0, 0, 1});
  std::printf("%.6g %.6g %.6g\n", e.r, e.g, e.b);
}
