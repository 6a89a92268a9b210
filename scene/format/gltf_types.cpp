#include "scene/format/gltf_types.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace daylit::detail {

namespace {

using Json = nlohmann::json;

/// A member of a material, or of an object in it.
struct Member {
  const char *in, *key;
  std::size_t numbers; ///< 1: a number, more: an array of so many, 0: a texture
};

constexpr const char* kPbr = "pbrMetallicRoughness";
constexpr std::array kMembers = {Member{kPbr, "baseColorFactor", 4},
                                 Member{kPbr, "metallicFactor", 1},
                                 Member{kPbr, "roughnessFactor", 1},
                                 Member{kPbr, "baseColorTexture", 0},
                                 Member{kPbr, "metallicRoughnessTexture", 0},
                                 Member{"", "emissiveFactor", 3},
                                 Member{"", "normalTexture", 0},
                                 Member{"", "occlusionTexture", 0},
                                 Member{"", "emissiveTexture", 0},
                                 Member{"normalTexture", "scale", 1},
                                 Member{"occlusionTexture", "strength", 1}};

std::string not_a(const std::string& key, const Json& found, const std::string& expected) {
  const std::string text = found.dump(-1, ' ', false, Json::error_handler_t::replace);
  return fmt::format("{} is {}, not {}", key, text.size() > 60 ? text.substr(0, 60) + "..." : text, expected);
}

bool is_numbers(const Json& value, std::size_t count) {
  return value.is_array() && value.size() == count &&
         std::ranges::all_of(value, [](const Json& v) { return v.is_number(); });
}

/// What is wrong with a member; empty where it is right, or not there.
std::string wrong(const Json& material, const Member& m) {
  const Json* of = &material;
  if (*m.in) {
    const auto parent = material.find(m.in);
    if (parent == material.end())
      return "";
    if (!parent->is_object())
      return not_a(m.in, *parent, "an object");
    of = &*parent;
  }
  const auto found = of->find(m.key);
  if (found == of->end())
    return "";
  if (m.numbers == 0)
    return found->is_object() && found->contains("index") && (*found)["index"].is_number_integer()
               ? ""
               : not_a(m.key, *found, "an object with the index of a texture");
  if (m.numbers == 1)
    return found->is_number() ? "" : not_a(m.key, *found, "a number");
  return is_numbers(*found, m.numbers) ? "" : not_a(m.key, *found, fmt::format("{} numbers", m.numbers));
}

std::string wrong_extension(const Json& material) {
  const auto extensions = material.find("extensions");
  if (extensions == material.end())
    return "";
  if (!extensions->is_object())
    return not_a("extensions", *extensions, "an object");
  for (const auto& [name, value] : extensions->items())
    if (!value.is_object())
      return not_a(name.substr(0, 80), value, "an object");
  return "";
}

std::string wrong_in(const Json& material) {
  if (!material.is_object())
    return not_a("the material", material, "an object");
  for (const Member& m : kMembers)
    if (std::string what = wrong(material, m); !what.empty())
      return what;
  return wrong_extension(material);
}

std::string place(const std::string& name, std::size_t index, const Json& material) {
  const std::string where = fmt::format("{}, material {}", name, index);
  const bool named = material.is_object() && material.contains("name") && material["name"].is_string();
  return named ? fmt::format("{} \"{}\"", where, material["name"].get<std::string>()) : where;
}

/// The materials alone are kept: buffers may be in the text.
Json materials_of(std::span<const std::uint8_t> json) {
  const auto keep = [](int depth, Json::parse_event_t event, const Json& key) {
    return depth != 1 || event != Json::parse_event_t::key || key == "materials";
  };
  const Json root = Json::parse(json.begin(), json.end(), keep, false);
  return root.is_object() && root.contains("materials") ? root["materials"] : Json::array();
}

} // namespace

std::optional<Error> check_material_types(std::span<const std::uint8_t> json, const std::string& name) {
  const Json materials = materials_of(json);
  const auto error = [](const std::string& what, const std::string& where) {
    return Error{ErrorCode::file_malformed, what, where, "correct it in the program that wrote the file"};
  };
  if (!materials.is_array())
    return error(not_a("materials", materials, "an array"), name);
  for (std::size_t k = 0; k < materials.size(); ++k)
    if (const std::string what = wrong_in(materials[k]); !what.empty())
      return error(what, place(name, k, materials[k]));
  return std::nullopt;
}

} // namespace daylit::detail
