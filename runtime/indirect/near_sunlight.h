#pragma once

// What sunlit surfaces send to objects that stand on them or beside them. Within a metre of a sun patch the light
// changes more than probes, sky nodes and the mean light of an element can tell: there the volume's part of it is
// replaced by that of the patch as the sun draws it (scene/volume/first_reflection.h says why and does it for single
// points).

#include <optional>
#include <span>
#include <vector>

#include "runtime/indirect/indirect_shadow.h"
#include "runtime/indirect/lit_side.h"
#include "runtime/object/relight.h"
#include "runtime/object/virtual_objects.h"
#include "scene/room/aperture.h"
#include "scene/sky/sun.h"
#include "scene/volume/first_reflection.h"

namespace daylit {

class NearSunlight {
public:
  /// Keeps references; `rays`: rays_of_light() of the volume. A volume that does not name its elements is not
  /// corrected.
  NearSunlight(const BasisVolume& volume, const RayScene& rays, const ApertureCrossings& windows);

  /// The volume names its elements.
  bool is_known() const { return surfaces_.has_value(); }

  /// Of each sender of the objects, in nine coefficients: what the surfaces near its object send it, those in the
  /// shadow of objects nothing (`objects_too`, null: without that), less what the volume has of that at `probes`. Zero
  /// without a sun. Found anew where objects moved (another `placement`) or the sun stands elsewhere; its brightness is
  /// a factor.
  std::vector<Sh9Rgb> correction(const VirtualObjects& objects, std::span<const VertexProbes> probes,
                                 std::uint64_t placement, const std::optional<DetectedSun>& sun,
                                 const IndirectShadow* objects_too);

  /// After correction(): around a part, the surfaces that are known.
  SurfacesKnown surfaces_known(std::size_t part) const {
    return part < around_.size() ? around_[part] : SurfacesKnown{};
  }
  /// Irradiance of one side that the nine coefficients of these surfaces' light miss: a sheet that stands in the sun
  /// has a lit floor on one side and its shadow on the other, and nine coefficients spread it over both.
  /// After correction(); zero without a sun.
  Rgb missed(std::size_t sender, bool back) const {
    return sender < missed_.size() ? normal_irradiance_ * missed_[sender][back] : Rgb(0.0f);
  }

private:
  /// A triangle of a surface, or one of the four that it is cut into where an object is close by.
  struct Piece {
    std::array<glm::dvec3, 3> corner;
    glm::dvec3 normal{0.0};
    Rgb radiance{0.0f};           ///< mean, under a sun that sends 1 to a plane facing it; as the object sees it
    std::uint32_t first_part = 0; ///< of four in a row; 0: not cut
  };
  struct Pieces {
    std::vector<std::uint32_t> whole; ///< that no other holds
    std::vector<Piece> all;
    double lift_m = 0.0; ///< off the surface that a vertex may lie on
  };
  enum class Place : std::uint8_t { nowhere, within, at_foot };
  /// What the surfaces send a sender, under a sun of 1.
  struct Received {
    Sh9Rgb light{};
    Place place = Place::nowhere;
  };
  std::vector<Rgb> stored() const;
  Rgb sunlit(const FirstReflection::Element& element, const glm::dvec3& point) const;
  Pieces pieces(std::span<const FirstReflection::Near> near, const Bounds& box) const;
  double longest_at(const glm::dvec3& point, const Bounds& box) const;
  void cut(std::uint32_t piece, const FirstReflection::Element& element, const Bounds& box, Pieces& pieces) const;
  Pieces correct_part(const VirtualObjects& objects, std::size_t part, std::span<const VertexProbes> probes,
                      std::span<const Rgb> stored, std::span<Received> received);
  void find_missed(const VirtualObjects& objects, std::span<const Pieces> pieces, std::span<const Received> received);

  const BasisVolume* volume_;
  const RayScene* rays_;
  const ApertureCrossings* windows_;
  const IndirectShadow* shadow_ = nullptr;
  std::optional<FirstReflection> surfaces_;
  std::optional<glm::dvec3> sun_; ///< that the following belongs to
  std::uint64_t placement_ = 0;
  Rgb normal_irradiance_{0.0f};            ///< of the sun
  std::vector<Sh9Rgb> unit_;               ///< of each sender, under a sun of 1
  std::vector<std::array<Rgb, 2>> missed_; ///< of both sides of each, the same
  std::vector<SurfacesKnown> around_;      ///< of each part
};

} // namespace daylit
