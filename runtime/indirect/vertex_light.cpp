#include "runtime/indirect/vertex_light.h"

#include <algorithm>
#include <map>
#include <numbers>

#include "runtime/base/cell_key.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

/// From the first of ascending vertices that belong to a part to the last.
struct Range {
  std::size_t first = 0, last = 0;
};
Range of_part(const VirtualObjects::Part& part, std::span<const std::uint32_t> vertices) {
  const auto place = [&](std::size_t vertex) {
    return static_cast<std::size_t>(std::ranges::lower_bound(vertices, vertex) - vertices.begin());
  };
  return {place(part.first_vertex), place(part.first_vertex + part.mesh().positions.size())};
}

constexpr float kLeastHidden = 0.1f; // from there on it counts in which directions the object hides itself
constexpr float kMostHidden = 0.98f; // from there on nothing is seen
constexpr double kWindowCell = 0.1;  // of an object's radius: a cube of that side sees windows alike

/// One side of a vertex that sends light.
struct LitSide {
  const VirtualObjects& objects;
  const glm::mat3& rotation; ///< of its part
  std::size_t part;
  std::size_t own;     ///< its number in the mesh
  std::size_t number;  ///< among all senders
  std::size_t in_part; ///< among those of its part
  bool back;

  const TransferVector& transfer() const {
    const VertexTransfer& t = objects.senders.transfer[number];
    return back ? t.back : t.front;
  }
  const glm::dvec3& position() const { return objects.senders.surface.positions[number]; }
  SenderSide seen() const {
    const VirtualObjects::Part& p = objects.parts[part];
    const glm::vec3& n = p.mesh().normals[own];
    return {&p.model->self.visibility(), in_part, back, rotation * VertexRays::frame(back ? -n : n)};
  }
  Rgb& of(std::span<TwoSided> radiance) const { return back ? radiance[number].back : radiance[number].front; }
  /// L += rho / pi Delta E, never below zero.
  void add_irradiance(const Rgb& change, std::span<TwoSided> radiance) const {
    const Rgb rho_over_pi = objects.senders.surface.reflectance[number] * std::numbers::inv_pi_v<float>;
    of(radiance) = glm::max(of(radiance) + rho_over_pi * change, Rgb(0.0f));
  }
  /// L += rho / pi sum_lm dL_lm C_lm, never below zero.
  void add_coefficients(const Sh9Rgb& change, std::span<TwoSided> radiance) const {
    of(radiance) = add_reflected(of(radiance), change, transfer(), objects.senders.surface.reflectance[number]);
  }
};

/// work(side) for each side that light reaches.
template <class Work>
void for_each_side(const VirtualObjects& objects, const Work& work) {
  const std::vector<std::uint32_t>& vertex = objects.senders.vertex;
  for (std::size_t k = 0; k < objects.parts.size(); ++k) {
    const VirtualObjects::Part& part = objects.parts[k];
    const glm::mat3 rotation = part.rotation();
    const auto [first, last] = of_part(part, vertex);
    parallel_for(tbb::blocked_range<std::size_t>(first, last, 64), [&, begin = first](const auto& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i)
        for (const bool back : {false, true})
          if (!back || objects.has_back[vertex[i]])
            work(LitSide{objects, rotation, k, vertex[i] - part.first_vertex, i, i - begin, back});
    });
  }
}

} // namespace

void add_sunlit_correction(const IndirectShadow& field, const VirtualObjects& objects, std::span<TwoSided> radiance) {
  for_each_side(objects, [&](const LitSide& side) {
    side.add_irradiance(field.sunlit_correction(side.part, side.position(), side.seen(), side.transfer()), radiance);
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

ContactViews contact_views(const IndirectShadow& field, const VirtualObjects& objects) {
  if (!field.objects_see_each_other())
    return {};
  ContactViews views(objects.senders.vertex.size());
  for_each_side(objects, [&](const LitSide& side) {
    views[side.number][side.back] = field.contact_view(side.part, side.position(), side.seen());
  });
  return views;
}

namespace {

/// What of the windows is seen from cubes of space around the senders.
struct WindowCells {
  using SeenPoints = WindowVisibility::SeenPoints;
  std::vector<std::uint32_t> of;               ///< per sender
  std::vector<SeenPoints> past_room, past_all; ///< past_all: past other objects, too; empty where these are far away
};

/// Of those in one cube from the first of them. What lies on a surface looks from above it.
WindowCells window_cells(const IndirectShadow& field, const VirtualObjects& objects) {
  WindowCells cells;
  cells.of.resize(objects.senders.vertex.size());
  std::vector<glm::dvec3> eye;
  std::vector<std::size_t> part_of;
  for (std::size_t k = 0; k < objects.parts.size(); ++k) {
    std::map<CellKey, std::uint32_t> known;
    const auto [first, last] = of_part(objects.parts[k], objects.senders.vertex);
    const double side = std::max(kWindowCell * objects.parts[k].sphere.radius, 1e-6);
    for (std::size_t i = first; i < last; ++i) {
      const glm::dvec3& x = objects.senders.surface.positions[i];
      const auto [found, made] = known.emplace(CellKey(x, side), static_cast<std::uint32_t>(eye.size()));
      if (made)
        eye.push_back(x + kAirGap_m * (glm::dvec3(objects.senders.surface.normals[i]) + glm::dvec3(0.0, 0.0, 2.0)));
      cells.of[i] = found->second;
    }
    part_of.resize(eye.size(), k);
  }
  cells.past_room.resize(eye.size());
  cells.past_all.resize(field.objects_see_each_other() ? eye.size() : 0);
  parallel_for(std::size_t{0}, eye.size(), [&](std::size_t k) {
    cells.past_room[k] = field.windows().seen_points(eye[k]);
    if (!cells.past_all.empty())
      cells.past_all[k] = field.not_hidden(part_of[k], eye[k], cells.past_room[k]);
  });
  return cells;
}

} // namespace

/// Nearer to another object than its views tell, what this hides is wanted of each vertex.
WindowShares window_shares(const IndirectShadow& field, const VirtualObjects& objects, const ContactViews& views) {
  const WindowCells cells = window_cells(field, objects);
  WindowShares shares(cells.of.size());
  for_each_side(objects, [&](const LitSide& side) {
    const glm::dvec3& x = side.position();
    const glm::dvec3 n = (side.back ? -1.0 : 1.0) * glm::dvec3(objects.senders.surface.normals[side.number]);
    const auto seen = [&](const std::vector<WindowVisibility::SeenPoints>& from) {
      return field.windows().visible_fraction(x, n, from[cells.of[side.number]]);
    };
    float& share = shares[side.number][side.back];
    if (views.empty()) {
      share = seen(cells.past_room);
      return;
    }
    const ContactView& view = views[side.number][side.back];
    share = view.share < 1.0f ? (1.0f - view.share) * seen(cells.past_all) : 0.0f;
    if (view.share > 0.0f)
      share += view.share * std::max(seen(cells.past_room) - view.blocked, 0.0f);
  });
  return shares;
}

void shade_direct(const VirtualObjects& objects, const WindowShares& shares, std::span<TwoSided> direct) {
  for_each_side(objects, [&](const LitSide& side) { side.of(direct) *= shares[side.number][side.back]; });
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
    s.of_windows = shares[k][side.back] * seen;
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
