#include "radiosity/first_bounce.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "radiosity/detail/aperture_light.h"
#include "radiosity/detail/sampling.h"
#include "scene/core/parallel_stage.h"
#include "scene/core/seconds.h"
#include "scene/room/glass.h"

namespace daylit::radiosity {

namespace {

constexpr std::uint32_t kScoutRays = 64;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Rays start this part of the way to the middle: closer to a wall than their first gap they would pass through it.
constexpr double kOffEdges = 1e-3;

/// The ray from a point of the patch meets neither surface nor opening.
bool sees_open_sky(DirectLight& task, const Patch& e, const glm::dvec2& on_patch, const glm::dvec3& d) {
  const glm::dvec3 middle = (e.corner[0] + e.corner[1] + e.corner[2]) / 3.0,
                   from = glm::mix(on_triangle(e.corner, on_patch), middle, kOffEdges);
  return task.escapes(from, d) && task.crossings.met(from + task.mesh.origin, d, kInfinity).count == 0;
}

/// Escapes through no listed aperture: outside surfaces, and gaps whose outline nobody knows. A few rays of density
/// cos / pi tell whether there are any; then every direction of the sky has one, dw (n . w) of it where it is free.
void receive_open_sky(DirectLight& task, std::size_t index, Received& out) {
  const Patch& e = task.set.patches[index];
  const std::uint64_t seed = mix_bits(index + 0x5555555555ull);
  bool open = false;
  for (std::uint32_t k = 0; k < kScoutRays && !open; ++k)
    open = sees_open_sky(task, e, r2_point(k, random_shift(seed)),
                         cosine_direction(e.normal, r2_point(k, random_shift(seed + 77))));
  task.rays.fetch_add(kScoutRays, std::memory_order_relaxed);
  if (!open)
    return;
  task.open_sky.fetch_add(1, std::memory_order_relaxed);
  const SkyDirections& sky = task.wide.sky;
  for (std::uint32_t k = 0; k < sky.w.size(); ++k) {
    const double projected = sky.solid_angle_sr[k] * glm::dot(sky.w[k], e.normal);
    if (projected <= 0.0 || !sees_open_sky(task, e, r2_point(k, random_shift(seed)), sky.w[k]))
      continue;
    out.region[static_cast<std::size_t>(sky.region[k])] += glm::dvec3(projected);
    out.opening += projected / std::numbers::pi;
  }
  task.rays.fetch_add(sky.w.size() / 2, std::memory_order_relaxed);
}

/// Only the regions that give light.
FirstBounceRow squeeze(const Received& received) {
  FirstBounceRow row;
  const auto lit =
      received.region.size() - static_cast<std::size_t>(std::ranges::count(received.region, glm::dvec3(0.0)));
  row.region.reserve(lit); // there are as many rows as elements: no byte more than needed
  row.irradiance.reserve(lit);
  for (std::size_t i = 0; i < received.region.size(); ++i)
    if (received.region[i] != glm::dvec3(0.0)) {
      row.region.push_back(static_cast<std::int32_t>(i));
      row.irradiance.emplace_back(received.region[i]);
    }
  row.opening = static_cast<float>(received.opening);
  return row;
}

/// Keeps the columns in which any patch receives light, and one channel where all panes are colourless.
FirstBounce compact(const std::vector<FirstBounceRow>& rows, int regions) {
  std::vector<std::int32_t> column(regions, -1);
  FirstBounce result;
  result.channels = 1;
  for (const FirstBounceRow& row : rows)
    for (std::size_t k = 0; k < row.region.size(); ++k) {
      column[row.region[k]] = 0;
      if (row.irradiance[k] != Rgb(row.irradiance[k].r))
        result.channels = 3;
    }
  for (int i = 0; i < regions; ++i)
    if (column[i] == 0) {
      column[i] = static_cast<std::int32_t>(result.region.size());
      result.region.push_back(i);
    }
  result.patches = rows.size();
  result.irradiance.assign(rows.size() * static_cast<std::size_t>(result.channels) * result.columns(), 0.0f);
  result.opening.resize(rows.size());
  for (std::size_t e = 0; e < rows.size(); ++e) {
    result.opening[e] = rows[e].opening;
    for (int c = 0; c < result.channels; ++c)
      for (std::size_t k = 0; k < rows[e].region.size(); ++k)
        result.row(e, c)[column[rows[e].region[k]]] = rows[e].irradiance[k][c];
  }
  return result;
}

} // namespace

Result<std::vector<FirstBounceRow>> first_bounce_rows(const PatchSet& set, const SurfaceMesh& mesh,
                                                      const RayScene& scene, const std::vector<Aperture>& apertures,
                                                      const SkyPartition& partition, const Progress& progress,
                                                      FirstBounceReport* report, const FirstBounceOptions& options) {
  const double start = wall_seconds();
  DirectLight task(set, mesh, scene, apertures, partition, options);
  std::vector<FirstBounceRow> rows(set.patches.size());
  const Result<void> done = parallel_stage("first bounce", set.patches.size(), 64, progress, [&](std::size_t i) {
    Received received{std::vector<glm::dvec3>(partition.size(), glm::dvec3(0.0)), 0.0};
    for (std::size_t p = 0; p < task.parts.size(); ++p)
      receive_through(task, i, p, received);
    receive_open_sky(task, i, received);
    rows[i] = squeeze(received);
  });
  if (!done)
    return done.error();
  if (report)
    *report = {.rays = task.rays,
               .clear_pairs = task.clear,
               .sampled_pairs = task.sampled,
               .open_sky_patches = task.open_sky,
               .seconds = wall_seconds() - start};
  return rows;
}

Result<FirstBounce> first_bounce(const PatchSet& set, const SurfaceMesh& mesh, const RayScene& scene,
                                 const std::vector<Aperture>& apertures, const SkyPartition& partition,
                                 const Progress& progress, FirstBounceReport* report,
                                 const FirstBounceOptions& options) {
  const auto rows = first_bounce_rows(set, mesh, scene, apertures, partition, progress, report, options);
  if (!rows)
    return rows.error();
  FirstBounce result = compact(*rows, partition.size());
  if (report)
    report->regions_skipped = partition.size() - static_cast<int>(result.columns());
  return result;
}

} // namespace daylit::radiosity
