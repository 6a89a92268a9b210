#include <algorithm>
#include <numbers>

#include "precompute/detail/bake_stage.h"
#include "precompute/detail/more_rays.h"
#include "scene/core/parallel.h"
#include "scene/volume/first_reflection.h"

namespace daylit::precompute::detail {

namespace {

constexpr int kHeldOutRays = 4; ///< times those of a probe

/// Which points stand for some probes (increasing, as the points' own).
std::vector<std::uint32_t> points_of(const ProbePoints& points, const std::vector<std::size_t>& probes) {
  std::vector<std::uint32_t> list;
  for (std::uint32_t p = 0; p < points.probe.size(); ++p)
    if (std::ranges::binary_search(probes, points.probe[p]))
      list.push_back(p);
  return list;
}

/// Probe values of some points, [point][lm][column].
Result<std::vector<float>> fitted_coefficients(const Stage& s, const std::vector<std::uint32_t>& some,
                                               const radiosity::Radiosity& radiosity) {
  const std::vector<std::uint32_t> needed = s.fit.needed(some);
  std::vector<std::size_t> positions;
  for (const std::uint32_t point : needed)
    positions.push_back(s.points.position[point]);
  const auto values = radiosity::gather_coefficients(s.hits, positions, radiosity, s.progress);
  if (!values)
    return values.error();
  const std::size_t count = 9 * radiosity.columns;
  const auto copy = [&](std::uint32_t point, float* to) {
    const auto at = std::ranges::lower_bound(needed, point) - needed.begin();
    std::copy_n(values->data() + static_cast<std::size_t>(at) * count, count, to);
  };
  std::vector<float> fitted(some.size() * count);
  s.fit.apply(some, count, copy, fitted.data());
  return fitted;
}

/// What the audit's points see, by more rays than a probe has.
Result<radiosity::GatherHits> seen_from_points(const Stage& s, const Audit& audit) {
  std::vector<glm::dvec3> points = audit.points();
  for (glm::dvec3& p : points)
    p -= s.problem.mesh.origin;
  const int rays = kHeldOutRays * s.options.gather_rays;
  auto seen = radiosity::gather_hits(points, s.elements.patches, s.elements.mesh, s.elements.rays,
                                     {.rays = rays, .group = s.elements.parent, .faces = &s.faces}, s.progress);
  if (!seen)
    return seen.error();
  if (const Result<void> aimed = seen->aim_at(s.problem.holes, s.white, s.progress); !aimed)
    return aimed.error();
  if (const Result<void> more = seen->add_rays(more_rays(*seen, points, s.white, rays), s.progress); !more)
    return more.error();
  return seen;
}

/// Light of the elements under the audit's skies: straight from the sky, and radiosity.
struct HeldOutLight {
  radiosity::FirstBounce direct;
  radiosity::Radiosity radiosity;
};

/// What the light of each element counts at a room's points by its first reflection: the rays that meet it, times its
/// reflectance (green, as the light of suns() is).
std::vector<double> weight_in(const radiosity::PatchSet& elements, const radiosity::GatherHits& seen,
                              const std::array<std::size_t, 2>& points) {
  std::vector<std::uint64_t> rays(seen.patches(), 0);
  parallel_for(points[0], points[1], [&](std::size_t p) { seen.count_rays(p, rays); });
  std::vector<double> weight;
  for (std::size_t e = 0; e < rays.size(); ++e)
    weight.push_back(static_cast<double>(rays[e]) * static_cast<double>(elements.patches[e].reflectance.g));
  return weight;
}

Result<HeldOutLight> held_out_light(const Stage& s, const radiosity::GatherHits& seen, Audit& audit) {
  const LightElements& elements = s.elements;
  const auto light =
      radiosity::first_bounce_rows(elements.patches, elements.mesh, elements.rays, s.problem.apertures.list,
                                   held_out_partition(), s.progress, nullptr, {s.options.directions});
  if (!light)
    return light.error();
  std::vector<std::vector<double>> in_room;
  for (std::size_t r = 0; r < audit.rooms(); ++r)
    in_room.push_back(weight_in(elements.patches, seen, audit.range_of_room(r)));
  radiosity::FirstBounce direct = audit.direct_light(*light, elements.patches, in_room);
  const radiosity::FirstBounce of_parents = elements.of_parents(direct);
  const auto solved = radiosity::solve_radiosity(s.problem.patches, s.exchange, of_parents,
                                                 {.tolerance = s.options.tolerance}, s.progress);
  if (!solved)
    return solved.error();
  radiosity::Radiosity sent = elements.radiosity_of(*solved, of_parents, direct);
  return HeldOutLight{std::move(direct), std::move(sent)};
}

/// What the sources of the volume send back of the direct light: reflectance E / pi, [sky][source].
std::vector<Rgb> first_reflection(const radiosity::FirstBounce& direct, std::span<const std::uint32_t> source,
                                  const SourceElements& elements) {
  std::vector<Rgb> radiance;
  for (std::size_t sky = 0; sky < direct.columns(); ++sky)
    for (std::size_t i = 0; i < source.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        if (c == 0)
          radiance.emplace_back(0.0f);
        radiance.back()[c] = elements.reflectance[i][c] * direct.row(source[i], std::min(c, direct.channels - 1))[sky] /
                             std::numbers::pi_v<float>;
      }
  return radiance;
}

} // namespace

/// The same transport with other right-hand sides (held-out skies) and other receivers (held-out points), judged
/// against what the volume gives there.
Result<AuditReport> audit_bake(const Stage& s, const Room& room, const BasisVolume& volume,
                               std::span<const std::uint32_t> source) {
  Result<Audit> audit = Audit::prepare(room, s.problem.apertures.list, volume.probes, s.options.held_out,
                                       s.options.held_out_standing, s.options.held_out_rooms);
  if (!audit)
    return audit.error();
  const auto seen = seen_from_points(s, *audit);
  if (!seen)
    return seen.error();
  const auto light = held_out_light(s, *seen, *audit);
  if (!light)
    return light.error();
  const auto at_points = radiosity::gather_coefficients(*seen, light->radiosity, s.progress);
  if (!at_points)
    return at_points.error();
  const auto band4 = radiosity::gather_coefficients(*seen, light->radiosity, s.progress, radiosity::Bands::fourth);
  if (!band4)
    return band4.error();
  const auto axes = radiosity::gather_coefficients(*seen, light->radiosity, s.progress, radiosity::Bands::axes);
  if (!axes)
    return axes.error();
  const std::vector<std::uint32_t> some = points_of(s.points, audit->probes());
  const auto at_probes = fitted_coefficients(s, some, light->radiosity);
  if (!at_probes)
    return at_probes.error();
  std::vector<std::size_t> probes;
  for (const std::uint32_t point : some)
    probes.push_back(s.points.probe[point]);
  const auto rays = RayScene::build(room);
  if (!rays)
    return rays.error();
  const std::optional<FirstReflection> surfaces = FirstReflection::make(volume, *rays);
  const std::vector<Rgb> sent =
      surfaces ? first_reflection(light->direct, source, volume.elements) : std::vector<Rgb>{};
  AuditReport report =
      audit->judge(volume, {*at_points, *band4, *axes, *at_probes, probes}, {surfaces ? &*surfaces : nullptr, sent});
  s.clock.finish("audit");
  return report;
}

} // namespace daylit::precompute::detail
