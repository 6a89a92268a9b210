#include "runtime/session/exchange_series.h"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace daylit {

namespace {

constexpr double kSmall = 0.04;    // rms change over rms light
constexpr double kMostRatio = 0.7; // a foot between two bright surfaces sends back no more

double product(const TwoSided& a, const TwoSided& b) {
  return static_cast<double>(glm::dot(a.front, b.front) + glm::dot(a.back, b.back));
}

} // namespace

/// q = sum d_k d_k-1 / sum d_k-1^2
bool ExchangeSeries::add(std::span<const TwoSided> radiance) {
  const bool first = change_.empty();
  change_.resize(last_.size());
  double before = 0, both = 0, now = 0, light = 0;
  for (std::size_t i = 0; i < last_.size(); ++i) {
    const TwoSided all{radiance[i].front + direct_[i].front, radiance[i].back + direct_[i].back},
        change{radiance[i].front - last_[i].front, radiance[i].back - last_[i].back};
    before += product(change_[i], change_[i]);
    both += product(change_[i], change);
    now += product(change, change);
    light += product(all, all);
    change_[i] = change;
    last_[i] = radiance[i];
  }
  ratio_ = !first && before > 0.0 ? std::clamp(both / before, 0.0, kMostRatio) : 0.0;
  return !first && now <= kSmall * kSmall * light;
}

std::vector<TwoSided> ExchangeSeries::limit() const {
  const auto rest = static_cast<float>(ratio_ / (1.0 - ratio_));
  std::vector<TwoSided> all = last_;
  for (std::size_t i = 0; i < change_.size(); ++i) {
    all[i].front = glm::max(all[i].front + rest * change_[i].front, Rgb(0.0f));
    all[i].back = glm::max(all[i].back + rest * change_[i].back, Rgb(0.0f));
  }
  return all;
}

} // namespace daylit
