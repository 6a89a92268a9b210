#include "runtime/indirect/indirect_shadow.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "runtime/indirect/indirect_feedback.h"
#include "runtime/indirect/object_effects.h"
#include "runtime/indirect/receiver_lattice.h"
#include "runtime/indirect/sunlit_correction.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {
constexpr double kLeastFraction = 0.002; // of the cosine-weighted hemisphere
// Of the windows' light: an object that takes less dims the room by less than can be seen; one that takes more than the
// second counts fully.
constexpr double kLeastTaken = 0.015, kMuchTaken = 0.03;
constexpr int kSunPoints = 64; // of a patch
} // namespace

/// Of the light that comes in through the windows, about what the parts can take at most: their discs beside the
/// window and what its light spreads over at their distance, pi r^2 / (A + pi d^2), of the window that gives most.
static double taken_part(const PlacedParts& parts, std::span<const Aperture> windows) {
  double sum = 0.0;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const BoundingSphere& sphere = parts.sphere(k);
    double most = 0.0;
    for (const Aperture& window : windows) {
      Bounds box;
      glm::dvec3 across(0.0);
      for (std::size_t c = 0; c < window.corners.size(); ++c) {
        box.include(window.corners[c]);
        across += 0.5 * glm::cross(window.corners[c], window.corners[(c + 1) % window.corners.size()]);
      }
      const double d = glm::distance(sphere.centre, glm::clamp(sphere.centre, box.min, box.max));
      most = std::max(most, sphere.radius * sphere.radius / (glm::length(across) / std::numbers::pi + d * d));
    }
    sum += most;
  }
  return sum;
}

struct IndirectShadow::State : LitScene {
  ReceiverLattice receivers{*this};
  IndirectFeedback indirect_feedback{*this, receivers};
  OtherObjects other_objects{rays, patches, windows};
  SunlitCorrection correction;
  double dimming = 0.0; ///< part of the dimming that counts
  std::vector<RoomPatch*> dimmed;
  std::vector<ReceiverLattice::Link> dimmed_at; ///< of each
  std::vector<TwoSided> direct;                 ///< radiance of the objects' vertices that does not come from the room
  std::uint64_t sky_version = 0;
  bool moved = true; ///< sun or objects, since the sunlit points were found
  using LitScene::LitScene;

  /// After the parts moved.
  void find_dimmed() {
    dimmed.clear();
    dimmed_at.clear();
    lamps.forget_changes();
    dimming = glm::smoothstep(kLeastTaken, kMuchTaken, taken_part(parts, windows.apertures()));
    if (dimming == 0.0)
      return;
    for (RoomPatch* patch : lamps.find_seen_by_parts()) {
      const glm::dvec3 x = patch->point + kAirGap_m * patch->normal;
      RayHit hit;
      if (!rays.closest(rays.to_local(x), glm::vec3(-patch->normal), 0.0f, 2.0f * static_cast<float>(kAirGap_m), hit))
        continue;
      dimmed.push_back(patch);
      dimmed_at.push_back(receivers.link(hit.triangle, patch->point, -patch->normal, kFeedbackRadii));
    }
  }
};

IndirectShadow::IndirectShadow(const Room& room, const RayScene& room_rays, std::span<const Aperture> apertures,
                               const RoomLight& room_light)
    : state_(std::make_unique<State>(room, room_rays, apertures, room_light)) {}
IndirectShadow::IndirectShadow(IndirectShadow&&) noexcept = default;
IndirectShadow& IndirectShadow::operator=(IndirectShadow&&) noexcept = default;
IndirectShadow::~IndirectShadow() = default;

void IndirectShadow::set_objects(std::vector<PlacedPart> parts) {
  State& s = *state_;
  s.parts = PlacedParts(std::move(parts));
  s.moved = true;
  s.receivers.objects_moved();
  s.indirect_feedback.objects_moved();
  s.other_objects.set_objects(s.parts);
  s.find_dimmed();
}

bool IndirectShadow::dims_room() const { return state_->dimming > 0.0; }

