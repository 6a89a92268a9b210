#include "sh/transform.h"

#include <cmath>
#include <numbers>

#include "sh/detail/check.h"
#include "sh/detail/fft_plan.h"
#include "sh/detail/legendre_engine.h"

namespace daylit::sh {
namespace {

using detail::AlignedBuffer;
using detail::Kernels;
using detail::RingPair;

/// Amplitudes held at a time: all of them up to degree 1023 or so.
constexpr std::size_t kBlockBytes = 128u << 20;

std::vector<RingPair> pair_rings(const RingGrid& grid) {
  std::vector<RingPair> pairs;
  for (int i = 0, j = grid.rings() - 1; i <= j; ++i, --j) {
    const bool equator = i == j;
    pairs.push_back({grid.cos_theta[std::size_t(i)], grid.sin_theta[std::size_t(i)], i, equator ? -1 : j,
                     grid.weight_sr[std::size_t(i)], equator ? 0.0 : grid.weight_sr[std::size_t(j)]});
  }
  return pairs;
}

double max_abs(const Kernels& k, const double* p, std::size_t n) { return k.max_abs_f64(p, n); }
double max_abs(const Kernels& k, const float* p, std::size_t n) { return k.max_abs_f32(p, n); }
void load_rows(const Kernels& k, const detail::RowSet<const double>& r, int n, double s, double* out) {
  k.load_rows_f64(r, n, s, out);
}
void load_rows(const Kernels& k, const detail::RowSet<const float>& r, int n, double s, double* out) {
  k.load_rows_f32(r, n, s, out);
}
void store_rows(const Kernels& k, const detail::RowSet<double>& r, int n, double s, const double* in) {
  k.store_rows_f64(r, n, s, in);
}
void store_rows(const Kernels& k, const detail::RowSet<float>& r, int n, double s, const double* in) {
  k.store_rows_f32(r, n, s, in);
}

Error not_finite(const char* what, const char* where) {
  return {ErrorCode::not_finite, std::string(what) + " holds a NaN or an infinity", where};
}

} // namespace

struct RingTransform::State {
  RingGrid grid;
  detail::LegendreEngine engine;
  detail::FftPlan fft;
  std::vector<double> phase; ///< exp(i m first_azimuth), empty when all are 1
  AlignedBuffer bins, work_a, work_b, weights;

  State(const RingGrid& g, int degree)
      : grid(g), engine(pair_rings(g), degree, kBlockBytes, detail::kernels()), fft(g.longitudes) {
    const std::size_t vector = 2 * std::size_t(engine.lanes());
    bins.reserve(std::size_t(std::max(fft.bins(), degree + 1)) * vector);
    work_a.reserve(std::size_t(fft.complex_length()) * vector);
    work_b.reserve(std::size_t(fft.complex_length()) * vector);
    weights.reserve(vector);
    if (grid.first_azimuth != 0.0 || grid.turn < 0)
      for (int m = 0; m <= degree; ++m) {
        const long double angle =
            std::fmod(static_cast<long double>(grid.first_azimuth) * m, 2.0L * std::numbers::pi_v<long double>);
        phase.push_back(double(std::cos(angle)));
        phase.push_back(double(std::sin(angle)));
      }
  }

