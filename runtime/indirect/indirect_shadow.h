#pragma once

// What virtual objects do to the indirect light of the real room: they stand before lit surfaces, and they send light
// themselves.
//
// At a point x of the room, Delta E(x) = integral over the directions that an object covers of
// (L_object - L_room behind it) cos dw. What is behind is looked up where the ray meets the room, not in the nine
// coefficients: next to a sunlit floor these are wrong by a factor at the horizon, where objects stand. Sky behind the
// object counts as zero: its loss is the direct shadow, drawn elsewhere. What is behind is the room without objects;
// the objects themselves see the room with their own direct shadow on it (feedback); further bounces are left
// out, but for the light of lamps (lamp_light.h).
//
// Rays are traced at the corners of square cells on the room's planes, finer near an object, when a point nearby is
// looked up first; they hold until an object moves. What they carry is renewed with the light.

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "runtime/indirect/feedback_term.h"
#include "runtime/indirect/object_effects.h"
#include "runtime/indirect/receiver.h"
#include "runtime/indirect/sunlit_correction.h"
#include "runtime/object/object_surface.h"
#include "runtime/object/self_visibility.h"

namespace daylit {

/// Keeps references to everything given to the constructor. at() is thread-safe.
class IndirectShadow {
public:
  IndirectShadow(const Room& room, const RayScene& room_rays, std::span<const Aperture> apertures,
                 const RoomLight& room_light);
  IndirectShadow(IndirectShadow&&) noexcept;
  IndirectShadow& operator=(IndirectShadow&&) noexcept;
  ~IndirectShadow();

  /// The parts must live until the next call.
  void set_objects(std::vector<PlacedPart> parts);
  /// After set_objects(): those of `surface`, all objects in the world, that emit light the room and are reflected in
  /// it.
  void set_lamps(const ObjectSurface& surface);
  bool has_lamps() const;
  /// The objects are so large, or stand so near to a window, that the whole room is darker for them.
  bool dims_room() const;
  /// Then, after set_indirect(): how much darker; it is part of lamp_light() and at().
  void find_dimming();
  /// Nine coefficients of that light, reflected by the room, and of the light that the room lacks, at a world point of
  /// a part: LampLight::at_part().
  Sh9Rgb lamp_light(std::size_t part, const glm::dvec3& x) const;
  /// The light of a sky; room_light must hold the same sky's, and `pyramid` lives until the next. Equal versions mean
  /// the same sky: then only objects moved since the last call. 0: another sky.
  void set_sky(std::span<const SkyMap> pyramid, const std::optional<DetectedSun>& sun, std::uint64_t sky_version = 0);
  /// `direct`: radiance from each vertex of all objects, on both sides, because of light straight from the sky;
  /// what the `diffuse` reflectance of each sends on of the sun's is added here with shadows. Call after set_sky().
  void set_direct(std::vector<TwoSided> direct, const ObjectSurface& surface, std::span<const Rgb> diffuse);
  /// The same with the sun's.
  std::span<const TwoSided> direct() const;
  /// What metals mirror, between set_direct() and set_indirect(): of each sender, and the windows' light without
  /// shadows (MirroredLight). No sides: nothing mirrors.
  void set_mirrored(std::vector<std::array<MirroringSide, 2>> sides, std::span<const DirectionalLight> windows);
  /// Radiance from them because of all other light.
  void set_indirect(std::span<const TwoSided> indirect);

  /// What the objects do to the room comes back to them: after exchange_with_room(), nine coefficients of the change
  /// of radiance that arrives at a vertex of a part from the surfaces around, under the light of set_indirect().
  /// `sun_too`: also what the objects keep of the sun from these surfaces.
  void exchange_with_room(bool sun_too);
  Sh9Rgb feedback(std::size_t part, std::size_t vertex) const;
  /// The same as irradiance of one side, from what a vertex that sends light sees past its own object. The terms hold
  /// until an object moves.
  std::vector<FeedbackTerm> feedback_terms(std::size_t part, std::size_t vertex, const SenderSide& side) const;
  Rgb feedback(std::span<const FeedbackTerm> terms) const;
  /// What nine coefficients of the sunlit surfaces' light miss: SunlitCorrection::at(). After set_sky().
  Rgb sunlit_correction(std::size_t part, const glm::dvec3& x, const SenderSide& side,
                        const TransferVector& world_transfer, const SurfacesKnown& known = {}) const;
  /// Light between the objects: whether there is any, and after set_indirect(), what it changes of the radiance that
  /// arrives at a point of a part.
  bool objects_see_each_other() const;
  void exchange();
  Sh9Rgb exchanged(std::size_t part, const glm::dvec3& x) const;
  /// The same of a side of a vertex at x that another object is near: OtherObjects::contact_view(). After
  /// set_objects(), and the change of its irradiance after set_indirect().
  ContactView contact_view(std::size_t part, const glm::dvec3& x, const SenderSide& side) const;
  Rgb exchanged(const ContactView& view) const;
  /// What a point of a part sees of the windows past the room, without what other parts hide.
  WindowVisibility::SeenPoints not_hidden(std::size_t part, const glm::dvec3& x,
                                          const WindowVisibility::SeenPoints& past_room) const;
  /// What of light from a direction the objects let through to a world point (PlacedParts::passed()).
  Rgb passed_by_objects(const glm::dvec3& x, const glm::dvec3& direction) const;
  /// From a world point to the nearest surface of an object, or the limit.
  double distance_to_objects(const glm::dvec3& x, double limit_m) const;

  /// False where no object covers more than 1/500 of what x sees; lamps, and what dims the room, reach everywhere.
  bool affects(const glm::dvec3& x) const;
  /// So close to an object that its effect may be narrower than a few of its cells further away.
  bool near(const glm::dvec3& x) const;
  /// From x to the nearest surface of an object, about; nearer than contact_distance() the effect is as narrow as a
  /// pixel. Metres.
  double surface_distance(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const;
  double contact_distance() const;
  IndirectChange at(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const;
  /// The same without cells and with `rays` rays per object: the slow twin.
  IndirectChange evaluate(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction, int rays) const;
  /// Irradiance of x with the objects there, from all but the sun; past the room and past them. From cells. Without
  /// `with_objects` as if there were none.
  RoomIrradiance irradiance_without_sun(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction,
                                        bool with_objects = true) const;
  /// What every vertex of the objects sends to both sides, as a diffuse surface of its reflectance.
  std::span<const TwoSided> sent() const;
  /// Irradiance from the sun at x, past the room without the objects.
  Rgb sun_irradiance(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const;
  /// Which side of which plane: equal for points that interpolation may join.
  std::uint32_t facing_of(std::uint32_t triangle, const glm::dvec3& direction) const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace daylit
