#pragma once

// Window panes whose transmittance depends on the angle of incidence.

#include <string>

#include "scene/room/room.h"

namespace daylit {

constexpr double kClearGlassIndex = 1.52;  ///< soda-lime float glass
constexpr double kLargestGlassIndex = 4.0; ///< beyond every transparent solid; larger ones are refused

/// Transmittance of a clear slab in air for unpolarised light, all internal reflections, no absorption:
/// tau = (t_s + t_p) / 2 with t = (1 - R) / (1 + R) and R the Fresnel reflectance of one face (Born & Wolf, 1.5.2).
/// n = 1.52: 0.91832 at normal incidence, 0 at grazing. `cos_incidence`: against the pane's normal, either sign.
double clear_slab_transmittance(double cos_incidence, double refractive_index);

/// Fraction of the light along a ray that crosses the pane: its transmittance, times the slab where it is clear glass.
inline Rgb pane_transmittance(const Rgb& transmittance, float refractive_index, double cos_incidence) {
  if (refractive_index <= 0.0f)
    return transmittance;
  return transmittance *
         static_cast<float>(clear_slab_transmittance(cos_incidence, static_cast<double>(refractive_index)));
}
inline Rgb pane_transmittance(const Aperture& pane, double cos_incidence) {
  return pane_transmittance(pane.transmittance, pane.refractive_index, cos_incidence);
}

/// "constant" or "clear glass, index 1.52": the model that a result used.
std::string pane_model_name(float refractive_index);

} // namespace daylit
