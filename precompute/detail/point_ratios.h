#pragma once

// Errors over many points, relative to the light there.

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <vector>

namespace daylit::precompute::detail {

/// nrms = sqrt(sum (value - truth)^2 / sum truth^2).
struct Ratio {
  double error2 = 0, power2 = 0;
  void add(double value, double truth) {
    error2 += (value - truth) * (value - truth);
    power2 += truth * truth;
  }
  double nrms() const { return power2 > 0 ? std::sqrt(error2 / power2) : 0.0; }
};

class PointRatios {
public:
  static constexpr double kMostOfPoint = 0.1; ///< of the squared error, in limited_nrms()

  void add(const Ratio& point) {
    error2_.push_back(point.error2);
    power2_ += point.power2;
  }
  double nrms() const { return Ratio{std::accumulate(error2_.begin(), error2_.end(), 0.0), power2_}.nrms(); }

  /// No point counts for more than kMostOfPoint of the squared error s: where the n largest do, s = rest +
  /// n kMostOfPoint s. One point in a window's reveal would else decide how close all probes stand. Of fewer than 20
  /// points as nrms().
  double limited_nrms() const {
    if (static_cast<double>(error2_.size()) * kMostOfPoint < 2.0)
      return nrms();
    std::vector<double> error2 = error2_;
    std::ranges::sort(error2, std::greater<>{});
    double sum = std::accumulate(error2.begin(), error2.end(), 0.0), left = 1.0;
    for (auto e = error2.begin(); e != error2.end() && *e > kMostOfPoint * sum && left > 1.5 * kMostOfPoint; ++e) {
      left -= kMostOfPoint;
      sum = std::accumulate(e + 1, error2.end(), 0.0) / left;
    }
    return Ratio{sum, power2_}.nrms();
  }

private:
  std::vector<double> error2_; ///< of each point
  double power2_ = 0;          ///< of all
};

} // namespace daylit::precompute::detail
