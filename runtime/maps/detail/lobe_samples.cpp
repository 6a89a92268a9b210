#include "runtime/maps/detail/lobe_samples.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/maps/detail/lobe_samples.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace daylit::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Vector = hn::Vec<Floats>;

inline Vector load(const float* from) { return hn::LoadU(Floats(), from); }
inline Vector all(float value) { return hn::Set(Floats(), value); }

/// 2 / pi atan(t), 0 <= t <= 1: the polynomial of Pharr, Jakob & Humphreys (4th edition, sect. 3.8.3), error 1e-6.
inline Vector quarter_turns(Vector t) {
  Vector p = hn::MulAdd(t, all(-0.0251390972f), all(0.0419038818f));
  p = hn::MulAdd(p, t, all(0.0881770665f));
  p = hn::MulAdd(p, t, all(-0.2473337333f));
  p = hn::MulAdd(p, t, all(0.00615720179f));
  p = hn::MulAdd(p, t, all(0.6362265453f));
  return hn::MulAdd(p, t, all(0.00000406758566f));
}

/// octahedral_point() (runtime/base/octahedral.h) of unit directions, in [0, 1]^2.
inline void octahedral(Vector x, Vector y, Vector z, Vector& u, Vector& v) {
  const Vector ax = hn::Abs(x), ay = hn::Abs(y), one = all(1.0f);
  const Vector r = hn::Sqrt(hn::Max(hn::Zero(Floats()), hn::Sub(one, hn::Abs(z))));
  const Vector large = hn::Max(hn::Max(ax, ay), all(1e-20f)), part = quarter_turns(hn::Div(hn::Min(ax, ay), large));
  const Vector across = hn::Mul(r, hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(one, part), part)),
               along = hn::Sub(r, across);
  const auto south = hn::Lt(z, hn::Zero(Floats()));
  const Vector half = all(0.5f);
  const Vector pu = hn::IfThenElse(south, hn::Sub(one, across), along);
  const Vector pv = hn::IfThenElse(south, hn::Sub(one, along), across);
  u = hn::MulAdd(hn::CopySign(pu, x), half, half);
  v = hn::MulAdd(hn::CopySign(pv, y), half, half);
}

/// (u, v)[size()] of the samples in the frame e1, e2, e3.
void points_of(const LobeSamples& s, const glm::vec3& e1, const glm::vec3& e2, const glm::vec3& e3, float* u,
               float* v) {
  const Floats f;
  for (std::size_t i = 0; i < s.size(); i += hn::Lanes(f)) {
    const Vector a = load(&s.x[i]), b = load(&s.y[i]), c = load(&s.z[i]);
    const auto turned = [&](float x, float y, float z) {
      return hn::MulAdd(a, all(x), hn::MulAdd(b, all(y), hn::Mul(c, all(z))));
    };
    Vector pu, pv;
    octahedral(turned(e1.x, e2.x, e3.x), turned(e1.y, e2.y, e3.y), turned(e1.z, e2.z, e3.z), pu, pv);
    hn::StoreU(pu, f, u + i);
    hn::StoreU(pv, f, v + i);
  }
}

/// Four floats of the compiler's vector type: Highway's baseline has no four lanes.
typedef float Colour __attribute__((vector_size(16), aligned(4), may_alias));

inline Colour texel(const float* from) { return *reinterpret_cast<const Colour*>(from); }

/// sum + the bilinear colour.
inline Colour add_texels(const MipLevel& level, float u, float v, Colour sum) {
  constexpr float kShift = static_cast<float>(MipLevel::kBorder) - 0.5f;
  const float x = u * static_cast<float>(level.side) + kShift, y = v * static_cast<float>(level.side) + kShift;
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const float s = x - static_cast<float>(i), t = y - static_cast<float>(j);
  const float* p = &level.texels[4 * (static_cast<std::size_t>(j) * level.stride + i)];
  const float* q = p + 4 * level.stride;
  const Colour upper = texel(p) + s * (texel(p + 4) - texel(p)), lower = texel(q) + s * (texel(q + 4) - texel(q));
  return sum + (upper + t * (lower - upper));
}

inline Rgb colour_of(Colour sum) { return {sum[0], sum[1], sum[2]}; }

