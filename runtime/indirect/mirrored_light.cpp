#include "runtime/indirect/mirrored_light.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/base/octahedral.h"
#include "sh/sh9.h"

namespace daylit {

namespace {
constexpr int kSquarings = 4; // of a cosine: half as bright 17 degrees away
} // namespace

MirroredLight::Direction MirroredLight::direction_of(const glm::vec3& from) {
  const glm::ivec2 at = glm::clamp(glm::ivec2((octahedral_point(from) * 0.5 + 0.5) * double{kSide}), 0, kSide - 1);
  return static_cast<Direction>(at.y * kSide + at.x);
}

glm::vec3 MirroredLight::middle_of(Direction texel) {
  const glm::dvec2 at(texel % kSide + 0.5, texel / kSide + 0.5);
  return glm::vec3(octahedral_direction(2.0 / kSide * at - 1.0));
}

const std::vector<std::array<float, 9>>& MirroredLight::harmonics() {
  static const std::vector<std::array<float, 9>> made = [] {
    std::vector<std::array<float, 9>> y;
    for (int k = 0; k < kSide * kSide; ++k)
      y.push_back(sh::evaluate9(middle_of(static_cast<Direction>(k))));
    return y;
  }();
  return made;
}

/// L(w) = sum over the lights of (n + 1) / (2 pi) (w . w_k)^n E_k, n = 16: the few rays of a receiver find it without
/// noise.
MirroredLight::MirroredLight(std::vector<std::array<MirroringSide, 2>> sides, std::span<const DirectionalLight> windows)
    : sides_(std::move(sides)) {
  if (sides_.empty())
    return;
  constexpr float kScale = (static_cast<float>(1 << kSquarings) + 1.0f) / (2.0f * std::numbers::pi_v<float>);
  windows_.assign(kSide * kSide, Rgb(0.0f));
  for (std::size_t k = 0; k < windows_.size(); ++k) {
    const glm::vec3 w = middle_of(static_cast<Direction>(k));
    for (const DirectionalLight& l : windows) {
      float power = std::max(glm::dot(w, glm::vec3(l.direction)), 0.0f);
      for (int square = 0; square < kSquarings; ++square)
        power *= power;
      windows_[k] += kScale * power * l.irradiance;
    }
  }
}

/// sum_lm L_lm Y_lm(r) + L_windows(r) - L_diffuse; r: where light that is mirrored comes from.
Rgb MirroredLight::change(std::uint32_t side, Direction from) const {
  const MirroringSide& s = sides_[side / 2][side % 2];
  if (s.as_diffuse == Rgb(0.0f))
    return Rgb(0.0f);
  const std::array<float, 9>& y = harmonics()[from];
  Rgb sum(0.0f);
  for (std::size_t i = 0; i < y.size(); ++i)
    sum += y[i] * s.sent[i];
  return glm::max(sum, Rgb(0.0f)) + s.of_windows * windows_[from] - s.as_diffuse;
}

} // namespace daylit
