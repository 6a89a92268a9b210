#include "precompute/adaptive_sky.h"

#include <algorithm>
#include <charconv>
#include <queue>
#include <string_view>
#include <utility>

#include "precompute/detail/transport_problem.h"
#include "precompute/held_out.h"
#include "precompute/room_frame.h"
#include "radiosity/coefficients.h"

namespace daylit::precompute {

namespace {

constexpr int kBands = 64, kCells = 128, kFewest = 16;
constexpr int kFacets = 640, kGatherRays = 1024;
constexpr double kVisibilityRays = 16384;
constexpr std::size_t kPoints = 48;
constexpr double kClearance = 0.04; ///< of the room's longest side
constexpr std::string_view kKind = "adaptive:";

struct Cut {
  double gain = 0;
  SkyRectangle low, high;
};

/// A rectangle and the best cut through it.
struct Part {
  SkyRectangle whole;
  Cut best;
  /// A sky that varies slowly differs more between the halves of a large rectangle: its solid angle counts too.
  double urgency() const { return best.gain * whole.bands * whole.cells; }
  bool operator<(const Part& other) const { return urgency() < other.urgency(); }
};

/// Judges cuts of a rectangle of cells by the responses on both sides.
class Cutter {
public:
  Cutter(std::span<const float> response, std::size_t width) : response_(response), width_(width) {}

  /// The rectangle with the best of all cuts along its rows or columns.
  Part part(const SkyRectangle& r) const {
    Part out{r, {}};
    try_cuts(r, true, out.best);
    try_cuts(r, false, out.best);
    return out;
  }

private:
  /// Sum over the cells of one row (or column) of the rectangle.
  void add_line(const SkyRectangle& r, bool rows, int line, std::vector<double>& sum) const {
    for (int k = 0; k < (rows ? r.cells : r.bands); ++k) {
      const int band = r.band + (rows ? line : k), cell = r.cell + (rows ? k : line);
      const float* from = response_.data() + static_cast<std::size_t>(band * kCells + cell) * width_;
      for (std::size_t i = 0; i < width_; ++i)
        sum[i] += static_cast<double>(from[i]);
    }
  }

  /// The squared difference to the mean falls by n1 n2 / n |mean1 - mean2|^2 when n cells are cut into n1 and n2.
  void try_cuts(const SkyRectangle& r, bool rows, Cut& best) const {
    const int lines = rows ? r.bands : r.cells;
    std::vector<double> all(width_, 0.0), low(width_, 0.0);
    for (int line = 0; line < lines; ++line)
      add_line(r, rows, line, all);
    for (int line = 1; line < lines; ++line) {
      add_line(r, rows, line - 1, low);
      const double fraction = static_cast<double>(line) / lines;
      double apart2 = 0;
      for (std::size_t i = 0; i < width_; ++i) {
        const double d = low[i] - fraction * all[i];
        apart2 += d * d;
      }
      const double gain = apart2 / (fraction * (1 - fraction) * r.bands * r.cells);
      if (gain <= best.gain)
        continue;
      best = {gain, r, r};
      (rows ? best.low.bands : best.low.cells) = line;
      (rows ? best.high.bands : best.high.cells) -= line;
      (rows ? best.high.band : best.high.cell) += line;
    }
  }

