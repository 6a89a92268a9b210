#pragma once

// Radiance per direction: an image plus the mapping between its pixels and world directions.
// `w` always points from the observer to where the light comes from.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/lens/fall_off.h"

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
    albedo, ///< below the horizon albedo * E / pi; above it the measured mean radiance (see SkyImage)
  } kind = Kind::none;
  float albedo = 0.2f;
};

/// Which directions the pixels of a sky image see. Depends on the projection and the size only: a camera that
/// delivers frame after frame needs one.
class SkyGeometry {
public:
  /// Error: an angular map that is not square, a lens file for another image size, forward parallel to up.
  static Result<std::shared_ptr<const SkyGeometry>> make(int width, int height, const SkyProjection& projection,
                                                         const std::string& name = "sky");

  int width() const { return width_; }
  int height() const { return height_; }
  const SkyProjection& projection() const { return projection_; }
  bool is_equirect() const { return !lens_.has_value(); }
  bool covers_sphere() const { return covers_sphere_; }
  /// True solid angle of each pixel, steradians: exact band areas for equirect, the integral of the lens's analytic
  /// Jacobian otherwise, pixels on the rim of the field counted with the part inside.
  const std::vector<float>& solid_angle_sr() const { return solid_angle_; }
  /// Integral of max(0, w.z) over each pixel, steradians; empty when the field is the whole sphere.
  const std::vector<float>& projected_solid_angle_sr() const { return projected_solid_angle_; }

  /// Unit world direction through a pixel position (centre of the top left pixel = (0, 0)); empty outside the field.
  std::optional<glm::dvec3> direction(const glm::dvec2& pixel) const;
  /// Pixel position of a world direction; empty outside the field or the image.
  std::optional<glm::dvec2> pixel(const glm::dvec3& world_direction) const;
  /// Row-major index of the texel that a direction falls in.
  std::optional<std::size_t> texel(const glm::dvec3& world_direction) const;

private:
  SkyGeometry() = default;
  void measure_equirect();
  void measure_lens();
  double pixel_solid_angle(int x, int y) const;

  int width_ = 0, height_ = 0;
  SkyProjection projection_;
  double rotation_ = 0.0;         ///< of an equirect image
  std::optional<LensModel> lens_; ///< fish-eye, or the ideal lens that an angular map is
  glm::dmat3 world_from_camera_{1.0};
  bool covers_sphere_ = true;
  std::vector<float> solid_angle_, projected_solid_angle_;
};

/// Invariants: every texel inside the field is finite and >= 0 (checked by make()), texels outside it are zero and
/// have solid angle 0; solid_angle.size() == radiance.texels.size().
class SkyImage {
public:
  /// Error when a texel inside the field is NaN, infinite or negative (says how many and which is the first), when
  /// the size is not the geometry's, or when the field is not the whole sphere and `ground` does not say what fills
  /// the rest.
  static Result<SkyImage> make(RgbImage radiance, SkyProjection projection, GroundFill ground = {},
                               const std::string& name = "sky");
  static Result<SkyImage> make(RgbImage radiance, std::shared_ptr<const SkyGeometry> geometry, GroundFill ground = {},
                               const std::string& name = "sky");

  const RgbImage& image() const { return image_; }
  const std::shared_ptr<const SkyGeometry>& geometry() const { return geometry_; }
  const SkyProjection& projection() const { return geometry_->projection(); }
  const std::vector<float>& solid_angle_sr() const { return geometry_->solid_angle_sr(); }
  bool covers_sphere() const { return geometry_->covers_sphere(); }

  std::optional<glm::dvec3> direction(const glm::dvec2& pixel) const { return geometry_->direction(pixel); }
  std::optional<glm::dvec2> pixel(const glm::dvec3& direction) const { return geometry_->pixel(direction); }
  /// Radiance of the texel that a direction falls in (nearest, no interpolation: what the solid angles integrate);
  /// the fill outside the field.
  Rgb radiance(const glm::dvec3& world_direction) const;
  /// Radiance below the horizon where the camera sees nothing: albedo * E / pi, with E = pi times the measured
  /// cosine-weighted mean radiance above the horizon. Zero when the field is the whole sphere.
  Rgb fill_radiance() const { return ground_radiance_; }
  /// Radiance above the horizon where the camera sees nothing: that cosine-weighted mean, E / pi.
  Rgb sky_fill_radiance() const { return sky_fill_; }
  /// The one of the two that holds for a direction outside the field.
  Rgb fill_radiance(const glm::dvec3& direction) const { return direction.z < 0 ? ground_radiance_ : sky_fill_; }

private:
  RgbImage image_;
  std::shared_ptr<const SkyGeometry> geometry_;
  Rgb ground_radiance_{0.0f}, sky_fill_{0.0f};
};

/// Command-line form of a projection: "equirect", "angular", "fisheye:LENS.yaml".
Result<SkyProjection> parse_projection(const std::string& text, double rotation, const glm::dvec3& forward,
                                       const glm::dvec3& up);

/// What a file in CONFIG.toml or on a command line shows as a sky. Errors, each with the projection that fits: the
/// shape is not that of the projection (2:1 for equirect, square for an angular map, a lens file's own), a Radiance
/// header names another (VIEW=), `ground` is given for a picture of the whole sphere. `notes`: one line per thing a
/// user should know. `fall_off` of a fish-eye's lens is divided out.
Result<SkyImage> read_sky(const std::filesystem::path& path, const SkyProjection& projection, GroundFill ground = {},
                          std::vector<std::string>* notes = nullptr, const FallOff& fall_off = {});

} // namespace daylit
