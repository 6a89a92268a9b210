#include "scene/material/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/common.hpp>

#include "scene/core/parallel.h"

namespace daylit {

namespace {

using Codes = std::array<float, 256>;

/// Linear value of every code.
const Codes& decoded(TextureCoding coding) {
  static const auto tables = [] {
    std::array<Codes, 2> t{};
    for (std::size_t v = 0; v < 256; ++v) {
      t[1][v] = static_cast<float>(v) / 255.0f;
      t[0][v] = srgb_decode(t[1][v]);
    }
    return t;
  }();
  return tables[coding == TextureCoding::srgb ? 0 : 1];
}

/// Nearest code of a linear value: codes change half-way between their neighbours, as coded.
std::uint8_t encoded(float value, TextureCoding coding) {
  if (coding == TextureCoding::linear)
    return static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(value, 0.0f, 1.0f)));
  static const auto borders = [] {
    std::array<float, 255> b{};
    for (std::size_t v = 0; v < 255; ++v)
      b[v] = srgb_decode((static_cast<float>(v) + 0.5f) / 255.0f);
    return b;
  }();
  return static_cast<std::uint8_t>(std::upper_bound(borders.begin(), borders.end(), value) - borders.begin());
}

/// What texel i of a halved line takes: of n = 2 m texels two, of n = 2 m + 1 the length 2 + 1/m, so that every texel
/// of the finer line counts once.
struct Share {
  int first = 0;
  std::array<float, 3> weight{};
};
Share share(int i, int n) {
  if (n == 1)
    return {0, {1.0f, 0.0f, 0.0f}};
  if (n % 2 == 0)
    return {2 * i, {0.5f, 0.5f, 0.0f}};
  const auto m = static_cast<float>(n / 2), k = static_cast<float>(i), whole = static_cast<float>(n);
  return {2 * i, {(m - k) / whole, m / whole, (k + 1.0f) / whole}};
}

/// `texel(x, y)`: linear, of the finer picture.
template <class Texel>
RgbImage halved(int width, int height, const Texel& texel) {
  RgbImage out(std::max(width / 2, 1), std::max(height / 2, 1));
  parallel_for(tbb::blocked_range<int>(0, out.height, 16), [&](const auto& rows) {
    for (int y = rows.begin(); y != rows.end(); ++y) {
      const Share down = share(y, height);
      for (int x = 0; x < out.width; ++x) {
        const Share across = share(x, width);
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i)
            if (const float w = down.weight[j] * across.weight[i]; w > 0.0f)
              out.at(x, y) += w * texel(across.first + i, down.first + j);
      }
    }
  });
  return out;
}

Rgb8Image coded(const RgbImage& linear, TextureCoding coding) {
  Rgb8Image out{linear.width, linear.height, std::vector<std::uint8_t>(3 * linear.texels.size())};
  for (std::size_t i = 0; i < linear.texels.size(); ++i)
    for (int c = 0; c < 3; ++c)
      out.bytes[3 * i + static_cast<std::size_t>(c)] = encoded(linear.texels[i][c], coding);
  return out;
}

/// The two texels of a line around u, and how far the point is from the first to the second.
struct Between {
  int low = 0, high = 0;
  float t = 0.0f;
};
Between between(float u, int size, TextureWrap wrap) {
  if (wrap == TextureWrap::mirror) // beyond its edge a mirrored picture begins with the texel that it ended with
    u = 1.0f - std::fabs(u - 2.0f * std::floor(0.5f * u) - 1.0f);
  u = wrap == TextureWrap::repeat ? u - std::floor(u) : std::clamp(u, 0.0f, 1.0f);
  const float x = u * static_cast<float>(size) - 0.5f, lower = std::floor(x);
  const int low = static_cast<int>(lower);
  if (wrap == TextureWrap::repeat)
    return {low < 0 ? size - 1 : low, low + 1 == size ? 0 : low + 1, x - lower};
  return {std::max(low, 0), std::min(low + 1, size - 1), x - lower};
}

const std::uint8_t* code_at(const Rgb8Image& level, int x, int y) {
  return level.bytes.data() +
         3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(level.width) + static_cast<std::size_t>(x));
}

constexpr float kFarthest = 1e9f;

} // namespace

Result<Texture> Texture::make(Rgb8Image picture, TextureCoding coding, TextureWrap wrap_u, TextureWrap wrap_v) {
  if (picture.width < 1 || picture.height < 1 ||
      picture.bytes.size() != 3 * static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height))
    return Error{ErrorCode::value_invalid, "an empty picture cannot be a texture", "texture", "export it again"};
  Texture texture;
  texture.linear_ = &decoded(coding);
  texture.wrap_u_ = wrap_u;
  texture.wrap_v_ = wrap_v;
  texture.levels_.push_back(std::move(picture));
  RgbImage linear; // of the last level: each is made of the exact one before it, not of rounded codes
  while (texture.levels_.back().width > 1 || texture.levels_.back().height > 1) {
    const Rgb8Image& finest = texture.levels_.front();
    linear = linear.empty() ? halved(finest.width, finest.height,
                                     [&](int x, int y) { return texture.texel(code_at(finest, x, y)); })
                            : halved(linear.width, linear.height, [&](int x, int y) { return linear.at(x, y); });
    texture.levels_.push_back(coded(linear, coding));
  }
  return texture;
}

std::size_t Texture::bytes() const {
  std::size_t sum = 0;
  for (const Rgb8Image& level : levels_)
    sum += level.bytes.size();
  return sum;
}

Rgb Texture::texel(const std::uint8_t* code) const {
  const Codes& value = *linear_;
  return {value[code[0]], value[code[1]], value[code[2]]};
}

Rgb Texture::bilinear(const Rgb8Image& level, const glm::vec2& uv) const {
  const Between x = between(uv.x, level.width, wrap_u_), y = between(uv.y, level.height, wrap_v_);
  const std::uint8_t *upper = code_at(level, 0, y.low), *lower = code_at(level, 0, y.high);
  const std::size_t left = 3 * static_cast<std::size_t>(x.low), right = 3 * static_cast<std::size_t>(x.high);
  const Rgb above = (1.0f - x.t) * texel(upper + left) + x.t * texel(upper + right);
  const Rgb below = (1.0f - x.t) * texel(lower + left) + x.t * texel(lower + right);
  return (1.0f - y.t) * above + y.t * below;
}

/// A texel of level k is 2^k texels wide (Williams 1983).
Rgb Texture::at(const glm::vec2& uv, float width_uv) const {
  const bool known = std::fabs(uv.x) <= kFarthest && std::fabs(uv.y) <= kFarthest;
  const glm::vec2 p = known ? uv : glm::vec2(0.0f);
  const float texels = width_uv * static_cast<float>(std::max(width(), height()));
  if (!(texels > 1.0f))
    return bilinear(levels_.front(), p);
  const float level = std::min(std::log2(texels), static_cast<float>(levels_.size() - 1));
  const auto fine = static_cast<std::size_t>(level);
  const float t = level - static_cast<float>(fine);
  const Rgb value = bilinear(levels_[fine], p);
  return t > 0.0f ? glm::mix(value, bilinear(levels_[fine + 1], p), t) : value;
}

} // namespace daylit
