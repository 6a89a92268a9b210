#include "runtime/indirect/vertex_light.h"

#include <algorithm>
#include <numbers>

#include "runtime/indirect/lit_side.h"

namespace daylit {

namespace {

constexpr float kLeastHidden = 0.1f; // from there on it counts in which directions the object hides itself
constexpr float kMostHidden = 0.98f; // from there on nothing is seen

} // namespace

void add_sunlit_correction(const IndirectShadow& field, const NearSunlight& near, const VirtualObjects& objects,
                           std::span<TwoSided> radiance) {
  for_each_side(objects, [&](const LitSide& side) {
    side.add_irradiance(near.missed(side.number, side.back) + field.sunlit_correction(side.part, side.position(),
                                                                                      side.seen(), side.transfer(),
                                                                                      near.surfaces_known(side.part)),
                        radiance);
  });
}

FeedbackTerms feedback_terms(const IndirectShadow& field, const VirtualObjects& objects) {
  FeedbackTerms terms(objects.senders.vertex.size());
  for_each_side(objects, [&](const LitSide& side) {
    const float hidden = hidden_fraction(side.transfer());
    if (hidden >= kLeastHidden && hidden < kMostHidden)
      terms[side.number][side.back] = field.feedback_terms(side.part, side.own, side.seen());
  });
  return terms;
}

/// Of what the vertex sees; in nine coefficients where it sees nearly all.
void add_feedback(const IndirectShadow& field, const VirtualObjects& objects, const FeedbackTerms& terms,
                  std::span<TwoSided> radiance) {
  for_each_side(objects, [&](const LitSide& side) {
    if (hidden_fraction(side.transfer()) >= kLeastHidden)
      side.add_irradiance(field.feedback(terms[side.number][side.back]), radiance);
    else
      side.add_coefficients(field.feedback(side.part, side.own), radiance);
  });
}

std::vector<std::array<Rgb, 2>> contact_changes(const IndirectShadow& field, const VirtualObjects& objects,
                                                const ContactViews& views) {
  std::vector<std::array<Rgb, 2>> changes(views.size(), {Rgb(0.0f), Rgb(0.0f)});
  for_each_side(objects, [&](const LitSide& side) {
    changes[side.number][side.back] = field.exchanged(views[side.number][side.back]);
  });
  return changes;
}

void add_exchange(const IndirectShadow& field, const VirtualObjects& objects, const ContactViews& views,
                  std::span<const std::array<Rgb, 2>> changes, std::span<TwoSided> radiance) {
  for_each_side(objects, [&](const LitSide& side) {
    const ContactView& view = views[side.number][side.back];
    if (view.share > 0.0f)
      side.add_irradiance(view.share * changes[side.number][side.back], radiance);
    if (view.share < 1.0f) {
      Sh9Rgb change = field.exchanged(side.part, side.position());
      for (Rgb& c : change)
        c *= 1.0f - view.share;
      side.add_coefficients(change, radiance);
    }
  });
}

std::vector<Sh9Rgb> lamp_light(const IndirectShadow& field, const VirtualObjects& objects) {
  constexpr int kSide = 3;
  constexpr double kInset = 0.05; // of the box: floors and walls touch it
  std::vector<Sh9Rgb> light(field.has_lamps() ? objects.senders.surface.positions.size() : 0);
  for (std::size_t k = 0; field.has_lamps() && k < objects.parts.size(); ++k) {
    const auto [first, last] = of_part(objects.parts[k], objects.senders.vertex);
    Bounds box;
    for (std::size_t i = first; i < last; ++i)
      box.include(objects.senders.surface.positions[i]);
    const BoxLattice lattice(box, kSide, kInset);
    std::vector<Sh9Rgb> known(box.empty() ? 0 : lattice.point_count());
    parallel_for(std::size_t{0}, known.size(),
                 [&](std::size_t p) { known[p] = field.lamp_light(k, lattice.position(p)); });
    for (std::size_t i = first; i < last; ++i)
      for (const BoxLattice::Corner& c : lattice.around(objects.senders.surface.positions[i]))
        for (std::size_t m = 0; m < light[i].size(); ++m)
          light[i][m] += c.weight * known[c.point][m];
  }
  return light;
}

void add_change(const VirtualObjects& objects, std::span<const Sh9Rgb> change, std::span<TwoSided> radiance) {
  for_each_side(objects, [&](const LitSide& side) { side.add_coefficients(change[side.number], radiance); });
}

/// What the side hides from itself it does not mirror.
std::vector<std::array<MirroringSide, 2>> mirroring_sides(const IndirectShadow& field, const VirtualObjects& objects,
                                                          std::span<const Sh9Rgb> light, const WindowShares& shares,
                                                          std::span<const TwoSided> of_windows,
                                                          std::span<const TwoSided> of_room) {
  std::vector<std::array<MirroringSide, 2>> sides(light.size());
  for_each_side(objects, [&](const LitSide& side) {
    const std::size_t k = side.number;
    const Rgb& rho = objects.senders.mirrored_reflectance[k];
    if (rho == Rgb(0.0f))
      return;
    MirroringSide& s = sides[k][side.back];
    const auto of = [&](const TwoSided& both) { return side.back ? both.back : both.front; };
    s.as_diffuse = rho / objects.senders.surface.reflectance[k] * (of(of_windows[k]) + of(of_room[k]));
    const Rgb seen = (1.0f - hidden_fraction(side.transfer())) * rho;
    s.of_windows = shares[k][side.back] * rho;
    const Sh9Rgb change = field.feedback(side.part, side.own);
    for (std::size_t i = 0; i < s.sent.size(); ++i)
      s.sent[i] = seen * (light[k][i] + change[i]);
  });
  return sides;
}

void reflect_within(const VirtualObjects& objects, std::span<const TwoSided> direct,
                    std::span<const TwoSided> from_outside, std::span<TwoSided> radiance) {
  for (const VirtualObjects::Part& part : objects.parts) {
    const auto [first, last] = of_part(part, objects.senders.vertex);
    const std::span<const Rgb> reflectance(objects.senders.surface.reflectance);
    part.model->self.reflect(direct.subspan(first, last - first), from_outside.subspan(first, last - first),
                             reflectance.subspan(first, last - first), radiance.subspan(first, last - first));
  }
}

namespace {

/// Of a part whose senders are `first` and the following.
LightInBox light_in_box(const VirtualObjects& objects, std::size_t k, std::size_t first, std::span<const TwoSided> sent,
                        const auto& light_of) {
  const VirtualObjects::Part& part = objects.parts[k];
  const std::vector<std::uint32_t>& own = part.model->senders.vertex;
  const std::vector<TwoSided> within = part.model->self.irradiance(sent);
  const auto position = [&](std::size_t i) { return glm::dvec3(part.mesh().positions[own[i]]); };
  Bounds bounds;
  for (std::size_t i = 0; i < own.size(); ++i)
    bounds.include(position(i));
  LightInBox box(bounds);
  for (std::size_t i = 0; i < own.size(); ++i) {
    const VertexTransfer& t = part.model->transfer[own[i]];
    if (const auto light = light_of(first + i, own[i]))
      box.add(position(i), *light, {within[i], hidden_fraction(t.front), hidden_fraction(t.back)});
  }
  box.turn(part.rotation());
  return box;
}

/// E = pi (the hidden fraction) (the mean radiance there).
TwoSided relight_between(const LightAtPoint& light, const VertexTransfer& transfer, const Rgb& rho) {
  TwoSided radiance = relight_vertex(light.from_room, transfer, rho);
  radiance.front += rho * hidden_fraction(transfer.front) * light.of_object.front;
  radiance.back += rho * hidden_fraction(transfer.back) * light.of_object.back;
  return radiance;
}

/// Of a surface that reflects rho in the place of one that reflects `was`.
TwoSided with_reflectance(const TwoSided& radiance, const Rgb& was, const Rgb& rho) {
  const Rgb factor = rho / glm::max(was, Rgb(1e-30f));
  return {factor * radiance.front, factor * radiance.back};
}

} // namespace

std::vector<std::optional<LightInBox>> light_in_boxes(const VirtualObjects& objects, std::span<const Sh9Rgb> light,
                                                      std::span<const VertexProbes> probes,
                                                      std::span<const TwoSided> sent, const IndirectShadow* field) {
  std::vector<std::optional<LightInBox>> boxes(objects.parts.size());
  const bool exchange = field && field->objects_see_each_other();
  parallel_for(std::size_t{0}, boxes.size(), [&](std::size_t k) {
    const VirtualObjects::Part& part = objects.parts[k];
    const auto [first, last] = of_part(part, objects.senders.vertex);
    if (last - first == part.mesh().positions.size() || !part.shows_diffuse())
      return;
    boxes[k].emplace(light_in_box(objects, k, first, sent.subspan(first, last - first),
                                  [&](std::size_t i, std::uint32_t own) -> std::optional<Sh9Rgb> {
                                    if (probes[i].count == 0)
                                      return std::nullopt;
                                    Sh9Rgb sum = light[i];
                                    const auto add = [&](const Sh9Rgb& change) {
                                      for (std::size_t c = 0; c < sum.size(); ++c)
                                        sum[c] += change[c];
                                    };
                                    if (field)
                                      add(field->feedback(k, own));
                                    if (exchange)
                                      add(field->exchanged(k, objects.senders.surface.positions[i]));
                                    return sum;
                                  }));
  });
  return boxes;
}

/// Senders have it, and those at the foot that of their sender; the others take the light between them. Its product
/// with transfer vectors is the same in every frame: the part's own.
std::vector<TwoSided> reflected_indirect(const VirtualObjects& objects, std::span<const std::uint32_t> vertices,
                                         const ObjectsIndirectLight& light) {
  std::vector<TwoSided> radiance(vertices.size());
  for (std::size_t k = 0; k < objects.parts.size(); ++k) {
    const VirtualObjects::Part& part = objects.parts[k];
    const auto [first, last] = of_part(part, vertices);
    parallel_for(tbb::blocked_range<std::size_t>(first, last, 512), [&](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        const std::size_t own = vertices[i] - part.first_vertex;
        const std::uint32_t sender = part.sender[own];
        const Rgb& rho = objects.surface.reflectance[vertices[i]];
        if (objects.senders.vertex[sender] == vertices[i])
          radiance[i] = light.radiance[sender];
        else if (part.model->senders.at_foot[own])
          radiance[i] = with_reflectance(light.radiance[sender], objects.senders.surface.reflectance[sender], rho);
        else if (light.in_box[k]) // else nothing shows it: what mirrors is black without its reflections
          radiance[i] = relight_between(light.in_box[k]->at(glm::dvec3(part.mesh().positions[own])),
                                        part.model->transfer[own], rho);
      }
    });
  }
  return radiance;
}

