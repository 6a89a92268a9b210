// Unshadowed sky irradiance of many points at once: the fast twin of the one-point function.

#include <algorithm>
#include <vector>

#include "runtime/sky/direct_light.h"
#include "runtime/sky/open_sky_kernels.h"
#include "runtime/sky/open_sky_lattice.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

using namespace open_sky;

/// Points relative to an origin, and where their result goes.
struct Batch {
  std::span<const SkyMap> pyramid;
  std::span<const ApertureCell> cells;
  glm::dvec3 origin{0.0};
  std::vector<glm::vec3> points;
  std::span<const glm::vec3> normals;
  std::vector<Rgb> irradiance;
};

/// E = sum over the cells of weight x transmittance x L, the sky looked up for each of the sixteen points. Close cells
/// one by one.
void gather(Batch& batch, std::size_t first) {
  const std::size_t count = std::min<std::size_t>(kLanes, batch.points.size() - first);
  Receivers receivers;
  for (std::size_t k = 0; k < kLanes; ++k) {
    const std::size_t i = first + std::min(k, count - 1);
    receivers.set(static_cast<int>(k), batch.points[i], batch.normals[i]);
  }
  CellView view;
  for (const ApertureCell& cell : batch.cells) {
    const SkyMap& map = batch.pyramid[cell.level];
    view_cell(CellConstants(cell, map, batch.origin), receivers, view);
    const auto close = static_cast<float>(close2(cell));
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = first + k;
      if (view.distance2[k] < close)
        batch.irradiance[i] += irradiance_through(cell, batch.pyramid, batch.origin + glm::dvec3(batch.points[i]),
                                                  glm::dvec3(batch.normals[i]));
      else if (view.weight[k] > 0.0f)
        batch.irradiance[i] += view.weight[k] * cell.transmittance * interpolate(map, view.u[k], view.v[k]);
    }
  }
}

/// The same of the points of one box, which `order` lists; L is trilinear in the box.
void gather_box(Batch& batch, std::span<const CellConstants> cells, const Lattice& lattice, int box,
                std::span<const std::uint32_t> order) {
  thread_local std::vector<BoxRadiance> radiance; // keeps its memory
  lattice.box_radiance(box, radiance);
  for (std::size_t first = 0; first < order.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, order.size() - first);
    BoxPoints points;
    for (std::size_t k = 0; k < kLanes; ++k) {
      const std::uint32_t i = order[first + std::min(k, count - 1)];
      const glm::vec3 local = lattice.in_box(box, batch.points[i]);
      points.receivers.set(static_cast<int>(k), batch.points[i], batch.normals[i]);
      points.x[k] = local.x, points.y[k] = local.y, points.z[k] = local.z;
    }
    alignas(64) float sum[3][kLanes] = {};
    for (std::size_t c = 0; c < cells.size(); ++c)
      add_cell(cells[c], radiance[c], points, sum);
    for (std::size_t k = 0; k < count; ++k)
      batch.irradiance[order[first + k]] = Rgb(sum[0][k], sum[1][k], sum[2][k]);
  }
}

/// The points are sorted by box (a counting sort), so that each box makes its polynomials once.
void gather_in_boxes(Batch& batch, const Lattice& lattice) {
  std::vector<CellConstants> constants;
  for (const ApertureCell& cell : batch.cells)
    constants.emplace_back(cell, batch.pyramid[cell.level], batch.origin);
  const std::size_t boxes = static_cast<std::size_t>(lattice.box_count()), count = batch.points.size();
  std::vector<std::uint32_t> box_of(count), first(boxes + 1, 0), order(count); // points sorted by box
  for (std::size_t i = 0; i < count; ++i) {
    box_of[i] = static_cast<std::uint32_t>(lattice.box_of(batch.points[i]));
    ++first[box_of[i] + 1];
  }
  for (std::size_t b = 0; b < boxes; ++b)
    first[b + 1] += first[b];
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < count; ++i)
    order[next[box_of[i]]++] = static_cast<std::uint32_t>(i);
  parallel_for(tbb::blocked_range<std::size_t>(0, boxes), [&](const auto& range) {
    for (std::size_t b = range.begin(); b != range.end(); ++b)
      if (first[b] < first[b + 1])
        gather_box(batch, constants, lattice, static_cast<int>(b), {&order[first[b]], first[b + 1] - first[b]});
  });
}

} // namespace

/// Positions are taken relative to a window: metres in single precision are then exact to 1e-6 of the room.
std::vector<Rgb> open_sky_irradiance(std::span<const SkyMap> pyramid, std::span<const ApertureCell> cells,
                                     std::span<const glm::dvec3> x, std::span<const glm::vec3> n) {
  if (cells.empty() || x.empty())
    return std::vector<Rgb>(x.size(), Rgb(0.0f));
  Batch batch{pyramid, cells, cells[0].centre, {}, n, std::vector<Rgb>(x.size(), Rgb(0.0f))};
  for (const glm::dvec3& p : x)
    batch.points.emplace_back(p - batch.origin);
  if (x.size() <= kLanes)
    gather(batch, 0);
  else if (const auto lattice = Lattice::around(batch.points, pyramid, cells, batch.origin))
    gather_in_boxes(batch, *lattice);
  else
    parallel_for(tbb::blocked_range<std::size_t>(0, (x.size() + kLanes - 1) / kLanes, 4), [&](const auto& range) {
      for (std::size_t b = range.begin(); b != range.end(); ++b)
        gather(batch, b * kLanes);
    });
  return std::move(batch.irradiance);
}

} // namespace daylit
