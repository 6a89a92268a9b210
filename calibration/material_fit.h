#pragma once

// Reflectances of a room's materials from photographs: inverse radiosity.

#include <string>
#include <vector>

#include "calibration/material_samples.h"

namespace daylit::calibration {

struct MaterialEstimate {
  std::string name;
  Rgb given{0.0f};       ///< reflectance in the model
  Rgb reflectance{0.0f}; ///< found; as given where it is not seen
  Rgb uncertainty{0.0f}; ///< 95 %, absolute
  bool seen = false;     ///< in enough pixels to be measured
  std::size_t samples = 0;
  double used = 0;     ///< part of the samples that agree: highlights and what hides the surface do not
  double coverage = 0; ///< of the picture that shows most of it
  double scatter = 0;  ///< relative deviation between single pixels, of those that agree
  /// d ln radiance / d ln irradiance over the pixels of the material: 1 where the light is right. 0: too even to tell.
  double slope = 0;
};

/// How one photograph agrees with the reflectances found from all.
struct ViewAgreement {
  double used = 0;  ///< part of its samples that agree
  double level = 1; ///< median of measured over computed radiance
};

struct MaterialFit {
  std::vector<MaterialEstimate> materials; ///< as Room::materials, windows too
  std::vector<ViewAgreement> views;
  std::vector<Rgb> reflectance;   ///< of all of the room's materials
  radiosity::Radiosity radiosity; ///< of the room with these
  int steps = 0;
  bool settled = false;
};

/// For each material the rho with which measured radiance = rho / pi x irradiance in the robust mean (Tukey's biweight,
/// 1977) of its pixels, where the irradiance is that of the room with all these reflectances: the step of the paper
/// (Grosch et al. 2007, section 4). The dependence of the irradiance on all rho is taken into account by Newton steps
/// on ln rho, channel by channel, which settle in bright rooms, too, where plain repetition swings. Materials that are
/// not seen keep what the model says; that they may be wrong by 0.25 (standard deviation) is part of the uncertainty of
/// the others. Errors: no pixel shows a material; interrupted.
Result<MaterialFit> fit_materials(const Room& room, const MaterialSamples& samples,
                                  const std::vector<MaterialView>& views, RoomTransport& transport,
                                  const Progress& progress);

} // namespace daylit::calibration
