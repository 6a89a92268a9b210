#include "sh/direction_transform.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sh/basis.h"
#include "sh/detail/check.h"
#include "sh/detail/legendre_engine.h"

namespace daylit::sh {
namespace {

using detail::AlignedBuffer;
using detail::RingPair;

constexpr std::size_t kBlockBytes = 64u << 20;

constexpr std::size_t kImages = 4; ///< of a direction: with x, y or both turned round
constexpr std::ptrdiff_t kNone = -1;

/// Azimuths of one |z| and one hemisphere: positions [begin, end).
struct Members {
  std::size_t begin = 0, end = 0;
};

/// A direction of the quadrant x, y >= 0 and which of the directions it and its mirror images are.
struct Azimuth {
  double cosine, sine;
  std::ptrdiff_t direction[kImages] = {kNone, kNone, kNone, kNone};
};

struct Directions {
  std::span<const double> x, y, z;

  /// Same |z| side by side, falling; within it the hemispheres, within these the mirror images.
  bool before(std::size_t a, std::size_t b) const {
    const double za = std::abs(z[a]), zb = std::abs(z[b]);
    if (za != zb)
      return za > zb;
    if (std::signbit(z[a]) != std::signbit(z[b]))
      return !std::signbit(z[a]);
    return mirrors(a, b)                      ? a < b
           : std::abs(x[a]) != std::abs(x[b]) ? std::abs(x[a]) < std::abs(x[b])
                                              : std::abs(y[a]) < std::abs(y[b]);
  }
  bool mirrors(std::size_t a, std::size_t b) const {
    return std::abs(x[a]) == std::abs(x[b]) && std::abs(y[a]) == std::abs(y[b]);
  }
  std::size_t image(std::size_t k) const { return (std::signbit(x[k]) ? 1u : 0u) + (std::signbit(y[k]) ? 2u : 0u); }
};

struct Grouping {
  std::vector<Azimuth> azimuths;
  std::vector<RingPair> pairs;
  std::vector<Members> members; ///< north and south of each pair
  std::size_t directions = 0;
};

Azimuth azimuth_of(const Directions& d, std::size_t k) {
  const double sine = std::hypot(d.x[k], d.y[k]);
  return {sine > 0.0 ? std::abs(d.x[k]) / sine : 1.0, sine > 0.0 ? std::abs(d.y[k]) / sine : 0.0};
}

Grouping group_by_latitude(const Directions& d) {
  Grouping g;
  g.directions = d.z.size();
  std::vector<std::size_t> order(d.z.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  const auto before = [&](std::size_t a, std::size_t b) { return d.before(a, b); };
  if (!std::is_sorted(order.begin(), order.end(), before))
    std::sort(order.begin(), order.end(), before);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t k = order[i], last = order[i == 0 ? 0 : i - 1];
    const bool new_ring = i == 0 || std::abs(d.z[last]) != std::abs(d.z[k]);
    if (new_ring) {
      const double length = std::sqrt(d.x[k] * d.x[k] + d.y[k] * d.y[k] + d.z[k] * d.z[k]);
      const double cosine = std::abs(d.z[k]) / length, sine = std::hypot(d.x[k], d.y[k]) / length;
      g.pairs.push_back({std::min(1.0, cosine), sine, 0, 0, 1.0, 1.0});
      g.members.insert(g.members.end(), 2, {g.azimuths.size(), g.azimuths.size()});
    }
    Members& side = g.members[2 * g.pairs.size() - (std::signbit(d.z[k]) ? 1 : 2)];
    if (side.begin == side.end)
      side.begin = side.end = g.azimuths.size();
    const bool image = side.end > side.begin && d.mirrors(last, k) && g.azimuths.back().direction[d.image(k)] == kNone;
    if (!image) {
      g.azimuths.push_back(azimuth_of(d, k));
      side.end = g.azimuths.size();
    }
    g.azimuths.back().direction[d.image(k)] = std::ptrdiff_t(k);
  }
  return g;
}

} // namespace

struct DirectionTransform::State {
  std::shared_ptr<const Grouping> groups;
  detail::LegendreEngine engine;
  AlignedBuffer lanes_buffer; ///< cosine and sine, then the values of three channels