/// Weights of the four texels about a point t beyond the second: Catmull-Rom.
struct Cubic {
  float weight[4];
  explicit Cubic(float t)
      : weight{((-0.5f * t + 1.0f) * t - 0.5f) * t, (1.5f * t - 2.5f) * t * t + 1.0f,
               ((-1.5f * t + 2.0f) * t + 0.5f) * t, (0.5f * t - 0.5f) * t * t} {}
};

Rgb cubic_here(const MipLevel& level, float u, float v) {
  constexpr float kShift = static_cast<float>(MipLevel::kBorder) - 0.5f;
  const float x = u * static_cast<float>(level.side) + kShift, y = v * static_cast<float>(level.side) + kShift;
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const Cubic along(x - static_cast<float>(i)), down(y - static_cast<float>(j));
  Colour sum{};
  for (int row = 0; row < 4; ++row) {
    const float* p = &level.texels[4 * (static_cast<std::size_t>(j - 1 + row) * level.stride + (i - 1))];
    Colour of_row{};
    for (int k = 0; k < 4; ++k)
      of_row += along.weight[k] * texel(p + 4 * k);
    sum += down.weight[row] * of_row;
  }
  return glm::max(colour_of(sum), Rgb(0.0f));
}

Rgb mean_here(const LobeSamples& s, std::span<const MipLevel> chain, const glm::vec3& axis) {
  const glm::vec3 aside = std::abs(axis.z) < 0.9f ? glm::vec3(0, 0, 1) : glm::vec3(1, 0, 0);
  const glm::vec3 e1 = glm::normalize(glm::cross(aside, axis)), e2 = glm::cross(axis, e1);
  constexpr std::size_t kMost = LobeSamples::kMost;
  float u[kMost], v[kMost];
  points_of(s, e1, e2, axis, u, v);
  Colour sum{};
  for (std::size_t k = 0; k < s.size(); ++k)
    sum = add_texels(chain[static_cast<std::size_t>(s.level[k])], u[k], v[k], sum);
  return colour_of(sum) / static_cast<float>(s.size());
}

} // namespace daylit::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace daylit::detail {

HWY_EXPORT(cubic_here);
HWY_EXPORT(mean_here);

/// cos(theta) = (1 - xi)^(1 / (s + 1)) has the density (s + 1) / 2 pi cos^s. A sample reads the level whose texels are
/// as large as what it stands for: level = log2(solid angle / texel) / 2 (Krivanek & Colbert 2008, eq. 3, without
/// bias).
LobeSamples::LobeSamples(double exponent, std::size_t count, double texel_sr, int levels) {
  for (std::size_t k = 0; k < count; ++k) {
    const double rest = 1.0 - (static_cast<double>(k) + 0.5) / static_cast<double>(count);
    const double cosine = std::pow(rest, 1.0 / (exponent + 1.0)), sine = std::sqrt(1.0 - cosine * cosine);
    const double phi = 2.0 * std::numbers::pi * static_cast<double>(k) / std::numbers::phi;
    const double density = (exponent + 1.0) / (2.0 * std::numbers::pi) * std::pow(cosine, exponent);
    x.push_back(static_cast<float>(sine * std::cos(phi)));
    y.push_back(static_cast<float>(sine * std::sin(phi)));
    z.push_back(static_cast<float>(cosine));
    const double fitting = 0.5 * std::log2(1.0 / (static_cast<double>(count) * density * texel_sr));
    level.push_back(static_cast<int>(std::lround(std::clamp(fitting, 0.0, levels - 1.0))));
  }
}

MipLevel::MipLevel(const RadianceMap& map) : side(map.side), stride(map.side + 2 * kBorder) {
  texels.reserve(4 * static_cast<std::size_t>(stride) * stride);
  for (int y = -kBorder; y < side + kBorder; ++y)
    for (int x = -kBorder; x < side + kBorder; ++x) {
      const Rgb c = map.at_folded(x, y);
      texels.insert(texels.end(), {c.r, c.g, c.b, 0.0f});
    }
}

Rgb MipLevel::cubic(float u, float v) const { return HWY_DYNAMIC_DISPATCH(cubic_here)(*this, u, v); }

Rgb mean_of_samples(const LobeSamples& samples, std::span<const MipLevel> chain, const glm::vec3& axis) {
  return HWY_DYNAMIC_DISPATCH(mean_here)(samples, chain, axis);
}

} // namespace daylit::detail
#endif // HWY_ONCE
