#include "radiosity/gather.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include <cblas.h>
#include <glm/geometric.hpp>

#include "radiosity/detail/sampling.h"
#include "scene/core/parallel.h"
#include "sh/band4.h"
#include "sh/sh9.h"

namespace daylit::radiosity {

namespace {

constexpr std::size_t kChunk = 32; ///< points per dense product
constexpr double kOwnRays = 4;     ///< that a member of a group is expected to meet, to count by itself

/// Cosine and sine of the angle by which a point's rays are turned about z.
glm::vec2 turn_of(std::size_t point) {
  const double angle = 2.0 * std::numbers::pi * random_shift(point).y;
  return {std::cos(angle), std::sin(angle)};
}

glm::vec3 turned(const glm::vec3& d, const glm::vec2& turn) {
  return {d.x * turn.x - d.y * turn.y, d.x * turn.y + d.y * turn.x, d.z};
}

/// Place on a Z curve over the octahedral map of the sphere: neighbours in it are neighbours in direction.
std::uint32_t place_on_curve(const glm::vec3& d) {
  glm::vec2 p = glm::vec2(d) / (std::abs(d.x) + std::abs(d.y) + std::abs(d.z));
  if (d.z < 0.0f)
    p = (1.0f - glm::vec2(std::abs(p.y), std::abs(p.x))) *
        glm::vec2(std::copysign(1.0f, p.x), std::copysign(1.0f, p.y));
  const auto cell = [](float x) {
    return static_cast<std::uint32_t>(std::clamp(0.5f * x + 0.5f, 0.0f, 1.0f) * 1023.0f);
  };
  const std::uint32_t x = cell(p.x), y = cell(p.y);
  std::uint32_t code = 0;
  for (std::uint32_t bit = 0; bit < 10; ++bit)
    code |= (x >> bit & 1u) << (2 * bit) | (y >> bit & 1u) << (2 * bit + 1);
  return code;
}

/// sum[piece][16] += harmonics of the rays that meet one of its patches. Plain loops that become vectors of any width.
__attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4"))) void
add_harmonics(const std::int32_t* met, const std::uint32_t* piece, const float* harmonics, std::size_t rays,
              float* sum) {
  for (std::size_t k = 0; k < rays; ++k) {
    if (met[k] < 0)
      continue;
    float* to = sum + static_cast<std::size_t>(piece[met[k]]) * RayFan::kStride;
    for (std::size_t l = 0; l < RayFan::kStride; ++l)
      to[l] += harmonics[k * RayFan::kStride + l];
  }
}

/// Nine sums of harmonics of directions, as if these had been turned about z: m and -m are cosine and sine of m times
/// the azimuth.
void turn_harmonics(const float* from, const glm::vec2& turn, std::size_t stride, Bands bands, float* to) {
  const float c1 = turn.x, s1 = turn.y, c2 = c1 * c1 - s1 * s1, s2 = 2.0f * c1 * s1;
  const auto pair = [&](std::size_t sine, std::size_t cosine, float c, float s) {
    to[sine * stride] = from[sine] * c + from[cosine] * s;
    to[cosine * stride] = from[cosine] * c - from[sine] * s;
  };
  if (bands == Bands::fourth) {
    to[4 * stride] = from[4];
    pair(3, 5, c1, s1);
    pair(2, 6, c2, s2);
    pair(1, 7, c2 * c1 - s2 * s1, s2 * c1 + c2 * s1);
    pair(0, 8, c2 * c2 - s2 * s2, 2.0f * c2 * s2);
    return;
  }
  to[0] = from[0];
  to[2 * stride] = from[2];
  to[6 * stride] = from[6];
  pair(1, 3, c1, s1);
  pair(5, 7, c1, s1);
  pair(4, 8, c2, s2);
}

/// Nine rows of weights for each of the points.
std::vector<float> weights_of(const GatherHits& hits, std::span<const std::size_t> points, Bands bands) {
  std::vector<float> weights(points.size() * 9 * hits.patches());
  for (std::size_t p = 0; p < points.size(); ++p)
    hits.weights(points[p], weights.data() + p * 9 * hits.patches(), bands);
  return weights;
}

std::vector<std::size_t> all_points(const GatherHits& hits) {
  std::vector<std::size_t> points(hits.points());
  std::iota(points.begin(), points.end(), std::size_t{0});
  return points;
}

/// rows x (3 channels x regions): fills the channels that are copies of others.
void copy_channels(float* values, std::size_t rows, std::size_t regions, const std::array<int, 3>& copy_of) {
  for (std::size_t c = 0; c < 3; ++c) {
    const auto from = static_cast<std::size_t>(copy_of[c]);
    for (std::size_t row = 0; row < rows && from != c; ++row)
      std::copy_n(values + (row * 3 + from) * regions, regions, values + (row * 3 + c) * regions);
  }
}

/// One channel of the first light, [patch][region].
std::vector<float> channel_of(const FirstBounce& light, int channel) {
  std::vector<float> h(light.patches * light.columns());
  for (std::size_t i = 0; i < light.patches; ++i)
    std::copy_n(light.row(i, channel), light.columns(), h.data() + i * light.columns());
  return h;
}

} // namespace

RayFan RayFan::of(int rays) {
  const auto n = static_cast<std::uint32_t>(rays);
  std::vector<std::pair<std::uint32_t, glm::vec3>> list;
  for (std::uint32_t k = 0; k < n; ++k) {
    const glm::vec3 d(fibonacci_direction(k, n, {0.5, 0.0}));
    list.emplace_back(place_on_curve(d), d);
  }
  std::ranges::stable_sort(list, {}, &std::pair<std::uint32_t, glm::vec3>::first);
  RayFan fan;
  fan.harmonics.assign(n * kStride, 0.0f);
  fan.band4.assign(n * kStride, 0.0f);
  for (std::size_t k = 0; k < list.size(); ++k) {
    fan.direction.push_back(list[k].second);
    const auto y = sh::evaluate9(list[k].second), y4 = sh::evaluate_band4(list[k].second);
    for (std::size_t l = 0; l < 9; ++l) {
      fan.harmonics[k * kStride + l] = y[l] * 4.0f / static_cast<float>(n);
      fan.band4[k * kStride + l] = y4[l] * 4.0f / static_cast<float>(n);
    }
  }
  return fan;
}

void GatherHits::trace(std::size_t point, std::span<std::int32_t> met) const {
  const glm::vec2 turn = turn_of(point);
  std::ranges::fill(met, WholeFaces::kUnknown);
  if (faces_)
    faces_->trace(points_[point], rays_in_groups_, turn, met);
  const glm::vec3 origin = scene_->to_local(points_[point]);
  RayPacket16 packet;
  std::ranges::fill(packet.org_x, origin.x);
  std::ranges::fill(packet.org_y, origin.y);
  std::ranges::fill(packet.org_z, origin.z);
  std::ranges::fill(packet.tnear, 0.0f);
  std::ranges::fill(packet.tfar, std::numeric_limits<float>::infinity());
  std::array<std::uint32_t, 16> facet;
  std::array<std::size_t, 16> ray;
  std::size_t count = 0;
  const auto shoot = [&] {
    const std::uint32_t hit = scene_->closest16(packet, static_cast<int>(count), facet);
    for (std::size_t k = 0; k < count; ++k)
      met[ray[k]] =
          (hit >> k & 1u) != 0 ? set_->hit(*mesh_, facet[k], {packet.dir_x[k], packet.dir_y[k], packet.dir_z[k]}) : -1;
    count = 0;
  };
  for (std::size_t k = 0; k < met.size(); ++k) {
    if (met[k] != WholeFaces::kUnknown)
      continue;
    const glm::vec3 d = turned(fan_.direction[k], turn);
    packet.dir_x[count] = d.x;
    packet.dir_y[count] = d.y;
    packet.dir_z[count] = d.z;
    ray[count] = k;
    if (++count == 16)
      shoot();
  }
  if (count > 0)
    shoot();
}

Result<GatherHits> gather_hits(std::span<const glm::dvec3> points, const PatchSet& set, const SurfaceMesh& mesh,
                               const RayScene& facets, const GatherOptions& options, const Progress& progress,
                               std::size_t most_kept_rays) {
  GatherHits hits;
  hits.set_ = &set;
  hits.mesh_ = &mesh;
  hits.scene_ = &facets;
  hits.faces_ = options.faces && !options.faces->empty() ? options.faces : nullptr;
  hits.points_.assign(points.begin(), points.end());
  hits.rays_ = static_cast<std::size_t>(options.rays);
  hits.fan_ = RayFan::of(options.rays);
  hits.rays_in_groups_ = RayGroups::of(hits.fan_.direction);
  hits.groups_ = GatherHits::groups_of(set, options.group);
  const std::size_t kept = std::min(points.size(), most_kept_rays / hits.rays_);
  hits.patch_.resize(kept * hits.rays_);
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  parallel_for(std::size_t{0}, kept, [&](std::size_t p) {
    if (stop)
      return;
    hits.trace(p, std::span(hits.patch_).subspan(p * hits.rays_, hits.rays_));
    if (++done % kChunk == 0 && !progress("rays", static_cast<double>(done) / static_cast<double>(kept)))
      stop = true;
  });
  if (stop)
    return interrupted_error("rays");
  return hits;
}

std::vector<GatherHits::Group> GatherHits::groups_of(const PatchSet& set, std::span<const std::uint32_t> group) {
  std::vector<Group> groups;
  for (std::uint32_t first = 0, end = 0; first < group.size(); first = end) {
    Group g{group[first], first, first, glm::dvec3(0.0), set.patches[first].normal, 0.0};
    for (; end < group.size() && group[end] == group[first]; ++end) {
      const Patch& e = set.patches[end];
      g.middle += e.area_m2 * (e.corner[0] + e.corner[1] + e.corner[2]) / 3.0;
      g.member_m2 += e.area_m2;
    }
    g.end = end;
    g.middle /= g.member_m2;
    g.member_m2 /= end - first;
    if (end - first > 1)
      groups.push_back(g);
  }
  return groups;
}

bool GatherHits::tells_apart(const glm::dvec3& point, const Group& g) const {
  const glm::dvec3 way = point - g.middle;
  const double distance2 = glm::dot(way, way), own_sr = kOwnRays * 4.0 * std::numbers::pi / static_cast<double>(rays_);
  return g.member_m2 * std::abs(glm::dot(way, g.normal)) > own_sr * distance2 * std::sqrt(distance2);
}

void GatherHits::mark_told_apart(std::size_t point, std::span<std::uint8_t> groups) const {
  for (const Group& g : groups_)
    if (tells_apart(points_[point], g))
      groups[g.group] = 1;
}

void GatherHits::share_out(const glm::dvec3& point, std::span<const std::uint32_t> piece,
                           std::vector<float>& sum) const {
  for (const Group& g : groups_) {
    const std::size_t count = g.end - g.first;
    if (piece[g.first] == piece[g.end - 1] || tells_apart(point, g))
      continue;
    std::array<float, RayFan::kStride> all{};
    float* of_group = sum.data() + piece[g.first] * RayFan::kStride; // every patch is a piece
    for (std::size_t k = 0; k < count; ++k)
      for (std::size_t l = 0; l < RayFan::kStride; ++l)
        all[l] += of_group[k * RayFan::kStride + l];
    for (std::size_t k = 0; k < count; ++k) {
      const auto share = static_cast<float>(set_->patches[g.first + k].area_m2 / (g.member_m2 * (g.end - g.first)));
      for (std::size_t l = 0; l < RayFan::kStride; ++l)
        of_group[k * RayFan::kStride + l] = share * all[l];
    }
  }
}

std::vector<float> GatherHits::sums(std::size_t point, std::span<const std::uint32_t> piece, std::size_t pieces,
                                    Bands bands) const {
  std::vector<std::int32_t> again;
  const std::int32_t* met = patch_.data() + point * rays_;
  if ((point + 1) * rays_ > patch_.size()) {
    again.resize(rays_);
    trace(point, again);
    met = again.data();
  }
  std::vector<float> sum(pieces * RayFan::kStride, 0.0f);
  add_harmonics(met, piece.data(), (bands == Bands::low ? fan_.harmonics : fan_.band4).data(), rays_, sum.data());
  share_out(points_[point], piece, sum);
  return sum;
}

void GatherHits::weights(std::size_t point, float* nine_rows, Bands bands) const {
  std::vector<std::uint32_t> end(patches());
  std::iota(end.begin(), end.end(), 1u);
  weights(point, end, nine_rows, bands);
}

void GatherHits::weights(std::size_t point, std::span<const std::uint32_t> piece_end, float* nine_rows,
                         Bands bands) const {
  std::vector<std::uint32_t> piece(patches());
  for (std::uint32_t k = 0, e = 0; k < piece_end.size(); ++k)
    for (; e < piece_end[k]; ++e)
      piece[e] = k;
  const std::vector<float> sum = sums(point, piece, piece_end.size(), bands);
  const glm::vec2 turn = turn_of(point);
  for (std::size_t k = 0; k < piece_end.size(); ++k)
    turn_harmonics(sum.data() + k * RayFan::kStride, turn, piece_end.size(), bands, nine_rows + k);
}

Result<std::vector<float>> gather_coefficients(const GatherHits& hits, const Radiosity& radiosity,
                                               const Progress& progress, Bands bands) {
  return gather_coefficients(hits, all_points(hits), radiosity, progress, bands);
}

Result<std::vector<float>> gather_coefficients(const GatherHits& hits, std::span<const std::size_t> points,
                                               const Radiosity& radiosity, const Progress& progress, Bands bands) {
  openblas_set_num_threads(1);
  const std::size_t columns = radiosity.columns, regions = columns / 3;
  std::vector<float> result(points.size() * 9 * columns, 0.0f);
  const std::size_t chunks = (points.size() + kChunk - 1) / kChunk;
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
    if (stop || columns == 0)
      return;
    const std::size_t first = c * kChunk, count = std::min(kChunk, points.size() - first);
    const std::vector<float> weights = weights_of(hits, points.subspan(first, count), bands);
    const auto rows = static_cast<int>(9 * count), inner = static_cast<int>(hits.patches()),
               stride = static_cast<int>(columns);
    float* out = result.data() + first * 9 * columns;
    for (std::size_t channel = 0; channel < 3; ++channel)
      if (radiosity.copy_of[channel] == static_cast<int>(channel))
        cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, rows, static_cast<int>(regions), inner, 1.0f,
                    weights.data(), inner, radiosity.b.data() + channel * regions, stride, 0.0f,
                    out + channel * regions, stride);
    copy_channels(out, 9 * count, regions, radiosity.copy_of);
    if (!progress("volume", static_cast<double>(++done) / static_cast<double>(chunks)))
      stop = true;
  });
  if (stop)
    return interrupted_error("volume");
  return result;
}

