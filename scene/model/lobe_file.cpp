#include "scene/model/lobe_file.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <string>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "scene/format/toml_section.h"

namespace daylit::detail {

namespace {

constexpr float kRadiansPerDegree = std::numbers::pi_v<float> / 180.0f;

/// A [[lobe]] as it is written.
struct GivenLobe {
  LafortuneLobe lobe;
  float rotation_deg = 0.0f;
  std::filesystem::path weight_texture, exponent_texture, rotation_texture;
};

/// `number`: of the lobe in the file, from 1; `material`: that it names, or empty.
GivenLobe read_lobe(TomlSection& section, std::size_t number, const std::string& material) {
  GivenLobe given;
  LafortuneLobe& lobe = given.lobe;
  glm::dvec3 c(lobe.c);
  if (!section.read_rgb("specular", lobe.weight, {0.0, 1.0}) && !section.has("specular"))
    section.problem("",
                    fmt::format("lobe {} of the file{} needs specular, the part of light that it sends, 0 to 1", number,
                                material.empty() ? "" : fmt::format(", for the material \"{}\",", material)));
  section.read("specular_texture", given.weight_texture);
  if (section.read("c", c, {-1e3, 1e3}) && !(c.z > 1e-6))
    section.problem("c", "the third coefficient is not above 0: the lobe would point below the surface");
  lobe.c = glm::vec3(c);
  section.read("exponent", lobe.exponent, {1.0, static_cast<double>(LafortuneLobe::kMostExponent)});
  section.read("exponent_texture", given.exponent_texture);
  section.read("grazing", lobe.grazing, {0.0, 1.0});
  section.read("falloff", lobe.falloff, {0.1, 100.0});
  section.read("rotation", given.rotation_deg, {-360.0, 360.0});
  section.read("rotation_texture", given.rotation_texture);
  return given;
}

/// What the lobe stands over is kept; all that mirrors or lets light through is gone.
ObjectMaterial under_lobe(const ObjectMaterial& m) {
  ObjectMaterial kept{.name = m.name,
                      .base_colour = m.base_colour,
                      .emission = m.emission,
                      .normal_scale = m.normal_scale,
                      .occlusion_strength = m.occlusion_strength};
  kept.base_colour_texture = m.base_colour_texture;
  kept.normal_texture = m.normal_texture;
  kept.occlusion_texture = m.occlusion_texture;
  kept.emission_texture = m.emission_texture;
  return kept;
}

bool has_texture_coordinates(const TriangleSoup& soup, std::size_t material) {
  return std::ranges::any_of(soup.triangles, [&](const SoupTriangle& t) {
    return t.material == material && (t.corner[0].uv != t.corner[1].uv || t.corner[0].uv != t.corner[2].uv);
  });
}

class LobeReader {
public:
  LobeReader(std::filesystem::path path, TriangleSoup& soup) : path_(std::move(path)), soup_(soup) {}

  Result<void> run() {
    auto file = parse_config_file(path_);
    if (!file)
      return file.error();
    TomlSection root(*file, &file->root, "");
    std::vector<std::pair<GivenLobe, std::string>> lobes;
    for (TomlSection& section : root.sections("lobe")) {
      std::string name;
      if (section.read("material", name) && !is_material(name))
        section.problem("material", fmt::format("the model has no material \"{}\", but: {}", name,
                                                fmt::join(material_names(), ", ")));
      lobes.emplace_back(read_lobe(section, lobes.size() + 1, name), name);
      section.finish();
    }
    root.finish();
    if (auto error = file->error())
      return *error;
    if (lobes.empty())
      soup_.surfaces.note(path_.string() + " has no [[lobe]]");
    for (const auto& [given, name] : lobes)
      for (std::size_t k = 0; k < soup_.surfaces.materials.size(); ++k)
        if (name.empty() || soup_.surfaces.materials[k].name == name)
          if (const auto applied = apply(given, k); !applied)
            return applied;
    return {};
  }

private:
  bool is_material(const std::string& name) const {
    return std::ranges::any_of(soup_.surfaces.materials, [&](const ObjectMaterial& m) { return m.name == name; });
  }
  std::vector<std::string> material_names() const {
    std::vector<std::string> names;
    for (const ObjectMaterial& m : soup_.surfaces.materials)
      names.push_back(fmt::format("\"{}\"", m.name));
    return names;
  }

  Result<void> apply(const GivenLobe& given, std::size_t material) {
    ObjectMaterial m = under_lobe(soup_.surfaces.materials[material]);
    m.lobe = given.lobe;
    m.lobe_rotation = kRadiansPerDegree * given.rotation_deg;
    for (const auto& [picture, coding, use] :
         {std::tuple(&given.weight_texture, TextureCoding::srgb, &m.lobe_weight_texture),
          std::tuple(&given.exponent_texture, TextureCoding::linear, &m.lobe_exponent_texture),
          std::tuple(&given.rotation_texture, TextureCoding::linear, &m.lobe_rotation_texture)})
      if (const auto added = add_texture(*picture, coding, material, *use); !added)
        return added.error();
    note_sum(m);
    soup_.surfaces.materials[material] = std::move(m);
    return {};
  }

  Result<void> add_texture(const std::filesystem::path& picture, TextureCoding coding, std::size_t material,
                           TextureUse& use) {
    if (picture.empty())
      return {};
    if (!has_texture_coordinates(soup_, material))
      return Error{ErrorCode::value_invalid,
                   fmt::format("a lobe with a texture, but the material \"{}\" has no texture coordinates",
                               soup_.surfaces.materials[material].name),
                   path_.string(), "export the model with them, or leave the texture out"};
    const auto added = soup_.surfaces.add_texture(
        {picture.string(), coding}, [&] { return read_ldr_image(picture); },
        fmt::format("{}, material \"{}\"", path_.string(), soup_.surfaces.materials[material].name));
    if (!added)
      return added.error();
    use.texture = *added;
    return {};
  }

  void note_sum(const ObjectMaterial& m) {
    const Rgb sum = m.base_colour + m.lobe->weight;
    if (!m.base_colour_texture && !m.lobe_weight_texture && std::max({sum.r, sum.g, sum.b}) > 1.0f + 1e-6f)
      soup_.surfaces.note(fmt::format("{}: base colour and specular of the material \"{}\" exceed 1 together; the base "
                                      "has what specular leaves",
                                      path_.string(), m.name));
  }

  std::filesystem::path path_;
  TriangleSoup& soup_;
};

} // namespace

Result<void> add_lobes(const std::filesystem::path& model, TriangleSoup& soup) {
  std::filesystem::path path = model;
  path.replace_extension(".lobes.toml");
  std::error_code failed;
  if (!std::filesystem::exists(path, failed))
    return {};
  return LobeReader(std::move(path), soup).run();
}

} // namespace daylit::detail
