#include "runtime/maps/detail/lobe_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/maps/detail/lobe_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace daylit::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kChargePad>;
using Integers = hn::RebindToSigned<Floats>;
using Vector = hn::Vec<Floats>;

inline Vector load(const float* from) { return hn::LoadU(Floats(), from); }
inline Vector all(float value) { return hn::Set(Floats(), value); }

/// log2(1 - d) for d < 1: log2(t) of the rounded t = 1 - d, and what rounding took, (1 - t) - d, to first order.
/// Without it an error of 6e-8 in t would be one of 6e-8 x exponent in the power. Mantissa m = 1 + f in [sqrt(1/2),
/// sqrt(2)), then ln(m) = f - f^2 / 2 + f^3 P(f) with the minimax P of Cephes (Moshier 1989, logf), error 1e-7 of it.
inline Vector log2_one_minus(Vector d) {
  const Floats f;
  const Integers i;
  const Vector one = all(1.0f), t = hn::Sub(one, d);
  const Vector lost = hn::Sub(hn::Sub(one, t), d);
  const auto bits = hn::BitCast(i, t);
  const auto exponent = hn::ShiftRight<23>(hn::Sub(bits, hn::Set(i, 0x3f3504f3))); // bits of sqrt(1/2)
  const Vector x = hn::Sub(hn::BitCast(f, hn::Sub(bits, hn::ShiftLeft<23>(exponent))), one), x2 = hn::Mul(x, x);
  Vector p = hn::MulAdd(x, all(7.0376836292e-2f), all(-1.1514610310e-1f));
  p = hn::MulAdd(p, x, all(1.1676998740e-1f));
  p = hn::MulAdd(p, x, all(-1.2420140846e-1f));
  p = hn::MulAdd(p, x, all(1.4249322787e-1f));
  p = hn::MulAdd(p, x, all(-1.6668057665e-1f));
  p = hn::MulAdd(p, x, all(2.0000714765e-1f));
  p = hn::MulAdd(p, x, all(-2.4999993993e-1f));
  p = hn::MulAdd(p, x, all(3.3333331174e-1f));
  p = hn::MulAdd(hn::Mul(p, x), x2, hn::MulAdd(x2, all(-0.5f), hn::Mul(lost, hn::ApproximateReciprocal(t))));
  return hn::MulAdd(hn::Add(p, x), all(1.442695041f), hn::ConvertTo(f, exponent));
}

/// The same by its series, d + d^2 / 2 + ... + d^7 / 7. exponent d^8 / 8 is missing: 1e-5 of the lobe where that is
/// exp(-25), for exponent 150; far less elsewhere.
inline Vector log2_one_minus_small(Vector d) {
  Vector p = hn::MulAdd(d, all(-1.442695041f / 7.0f), all(-1.442695041f / 6.0f));
  p = hn::MulAdd(p, d, all(-1.442695041f / 5.0f));
  p = hn::MulAdd(p, d, all(-1.442695041f / 4.0f));
  p = hn::MulAdd(p, d, all(-1.442695041f / 3.0f));
  p = hn::MulAdd(p, d, all(-1.442695041f / 2.0f));
  return hn::Mul(hn::MulAdd(p, d, all(-1.442695041f)), d);
}

/// 2^x for x <= 0; 0 below 2^-124. Integer and fraction f in [-1/2, 1/2]; the series of 2^f to degree 6, error 1.2e-7.
inline Vector exp2_of_negative(Vector x) {
  const Floats f;
  const Integers i;
  const auto enough = hn::Ge(x, all(-124.0f));
  const Vector bounded = hn::Max(x, all(-124.0f)), whole = hn::Round(bounded), part = hn::Sub(bounded, whole);
  Vector p = hn::MulAdd(part, all(1.5403530e-4f), all(1.3333558e-3f));
  p = hn::MulAdd(p, part, all(9.6181291e-3f));
  p = hn::MulAdd(p, part, all(5.5504109e-2f));
  p = hn::MulAdd(p, part, all(2.4022651e-1f));
  p = hn::MulAdd(p, part, all(6.9314718e-1f));
  p = hn::MulAdd(p, part, all(1.0f));
  const auto scaled = hn::Add(hn::BitCast(i, p), hn::ShiftLeft<23>(hn::ConvertTo(i, whole)));
  return hn::IfThenElseZero(enough, hn::BitCast(f, scaled));
}

enum class Width { cosine, wide, narrow };
constexpr float kNarrow = 150.0f;

/// max(0, cos)^exponent, cos = 1 - |w - r|^2 / 2: near the axis the difference keeps the digits that w . r loses.
template <Width kWidth>
inline Vector lobe(Vector dx, Vector dy, Vector dz, Vector exponent) {
  const Vector square = hn::MulAdd(dx, dx, hn::MulAdd(dy, dy, hn::Mul(dz, dz)));
  const Vector d = hn::Mul(square, all(0.5f));
  if constexpr (kWidth == Width::cosine)
    return hn::Max(hn::Zero(Floats()), hn::Sub(all(1.0f), d));
  if constexpr (kWidth == Width::narrow)
    return exp2_of_negative(hn::Mul(log2_one_minus_small(d), exponent));
  const auto in_front = hn::Lt(d, all(1.0f - 1e-6f));
  const Vector bounded = hn::IfThenElseZero(in_front, d);
  return hn::IfThenElseZero(in_front, exp2_of_negative(hn::Mul(log2_one_minus(bounded), exponent)));
}

/// Points of one pass over the charges, so that a loaded charge serves all of them.
constexpr std::size_t kPointsAtOnce = 2;

/// Charges that are summed in float before the sums go to double.
constexpr std::size_t kFlush = 8192;

