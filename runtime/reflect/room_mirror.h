#pragma once

// Mirror images of virtual objects in real surfaces that are declared to mirror ([room] glossy). The photograph holds
// what they mirror without the objects: only the difference is added.

#include <map>
#include <span>
#include <string>
#include <vector>

#include "runtime/composite/compose.h"
#include "runtime/composite/drawn_picture.h"
#include "runtime/reflect/glossy_rays.h"

namespace daylit {

class RoomMirror {
public:
  /// `glossy`: by material, the part of light that it mirrors seen face on. Error value_invalid: no such material.
  static Result<RoomMirror> make(const Room& room, const std::map<std::string, double>& glossy);
  bool empty() const { return planes_.empty(); }
  /// For RoomSeen::gloss.
  std::span<const float> gloss() const { return empty() ? std::span<const float>() : reflectance_; }

  /// Adds the images to the room's part of the pixels; returns how many pixels show one. What the floor of the
  /// photograph mirrors is no light that a shadow on it takes away: where the composite is darker than `photo`, that
  /// part is given back.
  std::size_t draw(const DrawnPicture& drawn, const GlossyRays& rays, const RoomSeen& room, const PhotoPixels& photo,
                   const PhotoScale& scale, Composite& composite) const;

private:
  struct Plane {
    glm::dvec3 normal{0.0};
    double height = 0.0;
  };
  /// Pixels in which a plane may show the object.
  PixelBox box_of(const Plane& plane, const BoundingSphere& object, const DrawnPicture& drawn) const;
  struct Mirrored;
  /// Radiance that the room mirrors towards the camera, with the objects there and without.
  struct Image {
    Rgb now{0.0f}, before{0.0f};
  };
  std::size_t mirrored(std::span<const WorldRay> camera, const RoomSeen& room, std::span<Mirrored> found) const;
  void images(std::span<const WorldRay> camera, const GlossyRays& rays, const RoomSeen& room,
              std::span<Image> images) const;
  void find_row(const PixelBox& row, const DrawnPicture& drawn, const GlossyRays& rays, const RoomSeen& room,
                const PhotoPixels& photo, const PhotoScale& scale, const Composite& composite, Rgb* more) const;

  std::vector<float> reflectance_; ///< per triangle of the room, seen face on
  std::vector<Plane> planes_;      ///< of the triangles that mirror
};

} // namespace daylit
