#include "bench/frame_objects.h"

#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "scene/core/atomic_file.h"
#include "scene/image/image_formats.h"
#include "scene/model/object_mesh.h"
#include "simulate/sample_scene.h"
#include "simulate/teapot.h"

namespace daylit::bench {

namespace {

/// A ball whose radius in direction (u, v) is half of 0.84 of the width times `bumps`.
template <class Bumps>
ObjectMesh bumpy_ball(int around, int across, double width_m, Rgb reflectance, const Bumps& bumps) {
  const float pi = std::numbers::pi_v<float>, half = static_cast<float>(0.42 * width_m);
  const auto point = [&](float u, float v) {
    return half * bumps(u, v) * glm::vec3(std::cos(u) * std::cos(v), std::sin(u) * std::cos(v), std::sin(v));
  };
  ObjectMesh mesh;
  for (int i = 0; i <= around; ++i)
    for (int j = 0; j <= across; ++j) {
      const float u = 2.0f * pi * static_cast<float>(i) / static_cast<float>(around),
                  v = pi * (static_cast<float>(j) / static_cast<float>(across) - 0.5f);
      constexpr float h = 1e-3f;
      const glm::vec3 n = glm::cross(point(u + h, v) - point(u - h, v), point(u, v + h) - point(u, v - h));
      const bool pole = j == 0 || j == across;
      mesh.positions.push_back(point(u, v) + glm::vec3(0.0f, 0.0f, half));
      mesh.normals.push_back(pole ? glm::vec3(0.0f, 0.0f, j == 0 ? -1.0f : 1.0f) : glm::normalize(n));
      mesh.reflectance.push_back(reflectance);
    }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(i * (across + 1) + j); };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

/// `around` x `across` quads.
ObjectMesh blob_mesh(int around, int across, double width_m, Rgb reflectance) {
  return bumpy_ball(around, across, width_m, reflectance, [](float u, float v) {
    return 1.0f + 0.12f * std::sin(5.0f * u) * std::cos(v) * std::cos(v) * std::cos(4.0f * v);
  });
}

/// 40 folds around: 320 x 160 quads, 102,400 triangles.
ObjectMesh folded_mesh(double width_m, Rgb reflectance) {
  return bumpy_ball(320, 160, width_m, reflectance, [](float u, float v) {
    return 1.0f + 0.1f * std::sin(40.0f * u + 3.0f * std::sin(4.0f * v)) * std::cos(v) * std::cos(v);
  });
}

/// A model in its own size, and what its MTL file says of it.
struct Shape {
  ObjectMesh mesh;
  std::string mtl;
};

// Metres. One of them covers 8 to 12 % of the picture; so do three and five that are smaller.
constexpr double kTeapotWidth = 0.29, kBlobWidth = 0.235;
constexpr double kOfThree = 0.55, kOfFive = 0.75;

Result<Shape> shape_named(const std::string& name) {
  const Rgb white(0.7f, 0.68f, 0.62f);
  const std::string plain = object_mtl(white);
  if (name == "teapot")
    return Shape{tessellate_teapot(8, kTeapotWidth, white), plain};
  if (name == "blob")
    return Shape{blob_mesh(120, 64, kBlobWidth, white), plain};
  if (name == "folds")
    return Shape{folded_mesh(kBlobWidth, white), plain};
  if (name == "plain") // 5,040 triangles
    return Shape{blob_mesh(72, 35, kBlobWidth, white), plain};
  if (name == "dense") // 1,100,400
    return Shape{blob_mesh(1050, 524, kBlobWidth, white), plain};
  if (name == "ball" || name == "squares" || name == "lamp") {
    ObjectMesh ball = bumpy_ball(96, 48, kBlobWidth, white, [](float, float) { return 1.0f; });
    const std::string more = name == "squares" ? "map_Kd squares.png\n" : name == "lamp" ? "Ke 40 30 18\n" : "";
    return Shape{std::move(ball), (name == "squares" ? object_mtl(Rgb(1.0f)) : plain) + more};
  }
  return Error{ErrorCode::usage, "there is no object \"" + name + "\"", "--objects",
               "teapot, blob, folds, few, many or five"};
}

/// A shape, beside the middle: to the right as the camera sees it, and away from it, metres.
struct Standing {
  std::string shape, material;
  double right = 0.0, away = 0.0, scale = 1.0;
};

std::vector<Standing> standing(const std::string& what) {
  if (what == "five")
    return {{"ball", "mirror", -0.10, 0.05, 0.75 * kOfFive},
            {"blob", "aluminium", 0.09, 0.07, 0.7 * kOfFive},
            {"ball", "glass", 0.01, -0.09, 0.65 * kOfFive},
            {"squares", "", -0.16, -0.10, 0.5 * kOfFive},
            {"lamp", "", 0.17, -0.06, 0.35 * kOfFive}};
  if (what == "few" || what == "many") {
    const std::string ball = what == "few" ? "plain" : "dense";
    return {{"teapot", "", 0.0, -0.02, kOfThree}, {ball, "", -0.15, 0.04, kOfThree}, {ball, "", 0.15, 0.04, kOfThree}};
  }
  return {{what, "", 0.0, 0.0, 1.0}};
}

/// Dark and light, 64 around.
Rgb8Image squares() {
  constexpr int kSide = 512;
  Rgb8Image image{kSide, kSide / 2, {}};
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (const int value : (x / 8 + y / 8) % 2 ? std::array{225, 215, 200} : std::array{40, 60, 90})
        image.bytes.push_back(static_cast<std::uint8_t>(value));
  return image;
}

/// OBJ with the place of each vertex of a ball in its picture, by its direction from the middle.
std::string with_places(const ObjectMesh& ball, std::string obj) {
  const auto columns = static_cast<std::size_t>(49);
  std::string places;
  for (std::size_t k = 0; k < ball.positions.size(); ++k)
    places += fmt::format("vt {:.5f} {:.5f}\n", static_cast<double>(k / columns) / 96.0,
                          static_cast<double>(k % columns) / 48.0);
  obj.resize(obj.find("\nf ") + 1);
  obj += places;
  for (const auto& t : ball.triangles)
    obj += fmt::format("f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return obj;
}

Result<void> write_shape(const std::filesystem::path& folder, const std::string& name) {
  const std::filesystem::path model = folder / (name + ".obj");
  const auto shape = shape_named(name);
  if (!shape)
    return shape.error();
  std::string obj = object_obj(shape->mesh, name + ".mtl");
  if (name == "squares") {
    obj = with_places(shape->mesh, std::move(obj));
    if (const auto r = write_png(folder / "squares.png", squares()); !r)
      return r;
  }
  if (const auto r = write_file_atomically(model, obj); !r)
    return r;
  return write_file_atomically(folder / (name + ".mtl"), shape->mtl);
}

} // namespace

Result<std::vector<ObjectConfig>> write_frame_objects(const std::filesystem::path& folder, const std::string& what,
                                                      const RunConfig& scene) {
  const std::string name = what.substr(0, what.find(':'));
  const glm::dvec3 column((*scene.world_from_camera)[0]);
  const glm::dvec3 right = glm::normalize(glm::dvec3(column.x, column.y, 0.0)), away(-right.y, right.x, 0.0);
  std::vector<ObjectConfig> objects;
  for (const Standing& s : standing(name)) {
    if (const auto written = write_shape(folder, s.shape); !written)
      return written.error();
    ObjectConfig object = scene.objects[0];
    object.model = folder / (s.shape + ".obj");
    object.position += s.right * right + s.away * away;
    object.scale = s.scale;
    object.material = name == what ? s.material : what.substr(name.size() + 1);
    objects.push_back(std::move(object));
  }
  return objects;
}

} // namespace daylit::bench
