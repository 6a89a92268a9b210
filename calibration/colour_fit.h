#pragma once

// From code values of a chart to its known colours.

#include <array>
#include <span>
#include <string>
#include <vector>

#include <glm/mat3x3.hpp>

#include "calibration/chart.h"

namespace daylit::calibration {

/// Which unknowns a model has.
struct ColourTerms {
  bool curve = false;  ///< codes are a power of the light, on a pedestal of each channel (glare, black level)
  bool uneven = false; ///< the light on the chart falls off along a line
  bool roots = false;  ///< root-polynomial of degree 2 (Finlayson, Mackiewicz, Hurlbert 2015)
  bool operator==(const ColourTerms&) const = default;
  std::string name() const;
};

/// Rec. 709 = terms x (r, g, b [, sqrt rg, sqrt gb, sqrt rb]) with r = max(0, code - pedestal)^power.
struct ColourModel {
  ColourTerms terms;
  glm::dvec3 pedestal{0.0};
  double power = 1.0;
  glm::dvec2 uneven{0.0};                     ///< relative light per unit of ChartPatch::at
  std::array<std::array<double, 6>, 3> row{}; ///< of the matrix
  /// Linear Rec. 709, the light evened out.
  glm::dvec3 apply(const glm::dvec3& code, const glm::dvec2& at) const;
  /// The linear part alone, by its rows; camera to Rec. 709.
  glm::dmat3 matrix() const;
};

struct ColourFit {
  ColourModel model;
  double before = 0.0;   ///< mean Delta E 2000 of the codes themselves, scaled to the luminance of the chart
  double after = 0.0;    ///< of the fit
  double held_out = 0.0; ///< mean over patches, each with a model that does not know it
  std::array<double, kPatches> patch{}; ///< held out; negative: the patch had no part
  struct Tried {
    std::string name;
    double held_out = 0.0;
  };
  std::vector<Tried> tried; ///< all models; the best is `model`
};

/// Saturated patches have no part. `linear`: codes are known to be linear, so that no curve is tried. Error
/// value_invalid: fewer than 18 patches are left.
Result<ColourFit> fit_colour(const std::array<ChartPatch, kPatches>& patches, const ChartReference& reference,
                             bool linear);

/// Whether the codes fit the chart far better in the reverse order: it is upside down.
bool looks_upside_down(const std::array<ChartPatch, kPatches>& patches, const ChartReference& reference);

} // namespace daylit::calibration
