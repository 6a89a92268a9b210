#include <algorithm>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <glm/mat4x4.hpp>

#include "scene/format/gltf_model.h"
#include "scene/room/face_collector.h"
#include "scene/room/room_formats.h"

namespace daylit {

namespace {

constexpr std::size_t kMostTriangles = 10'000'000; // after instancing
constexpr double kLargestCoordinate = 1e12;

double number_in(const tinygltf::Material& m, const std::string& extension, const std::string& key, double otherwise) {
  const auto found = m.extensions.find(extension);
  if (found == m.extensions.end() || !found->second.IsObject() || !found->second.Has(key))
    return otherwise;
  const tinygltf::Value& value = found->second.Get(key);
  return value.IsNumber() ? value.GetNumberAsDouble() : otherwise;
}

class GltfRoom {
public:
  GltfRoom(const tinygltf::Model& model, const std::string& name) : model_(model), name_(name) {
    file_.report.counted_in_faces = true;
  }

  Result<RoomFile> run() {
    if (Result<void> done = add_materials(); !done)
      return done.error();
    if (Result<void> done = add_nodes(); !done)
      return done.error();
    file_.room.vertices = std::move(faces_.vertices);
    if (Result<void> done = detail::collect_faces(faces_, name_, file_.room, file_.report); !done)
      return done.error();
    if (other_shapes_ > 0)
      note(fmt::format("{} primitives are points or lines and are left out", other_shapes_));
    if (!model_.skins.empty() || !model_.animations.empty())
      note("skins and animations are not read: the model stands as it is stored");
    file_.content_hash = content_hash(file_.room);
    return std::move(file_);
  }

private:
  void note(std::string text) { file_.report.notes.push_back(std::move(text)); }

  Error wrong(const std::string& what, const std::string& where) const {
    return {ErrorCode::file_malformed, what, name_ + ", " + where, "export the model again"};
  }

  Result<void> add_materials() {
    std::map<int, Rgb> means;
    for (std::size_t i = 0; i < model_.materials.size(); ++i) {
      Result<Material> m = make_material(model_.materials[i], means);
      if (!m) {
        Error error = m.error();
        error.where = fmt::format("{}, material \"{}\"", name_, model_.materials[i].name.substr(0, 80)) +
                      (error.where.empty() ? "" : ", " + error.where);
        return error;
      }
      file_.room.materials.push_back(std::move(*m));
    }
    return {};
  }

  Result<Material> make_material(const tinygltf::Material& given, std::map<int, Rgb>& means) {
    Material m{.name = given.name, .is_window = is_window_name(given.name)};
    const auto& factor = given.pbrMetallicRoughness.baseColorFactor;
    Rgb colour(1.0f);
    for (int c = 0; c < 3 && c < static_cast<int>(factor.size()); ++c)
      colour[c] = static_cast<float>(factor[static_cast<std::size_t>(c)]);
    if (const int texture = given.pbrMetallicRoughness.baseColorTexture.index; texture >= 0) {
      const Result<Rgb> mean = texture_mean(texture, means);
      if (!mean)
        return mean.error();
      colour *= *mean;
      note(fmt::format("material \"{}\": the texture counts as its mean, reflectance {:.3f} {:.3f} {:.3f}", given.name,
                       colour.r, colour.g, colour.b));
    }
    for (int c = 0; c < 3; ++c)
      if (!(colour[c] >= 0.0f && colour[c] <= 1.0f))
        return Error{ErrorCode::value_invalid,
                     fmt::format("base colour {:g} {:g} {:g} is outside 0..1", colour.r, colour.g, colour.b), "",
                     "set it to the fraction of light, 0 to 1"};
    if (!m.is_window) {
      m.reflectance = colour;
      if (std::ranges::any_of(given.emissiveFactor, [](double e) { return e > 0.0; }))
        note(fmt::format("material \"{}\" emits light, which is ignored: light comes from the sky", given.name));
      return m;
    }
    m.reflectance = Rgb(0.0f);
    const double transmission = number_in(given, "KHR_materials_transmission", "transmissionFactor", -1.0);
    const double index = number_in(given, "KHR_materials_ior", "ior", 0.0);
    if (transmission > 1.0 || (index != 0.0 && !(index >= 1.0 && index <= 4.0)))
      return Error{ErrorCode::value_invalid, "transmission or refractive index is out of range", "",
                   "transmission 0 to 1, index 1 to 4"};
    if (transmission >= 0.0)
      m.transmittance = colour * static_cast<float>(transmission);
    m.refractive_index = static_cast<float>(index);
    return m;
  }