/// Delta E of each patch, direct light included, as far as the objects let the patch send it on: what they hide of it
/// is part of the changes elsewhere.
void IndirectShadow::find_dimming() {
  State& s = *state_;
  std::vector<Rgb> changes(s.dimmed.size(), Rgb(0.0f));
  parallel_for(tbb::blocked_range<std::size_t>(0, changes.size(), 16), [&](const auto& range) {
    for (std::size_t k = range.begin(); k != range.end(); ++k) {
      Rgb change(0.0f);
      float open = 0.0f;
      for (std::size_t j = 0; j < 4; ++j)
        if (const float w = s.dimmed_at[k].weight[j]; w > 0.0f) {
          ReceiverLattice::Node& node = *s.dimmed_at[k].node[j];
          change += w * s.receivers.whole_change(node, false);
          open += w * (1.0f - ReceiverLattice::covered(node));
        }
      change -= s.lost_sun(s.dimmed[k]->point, s.dimmed[k]->normal, RoomPatches::kSide_m, kSunPoints);
      changes[k] = static_cast<float>(s.dimming) * open * change;
    }
  });
  s.lamps.set_changes(s.dimmed, changes);
}

void IndirectShadow::set_lamps(const ObjectSurface& surface) { state_->lamps.set_lamps(surface); }
bool IndirectShadow::has_lamps() const { return state_->lamps.any(); }
Sh9Rgb IndirectShadow::lamp_light(std::size_t part, const glm::dvec3& x) const {
  return state_->lamps.at_part(part, x);
}

void IndirectShadow::set_sky(std::span<const SkyMap> pyramid, const std::optional<DetectedSun>& sun,
                             std::uint64_t sky_version) {
  State& s = *state_;
  if (std::exchange(s.sky_version, sky_version) != sky_version || sky_version == 0) {
    s.windows.set_sun(sun); // also one that does not reach the objects: they may stand before a patch of it
    s.patches.set_frame(pyramid);
    s.moved = true;
  }
  if (std::exchange(s.moved, false))
    s.sunlit = sun ? sunlit_points(s.room, s.rays, s.planes, s.windows.apertures(),
                                   s.patches.window_cells(kCellFraction), *sun, s.parts)
                   : std::vector<SunlitPoint>{};
  s.correction = SunlitCorrection(s.sunlit, s.parts, s.windows);
  s.other_objects.room_changed();
  s.receivers.sky_changed(); // the light of the room is another where its windows are seen from another object
}

/// L_out = direct + rho_d / pi E_sun V, on both sides; the sun in a mirror lights nothing (no caustics).
void IndirectShadow::set_direct(std::vector<TwoSided> direct, const ObjectSurface& surface,
                                std::span<const Rgb> diffuse) {
  State& s = *state_;
  s.direct = std::move(direct);
  if (s.windows.has_sun())
    parallel_for(tbb::blocked_range<std::size_t>(0, s.direct.size(), 64), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        const glm::dvec3 n(surface.normals[i]);
        s.direct[i].front += s.reflected_sun(surface.positions[i], n, diffuse[i]);
        s.direct[i].back += s.reflected_sun(surface.positions[i], -n, diffuse[i]);
      }
    });
}

void IndirectShadow::set_mirrored(std::vector<std::array<MirroringSide, 2>> sides,
                                  std::span<const DirectionalLight> windows) {
  state_->mirrored = MirroredLight(std::move(sides), windows);
  state_->receivers.mirrored_changed();
}

std::span<const TwoSided> IndirectShadow::direct() const { return state_->direct; }

void IndirectShadow::set_indirect(std::span<const TwoSided> indirect) {
  State& s = *state_;
  s.radiance = s.direct;
  for (std::size_t i = 0; i < s.radiance.size(); ++i) {
    s.radiance[i].front += indirect[i].front;
    s.radiance[i].back += indirect[i].back;
  }
  s.receivers.light_changed();
}