/// All points that need the window integral are gathered first, and integrated together.
std::vector<VertexLight> light_vertices(const VirtualObjects& objects, std::span<const std::uint32_t> vertices,
                                        std::span<const TwoSided> indirect, std::span<const SkyMap> pyramid,
                                        std::span<const ApertureCell> cells) {
  const ObjectSurface& surface = objects.surface;
  std::vector<glm::dvec3> points;
  std::vector<glm::vec3> normals;
  std::vector<Rgb*> results;
  std::vector<VertexLight> light(vertices.size());
  const auto add = [&](std::uint32_t vertex, float side, Rgb& result) {
    points.push_back(surface.positions[vertex]);
    normals.push_back(side * surface.normals[vertex]);
    results.push_back(&result);
  };
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const std::uint32_t v = vertices[i];
    const Rgb per_reflectance = surface.drawn_reflectance[v] / glm::max(surface.reflectance[v], Rgb(1e-30f));
    light[i].indirect_front = per_reflectance * indirect[i].front;
    light[i].indirect_back = per_reflectance * indirect[i].back;
    add(v, 1.0f, light[i].open_sky_front);
    if (objects.has_back[v])
      add(v, -1.0f, light[i].open_sky_back);
  }
  const std::vector<Rgb> open = open_sky_irradiance(pyramid, cells, points, normals);
  for (std::size_t k = 0; k < open.size(); ++k)
    *results[k] = open[k];
  return light;
}

} // namespace daylit
