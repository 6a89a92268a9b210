#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "runtime/indirect/indirect_shadow.h"
#include "runtime/indirect/light_in_box.h"
#include "runtime/indirect/near_sunlight.h"
#include "runtime/indirect/window_shares.h"
#include "runtime/object/relight.h"
#include "runtime/object/virtual_objects.h"
#include "runtime/sky/direct_light.h"

namespace daylit {

/// Adds to the reflected indirect radiance of each vertex that sends light (VirtualObjects::Senders) what nine
/// coefficients of the sunlit surfaces' light miss: by the surfaces that are near, and by points on those further away.
void add_sunlit_correction(const IndirectShadow& field, const NearSunlight& near, const VirtualObjects& objects,
                           std::span<TwoSided> radiance);
/// What lamps send each sender by way of the room, less what the objects take of its light: IndirectShadow::
/// lamp_light(), trilinear in the box of its part. Empty without both.
std::vector<Sh9Rgb> lamp_light(const IndirectShadow& field, const VirtualObjects& objects);
/// Adds what each side reflects of a change of light at its sender.
void add_change(const VirtualObjects& objects, std::span<const Sh9Rgb> change, std::span<TwoSided> radiance);
/// Of both sides of each sender: what it sees of the room that objects change. Empty where it sees nearly nothing, or
/// hides nearly nothing from itself.
using FeedbackTerms = std::vector<std::array<std::vector<FeedbackTerm>, 2>>;
FeedbackTerms feedback_terms(const IndirectShadow& field, const VirtualObjects& objects);
/// The same of what the objects change of the light that the room sends them.
void add_feedback(const IndirectShadow& field, const VirtualObjects& objects, const FeedbackTerms& terms,
                  std::span<TwoSided> radiance);
/// After each IndirectShadow::exchange(): of both sides, the change of irradiance by the views.
std::vector<std::array<Rgb, 2>> contact_changes(const IndirectShadow& field, const VirtualObjects& objects,
                                                const ContactViews& views);
/// The same of what they hide from each other and send to each other.
void add_exchange(const IndirectShadow& field, const VirtualObjects& objects, const ContactViews& views,
                  std::span<const std::array<Rgb, 2>> changes, std::span<TwoSided> radiance);

/// Indirect light at the objects.
struct ObjectsIndirectLight {
  std::vector<TwoSided> radiance; ///< that each sender reflects
  /// Of each part that shows diffuse light, where not all vertices are senders.
  std::vector<std::optional<LightInBox>> in_box;
  std::vector<TwoSided> sent;   ///< with the direct light: what mirrors show of an object; empty where none does
  std::vector<Sh9Rgb> arriving; ///< from the room at each sender; empty where no object has a normal map
  Ringing ringing;
};

/// What metals mirror, of each sender. `light`: that the room sends it, without what objects change of it;
/// `of_windows`, `of_room`: radiance with which it reflects light from there as a diffuse surface.
std::vector<std::array<MirroringSide, 2>> mirroring_sides(const IndirectShadow& field, const VirtualObjects& objects,
                                                          std::span<const Sh9Rgb> light, const WindowShares& shares,
                                                          std::span<const TwoSided> of_windows,
                                                          std::span<const TwoSided> of_room);

/// Light that goes from one part of an object to another, of all objects: SelfExchange::reflect().
void reflect_within(const VirtualObjects& objects, std::span<const TwoSided> direct,
                    std::span<const TwoSided> from_outside, std::span<TwoSided> radiance);

/// Of each part that is so dense and shows it: its light, with what objects change of it. `light`: that the room sends
/// each sender, none where `probes` has none; `sent`: all that the senders send; `field`: null where objects change
/// nothing.
std::vector<std::optional<LightInBox>> light_in_boxes(const VirtualObjects& objects, std::span<const Sh9Rgb> light,
                                                      std::span<const VertexProbes> probes,
                                                      std::span<const TwoSided> sent, const IndirectShadow* field);

/// Reflected indirect radiance of some vertices, ascending numbers of VirtualObjects::surface.
std::vector<TwoSided> reflected_indirect(const VirtualObjects& objects, std::span<const std::uint32_t> vertices,
                                         const ObjectsIndirectLight& light);

/// What a renderer needs to know of the same vertices: `indirect`, of each of them, and the open sky's irradiance.
std::vector<VertexLight> light_vertices(const VirtualObjects& objects, std::span<const std::uint32_t> vertices,
                                        std::span<const TwoSided> indirect, std::span<const SkyMap> pyramid,
                                        std::span<const ApertureCell> cells);

} // namespace daylit
