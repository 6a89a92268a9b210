#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "bench/sh_sections.h"
#include "bench/timing.h"
#include "sh/basis.h"
#include "sh/rotation.h"

namespace daylit::bench {
namespace {

using std::numbers::sqrt2;

/// Orthonormal P_lm, degrees m .. degree, in long double.
std::vector<long double> reference(int m, int degree, long double cosine, long double sine) {
  long double start = 0.5L / std::sqrt(std::numbers::pi_v<long double>);
  for (int k = 1; k <= m; ++k)
    start *= sine * std::sqrt((2.0L * k + 1.0L) / (2.0L * k));
  std::vector<long double> p{start};
  const auto a = [m](long double l) { return std::sqrt((4 * l * l - 1) / ((l - m) * (l + m))); };
  for (int l = m + 1; l <= degree; ++l) {
    const std::size_t i = p.size();
    p.push_back(i == 1 ? a(l) * cosine * p[0] : a(l) * (cosine * p[i - 1] - p[i - 2] / a(l - 1)));
  }
  return p;
}

/// The textbook: sqrt((2l+1)/4pi (l-m)!/(l+m)!) times the unnormalised recurrence, NaN taken as 0.
template <class T>
T by_factorials(int l, int m, T cosine, T sine) {
  T pmm = T(1), low = T(1), high = T(1);
  for (int k = 1; k <= m; ++k)
    pmm *= T(2 * k - 1) * sine;
  T p = pmm, before = T(0);
  for (int k = m + 1; k <= l; ++k) {
    const T next = (T(2 * k - 1) * cosine * p - T(k + m - 1) * before) / T(k - m);
    before = p;
    p = next;
  }
  for (int k = 2; k <= l - m; ++k)
    low *= T(k);
  for (int k = 2; k <= l + m; ++k)
    high *= T(k);
  const T value = std::sqrt(T(2 * l + 1) / (T(4) * std::numbers::pi_v<T>)*(low / high)) * p;
  return std::isnan(value) ? T(0) : value;
}

struct BandError {
  double recurrence = 0, recurrence_float = 0, factorials = 0, factorials_float = 0;
};

/// Largest error over the orders of degree l, relative to sqrt((2l + 1) / 4 pi), at one direction.
BandError band_error(int l, double cosine, double sine) {
  const std::size_t count = std::size_t(l + 1) * std::size_t(l + 1);
  std::vector<double> y(count);
  std::vector<float> yf(count);
  const double row = std::sqrt((2.0 * l + 1.0) / (4.0 * std::numbers::pi));
  BandError e;
  if (!sh::evaluate(l, glm::dvec3(sine, 0.0, cosine), y) ||
      !sh::evaluate(l, glm::vec3(float(sine), 0, float(cosine)), yf))
    return e;
  for (int m = 0; m <= l; ++m) {
    const double root = m ? sqrt2 : 1.0;
    const long double length = std::hypot(static_cast<long double>(cosine), static_cast<long double>(sine));
    const double exact = root * double(reference(m, l, cosine / length, sine / length).back());
    const auto worse = [&](double& worst, double value) {
      const double off = std::abs(value - exact) / row;
      worst = std::max(worst, std::isfinite(off) ? off : 1e30);
    };
    const std::size_t i = std::size_t(l) * std::size_t(l) + std::size_t(l + m);
    worse(e.recurrence, y[i]);
    const float cf = float(cosine), sf = float(sine); // the float path answers for the direction it was given
    const long double norm = std::hypot(static_cast<long double>(cf), static_cast<long double>(sf));
    const double exact_float = root * double(reference(m, l, cf / norm, sf / norm).back());
    e.recurrence_float = std::max(e.recurrence_float, std::abs(double(yf[i]) - exact_float) / row);
    worse(e.factorials, root * by_factorials<double>(l, m, cosine, sine));
    worse(e.factorials_float, root * double(by_factorials<float>(l, m, cf, sf)));
  }
  return e;
}

/// The fastest way to write: whole cache lines that are never read.
void fill_past_caches(float* to, std::size_t count) {
#if defined(__SSE2__)
  const __m128 one = _mm_set1_ps(1.0f);
  for (std::size_t i = 0; i < count; i += 4)
    _mm_stream_ps(to + i, one);
  _mm_sfence();
#else
  std::fill_n(to, count, 1.0f);
#endif
}

} // namespace

nlohmann::json measure_basis() {
  nlohmann::json rows = nlohmann::json::array();
  for (const int l : {2, 4, 8, 17, 25, 34, 50, 85, 86, 120, 172, 255, 511, 1023}) {
    BandError worst;
    for (const double theta : {0.01, 0.3, 0.9, 1.3, 1.57}) {
      const BandError e = band_error(l, std::cos(theta), std::sin(theta));
      worst.recurrence = std::max(worst.recurrence, e.recurrence);
      worst.recurrence_float = std::max(worst.recurrence_float, e.recurrence_float);
      worst.factorials = std::max(worst.factorials, e.factorials);
      worst.factorials_float = std::max(worst.factorials_float, e.factorials_float);
    }
    const std::size_t count = std::size_t(l + 1) * std::size_t(l + 1), directions = 64;
    std::vector<double> x(directions, 0.48), y(directions, 0.6), z(directions, 0.64), out(count * directions);
    const auto seconds =
        alternate(l > 500 ? 2 : 5, [&] { (void)sh::evaluate_batch(l, std::span<const double>(x), y, z, out); });
    rows.push_back({{"degree", l},
                    {"error_double", worst.recurrence},
                    {"error_float", worst.recurrence_float},
                    {"error_factorials_double", worst.factorials},
                    {"error_factorials_float", worst.factorials_float},
                    {"ns_per_harmonic", 1e9 * seconds[0] / double(count * directions)}});
  }
  return rows;
}

nlohmann::json measure_nine() {
  constexpr std::size_t kCount = 1 << 20;
  std::mt19937_64 engine(1);
  std::normal_distribution<float> normal;
  std::vector<float> x, y, z, out(9 * kCount + 64);
  for (std::size_t i = 0; i < kCount; ++i) {
    const float a = normal(engine), b = normal(engine), c = normal(engine), n = 1.0f / std::sqrt(a * a + b * b + c * c);
    x.push_back(a * n), y.push_back(b * n), z.push_back(c * n);
  }
  float* aligned = out.data();
  while (reinterpret_cast<std::size_t>(aligned) % 64)
    ++aligned;
  const auto t = alternate(
      25,
      [&] {
        (void)sh::evaluate9_batch(std::span<const float>(x), y, z, {aligned, 9 * kCount}, kCount);
      },
      [&] { fill_past_caches(aligned, 9 * kCount); }, [&] { std::fill_n(aligned, 9 * kCount, 1.0f); });
  const double bytes = 9.0 * kCount * sizeof(float);
  return {{"directions", kCount},
          {"ms", 1e3 * t[0]},
          {"written_gb_s", bytes / t[0] * 1e-9},
          {"store_bandwidth_gb_s", bytes / std::min(t[1], t[2]) * 1e-9},
          {"fraction_of_store_bandwidth", std::min(t[1], t[2]) / t[0]}};
}

nlohmann::json measure_rotation() {
  nlohmann::json rows = nlohmann::json::array();
  const double c = std::cos(1.1), s = std::sin(1.1), c2 = std::cos(0.7), s2 = std::sin(0.7);
  const glm::dmat3 about_y(c, 0, -s, 0, 1, 0, s, 0, c), about_x(1, 0, 0, 0, c2, s2, 0, -s2, c2);
  const glm::dmat3 r = about_x * about_y;
  for (const int degree : {2, 10, 35, 100, 255, 511, 1000}) {
    const std::size_t count = std::size_t(degree + 1) * std::size_t(degree + 1);
    std::mt19937_64 engine(2);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    std::vector<double> f(count), g, basis(count);
    double norm = 0.0;
    for (double& v : f) {
      v = uniform(engine);
      norm += v * v;
    }
    const auto seconds = alternate(2, [&] {
      g = f;
      (void)sh::rotate(r, degree, 1, g);
    });
    double worst = 0.0;
    for (int k = 0; k < 5; ++k) {
      const glm::dvec3 n = glm::normalize(glm::dvec3(uniform(engine), uniform(engine), uniform(engine)));
      double there = 0.0, here = 0.0;
      (void)sh::evaluate(degree, n, basis);
      for (std::size_t i = 0; i < count; ++i)
        there += g[i] * basis[i];
      (void)sh::evaluate(degree, glm::normalize(glm::transpose(r) * n), basis);
      for (std::size_t i = 0; i < count; ++i)
        here += f[i] * basis[i];
      worst = std::max(worst, std::abs(there - here));
    }
    rows.push_back({{"degree", degree},
                    {"ms", 1e3 * seconds[0]},
                    {"max_error_over_rms", worst / std::sqrt(norm / (4.0 * std::numbers::pi))}});
  }
  return rows;
}

} // namespace daylit::bench
