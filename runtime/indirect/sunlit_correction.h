#pragma once

// Light of the room's sunlit surfaces at the vertices of an object. A patch of sun is bright and small: nine
// coefficients of its light at a vertex, times its transfer vector, are wrong by a fifth where it lies beside the
// object.

#include <span>
#include <vector>

#include "runtime/indirect/sunlit_lanes.h"
#include "runtime/indirect/sunlit_points.h"
#include "runtime/indirect/window_visibility.h"
#include "runtime/object/placed_parts.h"
#include "runtime/object/self_visibility.h"
#include "runtime/object/transfer.h"

namespace daylit {

/// Around an object, what sunlit surfaces send is known surface by surface (near_sunlight.h): up to half of this reach,
/// and falling to nothing at its end. Zero: nowhere.
struct SurfacesKnown {
  glm::dvec3 centre{0.0};
  double reach_m = 0.0;
  float share_beyond(const glm::dvec3& x) const;
};

class SunlitCorrection {
public:
  SunlitCorrection() = default;
  /// Copies the points. What the room hides of them is found once for each part.
  SunlitCorrection(std::span<const SunlitPoint> points, const PlacedParts& parts, const WindowVisibility& windows);

  /// Irradiance of one side at x of a part: that of the points, past the object, less what their nine coefficients
  /// times `world_transfer` give. Of points nearer than two to four of their spacings it fades out: as points these are
  /// wrong, and as part of a floor that fills half of the view nine coefficients know them. What is known of surfaces
  /// is left out.
  Rgb at(std::size_t part, const glm::dvec3& x, const SenderSide& side, const TransferVector& world_transfer,
         const SurfacesKnown& known = {}) const;

private:
  /// Points with the power that reaches a part.
  struct Seen {
    Seen(const glm::dvec3& centre, std::span<const SunlitPoint> seen);
    glm::dvec3 origin;
    std::vector<sunlit::Points> blocks;
    std::vector<Rgb> power;
  };
  std::vector<Seen> seen_; ///< of each part
};

} // namespace daylit
