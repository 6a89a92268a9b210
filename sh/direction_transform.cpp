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

/// Directions of one |z| and one hemisphere: positions [begin, end) of the sorted order.
struct Members {
  std::size_t begin = 0, end = 0;
};

struct Grouping {
  std::vector<std::size_t> order; ///< direction at each sorted position
  std::vector<RingPair> pairs;
  std::vector<Members> members; ///< north and south of each pair
};

Grouping group_by_latitude(std::span<const double> x, std::span<const double> y, std::span<const double> z) {
  Grouping g;
  g.order.resize(z.size());
  std::iota(g.order.begin(), g.order.end(), std::size_t(0));
  std::sort(g.order.begin(), g.order.end(), [&](std::size_t a, std::size_t b) {
    const double za = std::abs(z[a]), zb = std::abs(z[b]);
    if (za != zb)
      return za > zb;
    return std::signbit(z[a]) != std::signbit(z[b]) ? !std::signbit(z[a]) : a < b;
  });
  for (std::size_t i = 0; i < g.order.size(); ++i) {
    const std::size_t k = g.order[i];
    const double length = std::sqrt(x[k] * x[k] + y[k] * y[k] + z[k] * z[k]);
    const double cosine = std::abs(z[k]), sine = std::hypot(x[k], y[k]) / length;
    if (i == 0 || std::abs(z[g.order[i - 1]]) != cosine) {
      g.pairs.push_back({std::min(1.0, cosine / length), sine, 0, 0, 1.0, 1.0});
      g.members.insert(g.members.end(), 2, {i, i});
    }
    Members& side = g.members[2 * g.pairs.size() - (std::signbit(z[k]) ? 1 : 2)];
    if (side.begin == side.end)
      side.begin = i;
    side.end = i + 1;
  }
  return g;
}

} // namespace

struct DirectionTransform::State {
  Grouping groups;
  detail::LegendreEngine engine;
  std::vector<double> cosine, sine; ///< of the azimuth, by sorted position
  AlignedBuffer lanes_buffer;

  State(Grouping g, std::span<const double> x, std::span<const double> y, int degree)
      : groups(std::move(g)), engine(groups.pairs, degree, kBlockBytes, detail::kernels()) {
    for (const std::size_t k : groups.order) {
      const double s = std::hypot(x[k], y[k]);
      cosine.push_back(s > 0.0 ? x[k] / s : 1.0);
      sine.push_back(s > 0.0 ? y[k] / s : 0.0);
    }
    lanes_buffer.reserve(5 * std::size_t(engine.lanes()));
  }

  const Members* members(int vector, int lane, int south) const {
    const std::size_t pair = std::size_t(vector) * std::size_t(engine.lanes()) + std::size_t(lane);
    return pair < groups.pairs.size() ? &groups.members[2 * pair + std::size_t(south)] : nullptr;
  }

  /// body(vector in block, hemisphere, sorted position or -1 per lane) for rounds of one direction per ring.
  template <class Body>
  void for_each_round(int block, Body&& body) {
    const int lanes = engine.lanes();
    std::ptrdiff_t position[detail::kMaxLanes];
    for (int v = 0; v < engine.block_vectors(block); ++v)
      for (int south = 0; south < 2; ++south)
        for (std::size_t round = 0;; ++round) {
          bool some = false;
          for (int lane = 0; lane < lanes; ++lane) {
            const Members* m = members(engine.first_vector(block) + v, lane, south);
            const bool here = m && m->begin + round < m->end;
            position[lane] = here ? std::ptrdiff_t(m->begin + round) : -1;
            some |= here;
          }
          if (!some)
            break;
          fill_azimuths(position);
          body(v, south, position);
        }
  }

  void fill_azimuths(const std::ptrdiff_t* position) {
    const std::size_t lanes = std::size_t(engine.lanes());
    for (std::size_t k = 0; k < lanes; ++k) {
      lanes_buffer[k] = position[k] < 0 ? 1.0 : cosine[std::size_t(position[k])];
      lanes_buffer[lanes + k] = position[k] < 0 ? 0.0 : sine[std::size_t(position[k])];
    }
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
      for_each_round(block, [&](int v, int south, const std::ptrdiff_t* position) {
        engine.kernels().sum_orders(engine.row(a, v, south, 0), std::size_t(a.order_stride) * 2 * lanes, group,
                                    engine.last_order(engine.first_vector(block) + v) + 1, azimuth, azimuth + lanes,
                                    azimuth + 2 * lanes);
        for (std::size_t k = 0; k < lanes; ++k)
          for (int g = 0; g < group && position[k] >= 0; ++g)
            values[groups.order[std::size_t(position[k])] * std::size_t(channels) + std::size_t(c + g)] =
                azimuth[(2 + std::size_t(g)) * lanes + k] / scale;
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
      for_each_round(block, [&](int v, int south, const std::ptrdiff_t* position) {
        for (std::size_t k = 0; k < lanes; ++k) {
          const std::size_t at = position[k] < 0 ? 0 : groups.order[std::size_t(position[k])];
          for (int g = 0; g < group; ++g)
            azimuth[(2 + std::size_t(g)) * lanes + k] =
                position[k] < 0 ? 0.0 : values[at * std::size_t(channels) + std::size_t(c + g)] * scale * weights[at];
        }
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
  return DirectionTransform(std::make_unique<State>(group_by_latitude(x, y, z), x, y, degree));
}

DirectionTransform::DirectionTransform(std::unique_ptr<State> state) : state_(std::move(state)) {}
DirectionTransform::DirectionTransform(DirectionTransform&&) noexcept = default;
DirectionTransform& DirectionTransform::operator=(DirectionTransform&&) noexcept = default;
DirectionTransform::~DirectionTransform() = default;

int DirectionTransform::degree() const { return state_->engine.degree(); }
std::size_t DirectionTransform::directions() const { return state_->groups.order.size(); }

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