void IndirectShadow::exchange_with_room(bool sun_too) { state_->indirect_feedback.light_changed(sun_too); }
Sh9Rgb IndirectShadow::feedback(std::size_t part, std::size_t vertex) const {
  return state_->indirect_feedback.change(part, vertex);
}

std::vector<FeedbackTerm> IndirectShadow::feedback_terms(std::size_t part, std::size_t vertex,
                                                         const SenderSide& side) const {
  return state_->indirect_feedback.terms(part, vertex, side);
}
Rgb IndirectShadow::feedback(std::span<const FeedbackTerm> terms) const {
  return state_->indirect_feedback.change(terms);
}
Rgb IndirectShadow::sunlit_correction(std::size_t part, const glm::dvec3& x, const SenderSide& side,
                                      const TransferVector& world_transfer, const SurfacesKnown& known) const {
  return state_->correction.at(part, x, side, world_transfer, known);
}

bool IndirectShadow::objects_see_each_other() const { return state_->other_objects.any(); }
void IndirectShadow::exchange() { state_->other_objects.set_light(state_->radiance); }
Sh9Rgb IndirectShadow::exchanged(std::size_t part, const glm::dvec3& x) const {
  return state_->other_objects.change(part, x);
}

ContactView IndirectShadow::contact_view(std::size_t part, const glm::dvec3& x, const SenderSide& side) const {
  return state_->other_objects.contact_view(part, x, side);
}
Rgb IndirectShadow::exchanged(const ContactView& view) const {
  return state_->other_objects.change(view, state_->radiance);
}
WindowVisibility::SeenPoints IndirectShadow::not_hidden(std::size_t part, const glm::dvec3& x,
                                                        const WindowVisibility::SeenPoints& past_room) const {
  return state_->windows.not_hidden(x, past_room, state_->parts, part);
}
Rgb IndirectShadow::passed_by_objects(const glm::dvec3& x, const glm::dvec3& direction) const {
  return state_->parts.passed(x, direction);
}

double IndirectShadow::distance_to_objects(const glm::dvec3& x, double limit) const {
  return state_->parts.distance(x, limit);
}

/// r^2 / d^2, the form factor of a sphere that faces x (Howell B-4), above kLeastFraction for some object.
bool IndirectShadow::affects(const glm::dvec3& x) const {
  const PlacedParts& parts = state_->parts;
  if (state_->lamps.any())
    return true;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const glm::dvec3 d = parts.sphere(k).centre - x;
    if (parts.sphere(k).radius * parts.sphere(k).radius > kLeastFraction * glm::dot(d, d))
      return true;
  }
  return false;
}

bool IndirectShadow::near(const glm::dvec3& x) const { return state_->receivers.near(x); }
double IndirectShadow::surface_distance(std::uint32_t triangle, const glm::dvec3& x,
                                        const glm::dvec3& direction) const {
  return state_->receivers.surface_distance(triangle, x, direction);
}
double IndirectShadow::contact_distance() const { return state_->receivers.contact_distance(); }

IndirectChange IndirectShadow::at(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  return state_->receivers.at(triangle, x, direction);
}

IndirectChange IndirectShadow::evaluate(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction,
                                        int rays) const {
  return state_->receivers.evaluate(triangle, x, direction, rays);
}

RoomIrradiance IndirectShadow::irradiance_without_sun(std::uint32_t triangle, const glm::dvec3& x,
                                                      const glm::dvec3& direction, bool with_objects) const {
  return state_->receivers.irradiance_without_sun(triangle, x, direction, with_objects);
}

std::span<const TwoSided> IndirectShadow::sent() const { return state_->radiance; }

Rgb IndirectShadow::sun_irradiance(std::uint32_t triangle, const glm::dvec3& x, const glm::dvec3& direction) const {
  const glm::dvec3 n = state_->normal_of(triangle, direction);
  return state_->windows.sun(x + kAirGap_m * n, n);
}

std::uint32_t IndirectShadow::facing_of(std::uint32_t triangle, const glm::dvec3& direction) const {
  return state_->facing_of(triangle, direction);
}

} // namespace daylit