template <std::size_t kPoints>
struct Accumulators {
  Vector red[kPoints], green[kPoints], blue[kPoints], weight[kPoints];

  void clear() {
    for (std::size_t p = 0; p < kPoints; ++p)
      red[p] = green[p] = blue[p] = weight[p] = hn::Zero(Floats());
  }
  void flush(LobeSum* sums) {
    const Floats f;
    for (std::size_t p = 0; p < kPoints; ++p) {
      sums[p].red += static_cast<double>(hn::GetLane(hn::SumOfLanes(f, red[p])));
      sums[p].green += static_cast<double>(hn::GetLane(hn::SumOfLanes(f, green[p])));
      sums[p].blue += static_cast<double>(hn::GetLane(hn::SumOfLanes(f, blue[p])));
      sums[p].weight += static_cast<double>(hn::GetLane(hn::SumOfLanes(f, weight[p])));
    }
    clear();
  }
};

template <Width kWidth, std::size_t kPoints>
void add_to_points(const Charges& c, std::span<const ChargeRange> ranges, const glm::vec3* points, float exponent,
                   LobeSum* sums) {
  const Vector power = all(exponent);
  Accumulators<kPoints> a;
  a.clear();
  std::size_t held = 0;
  for (const ChargeRange& range : ranges) {
    for (std::size_t i = range.first; i < range.first + range.count; i += hn::Lanes(Floats())) {
      const Vector x = load(&c.x[i]), y = load(&c.y[i]), z = load(&c.z[i]);
      const Vector r = load(&c.red[i]), g = load(&c.green[i]), b = load(&c.blue[i]), w = load(&c.weight[i]);
      for (std::size_t p = 0; p < kPoints; ++p) {
        const Vector k = lobe<kWidth>(hn::Sub(x, all(points[p].x)), hn::Sub(y, all(points[p].y)),
                                      hn::Sub(z, all(points[p].z)), power);
        a.red[p] = hn::MulAdd(k, r, a.red[p]);
        a.green[p] = hn::MulAdd(k, g, a.green[p]);
        a.blue[p] = hn::MulAdd(k, b, a.blue[p]);
        a.weight[p] = hn::MulAdd(k, w, a.weight[p]);
      }
    }
    if ((held += range.count) >= kFlush) {
      a.flush(sums);
      held = 0;
    }
  }
  a.flush(sums);
}

template <Width kWidth>
void add_to_all(const Charges& c, std::span<const ChargeRange> ranges, std::span<const glm::vec3> points,
                float exponent, std::span<LobeSum> sums) {
  std::size_t p = 0;
  for (; p + kPointsAtOnce <= points.size(); p += kPointsAtOnce)
    add_to_points<kWidth, kPointsAtOnce>(c, ranges, &points[p], exponent, &sums[p]);
  for (; p < points.size(); ++p)
    add_to_points<kWidth, 1>(c, ranges, &points[p], exponent, &sums[p]);
}

void add_lobe_here(const Charges& c, std::span<const ChargeRange> ranges, std::span<const glm::vec3> points,
                   float exponent, std::span<LobeSum> sums) {
  if (exponent == 1.0f)
    add_to_all<Width::cosine>(c, ranges, points, exponent, sums);
  else if (exponent < kNarrow)
    add_to_all<Width::wide>(c, ranges, points, exponent, sums);
  else
    add_to_all<Width::narrow>(c, ranges, points, exponent, sums);
}

inline Vector power_of(Vector cosine, float exponent) {
  const Vector some = hn::Max(cosine, all(1e-6f));
  const Vector log2 = hn::Min(log2_one_minus(hn::Sub(all(1.0f), some)), hn::Zero(Floats()));
  return hn::IfThenElseZero(hn::Gt(cosine, hn::Zero(Floats())), exp2_of_negative(hn::Mul(log2, all(exponent))));
}

void powers_here(std::span<const float> cosine, float exponent, std::span<float> powers) {
  const Floats f;
  std::size_t i = 0;
  for (; i + hn::Lanes(f) <= powers.size(); i += hn::Lanes(f))
    hn::StoreU(power_of(load(&cosine[i]), exponent), f, &powers[i]);
  for (; i < powers.size(); ++i)
    powers[i] = hn::GetLane(power_of(all(cosine[i]), exponent));
}

} // namespace daylit::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace daylit::detail {

HWY_EXPORT(add_lobe_here);
HWY_EXPORT(powers_here);

void Charges::resize(std::size_t count) {
  for (std::vector<float>* v : {&x, &y, &z, &red, &green, &blue, &weight})
    v->resize(count);
}

void Charges::set(std::size_t i, const glm::dvec3& direction, const glm::dvec3& colour, double of_weight) {
  x[i] = static_cast<float>(direction.x);
  y[i] = static_cast<float>(direction.y);
  z[i] = static_cast<float>(direction.z);
  red[i] = static_cast<float>(colour.r);
  green[i] = static_cast<float>(colour.g);
  blue[i] = static_cast<float>(colour.b);
  weight[i] = static_cast<float>(of_weight);
}

void add_lobe(const Charges& charges, std::span<const ChargeRange> ranges, std::span<const glm::vec3> points,
              float exponent, std::span<LobeSum> sums) {
  HWY_DYNAMIC_DISPATCH(add_lobe_here)(charges, ranges, points, exponent, sums);
}

void lobe_powers(std::span<const float> cosine, float exponent, std::span<float> powers) {
  HWY_DYNAMIC_DISPATCH(powers_here)(cosine, exponent, powers);
}

} // namespace daylit::detail
#endif // HWY_ONCE
