#include "scene/room/detail/hbjson_modifiers.h"

#include <array>
#include <optional>

#include <fmt/format.h>

#include "scene/core/lower_case.h"
#include "scene/room/radiance_material.h"

namespace daylit::detail {

namespace {

using Json = nlohmann::json;

/// Honeybee's generic modifiers (honeybee_radiance.lib.modifiers): opaque ones by reflectance, glass by transmissivity.
struct Generic {
  const char *set, *which, *type;
  double value;
};
constexpr std::array kGeneric = {Generic{"wall_set", "", "plastic", 0.5},
                                 Generic{"floor_set", "", "plastic", 0.2},
                                 Generic{"roof_ceiling_set", "", "plastic", 0.8},
                                 Generic{"aperture_set", "interior_modifier", "glass", 0.9584154328610596},
                                 Generic{"aperture_set", "", "glass", 0.6975761815384331},
                                 Generic{"door_set", "interior_glass_modifier", "glass", 0.9584154328610596},
                                 Generic{"door_set", "exterior_glass_modifier", "glass", 0.6975761815384331},
                                 Generic{"door_set", "", "plastic", 0.5},
                                 Generic{"shade_set", "interior_modifier", "plastic", 0.5},
                                 Generic{"shade_set", "", "plastic", 0.35}};

const Generic& generic_of(const ModifierUse& use) {
  const std::string_view set = use.set, which = use.which;
  for (const Generic& g : kGeneric)
    if (set == g.set && (which == g.which || *g.which == 0))
      return g;
  return kGeneric.back();
}

std::vector<double> arguments_of(const Json& modifier, const std::string& type) {
  std::vector<double> values;
  const auto add = [&](const char* key) {
    const Json& value = member(modifier, key);
    values.push_back(value.is_number() ? value.get<double>() : 0.0);
  };
  const bool glass = type == "glass";
  for (const char* key : {glass ? "r_transmissivity" : "r_reflectance", glass ? "g_transmissivity" : "g_reflectance",
                          glass ? "b_transmissivity" : "b_reflectance"})
    add(key);
  if (glass && member(modifier, "refraction_index").is_number())
    add("refraction_index");
  if (!glass)
    for (const char* key : {"specularity", "roughness", "transmitted_diff", "transmitted_spec"})
      add(key);
  return values;
}

} // namespace

const Json& member(const Json& object, const char* key) {
  static const Json none;
  if (!object.is_object())
    return none;
  const auto found = object.find(key);
  return found == object.end() ? none : *found;
}

std::string text_in(const Json& object, const char* key) {
  const Json& value = member(object, key);
  return value.is_string() ? value.get<std::string>() : std::string();
}

HbjsonModifiers::HbjsonModifiers(const Json& radiance) {
  const Json& global = member(radiance, "global_modifier_set");
  for (const Json* owner : {&global, &radiance})
    for (const Json& modifier : member(*owner, "modifiers"))
      modifiers_[text_in(modifier, "identifier")] = modifier;
  for (const Json& set : member(radiance, "modifier_sets"))
    sets_[text_in(set, "identifier")] = set;
  if (global.is_object()) {
    default_set_ = text_in(global, "identifier");
    sets_[default_set_] = global;
  }
}

/// The identifier, or "" where the set leaves it open. Sets name modifiers, or hold them.
std::string HbjsonModifiers::modifier_in(const std::string& set, const ModifierUse& use) const {
  const auto found = sets_.find(set);
  return found == sets_.end() ? std::string() : text_in(member(found->second, use.set), use.which);
}

Result<std::optional<std::uint32_t>> HbjsonModifiers::of(const Json& part, const std::string& room_set,
                                                         const ModifierUse& use) {
  std::string name = text_in(member(member(part, "properties"), "radiance"), "modifier");
  if (name.empty())
    name = modifier_in(room_set, use);
  if (name.empty())
    name = modifier_in(default_set_, use);
  if (!name.empty())
    return make(name);
  const Generic& g = generic_of(use);
  name = fmt::format("generic {}{}{}", g.set, *g.which == 0 ? "" : " ", g.which);
  if (const auto known = made_.find(name); known != made_.end())
    return known->second;
  const std::array<double, 5> grey = {g.value, g.value, g.value, 0.0, 0.0};
  auto material = radiance_material(name, g.type, std::span(grey).first(std::string_view(g.type) == "glass" ? 3 : 5));
  if (!material)
    return material.error();
  return made_[name] = add(std::move(*material));
}

Result<std::optional<std::uint32_t>> HbjsonModifiers::make(const std::string& name) {
  if (const auto known = made_.find(name); known != made_.end())
    return known->second;
  const auto found = modifiers_.find(name);
  if (found == modifiers_.end())
    return Error{ErrorCode::value_invalid, "the modifier \"" + name + "\" is not in the model", "", "export it again"};
  std::string type = lower_case(text_in(found->second, "type"));
  if (type == "void")
    return made_[name] = std::nullopt;
  const std::vector<double> arguments = arguments_of(found->second, type);
  auto material = radiance_material(name, type, arguments);
  if (!material)
    return material.error();
  if (const std::string missing = left_out(type, arguments); !missing.empty())
    notes.push_back(fmt::format("modifier \"{}\" ({}): {} is left out", name, type, missing));
  return made_[name] = add(std::move(*material));
}

std::uint32_t HbjsonModifiers::add(Material material) {
  materials.push_back(std::move(material));
  return static_cast<std::uint32_t>(materials.size() - 1);
}

std::uint32_t HbjsonModifiers::mean_of(std::uint32_t a, std::uint32_t b) {
  if (a == b || materials[a].is_window || materials[b].is_window)
    return a;
  const std::string name = "mean of " + materials[a].name + " and " + materials[b].name;
  if (const auto known = made_.find(name); known != made_.end())
    return *known->second;
  Material mean = materials[a];
  mean.name = name;
  mean.reflectance = 0.5f * (materials[a].reflectance + materials[b].reflectance);
  notes.push_back(name + ": a wall between two rooms is one face here");
  return *(made_[name] = add(std::move(mean)));
}

} // namespace daylit::detail
