// The augmented picture of a CONFIG.toml whose sky and camera picture are files, as linear EXR.
// Usage: draw CONFIG.toml OUT.exr

#include <cstdio>

#include "runtime/input/interior_input.h"
#include "runtime/session/session.h"
#include "scene/config/config.h"
#include "scene/image/image_formats.h"

namespace {

daylit::Result<void> draw(const char* config_file, const char* picture_file) {
  auto config = daylit::read_run_config(config_file);
  if (!config)
    return config.error();
  const auto interior = daylit::read_interior(*config); // photograph, lens, and where the camera stood
  if (!interior)
    return interior.error();
  const auto sky = daylit::read_sky(config->sky);
  if (!sky)
    return sky.error();
  config->world_from_camera = interior->world_from_camera;

  const daylit::PhotoPixels photo = interior->photo.pixels();
  const auto progress = [](const std::string&, double) { return true; }; // false would stop loading
  auto session = daylit::Session::open(*config, photo.width(), photo.height(), progress);
  if (!session)
    return session.error();
  const auto frame = session->render({*sky, photo}); // again and again, for a live picture
  if (!frame)
    return frame.error();
  return daylit::write_exr(picture_file, (*frame)->composite.picture);
}

} // namespace

int main(int argc, char** argv) {
  if (argc != 3)
    return std::fputs("usage: draw CONFIG.toml OUT.exr\n", stderr), 2;
  const auto done = draw(argv[1], argv[2]);
  if (!done)
    std::fprintf(stderr, "draw: %s\n", done.error().message().c_str());
  return done ? 0 : 1;
}
