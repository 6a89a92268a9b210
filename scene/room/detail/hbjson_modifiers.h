#pragma once

// Which Radiance modifier a part of a Honeybee model has.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit::detail {

/// The member, or null where `object` has none.
const nlohmann::json& member(const nlohmann::json& object, const char* key);
/// A text member, or "".
std::string text_in(const nlohmann::json& object, const char* key);

/// A part of a model as modifier sets name it: "wall_set" and "exterior_modifier".
struct ModifierUse {
  const char* set;
  const char* which;
};

class HbjsonModifiers {
public:
  /// `radiance`: properties.radiance of the model; null allowed.
  explicit HbjsonModifiers(const nlohmann::json& radiance);

  /// What `part` (a face, an aperture, ...) in a room with this modifier set is made of. Index into materials();
  /// empty: nothing (Void). Error: a modifier that is not there, or of a type that is not read.
  Result<std::optional<std::uint32_t>> of(const nlohmann::json& part, const std::string& room_set,
                                          const ModifierUse& use);
  std::uint32_t mean_of(std::uint32_t a, std::uint32_t b);

  std::vector<Material> materials;
  std::vector<std::string> notes;

private:
  std::string modifier_in(const std::string& set, const ModifierUse& use) const;
  Result<std::optional<std::uint32_t>> make(const std::string& name);
  std::uint32_t add(Material material);

  std::map<std::string, nlohmann::json> modifiers_, sets_;
  std::string default_set_;
  std::map<std::string, std::optional<std::uint32_t>> made_;
};

} // namespace daylit::detail
