#include "bench/plain_lobes.h"

#include <algorithm>

#include "bench/clones.h"

namespace daylit::bench {
namespace {

constexpr std::size_t kPack = 32;

/// Pixels side by side; weight 0 in the padding.
struct Pixels {
  std::vector<float> x, y, z, weight, red, green, blue;
};

/// sums[exponent][weight, r, g, b][lane] of one direction over all pixels.
template <std::size_t kLobes>
inline __attribute__((always_inline)) void add_all(const Pixels& p, const float* n, float* sums) {
  constexpr std::size_t kFirst = 8 - kLobes;
  for (std::size_t at = 0; at < p.x.size(); at += kPack) {
    float power[8][kPack];
    for (std::size_t i = 0; i < kPack; ++i) {
      const float d = p.x[at + i] * n[0] + p.y[at + i] * n[1] + p.z[at + i] * n[2], t = d > 0.0f ? d : 0.0f;
      const float t2 = t * t, t4 = t2 * t2, t8 = t4 * t4, t10 = t8 * t2, t20 = t10 * t10;
      power[0][i] = t;
      power[1][i] = t10;
      power[2][i] = t20 * t20;
      for (std::size_t k = 3; k < 8; ++k)
        power[k][i] = power[k - 1][i] * power[k - 1][i];
    }
    for (std::size_t k = kFirst; k < 8; ++k)
      for (std::size_t i = 0; i < kPack; ++i) {
        const float f = power[k][i] * p.weight[at + i];
        float* s = sums + (k - kFirst) * 4 * kPack + i;
        s[0] += f;
        s[kPack] += f * p.red[at + i];
        s[2 * kPack] += f * p.green[at + i];
        s[3 * kPack] += f * p.blue[at + i];
      }
  }
}

DAYLIT_CLONES void add_eight(const Pixels& p, const float* n, float* sums) { add_all<8>(p, n, sums); }
DAYLIT_CLONES void add_six(const Pixels& p, const float* n, float* sums) { add_all<6>(p, n, sums); }

Pixels pixels_of(const AngularMap& map) {
  Pixels p;
  const std::size_t count = (map.x.size() + kPack - 1) / kPack * kPack;
  for (std::vector<float>* v : {&p.x, &p.y, &p.z, &p.weight, &p.red, &p.green, &p.blue})
    v->resize(count);
  for (std::size_t i = 0; i < map.x.size(); ++i) {
    p.x[i] = float(map.x[i]);
    p.y[i] = float(map.y[i]);
    p.z[i] = float(map.z[i]);
    p.weight[i] = float(map.solid_angle[i]);
    p.red[i] = float(map.values[3 * i]);
    p.green[i] = float(map.values[3 * i + 1]);
    p.blue[i] = float(map.values[3 * i + 2]);
  }
  return p;
}

} // namespace

std::vector<float> plain_lobes(const AngularMap& map, std::span<const std::size_t> outputs, std::size_t first) {
  const Pixels pixels = pixels_of(map);
  const std::size_t lobes = 8 - first;
  std::vector<float> out, sums(8 * 4 * kPack);
  for (const std::size_t o : outputs) {
    std::fill(sums.begin(), sums.end(), 0.0f);
    const float n[3] = {float(map.x[o]), float(map.y[o]), float(map.z[o])};
    first == 0 ? add_eight(pixels, n, sums.data()) : add_six(pixels, n, sums.data());
    for (std::size_t k = 0; k < lobes; ++k) {
      float total[4] = {};
      for (std::size_t c = 0; c < 4; ++c)
        for (std::size_t i = 0; i < kPack; ++i)
          total[c] += sums[(k * 4 + c) * kPack + i];
      for (std::size_t c = 1; c < 4; ++c)
        out.push_back(total[c] / total[0]);
    }
  }
  return out;
}

} // namespace daylit::bench
