#pragma once

// What metals send to the room: mirrored, not to all sides alike.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/object/relight.h"
#include "runtime/sky/direct_light.h"

namespace daylit {

/// One side of a vertex that sends light.
struct MirroringSide {
  Sh9Rgb sent{};        ///< nine coefficients of the radiance that arrives from the room, times what is mirrored of it
  Rgb of_windows{0.0f}; ///< what is mirrored of the windows' light
  Rgb as_diffuse{0.0f}; ///< radiance that stands for both on all sides; 0: nothing is mirrored
};

/// Light comes from directions of the octahedral square (base/octahedral.h). Thread-safe.
class MirroredLight {
public:
  using Direction = std::uint16_t;
  static Direction direction_of(const glm::vec3& from);

  MirroredLight() = default;
  /// Both sides of each sender, none where nothing mirrors; the windows' light without shadows, at the objects' middle.
  MirroredLight(std::vector<std::array<MirroringSide, 2>> sides, std::span<const DirectionalLight> windows);
  bool any() const { return !sides_.empty(); }
  /// How much more radiance a side (Receiver::Sender::side) sends where it mirrors what comes from there than
  /// `as_diffuse`.
  Rgb change(std::uint32_t side, Direction from) const;

private:
  static constexpr int kSide = 16; // of the square
  static glm::vec3 middle_of(Direction texel);
  static const std::vector<std::array<float, 9>>& harmonics();
  std::vector<std::array<MirroringSide, 2>> sides_;
  std::vector<Rgb> windows_; ///< radiance, by direction
};

} // namespace daylit