  State(std::shared_ptr<const Grouping> g, int degree)
      : groups(std::move(g)), engine(groups->pairs, degree, kBlockBytes, detail::kernels()) {
    lanes_buffer.reserve((2 + 3 * kImages) * std::size_t(engine.lanes()));
  }

  const Members* members(int vector, int lane, int south) const {
    const std::size_t pair = std::size_t(vector) * std::size_t(engine.lanes()) + std::size_t(lane);
    return pair < groups->pairs.size() ? &groups->members[2 * pair + std::size_t(south)] : nullptr;
  }

  /// body(vector in block, hemisphere, azimuth or null per lane) for rounds of one azimuth per ring.
  template <class Body>
  void for_each_round(int block, Body&& body) {
    const int lanes = engine.lanes();
    const Azimuth* azimuth[detail::kMaxLanes];
    for (int v = 0; v < engine.block_vectors(block); ++v)
      for (int south = 0; south < 2; ++south)
        for (std::size_t round = 0;; ++round) {
          bool some = false;
          for (int lane = 0; lane < lanes; ++lane) {
            const Members* m = members(engine.first_vector(block) + v, lane, south);
            const bool here = m && m->begin + round < m->end;
            azimuth[lane] = here ? &groups->azimuths[m->begin + round] : nullptr;
            some |= here;
          }
          if (!some)
            break;
          fill_azimuths(azimuth);
          body(v, south, azimuth);
        }
  }

  void fill_azimuths(const Azimuth* const* azimuth) {
    const std::size_t lanes = std::size_t(engine.lanes());
    for (std::size_t k = 0; k < lanes; ++k) {
      lanes_buffer[k] = azimuth[k] ? azimuth[k]->cosine : 1.0;
      lanes_buffer[lanes + k] = azimuth[k] ? azimuth[k]->sine : 0.0;
    }
  }

  /// body(direction, place of its first channel) for the directions of a round; channels lie kImages x lanes apart.
  template <class Body>
  void for_each_direction(const Azimuth* const* azimuth, Body&& body) {
    const std::size_t lanes = std::size_t(engine.lanes());
    for (std::size_t k = 0; k < lanes; ++k)
      for (std::size_t image = 0; azimuth[k] && image < kImages; ++image)
        if (azimuth[k]->direction[image] != kNone)
          body(std::size_t(azimuth[k]->direction[image]), lanes_buffer.data() + (2 + image) * lanes + k);
  }

  void synthesise(std::span<const double> coefficients, int channels, double scale, std::span<double> values);
  void analyse(std::span<const double> values, std::span<const double> weights, int channels, double scale,
               std::span<double> coefficients);
};

void DirectionTransform::State::synthesise(std::span<const double> coefficients, int channels, double scale,
                                           std::span<double> values) {
  const std::size_t lanes = std::size_t(engine.lanes());
  double* azimuth = lanes_buffer.data();
  for (int c = 0, group = 0; c < channels; c += group) {
    group = channels - c >= 3 ? 3 : 1;
    engine.set_coefficients(coefficients.data() + c, channels, group, scale);
    for (int block = 0; block < engine.blocks(); ++block) {
      const auto a = engine.amplitudes(block, group);
      engine.synthesise(block, a);
      for_each_round(block, [&](int v, int south, const Azimuth* const* of_lane) {
        engine.kernels().sum_orders(engine.row(a, v, south, 0), std::size_t(a.order_stride) * 2 * lanes, group,
                                    engine.last_order(engine.first_vector(block) + v) + 1, azimuth, azimuth + lanes,
                                    azimuth + 2 * lanes);
        for_each_direction(of_lane, [&](std::size_t direction, const double* value) {
          for (int g = 0; g < group; ++g)
            values[direction * std::size_t(channels) + std::size_t(c + g)] =
                value[std::size_t(g) * kImages * lanes] / scale;
        });
      });
    }
  }
}

void DirectionTransform::State::analyse(std::span<const double> values, std::span<const double> weights, int channels,
                                        double scale, std::span<double> coefficients) {
  const std::size_t lanes = std::size_t(engine.lanes());
  double* azimuth = lanes_buffer.data();
  for (int c = 0, group = 0; c < channels; c += group) {
    group = channels - c >= 3 ? 3 : 1;
    for (int block = 0; block < engine.blocks(); ++block) {
      const auto a = engine.amplitudes(block, group);
      std::fill_n(a.data,
                  std::size_t(engine.block_vectors(block)) * 2 * std::size_t(group) * std::size_t(a.order_stride) * 2 *
                      lanes,
                  0.0);
      for_each_round(block, [&](int v, int south, const Azimuth* const* of_lane) {
        std::fill_n(azimuth + 2 * lanes, 3 * kImages * lanes, 0.0);
        for_each_direction(of_lane, [&](std::size_t direction, double* value) {
          for (int g = 0; g < group; ++g)
            value[std::size_t(g) * kImages * lanes] =
                values[direction * std::size_t(channels) + std::size_t(c + g)] * scale * weights[direction];
        });
        engine.kernels().add_orders(engine.row(a, v, south, 0), std::size_t(a.order_stride) * 2 * lanes, group,
                                    engine.last_order(engine.first_vector(block) + v) + 1, azimuth, azimuth + lanes,
                                    azimuth + 2 * lanes);
      });
      engine.analyse(block, a);
    }
    engine.get_coefficients(coefficients.data() + c, channels, group, 1.0 / scale);
  }
}

Expected<DirectionTransform> DirectionTransform::create(std::span<const double> x, std::span<const double> y,
                                                        std::span<const double> z, int degree) {
  constexpr const char* where = "DirectionTransform::create";
  if (const auto ok = detail::check_degree(degree, where); !ok)
    return ok.error();
  if (x.empty() || y.size() != x.size() || z.size() != x.size())
    return Error{ErrorCode::wrong_count, "x, y and z are empty or differ in length", where};
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!(std::abs(std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]) - 1.0) <= kUnitTolerance))
      return Error{ErrorCode::not_a_unit_direction, "direction " + std::to_string(i) + " is not of unit length", where};
  return DirectionTransform(
      std::make_unique<State>(std::make_shared<const Grouping>(group_by_latitude({x, y, z})), degree));
}

