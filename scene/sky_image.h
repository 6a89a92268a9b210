#pragma once

// Radiance per direction: an image plus the mapping between its pixels and world directions.
// `w` always points from the observer to where the light comes from.

#include <filesystem>
#include <optional>
#include <variant>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/lens.h"
#include "scene/result.h"
#include "scene/rgb_image.h"

namespace daylit {

/// u = 1/2 - azimuth / 2pi with azimuth = atan2(y, x) - rotation, v = acos(z) / pi from the top.
struct EquirectProjection {
  double rotation = 0.0; ///< radians, turns the sky counter-clockwise about +z
};
/// Debevec's probe: unit circle in the square, radius = angle from the forward axis / pi.
struct AngularProjection {
  glm::dvec3 forward{1.0, 0.0, 0.0};
  glm::dvec3 up{0.0, 0.0, 1.0};
  double rotation = 0.0; ///< radians, counter-clockwise about +z, applied after forward/up
};
struct FisheyeProjection {
  LensModel lens;
  double rotation = 0.0; ///< radians, counter-clockwise about +z, applied after world_from_camera
};
using SkyProjection = std::variant<EquirectProjection, AngularProjection, FisheyeProjection>;

/// How directions that the camera cannot see are filled.
struct GroundFill {
  enum class Kind {
    none,   ///< the projection covers the whole sphere; an uncovered direction is an error
    albedo, ///< radiance = albedo * measured horizontal irradiance / pi below the horizon, same mean above
  } kind = Kind::none;
  float albedo = 0.2f;
};

/// Invariants: every texel is finite and >= 0 (checked by make()); solid_angle.size() == radiance.texels.size();
/// texels outside the projection's field have solid angle 0.
class SkyImage {
public:
  /// Error when a texel inside the field is NaN, infinite or negative: says which pixel and how many.
  static Result<SkyImage> make(RgbImage radiance, SkyProjection projection, GroundFill ground = {},
                               const std::string& name = "sky");

  const RgbImage& image() const { return image_; }
  const SkyProjection& projection() const { return projection_; }
  /// True solid angle of each pixel, steradians (area-exact for equirect, partial at the border of the field).
  const std::vector<float>& solid_angle_sr() const { return solid_angle_; }

  /// Unit world direction through a pixel position (centre of the top left pixel = (0, 0)); empty outside the field.
  std::optional<glm::dvec3> direction(const glm::dvec2& pixel) const;
  /// Pixel position of a world direction; empty outside the field.
  std::optional<glm::dvec2> pixel(const glm::dvec3& world_direction) const;
  /// Radiance of the texel that a direction falls in (nearest, no interpolation: what the solid angles integrate);
  /// the ground fill outside the field.
  Rgb radiance(const glm::dvec3& world_direction) const;
  /// Radiance used where the camera sees nothing; zero when the field is the whole sphere.
  Rgb fill_radiance() const { return fill_radiance_; }
  bool covers_sphere() const;

private:
  RgbImage image_;
  SkyProjection projection_;
  std::vector<float> solid_angle_;
  Rgb fill_radiance_{0.0f};
};

/// Command-line form of a projection: "equirect", "angular", "fisheye:LENS.yaml".
Result<SkyProjection> parse_projection(const std::string& text, double rotation, const glm::dvec3& forward,
                                       const glm::dvec3& up);
Result<SkyImage> read_sky(const std::filesystem::path& path, const SkyProjection& projection, GroundFill ground = {});

} // namespace daylit
