#pragma once

// The light outside as a program is told about it: a picture, or a sky in words. What takes light from the sky takes
// one of these.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/sky/sky_image.h"
#include "scene/sky/sky_model.h"
#include "scene/sky/sky_partition.h"

namespace daylit {

/// Immutable, shared by threads. Either a picture, whose sun is in its texels, or a description, whose sun is a disc
/// apart from everything else.
class Sky {
public:
  explicit Sky(SkyImage image);
  explicit Sky(const SkyModel& model);

  /// Everything but sun().
  Rgb radiance(const glm::dvec3& unit_direction) const;
  /// Of a description; empty where its disc gives no light.
  const std::optional<SunDisc>& sun() const { return sun_; }
  /// The picture, or null.
  const std::shared_ptr<const SkyImage>& image() const { return image_; }
  /// The description, or null.
  const AnalyticSky* described() const { return described_ ? &*described_ : nullptr; }

private:
  std::shared_ptr<const SkyImage> image_;
  std::optional<AnalyticSky> described_;
  std::optional<SunDisc> sun_;
};

/// As region_radiance() of a picture. A described sky is averaged over a raster of a third of a degree; its sun is
/// added by area, cut off at the borders of the regions, so that its energy is kept to rounding.
std::vector<Rgb> region_radiance(const Sky& sky, const SkyPartition& partition);

/// A described sky without its sun as an equirectangular picture: solid-angle means of the texels.
SkyImage sky_raster(const AnalyticSky& sky, int height);

/// Points of equal area on a disc (Vogel's spiral, 1979).
std::vector<glm::dvec3> disc_points(const SunDisc& sun, int count);

/// What the options of a command line say about the sky.
struct SkyArguments {
  std::filesystem::path file;            ///< .exr, .hdr: a picture; .toml: a description; .epw, .wea: a weather tape
  std::string projection = "equirect";   ///< pictures
  double rotation_deg = 0.0;             ///< turns the sky counter-clockwise about z
  std::vector<double> forward{}, up{};   ///< angular maps, x y z; empty: +x, +z
  std::optional<double> ground_albedo{}; ///< fills what a fish-eye does not see; ground of a description
  std::string time{};                    ///< weather tapes: "06-21 12:30"
};

struct OpenedSky {
  Sky sky;
  std::vector<std::string> notes; ///< for people
};

/// Error: the file cannot be read, says nonsense, or an option is given that it has no use for.
Result<OpenedSky> open_sky(const SkyArguments& arguments);

} // namespace daylit