  bool folds() const { return engine.degree() >= fft.bins(); }
  void orders_to_bins(const double* row, int last);
  void bins_to_orders(double* row, int last);
  double* bins_to_samples();
  void samples_to_bins(double* samples, int count, double* out);
  template <class T>
  void store_block(int block, const detail::Amplitudes&, const ImageView<T>&, int channel, double scale);
  template <class T>
  void load_block(int block, const detail::Amplitudes&, const ImageView<const T>&, int channel, double scale,
                  bool weighted);
  template <class T>
  Expected<double> image_scale(const ImageView<const T>&, const char* where);
  template <class T>
  Expected<void> synthesise(std::span<const double>, const ImageView<T>&);
  template <class T>
  Expected<void> analyse(const ImageView<const T>&, std::span<double>, bool weighted, const char* where);
};

/// Amplitudes Z_m of one row of rings -> bins G_k with f_j = Re sum_k G_k exp(2 pi i k j / W). Orders above W/2 fold
/// back: samples cannot distinguish them.
void RingTransform::State::orders_to_bins(const double* row, int last) {
  const std::size_t lanes = std::size_t(engine.lanes()), vector = 2 * lanes;
  const int direct = std::min(last, fft.bins() - 1);
  if (phase.empty())
    std::copy_n(row, std::size_t(direct + 1) * vector, bins.data());
  else
    engine.kernels().turn_bins(row, direct + 1, phase.data(), false, grid.turn < 0, bins.data());
  std::fill(bins.data() + std::size_t(direct + 1) * vector, bins.data() + std::size_t(fft.bins()) * vector, 0.0);
  const int width = grid.longitudes;
  for (int m = direct + 1; m <= last; ++m) {
    const int k = m % width, bin = k < fft.bins() ? k : width - k;
    const bool conjugate = (k >= fft.bins()) != (grid.turn < 0);
    const double c = phase.empty() ? 1.0 : phase[2 * std::size_t(m)],
                 s = phase.empty() ? 0.0 : phase[2 * std::size_t(m) + 1];
    const double* z = row + std::size_t(m) * vector;
    double* g = bins.data() + std::size_t(bin) * vector;
    for (std::size_t i = 0; i < lanes; ++i) {
      g[i] += z[i] * c - z[lanes + i] * s;
      g[lanes + i] += (conjugate ? -1.0 : 1.0) * (z[lanes + i] * c + z[i] * s);
    }
  }
}

/// Bins H_k = sum_j f_j exp(-2 pi i k j / W) -> amplitudes sum_j f_j exp(-i m phi_j): the adjoint of orders_to_bins.
void RingTransform::State::bins_to_orders(double* row, int last) {
  const std::size_t lanes = std::size_t(engine.lanes()), vector = 2 * lanes;
  const int direct = std::min(last, fft.bins() - 1), width = grid.longitudes;
  if (phase.empty())
    std::copy_n(bins.data(), std::size_t(direct + 1) * vector, row);
  else
    engine.kernels().turn_bins(bins.data(), direct + 1, phase.data(), grid.turn > 0, true, row);
  for (int m = direct + 1; m <= last; ++m) {
    const int k = m % width, bin = k < fft.bins() ? k : width - k;
    const double sign = (k >= fft.bins()) != (grid.turn < 0) ? -1.0 : 1.0;
    const double c = phase.empty() ? 1.0 : phase[2 * std::size_t(m)],
                 s = phase.empty() ? 0.0 : phase[2 * std::size_t(m) + 1];
    const double* h = bins.data() + std::size_t(bin) * vector;
    double* z = row + std::size_t(m) * vector;
    for (std::size_t i = 0; i < lanes; ++i) {
      z[i] = h[i] * c + sign * h[lanes + i] * s;
      z[lanes + i] = sign * h[lanes + i] * c - h[i] * s;
    }
  }
}

/// Returns W vectors of samples.
double* RingTransform::State::bins_to_samples() {
  const Kernels& k = engine.kernels();
  double *a = work_a.data(), *b = work_b.data();
  if (fft.halved()) {
    k.merge_real(fft.passes(), bins.data(), a);
    return k.fft_backward(fft.passes(), a, b);
  }
  const std::size_t lanes = std::size_t(engine.lanes()), vector = 2 * lanes, width = std::size_t(grid.longitudes);
  std::fill(a, a + width * vector, 0.0);
  std::copy_n(bins.data(), std::size_t(fft.bins()) * vector, a); // f_j = Re of the transform of G, no symmetry needed
  double* samples = k.fft_backward(fft.passes(), a, b);
  for (std::size_t j = 1; j < width; ++j)
    std::copy_n(samples + j * vector, lanes, samples + j * lanes);
  return samples;
}

/// The first `count` bins of W vectors of samples (held in work_a), times the weights.
void RingTransform::State::samples_to_bins(double* samples, int count, double* out) {
  const Kernels& k = engine.kernels();
  if (fft.halved()) {
    double* half = k.fft_forward(fft.passes(), samples, work_b.data());
    k.split_real(fft.passes(), half, weights.data(), count, out);
    return;
  }
  const std::size_t lanes = std::size_t(engine.lanes()), vector = 2 * lanes;
  for (std::size_t j = std::size_t(grid.longitudes); j-- > 0;) {
    std::copy_n(samples + j * lanes, lanes, samples + j * vector);
    std::fill_n(samples + j * vector + lanes, lanes, 0.0);
  }
  const double* full = k.fft_forward(fft.passes(), samples, work_b.data());
  for (std::size_t i = 0; i < std::size_t(count) * vector; ++i)
    out[i] = full[i] * weights[i % lanes];
}

template <class T>
void RingTransform::State::store_block(int block, const detail::Amplitudes& a, const ImageView<T>& image, int channel,
                                       double scale) {
  for (int v = 0; v < engine.block_vectors(block); ++v)
    for (int south = 0; south < 2; ++south)
      for (int c = 0; c < a.channels; ++c) {
        detail::RowSet<T> rows{{}, image.pixel_stride};
        for (int lane = 0; lane < engine.lanes(); ++lane)
          if (const RingPair* p = engine.pair(engine.first_vector(block) + v, lane)) {
            const int row = south ? p->south : p->north;
            if (row >= 0)
              rows.row[lane] = image.data + row * image.row_stride + (channel + c) * image.channel_stride;
          }
        orders_to_bins(engine.row(a, v, south, c), engine.last_order(engine.first_vector(block) + v));
        store_rows(engine.kernels(), rows, grid.longitudes, scale, bins_to_samples());
      }
}

template <class T>
void RingTransform::State::load_block(int block, const detail::Amplitudes& a, const ImageView<const T>& image,
                                      int channel, double scale, bool weighted) {
  for (int v = 0; v < engine.block_vectors(block); ++v)
    for (int south = 0; south < 2; ++south)
      for (int c = 0; c < a.channels; ++c) {
        const int vector = engine.first_vector(block) + v;
        detail::RowSet<const T> rows{{}, image.pixel_stride};
        for (int lane = 0; lane < engine.lanes(); ++lane) { // missing rings read any row, with weight 0
          const RingPair* p = engine.pair(vector, lane);
          const int row = p ? (south ? p->south : p->north) : -1;
          weights[std::size_t(lane)] = row < 0 ? 0.0 : (weighted ? (south ? p->south_weight : p->north_weight) : 1.0);
          rows.row[lane] = image.data + std::max(row, 0) * image.row_stride + (channel + c) * image.channel_stride;
        }
        load_rows(engine.kernels(), rows, grid.longitudes, scale, work_a.data());
        const int last = engine.last_order(vector);
        double* row = engine.row(a, v, south, c);
        if (phase.empty() && !folds())
          samples_to_bins(work_a.data(), last + 1, row);
        else {
          samples_to_bins(work_a.data(), fft.bins(), bins.data());
          bins_to_orders(row, last);
        }
      }
}

template <class T>
Expected<double> RingTransform::State::image_scale(const ImageView<const T>& image, const char* where) {
  double most = 0.0;
  const bool dense = image.channel_stride == 1 && image.pixel_stride == image.channels;
  const std::size_t row_length = std::size_t(grid.longitudes) * std::size_t(image.channels);
  for (int i = 0; i < grid.rings(); ++i) {
    const T* row = image.data + i * image.row_stride;
    double largest = 0.0;
    if (dense)
      largest = max_abs(engine.kernels(), row, row_length);
    else
      for (int j = 0; j < grid.longitudes; ++j)
        for (int c = 0; c < image.channels; ++c) {
          const double v = double(row[j * image.pixel_stride + c * image.channel_stride]);
          largest = std::isfinite(v) ? std::max(largest, std::abs(v)) : std::nan("");
        }
    if (!std::isfinite(largest))
      return not_finite(("image row " + std::to_string(i)).c_str(), where);
    most = std::max(most, largest);
  }
  return detail::safe_scale(most);
}

template <class T>
Expected<void> RingTransform::State::synthesise(std::span<const double> coefficients, const ImageView<T>& image) {
  constexpr const char* where = "RingTransform::synthesise";
  const int channels = image.channels;
  if (const auto ok = detail::check_coefficients(coefficients.size(), engine.degree(), channels, where); !ok)
    return ok;
  const double most = engine.kernels().max_abs_f64(coefficients.data(), coefficients.size());
  if (!std::isfinite(most))
    return not_finite("coefficients", where);
  const double scale = detail::safe_scale(most);
  for (int c = 0, group = 0; c < channels; c += group) {
    group = channels - c >= 3 ? 3 : 1;
    engine.set_coefficients(coefficients.data() + c, channels, group, scale);
    for (int block = 0; block < engine.blocks(); ++block) {
      const auto a = engine.amplitudes(block, group);
      engine.synthesise(block, a);
      store_block(block, a, image, c, 1.0 / scale);
    }
  }
  return {};
}

template <class T>
Expected<void> RingTransform::State::analyse(const ImageView<const T>& image, std::span<double> coefficients,
                                             bool weighted, const char* where) {
  const int channels = image.channels;
  if (const auto ok = detail::check_coefficients(coefficients.size(), engine.degree(), channels, where); !ok)
    return ok;
  const auto scale = image_scale(image, where);
  if (!scale)
    return scale.error();
  for (int c = 0, group = 0; c < channels; c += group) {
    group = channels - c >= 3 ? 3 : 1;
    for (int block = 0; block < engine.blocks(); ++block) {
      const auto a = engine.amplitudes(block, group);
      load_block(block, a, image, c, *scale, weighted);
      engine.analyse(block, a);
    }
    engine.get_coefficients(coefficients.data() + c, channels, group, 1.0 / *scale);
  }
  return {};
}

Expected<RingTransform> RingTransform::create(const RingGrid& grid, int degree) {
  constexpr const char* where = "RingTransform::create";
  if (const auto ok = detail::check_degree(degree, where); !ok)
    return ok.error();
  const std::size_t rings = grid.cos_theta.size();
  if (rings == 0 || grid.longitudes < 1)
    return Error{ErrorCode::parameter_out_of_range, "grid without samples", where};
  for (const auto* v : {&grid.sin_theta, &grid.weight_sr})
    if (const auto ok = detail::check_count(v->size(), rings, "ring values", where); !ok)
      return ok.error();
  for (std::size_t i = 0; i < rings; ++i)
    if (grid.cos_theta[i] != -grid.cos_theta[rings - 1 - i] || !(std::abs(grid.cos_theta[i]) <= 1.0) ||
        !(std::abs(std::hypot(grid.cos_theta[i], grid.sin_theta[i]) - 1.0) < 1e-12))
      return Error{ErrorCode::parameter_out_of_range,
                   "ring " + std::to_string(i) + " is not on the unit sphere or has no mirror image in the equator",
                   where};
  return RingTransform(std::make_unique<State>(grid, degree));
}

RingTransform::RingTransform(std::unique_ptr<State> state) : state_(std::move(state)) {}
RingTransform::RingTransform(RingTransform&&) noexcept = default;
RingTransform& RingTransform::operator=(RingTransform&&) noexcept = default;
RingTransform::~RingTransform() = default;

int RingTransform::degree() const { return state_->engine.degree(); }
const RingGrid& RingTransform::grid() const { return state_->grid; }

Expected<void> RingTransform::synthesise(std::span<const double> coefficients, const ImageView<double>& image) {
  return state_->synthesise(coefficients, image);
}
Expected<void> RingTransform::synthesise(std::span<const double> coefficients, const ImageView<float>& image) {
  return state_->synthesise(coefficients, image);
}
Expected<void> RingTransform::analyse(const ImageView<const double>& image, std::span<double> coefficients) {
  return state_->analyse(image, coefficients, true, "RingTransform::analyse");
}
Expected<void> RingTransform::analyse(const ImageView<const float>& image, std::span<double> coefficients) {
  return state_->analyse(image, coefficients, true, "RingTransform::analyse");
}
Expected<void> RingTransform::adjoint_synthesise(const ImageView<const double>& image, std::span<double> coefficients) {
  return state_->analyse(image, coefficients, false, "RingTransform::adjoint_synthesise");
}

} // namespace daylit::sh
