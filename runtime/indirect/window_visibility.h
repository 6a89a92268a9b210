#pragma once

// What of the windows and of the sun a point of the room sees, past the room and, where given, past virtual objects.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/indirect/room_planes.h"
#include "runtime/object/placed_parts.h"
#include "runtime/object/self_visibility.h"
#include "runtime/sky/direct_light.h"
#include "scene/room/ray_scene.h"

namespace daylit {

/// Keeps a reference to the room's rays.
class WindowVisibility {
public:
  WindowVisibility(const RayScene& room_rays, std::span<const Aperture> apertures)
      : rays_(room_rays), apertures_(apertures.begin(), apertures.end()) {}

  void set_sun(const std::optional<DetectedSun>& sun);
  bool has_sun() const { return !sun_.empty(); }
  const std::vector<Aperture>& apertures() const { return apertures_; }

  bool visible(const glm::dvec3& a, const glm::dvec3& b) const {
    return !rays_.occluded(rays_.to_local(a), glm::vec3(b - a), 0.0f, 1.0f);
  }
  /// Fraction of the windows that x sees past the room, weighted by what a uniform sky sends through them; 1 where none
  /// faces x.
  float visible_fraction(const glm::dvec3& x, const glm::dvec3& n) const;
  /// A square of the parameters of a window, which sixteen points stand for: all of it, of a near window a part.
  struct Piece {
    std::uint32_t window = 0;
    float s = 0.0f, t = 0.0f, side = 1.0f;
    std::uint16_t points = 0xFFFF; ///< bits of those that are seen
  };
  /// What x sees past the room: for points nearby, whatever their normals.
  using SeenPoints = std::vector<Piece>;
  SeenPoints seen_points(const glm::dvec3& x) const;
  /// Of these, the points that no part but `own` hides.
  SeenPoints not_hidden(const glm::dvec3& x, SeenPoints seen, const PlacedParts& parts, std::size_t own) const;
  float visible_fraction(const glm::dvec3& x, const glm::dvec3& n, const SeenPoints& seen) const;
  /// Of these, the points towards which a side of an object sees past its own object.
  SeenPoints past_own(const glm::dvec3& x, SeenPoints seen, const SenderSide& side) const;
  /// What parts without glass take of that fraction, all but `ignored`.
  float blocked_fraction(const glm::dvec3& x, const glm::dvec3& n, const PlacedParts& parts,
                         std::size_t ignored = PlacedParts::kNone) const;
  /// What parts with glass keep of the light of that fraction, where no other part stands before the window.
  Rgb kept_by_glass(const glm::dvec3& x, const glm::dvec3& n, const PlacedParts& parts) const;
  /// Bit k: no surface of the room stands between x and x + offsets[k]; up to sixteen.
  std::uint32_t past_room(const glm::dvec3& x, std::span<const glm::dvec3> offsets) const;
  /// Irradiance by the whole sun, as one of its samples sees it.
  Rgb sun_sample(std::size_t k, const glm::dvec3& x, const glm::dvec3& n) const;
  Rgb sun(const glm::dvec3& x, const glm::dvec3& n) const; ///< the mean over all samples
  /// Irradiance by the sun that the parts keep from x, by its middle.
  Rgb lost_sun(const glm::dvec3& x, const glm::dvec3& n, const PlacedParts& parts) const;
  const Rgb& sun_normal_irradiance() const { return sun_normal_irradiance_; }
  glm::dvec3 sun_direction() const { return sun_[sun_.size() / 2]; }

private:
  glm::dvec3 point(const Piece& piece, double s, double t) const;
  SeenPoints pieces_near(const glm::dvec3& x) const; ///< all of their points
  void add_pieces(const Piece& piece, const glm::dvec3& x, SeenPoints& pieces) const;
  std::array<glm::dvec3, 16> offsets(const Piece& piece, const glm::dvec3& x) const;
  template <class Counts>
  double weighted_fraction(const SeenPoints& pieces, const glm::dvec3& x, const glm::dvec3& n, double none,
                           Counts counts) const;
  const RayScene& rays_;
  std::vector<Aperture> apertures_;
  std::vector<glm::dvec3> sun_; ///< directions
  Rgb sun_normal_irradiance_{0.0f};
};

} // namespace daylit