  std::span<const float> response_;
  std::size_t width_;
};

/// Coefficients at points in the air for radiance 1 in each cell, [cell][width], of a coarse bake: adjoint solves,
/// since the points are few and the cells many.
Result<std::vector<float>> responses(const RoomFile& file, const Progress& progress, std::size_t& width) {
  std::size_t collapsed = 0;
  const Room room = room_in_frame(file.room, RoomFrame::of(file.room), collapsed);
  BakeOptions options;
  options.target_facets = kFacets;
  const glm::dvec3 size = room.bounds().size();
  options.points = spread_points(room, room.bounds(), kPoints, kClearance * std::max({size.x, size.y, size.z}));
  options.grid = glm::ivec3(4); // where the room is too narrow for these
  BakeReport report;
  detail::StageClock clock(report);
  const auto problem = detail::set_up(room, options, report, clock);
  if (!problem)
    return problem.error();
  const SkyPartition cells = adaptive_cells();
  const auto light = radiosity::first_bounce(problem->patches, problem->mesh, problem->facet_rays,
                                             problem->apertures.list, cells, progress);
  if (!light)
    return light.error();
  const auto exchange = radiosity::exchange_areas(problem->patches, problem->mesh, room, problem->room_scene,
                                                  {.visibility_rays = kVisibilityRays, .skip_black = true}, progress);
  if (!exchange)
    return exchange.error();
  const detail::ProbePoints points(problem->probes, problem->mesh.origin);
  const auto hits = radiosity::gather_hits(points.at, problem->patches, problem->mesh, problem->facet_rays,
                                           {.rays = kGatherRays}, progress);
  if (!hits)
    return hits.error();
  const auto got = radiosity::adjoint_coefficients(*hits, problem->patches, *exchange, *light, {}, progress);
  if (!got)
    return got.error();
  width = 27 * points.at.size();
  const std::size_t columns = light->columns();
  std::vector<float> out(static_cast<std::size_t>(cells.size()) * width, 0.0f);
  for (std::size_t k = 0; k < columns; ++k)
    for (std::size_t i = 0; i < width; ++i)
      out[static_cast<std::size_t>(light->region[k]) * width + i] = (*got)[i * columns + k];
  return out;
}

} // namespace

/// N of "adaptive:N"; 0 where N is no number.
std::optional<int> adaptive_regions(const std::string& text) {
  if (!text.starts_with(kKind))
    return std::nullopt;
  int n = 0;
  const char* end = text.data() + text.size();
  const auto [stop, code] = std::from_chars(text.data() + kKind.size(), end, n);
  return code == std::errc() && stop == end ? n : 0;
}

/// Cells of equal solid angle: equal steps in sin(altitude) and in azimuth.
SkyPartition adaptive_cells() {
  std::vector<SkyBand> bands;
  for (int b = 0; b < kBands; ++b)
    bands.push_back({2.0 * b / kBands - 1.0, 2.0 * (b + 1) / kBands - 1.0, kCells, b * kCells, false});
  return *SkyPartition::from_bands(std::move(bands), "cells");
}

/// Greedy: the rectangle whose best cut gains most, weighted by its size, is cut next.
Result<SkyPartition> cut_where_it_changes(std::span<const float> response, std::size_t width, int regions) {
  const Cutter cutter(response, width);
  std::priority_queue<Part> open;
  open.push(cutter.part({0, 0, kBands / 2, kCells}));
  open.push(cutter.part({kBands / 2, 0, kBands / 2, kCells}));
  while (static_cast<int>(open.size()) < regions && open.top().best.gain > 0) {
    const Cut cut = open.top().best;
    open.pop();
    open.push(cutter.part(cut.low));
    open.push(cutter.part(cut.high));
  }
  std::vector<SkyRectangle> rectangles;
  for (; !open.empty(); open.pop())
    rectangles.push_back(open.top().whole);
  std::ranges::sort(rectangles, {}, [](const SkyRectangle& r) { return std::pair(r.band, r.cell); });
  return SkyPartition::from_rectangles(adaptive_cells().bands(), std::move(rectangles),
                                       std::string(kKind) + std::to_string(regions));
}

/// Refuses what neither this file nor SkyPartition::parse() reads.
Result<void> check_regions(const std::string& regions) {
  const std::optional<int> n = adaptive_regions(regions);
  if (n && (*n < kFewest || *n > kBands * kCells))
    return Error{ErrorCode::usage, "the number of regions must be in 16..8192", regions.substr(0, 60),
                 "use adaptive:256"};
  if (n)
    return {};
  const auto partition = SkyPartition::parse(regions);
  return partition ? Result<void>{} : partition.error();
}

/// A named partition, or one cut for the room after a coarse bake.
Result<SkyPartition> sky_for(const RoomFile& room, const std::string& regions, const Progress& progress) {
  if (const Result<void> good = check_regions(regions); !good)
    return good.error();
  const std::optional<int> n = adaptive_regions(regions);
  if (!n)
    return SkyPartition::parse(regions);
  std::size_t width = 0;
  const auto response = responses(room, progress, width);
  return response ? cut_where_it_changes(*response, width, *n) : Result<SkyPartition>(response.error());
}

} // namespace daylit::precompute