  Result<Rgb> texture_mean(int texture, std::map<int, Rgb>& means) const {
    if (static_cast<std::size_t>(texture) >= model_.textures.size())
      return Error{ErrorCode::file_malformed, "a texture that is not there", fmt::format("texture {}", texture), ""};
    const int image = model_.textures[static_cast<std::size_t>(texture)].source;
    if (const auto known = means.find(image); known != means.end())
      return known->second;
    const Result<Rgb> mean = detail::image_mean(model_, image);
    if (mean)
      means[image] = *mean;
    return mean;
  }

  Result<void> add_nodes() {
    return detail::walk_meshes(model_, name_,
                               [this](const tinygltf::Mesh& mesh, const glm::dmat4& world, const std::string& where) {
                                 return add_mesh(mesh, world, where);
                               });
  }

  Result<void> add_mesh(const tinygltf::Mesh& mesh, const glm::dmat4& world, const std::string& where) {
    for (const tinygltf::Primitive& p : mesh.primitives) {
      if (p.mode != TINYGLTF_MODE_TRIANGLES && p.mode != TINYGLTF_MODE_TRIANGLE_STRIP &&
          p.mode != TINYGLTF_MODE_TRIANGLE_FAN) {
        ++other_shapes_;
        continue;
      }
      const Result<detail::GltfTriangles> triangles = detail::read_triangles(model_, p);
      if (!triangles) {
        Error error = triangles.error();
        error.where = name_ + ", " + where + ", " + error.where;
        return error;
      }
      if (Result<void> done = append(*triangles, world, p.material, where); !done)
        return done;
    }
    return {};
  }

  Result<void> append(const detail::GltfTriangles& t, const glm::dmat4& world, int material, const std::string& where) {
    if (faces_.faces.size() + t.corners.size() / 3 > kMostTriangles ||
        faces_.vertices.size() + t.positions.size() > 3 * kMostTriangles)
      return Error{ErrorCode::limit_exceeded, "more than ten million triangles with all instances",
                   name_ + ", " + where, "leave out what does not matter for light"};
    if (material < 0)
      material = default_material();
    else if (static_cast<std::size_t>(material) >= model_.materials.size())
      return wrong("a material that is not there", where);
    const auto first = static_cast<std::uint32_t>(faces_.vertices.size());
    for (const glm::dvec3& p : t.positions) {
      const glm::dvec4 q = world * glm::dvec4(p, 1.0);
      if (!(std::abs(q.x) < kLargestCoordinate && std::abs(q.y) < kLargestCoordinate &&
            std::abs(q.z) < kLargestCoordinate))
        return Error{ErrorCode::value_invalid, "a transformed position is not finite or absurdly large",
                     name_ + ", " + where, "check the transforms of the node and its parents"};
      faces_.vertices.emplace_back(q.x, -q.z, q.y);
    }
    for (std::size_t k = 0; k + 2 < t.corners.size(); k += 3) {
      const auto face = static_cast<int>(faces_.faces.size()) + 1;
      faces_.faces.push_back(
          {static_cast<std::uint32_t>(faces_.corners.size()), 3, static_cast<std::uint32_t>(material), face});
      for (int c = 0; c < 3; ++c)
        faces_.corners.push_back({.vertex = first + t.corners[k + static_cast<std::size_t>(c)]});
    }
    return {};
  }

  int default_material() {
    if (!default_material_) {
      note("faces without a material: reflectance 0.5 assumed");
      default_material_ = static_cast<int>(file_.room.materials.size());
      file_.room.materials.push_back({});
    }
    return *default_material_;
  }

  const tinygltf::Model& model_;
  const std::string& name_;
  RoomFile file_;
  detail::ObjText faces_;
  std::optional<int> default_material_;
  std::size_t other_shapes_ = 0;
};

} // namespace

Result<RoomFile> parse_gltf_room(std::span<const std::uint8_t> bytes, const std::string& name,
                                 const ReadFile& read_file) {
  const Result<tinygltf::Model> model = detail::parse_gltf(bytes, name, read_file);
  if (!model)
    return model.error();
  return GltfRoom(*model, name).run();
}

} // namespace daylit
