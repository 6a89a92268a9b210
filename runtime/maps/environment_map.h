#pragma once

// What an object sees around it: radiance of every direction from one place, and the same blurred for rough surfaces.
// Filled by a callback, texel by texel, only where something changed; looked up by direction and width of the lobe.

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "runtime/maps/prefilter.h"

namespace daylit {

/// Exponent of the Phong lobe about the mirror direction that stands for a GGX surface of glTF roughness r:
/// alpha = r^2; the half vector of GGX is spread as cos^(2 / alpha^2 - 2) (Walter et al. 2007, the Beckmann-Phong rule;
/// Karis 2013). The mirror direction turns twice as far as the half vector, so that its solid angle is four times as
/// large and cos^n about the half vector is cos^(n / 4) about the mirror direction: s = (2 / alpha^2 - 2) / 4, kept
/// between 1 (from r = 0.76 on) and kMaxExponent.
double phong_exponent(double roughness);
/// Its inverse on (0, 0.76].
double ggx_roughness(double exponent);

class EnvironmentMap {
public:
  struct Settings {
    int side = 128; ///< texels; 128: 1.6 degrees a texel
    /// glTF roughness of the blurred maps, ascending, in (0, 1]; the sharp map stands below them.
    std::vector<double> roughness{0.2, 0.3, 0.42, 0.58, 0.8};
    PrefilterMethod method = PrefilterMethod::harmonics;
    double tolerance = 1e-3; ///< as in PrefilterOptions
  };
  /// Black until the first update. An error names the setting that is out of range.
  static Result<EnvironmentMap> create(const Settings& settings);

  /// Radiance that arrives from a unit direction; called from several threads.
  using Radiance = std::function<Rgb(const glm::vec3& direction)>;

  /// Asks `radiance` at the centre of every texel, or only of `texels`. When any answer differs from what the map
  /// holds, blurs the map anew. Returns the number of texels that changed; on an error (a radiance that is negative or
  /// not finite, `stop`) the map stays as it was.
  Result<std::size_t> update(const Radiance& radiance, std::stop_token stop = {});
  Result<std::size_t> update(const Radiance& radiance, std::span<const std::uint32_t> texels,
                             std::stop_token stop = {});

  /// Mean radiance under the lobe max(0, w . direction)^exponent, exponent >= 1; infinity: the sharp map. Bilinear in
  /// the map, and between maps in 1 / sqrt(exponent), the width of the lobe. `direction` of any length above 0.
  Rgb lookup(const glm::vec3& direction, double exponent) const;

  const RadianceMap& sharp() const { return sharp_; }
  /// For textures: the blurred maps, falling exponent.
  std::size_t levels() const { return blurred_.size(); }
  const RadianceMap& level(std::size_t k) const { return blurred_[k]; }
  double exponent(std::size_t k) const { return lobes_[k].exponent; }

private:
  Settings settings_;
  RadianceMap sharp_;
  std::vector<Lobe> lobes_;
  std::vector<RadianceMap> blurred_;
};

/// Side of a map that holds a lobe: at least two texels to its standard deviation 1 / sqrt(exponent), a power of two
/// between 8 and `most`.
int side_of_lobe(double exponent, int most);

} // namespace daylit