Result<std::vector<float>> adjoint_coefficients(const GatherHits& hits, const PatchSet& set,
                                                const ExchangeMatrix& exchange, const FirstBounce& light,
                                                const SolveOptions& solve, const Progress& progress,
                                                SolveReport* report, Bands bands) {
  const std::size_t n = set.patches.size(), regions = light.columns(), rows = 9 * hits.points();
  const std::vector<float> weights = weights_of(hits, all_points(hits), bands);
  std::vector<float> result(rows * 3 * regions, 0.0f);
  const std::array<int, 3> copy_of = equal_channels(set, light);
  SolveReport total;
  total.channels = 0;
  for (int channel = 0; channel < 3; ++channel) {
    const auto c = static_cast<std::size_t>(channel);
    if (copy_of[c] != channel)
      continue;
    SolveReport one;
    const auto wanted = solve_adjoint(set, exchange, weights, rows, channel, solve, progress, &one);
    if (!wanted)
      return wanted.error();
    const std::vector<float> h = channel_of(light, channel);
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, static_cast<int>(rows), static_cast<int>(regions),
                static_cast<int>(n), 1.0f, wanted->data(), static_cast<int>(n), h.data(), static_cast<int>(regions),
                0.0f, result.data() + c * regions, static_cast<int>(3 * regions));
    total.iterations = std::max(total.iterations, one.iterations);
    total.worst_residual = std::max(total.worst_residual, one.worst_residual);
    total.residual.insert(total.residual.end(), one.residual.begin(), one.residual.end());
    total.seconds += one.seconds;
    ++total.channels;
  }
  copy_channels(result.data(), rows, regions, copy_of);
  if (report)
    *report = std::move(total);
  return result;
}

} // namespace daylit::radiosity
