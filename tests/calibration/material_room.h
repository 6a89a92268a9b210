#pragma once

// A room with five materials in sight, one out of sight and a window, and its photographs by daylit-simulate.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "scene/image/rgb_image.h"

namespace daylit::test {

inline Rgb true_reflectance(const std::string& material) {
  static const std::map<std::string, Rgb> known{{"floor", {0.34f, 0.25f, 0.16f}},   {"ceiling", {0.83f, 0.83f, 0.8f}},
                                                {"wall", {0.7f, 0.68f, 0.6f}},      {"accent", {0.16f, 0.34f, 0.5f}},
                                                {"cupboard", {0.55f, 0.3f, 0.14f}}, {"hidden", {0.4f, 0.4f, 0.4f}}};
  const auto found = known.find(material);
  return found == known.end() ? Rgb(0.0f) : found->second;
}

struct MaterialRoomOptions {
  int width_px = 120, samples = 256;
};

inline void write_text(const std::filesystem::path& path, const std::string& text) { std::ofstream(path) << text; }

/// room.obj with the true room.mtl, guess.obj where all materials are 0.5, and scene.toml with three views.
inline void write_material_room(const std::filesystem::path& folder, const MaterialRoomOptions& options) {
  // 4 x 3 x 2.5 m, window in x = 0; a cupboard by the wall y = 0, its back (hidden) seen from nowhere.
  const std::string geometry = R"(v 0 0 0
v 4 0 0
v 4 3 0
v 0 3 0
v 0 0 2.5
v 4 0 2.5
v 4 3 2.5
v 0 3 2.5
v 0 0.7 0.8
v 0 2.3 0.8
v 0 2.3 2.1
v 0 0.7 2.1
v 1.5 0.1 0
v 2.7 0.1 0
v 2.7 0.6 0
v 1.5 0.6 0
v 1.5 0.1 1.5
v 2.7 0.1 1.5
v 2.7 0.6 1.5
v 1.5 0.6 1.5
usemtl floor
f 1 2 3 4
usemtl ceiling
f 5 8 7 6
usemtl wall
f 1 5 6 2
f 3 7 8 4
f 1 4 10 9
f 4 8 11 10
f 8 5 12 11
f 5 1 9 12
usemtl accent
f 2 6 7 3
usemtl cupboard
f 17 18 19 20
f 14 15 19 18
f 15 16 20 19
f 16 13 17 20
usemtl hidden
f 13 14 18 17
usemtl window
f 9 10 11 12
)";
  const std::string pane = "newmtl window\nKd 0 0 0\nTf 0.85 0.88 0.86\n";
  std::string truth = pane, guess = pane;
  for (const char* name : {"floor", "ceiling", "wall", "accent", "cupboard", "hidden"}) {
    const Rgb c = true_reflectance(name);
    truth += "newmtl " + std::string(name) + "\nKd " + std::to_string(c.r) + " " + std::to_string(c.g) + " " +
             std::to_string(c.b) + "\n";
    guess += "newmtl " + std::string(name) + "\nKd 0.5 0.5 0.5\n";
  }
  write_text(folder / "room.obj", "mtllib room.mtl\n" + geometry);
  write_text(folder / "guess.obj", "mtllib guess.mtl\n" + geometry);
  write_text(folder / "room.mtl", truth);
  write_text(folder / "guess.mtl", guess);
  write_text(folder / "cube.mtl", "newmtl cube\nKd 0.5 0.5 0.5\n");
  write_text(folder / "cube.obj", "mtllib cube.mtl\nusemtl cube\nv 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\n"
                                  "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
  const std::string width = std::to_string(options.width_px), height = std::to_string(options.width_px * 3 / 4);
  write_text(folder / "scene.toml", R"([sky]
model = "clear"
zenith_radiance = [14, 18, 26]
sun = { azimuth = 190, elevation = 32, normal_irradiance = [800, 730, 620] }
ground_albedo = 0.2
[interior]
fov = 70
[simulate]
samples = )" + std::to_string(options.samples) +
                                        R"(
sensor_noise = 0.01
marker_board = false
[path]
camera = [[0.3, 2.7, 1.6, 3.2, 0.4, 0.9], [3.7, 2.6, 1.5, 0.6, 0.6, 1.0], [0.4, 0.4, 1.5, 3.4, 2.2, 1.1]]
[pose]
position = [0.3, 2.7, 1.6]
look_at = [3.2, 0.4, 0.9]
[room]
model = "room.obj"
[[object]]
model = "cube.obj"
position = [3.5, 2.5, 0.02]
[output]
size = [)" + width + ", " + height + "]\n");
}

inline std::vector<std::filesystem::path> view_configs(const std::filesystem::path& folder) {
  return {folder / "out/view0.toml", folder / "out/view1.toml", folder / "out/view2.toml"};
}

/// Renders the three views and writes their configurations, with the model that knows no colours and one sky. Returns
/// the exit code of daylit-simulate.
inline int simulate_views(const std::filesystem::path& folder) {
  const std::string line = "cd '" + folder.string() +
                           "' && " DAYLIT_BINARY_DIR "/bin/daylit-simulate scene.toml -o out --frames 3 --quiet && "
                           "cd out && i=0 && for c in CONFIG.toml CONFIG_0001.toml CONFIG_0002.toml; do "
                           "sed 's|^model = .*room.obj.*|model = \"../guess.obj\"|; /^volume/d; "
                           "s|sky_000.|sky|' $c > view$i.toml; i=$((i + 1)); done";
  return std::system(line.c_str());
}

} // namespace daylit::test
