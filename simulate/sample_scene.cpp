#include "simulate/sample_scene.h"

#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "scene/core/atomic_file.h"
#include "scene/core/output_file.h"
#include "simulate/teapot.h"

namespace daylit {

namespace {

// The published box, millimetres: x to the left, y up, z away from the camera. Ours: (x, y, z) -> (x, depth - z, y).
constexpr double kMetresPerUnit = 0.005; // five times life size
constexpr double kWidth = 556.0, kHeight = 548.8, kDepth = 559.2;
using Footprint = std::array<std::array<double, 2>, 4>; // x, z in order around the block
constexpr Footprint kShortBlock = {{{130, 65}, {82, 225}, {240, 272}, {290, 114}}};
constexpr Footprint kTallBlock = {{{423, 247}, {265, 296}, {314, 456}, {472, 406}}};
constexpr double kShortHeight = 165.0, kTallHeight = 330.0;
// The window, metres along y and z of the red wall.
constexpr std::array<double, 2> kWindowY = {1.1, 2.5}, kWindowZ = {0.9, 2.1};

constexpr Rgb kPorcelain{0.70f, 0.66f, 0.58f};
constexpr double kTeapotWidth_m = 0.25;
constexpr double kRadians = std::numbers::pi / 180.0;

constexpr FileKind kSampleKind{"a file of the demo", "# Written by daylit-simulate --demo\n"};

class ObjWriter {
public:
  explicit ObjWriter(const std::string& mtl) : text_("mtllib " + mtl + "\n") {}
  void material(const std::string& name) { text_ += "usemtl " + name + "\n"; }
  void quad(const std::array<glm::dvec3, 4>& corners) {
    for (const glm::dvec3& c : corners)
      text_ += fmt::format("v {:.6g} {:.6g} {:.6g}\n", c.x, c.y, c.z);
    text_ += "f -4 -3 -2 -1\n";
  }
  const std::string& text() const { return text_; }

private:
  std::string text_;
};

void write_block(ObjWriter& out, const Footprint& footprint, double height) {
  const auto at = [&](std::size_t k, double z) {
    return glm::dvec3(footprint[k & 3][0], kDepth - footprint[k & 3][1], z) * kMetresPerUnit;
  };
  // The footprint runs counter-clockwise seen from above after the turn of the axes, so the sides face outwards.
  for (std::size_t k = 0; k < 4; ++k)
    out.quad({at(k, 0.0), at(k + 1, 0.0), at(k + 1, height), at(k, height)});
  out.quad({at(0, height), at(1, height), at(2, height), at(3, height)});
}

/// The wall x = width in nine fields without the middle one; no T-junctions at the window.
void write_window_wall(ObjWriter& out, double x, double depth, double height) {
  const std::array<double, 4> y = {0.0, kWindowY[0], kWindowY[1], depth}, z = {0.0, kWindowZ[0], kWindowZ[1], height};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      if (i != 1 || k != 1)
        out.quad({{{x, y[i], z[k]}, {x, y[i], z[k + 1]}, {x, y[i + 1], z[k + 1]}, {x, y[i + 1], z[k]}}});
}

SunDisc sun_at(double azimuth_deg, double elevation_deg, Rgb normal_irradiance) {
  const double a = azimuth_deg * kRadians, e = elevation_deg * kRadians;
  SunDisc sun;
  sun.direction = {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
  sun.normal_irradiance = normal_irradiance;
  return sun;
}

Result<SkyModel> sample_sky(const std::string& name) {
  SkyModel sky; // W m^-2 sr^-1 per channel
  if (name == "overcast") {
    sky.zenith_radiance = Rgb(50.0f);
    return sky;
  }
  if (name != "sun" && name != "shade")
    return Error{ErrorCode::usage, "'" + name + "' is not a sample scene", "--demo", "overcast, sun or shade"};
  sky.kind = SkyModel::Kind::clear;
  sky.zenith_radiance = Rgb(14.0f, 18.0f, 26.0f);
  // Through the window the sun reaches the floor around the teapot, or only its far side and the green wall.
  sky.sun =
      name == "sun" ? sun_at(15.0, 58.0, Rgb(850.0f, 800.0f, 720.0f)) : sun_at(12.0, 33.0, Rgb(780.0f, 690.0f, 560.0f));
  return sky;
}

} // namespace

std::string sample_room_obj(const std::string& mtl_name) {
  const double w = kWidth * kMetresPerUnit, d = kDepth * kMetresPerUnit, h = kHeight * kMetresPerUnit;
  ObjWriter out(mtl_name);
  out.material("white");
  out.quad({{{0, 0, 0}, {w, 0, 0}, {w, d, 0}, {0, d, 0}}}); // floor
  out.quad({{{0, 0, h}, {0, d, h}, {w, d, h}, {w, 0, h}}}); // ceiling
  out.quad({{{0, 0, 0}, {0, 0, h}, {w, 0, h}, {w, 0, 0}}}); // back
  out.quad({{{0, d, 0}, {w, d, 0}, {w, d, h}, {0, d, h}}}); // front
  out.material("green");
  out.quad({{{0, 0, 0}, {0, d, 0}, {0, d, h}, {0, 0, h}}});
  out.material("red");
  write_window_wall(out, w, d, h);
  out.material("white");
  write_block(out, kShortBlock, kShortHeight);
  write_block(out, kTallBlock, kTallHeight);
  return out.text();
}

std::string sample_room_mtl() {
  // Rec. 709 linear values of the measured spectra, as commonly used with the published box.
  return "newmtl white\nKd 0.725 0.71 0.68\nnewmtl red\nKd 0.63 0.065 0.05\nnewmtl green\nKd 0.14 0.45 0.091\n";
}

std::string object_obj(const ObjectMesh& mesh, const std::string& mtl_name) {
  std::string out = "mtllib " + mtl_name + "\nusemtl object\n";
  for (const glm::vec3& p : mesh.positions)
    out += fmt::format("v {:.6f} {:.6f} {:.6f}\n", p.x, p.y, p.z);
  for (const glm::vec3& n : mesh.normals)
    out += fmt::format("vn {:.5f} {:.5f} {:.5f}\n", n.x, n.y, n.z);
  for (const auto& t : mesh.triangles)
    out += fmt::format("f {0}//{0} {1}//{1} {2}//{2}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return out;
}

std::string object_mtl(const Rgb& c) { return fmt::format("newmtl object\nKd {} {} {}\n", c.r, c.g, c.b); }

Result<SimulateConfig> sample_scene(const std::string& name, int width_px, int height_px) {
  const auto sky = sample_sky(name);
  if (!sky)
    return sky.error();
  SimulateConfig scene;
  scene.sky_model = *sky;
  scene.interior_fov = 0.44;
  // For a standard error of the truth of about 1.5 % on the object; where direct sun dominates, fewer do.
  scene.samples_per_pixel = name == "sun" ? 96 : 512;
  scene.run.room_model = "room.obj";
  ObjectConfig teapot;
  teapot.model = "teapot.obj";
  teapot.position = {1.90, 1.90, 0.0};
  teapot.rotation_deg = {0.0, 0.0, -150.0};
  scene.run.objects.push_back(teapot);
  const glm::dvec3 eye(2.25, 2.72, 0.92), target(1.93, 1.90, 0.045);
  scene.run.world_from_camera = look_at(eye, target);
  for (const double turn : {-20.0, -10.0, 0.0, 10.0, 20.0}) { // a quarter of a minute's walk around the teapot
    const double c = std::cos(turn * kRadians), s = std::sin(turn * kRadians);
    const glm::dvec3 d = eye - target;
    scene.camera_path.push_back({target + glm::dvec3(c * d.x - s * d.y, s * d.x + c * d.y, d.z), target});
  }
  if (scene.sky_model.sun) { // half an hour
    const glm::dvec3 at = scene.sky_model.sun->direction;
    const double azimuth = std::atan2(at.y, at.x) / kRadians, elevation = std::asin(at.z) / kRadians;
    for (const double step : {-1.0, 1.0})
      scene.sun_path.push_back(sun_at(azimuth + 3.0 * step, elevation + 1.5 * step, Rgb(1.0f)).direction);
  }
  MarkerConfig marker;
  marker.ids = {23};
  marker.size_m = 0.08;
  // Flat on the floor beside the teapot, turned so that it stands upright in the picture. The sheet lies 1 mm high.
  const double turn = 155.0 * kRadians;
  marker.world_from_board = {{std::cos(turn), std::sin(turn), 0.0, 0.0},
                             {-std::sin(turn), std::cos(turn), 0.0, 0.0},
                             {0.0, 0.0, 1.0, 0.0},
                             {2.09, 2.00, 0.001, 1.0}};
  scene.run.marker = marker;
  scene.run.output.width_px = width_px;
  scene.run.output.height_px = height_px;
  return scene;
}

Result<std::filesystem::path> write_sample_scene(const std::string& name, const std::filesystem::path& folder,
                                                 int width_px, int height_px, bool force) {
  auto scene = sample_scene(name, width_px, height_px);
  if (!scene)
    return scene.error();
  const ObjectMesh teapot = tessellate_teapot(8, kTeapotWidth_m, kPorcelain);
  const std::pair<const char*, std::string> files[] = {{"room.obj", sample_room_obj("room.mtl")},
                                                       {"room.mtl", sample_room_mtl()},
                                                       {"teapot.obj", object_obj(teapot, "teapot.mtl")},
                                                       {"teapot.mtl", object_mtl(kPorcelain)},
                                                       {"scene.toml", to_toml(*scene)}};
  for (const auto& [file, text] : files)
    if (const auto writable = check_output(folder / file, kSampleKind, force); !writable)
      return writable.error();
  for (const auto& [file, text] : files)
    if (const auto written = write_file_atomically(folder / file, std::string(kSampleKind.start) + text); !written)
      return written.error();
  return folder / "scene.toml";
}

} // namespace daylit
