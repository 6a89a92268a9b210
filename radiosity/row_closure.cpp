#include "radiosity/row_closure.h"

#include <algorithm>
#include <cmath>

namespace daylit::radiosity {

namespace {

constexpr double kPowers[] = {0.5, 1.0, 0.5, 1.0, 0.5}; // of wanted / present row sum

/// Rows that can be closed, by their wanted sum.
class Rows {
public:
  Rows(const PatchSet& set, std::span<const float> opening, const CloseRowsOptions& options) {
    for (std::size_t i = 0; i < set.patches.size(); ++i) {
      const Patch& e = set.patches[i];
      const bool complete = !(options.black_left_out && e.reflectance == Rgb(0.0f));
      wanted_.push_back(complete ? e.area_m2 * (1.0 - static_cast<double>(opening[i])) : 0.0);
      complete_.push_back(complete);
    }
  }

  /// Deviation of every row, (sum - wanted) / A; rows beyond the limit are left as they are.
  RowClosure examine(const PatchSet& set, const std::vector<double>& sum, double limit) {
    RowClosure closure;
    closure.deviation.resize(wanted_.size());
    double area = 0;
    for (std::size_t i = 0; i < wanted_.size(); ++i) {
      if (!complete_[i])
        continue;
      const double off = (sum[i] - wanted_[i]) / set.patches[i].area_m2;
      closure.deviation[i] = static_cast<float>(off);
      closure.worst = std::max(closure.worst, std::abs(off));
      closure.mean += sum[i] - wanted_[i];
      area += set.patches[i].area_m2;
      if (std::abs(off) > limit) {
        ++closure.left;
        wanted_[i] = 0.0;
      }
    }
    closure.mean = area > 0 ? closure.mean / area : 0.0;
    return closure;
  }

  double factor(std::size_t patch, double sum, double power) const {
    return wanted_[patch] > 0.0 && sum > 0.0 ? std::pow(wanted_[patch] / sum, power) : 1.0;
  }

private:
  std::vector<double> wanted_; ///< m^2; 0: the row stays
  std::vector<bool> complete_;
};

} // namespace

/// Seeks S = diag(s) with sum_j s_i G_ij s_j = A_i (1 - F_i,outside): what leaves a patch of a closed room arrives
/// somewhere. s_i <- s_i (wanted_i / sum_i)^p, the symmetric form of the scaling of Sinkhorn & Knopp (1967); p = 1/2
/// converges without swinging, p = 1 in between is faster.
RowClosure close_rows(const PatchSet& set, std::span<const float> opening, const CloseRowsOptions& options,
                      ExchangeMatrix& exchange) {
  Rows rows(set, opening, options);
  const std::vector<double> raw = exchange.row_sums();
  const RowClosure closure = rows.examine(set, raw, options.limit);
  std::vector<double> scale(set.patches.size(), 1.0), sum = raw;
  for (const double power : kPowers) {
    for (std::size_t i = 0; i < scale.size(); ++i)
      scale[i] *= rows.factor(i, sum[i], power);
    sum = exchange.scaled_row_sums(scale);
  }
  exchange.scale(scale);
  return closure;
}

} // namespace daylit::radiosity
