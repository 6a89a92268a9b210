#pragma once

// Where in a wide lobe pixels look, and what neighbours make of it together.

#include <array>
#include <cstddef>

#include <glm/vec2.hpp>

#include "scene/image/rgb_image.h"

namespace daylit {

constexpr int kLobePlaces = 4;            ///< of a pixel
constexpr std::size_t kLobePatterns = 16; ///< of pixels, each once in a square of four by four

/// Number of a pixel's pattern.
inline std::size_t lobe_pattern(int x, int y) { return static_cast<std::size_t>(((x & 3) + 4 * (y & 3)) * 5 & 15); }

/// Number `sample` of four: sixty-four points of Hammersley 1960, dealt out so that the four of a pixel lie apart and a
/// square of four by four pixels has all. The same in every frame: a still scene does not flicker.
inline glm::vec2 lobe_place(std::size_t pattern, int sample) {
  const int n = 16 * sample + ((static_cast<int>(pattern) + sample) & 15);
  int mirrored = 0;
  for (int bit = 0; bit < 6; ++bit)
    mirrored |= (n >> bit & 1) << (5 - bit);
  return (glm::vec2(n, mirrored) + 0.5f) / 64.0f;
}

/// Mean of the patterns, each by the weights of the pixels that have it: every place in the lobe counts alike, however
/// much the weights favour some pixels. Else the mean beats with the patterns' period where one place is bright.
class SharedLobe {
public:
  void add(std::size_t pattern, float weight, const Rgb& radiance) {
    sums_[pattern] += weight * radiance;
    weights_[pattern] += weight;
  }
  Rgb mean() const {
    Rgb sum(0.0f);
    float count = 0.0f;
    for (std::size_t k = 0; k < kLobePatterns; ++k)
      if (weights_[k] > 0.0f) {
        sum += sums_[k] / weights_[k];
        count += 1.0f;
      }
    return count > 0.0f ? sum / count : sum;
  }

private:
  std::array<Rgb, kLobePatterns> sums_{};
  std::array<float, kLobePatterns> weights_{};
};

} // namespace daylit
