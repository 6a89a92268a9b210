#include "bench/lobe_reference.h"

#include <cmath>
#include <numbers>
#include <random>

#include "bench/clones.h"
#include "sh/zonal.h"

namespace daylit::bench {
namespace {

constexpr std::size_t kPack = 16, kLobes = kExponents.size();

/// sums[exponent][weight, r, g, b][lane] += contribution of kPack pixels. power[k]: cos^kExponents[k].
DAYLIT_CLONES void add_pack(const double* x, const double* y, const double* z, const double* w, const double* rgb,
                            double nx, double ny, double nz, double* sums) {
  double t[kPack], p[kLobes][kPack];
  for (std::size_t i = 0; i < kPack; ++i) {
    const double d = x[i] * nx + y[i] * ny + z[i] * nz;
    t[i] = d > 0.0 ? d : 0.0;
  }
  for (std::size_t i = 0; i < kPack; ++i) {
    const double t1 = t[i], t2 = t1 * t1, t4 = t2 * t2, t8 = t4 * t4;
    p[0][i] = t1;
    p[1][i] = t2;
    p[2][i] = t8 * t2;
    p[3][i] = p[2][i] * p[2][i];
    p[4][i] = p[3][i] * p[3][i];
    p[5][i] = p[4][i] * p[4][i];
    p[6][i] = p[5][i] * p[5][i];
    p[7][i] = p[6][i] * p[5][i];
    p[8][i] = p[6][i] * p[6][i];
    for (std::size_t k = 9; k < kLobes; ++k)
      p[k][i] = p[k - 1][i] * p[k - 1][i];
  }
  for (std::size_t k = 0; k < kLobes; ++k)
    for (std::size_t i = 0; i < kPack; ++i) {
      const double f = p[k][i] * w[i];
      double* s = sums + k * 4 * kPack + i;
      s[0] += f;
      s[kPack] += f * rgb[i];
      s[2 * kPack] += f * rgb[kPack + i];
      s[3 * kPack] += f * rgb[2 * kPack + i];
    }
}

float factorial(int n) {
  float f = 1.0f;
  for (int k = 2; k <= n; ++k)
    f *= float(k);
  return f;
}

/// K_lm in floats; 0 where the factorials left their range.
std::vector<float> float_norms(int order) {
  std::vector<float> norms;
  for (int l = 0; l < order; ++l)
    for (int m = 0; m <= l; ++m) {
      const float k = std::sqrt((2.0f * float(l) + 1.0f) /
                                (4.0f * std::numbers::pi_v<float>)*(factorial(l - m) / factorial(l + m)));
      norms.push_back(std::isnan(k) ? 0.0f : k * (m ? std::numbers::sqrt2_v<float> : 1.0f));
    }
  return norms;
}

/// All Y_lm of one pixel in floats, NaN taken as 0.
void float_harmonics(int order, const std::vector<float>& norms, float cosine, float sine, float phi, float* out) {
  float pmm = 1.0f;
  for (int m = 0; m < order; ++m) {
    if (m > 0)
      pmm *= float(2 * m - 1) * sine;
    const float c = std::cos(float(m) * phi), s = std::sin(float(m) * phi);
    float p = pmm, before = 0.0f;
    for (int l = m; l < order; ++l) {
      const float v = norms[std::size_t(l * (l + 1) / 2 + m)] * p;
      const auto keep = [](float f) { return std::isnan(f) ? 0.0f : f; };
      out[l * l + l + m] = keep(v * c);
      if (m > 0)
        out[l * l + l - m] = keep(v * s);
      const float next = (float(2 * l + 1) * cosine * p - float(l + m) * before) / float(l + 1 - m);
      before = p;
      p = next;
    }
  }
}

void harmonics_at(const AngularMap& map, std::size_t i, int order, const std::vector<float>& norms, float* out) {
  const float sine = float(std::hypot(map.x[i], map.y[i]));
  float_harmonics(order, norms, float(map.z[i]), sine, float(std::atan2(map.y[i], map.x[i])), out);
}

} // namespace

std::vector<double> direct_lobes(const AngularMap& map, std::span<const std::size_t> outputs) {
  const std::size_t count = map.x.size(), packs = (count + kPack - 1) / kPack;
  std::vector<double> x(packs * kPack), y(x), z(x), w(x), rgb(3 * x.size());
  for (std::size_t i = 0; i < count; ++i) {
    x[i] = map.x[i];
    y[i] = map.y[i];
    z[i] = map.z[i];
    w[i] = map.solid_angle[i]; // 0 in the padding
    for (std::size_t c = 0; c < 3; ++c)
      rgb[(i / kPack * 3 + c) * kPack + i % kPack] = map.values[3 * i + c];
  }
  std::vector<double> out, sums(kLobes * 4 * kPack);
  for (const std::size_t o : outputs) {
    std::fill(sums.begin(), sums.end(), 0.0);
    for (std::size_t k = 0; k < packs; ++k)
      add_pack(&x[k * kPack], &y[k * kPack], &z[k * kPack], &w[k * kPack], &rgb[3 * k * kPack], map.x[o], map.y[o],
               map.z[o], sums.data());
    for (std::size_t k = 0; k < kLobes; ++k) {
      double total[4] = {};
      for (std::size_t c = 0; c < 4; ++c)
        for (std::size_t i = 0; i < kPack; ++i)
          total[c] += sums[(k * 4 + c) * kPack + i];
      for (std::size_t c = 1; c < 4; ++c)
        out.push_back(total[c] / total[0]);
    }
  }
  return out;
}

std::vector<double> factorial_lobes(const AngularMap& map, std::span<const std::size_t> outputs, int order) {
  const std::vector<float> norms = float_norms(order);
  const std::size_t functions = std::size_t(order) * std::size_t(order);
  std::vector<float> y(functions);
  std::vector<double> coefficients(3 * functions), out;
  for (std::size_t i = 0; i < map.x.size(); ++i) {
    harmonics_at(map, i, order, norms, y.data());
    for (std::size_t c = 0; c < 3; ++c) {
      const double light = map.values[3 * i + c] * map.solid_angle[i];
      for (std::size_t k = 0; k < functions; ++k)
        coefficients[c * functions + k] += double(y[k]) * light;
    }
  }
  std::vector<std::vector<double>> bands;
  for (const double s : kExponents)
    bands.push_back(*sh::phong_mean_bands(s, order - 1));
  for (const std::size_t o : outputs) {
    harmonics_at(map, o, order, norms, y.data());
    std::vector<double> by_band(3 * std::size_t(order));
    for (std::size_t l = 0; l < std::size_t(order); ++l)
      for (std::size_t k = l * l; k < (l + 1) * (l + 1); ++k)
        for (std::size_t c = 0; c < 3; ++c)
          by_band[3 * l + c] += coefficients[c * functions + k] * double(y[k]);
    for (const auto& a : bands)
      for (std::size_t c = 0; c < 3; ++c) {
        double sum = 0.0;
        for (std::size_t l = 0; l < std::size_t(order); ++l)
          sum += a[l] * by_band[3 * l + c];
        out.push_back(sum);
      }
  }
  return out;
}

std::vector<std::size_t> one_per_cell(const AngularMap& map, int side, int cell, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  const int cells = (side + cell - 1) / cell;
  std::vector<std::size_t> chosen(std::size_t(cells) * std::size_t(cells), map.x.size());
  std::vector<int> seen(chosen.size(), 0);
  for (std::size_t i = 0; i < map.x.size(); ++i) {
    const std::size_t k = std::size_t(map.row[i] / cell * cells + map.column[i] / cell);
    if (std::uniform_int_distribution<int>(0, seen[k]++)(engine) == 0) // reservoir of one
      chosen[k] = i;
  }
  std::erase(chosen, map.x.size());
  return chosen;
}

} // namespace daylit::bench