DirectionTransform::DirectionTransform(std::unique_ptr<State> state) : state_(std::move(state)) {}
DirectionTransform::DirectionTransform(DirectionTransform&&) noexcept = default;
DirectionTransform& DirectionTransform::operator=(DirectionTransform&&) noexcept = default;
DirectionTransform::~DirectionTransform() = default;

Expected<DirectionTransform> DirectionTransform::at_degree(int degree) const {
  if (const auto ok = detail::check_degree(degree, "DirectionTransform::at_degree"); !ok)
    return ok.error();
  return DirectionTransform(std::make_unique<State>(state_->groups, degree));
}

int DirectionTransform::degree() const { return state_->engine.degree(); }
std::size_t DirectionTransform::directions() const { return state_->groups->directions; }

Expected<void> DirectionTransform::synthesise(std::span<const double> coefficients, int channels,
                                              std::span<double> values) {
  constexpr const char* where = "DirectionTransform::synthesise";
  if (const auto ok = detail::check_coefficients(coefficients.size(), degree(), channels, where); !ok)
    return ok;
  if (const auto ok = detail::check_count(values.size(), directions() * std::size_t(channels), "values", where); !ok)
    return ok;
  const double most = detail::kernels().max_abs_f64(coefficients.data(), coefficients.size());
  if (!std::isfinite(most))
    return Error{ErrorCode::not_finite, "coefficients hold a NaN or an infinity", where};
  state_->synthesise(coefficients, channels, detail::safe_scale(most), values);
  return {};
}

Expected<void> DirectionTransform::analyse(std::span<const double> values, std::span<const double> weight_sr,
                                           int channels, std::span<double> coefficients) {
  constexpr const char* where = "DirectionTransform::analyse";
  if (const auto ok = detail::check_coefficients(coefficients.size(), degree(), channels, where); !ok)
    return ok;
  if (const auto ok = detail::check_count(values.size(), directions() * std::size_t(channels), "values", where); !ok)
    return ok;
  if (const auto ok = detail::check_count(weight_sr.size(), directions(), "weights", where); !ok)
    return ok;
  const double most = detail::kernels().max_abs_f64(values.data(), values.size());
  if (!std::isfinite(most) || !std::isfinite(detail::kernels().max_abs_f64(weight_sr.data(), weight_sr.size())))
    return Error{ErrorCode::not_finite, "values or weights hold a NaN or an infinity", where};
  state_->analyse(values, weight_sr, channels, detail::safe_scale(most), coefficients);
  return {};
}

} // namespace daylit::sh
