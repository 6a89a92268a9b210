#include "radiosity/form_factors.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>
#include <tbb/parallel_for.h>

#include "radiosity/detail/block_visibility.h"
#include "radiosity/detail/sampling.h"
#include "radiosity/polygon_kernel.h"

namespace daylit::radiosity {

namespace {

constexpr int kPoints = 64; // sample points kept per element; the first 16 are used for every pair
constexpr int kFirst = 16;  // one ray packet
constexpr float kFarRatio2 =
    30.0f; // squared distance over squared sum of radii from which 3 x 3 points do (error 2e-4)
constexpr std::size_t kBlock = 16;

/// What the inner loop reads of an element, in float and local coordinates.
struct Cached {
  std::array<float, kPoints> x, y, z; // R2 points on the triangle
  std::array<glm::vec3, 3> gauss;     // 3-point rule of degree 2
  std::array<glm::vec3, 3> corner;
  glm::vec3 centre, normal;
  float radius2, area;
};

struct Counters {
  std::atomic<std::uint64_t> facing{0}, near{0}, clear{0}, partial{0}, rays{0};
};

/// `origin_shift` carries mesh coordinates to those of the ray scene.
Cached cache(const Element& e, std::uint32_t index, const glm::dvec3& origin_shift) {
  Cached c;
  const glm::dvec2 shift = random_shift(index);
  for (int k = 0; k < kPoints; ++k) {
    const glm::vec3 p(on_triangle(e.corner, r2_point(static_cast<std::uint32_t>(k), shift)) + origin_shift);
    c.x[k] = p.x;
    c.y[k] = p.y;
    c.z[k] = p.z;
  }
  const glm::dvec3 middle = (e.corner[0] + e.corner[1] + e.corner[2]) / 3.0;
  double radius2 = 0;
  for (int k = 0; k < 3; ++k) {
    c.gauss[k] = glm::vec3(0.5 * e.corner[k] + 0.5 * middle); // barycentric (2/3, 1/6, 1/6)
    c.corner[k] = glm::vec3(e.corner[k]);
    radius2 = std::max(radius2, glm::dot(e.corner[k] - middle, e.corner[k] - middle));
  }
  c.centre = glm::vec3(middle);
  c.normal = glm::vec3(e.normal);
  c.radius2 = static_cast<float>(radius2);
  c.area = static_cast<float>(e.area_m2);
  return c;
}

/// Heights of b's corners over a's plane: 1 all in front, 0 cut by the plane, -1 none in front.
int in_front(const Cached& a, const Cached& b) {
  const float tolerance = 1e-5f * std::sqrt(a.radius2 + b.radius2);
  int front = 0, behind = 0;
  for (const glm::vec3& p : b.corner) {
    const float h = glm::dot(p - a.centre, a.normal);
    front += h > tolerance;
    behind += h < -tolerance;
  }
  return front == 0 ? -1 : (behind == 0 ? 1 : 0);
}

double far_exchange(const Cached& a, const Cached& b) {
  float sum = 0;
  for (const glm::vec3& p : a.gauss)
    for (const glm::vec3& q : b.gauss) {
      const glm::vec3 d = q - p;
      const float r2 = glm::dot(d, d);
      sum += std::max(0.0f, glm::dot(d, a.normal)) * std::max(0.0f, -glm::dot(d, b.normal)) / (r2 * r2);
    }
  return static_cast<double>(sum * a.area * b.area) / (9.0 * std::numbers::pi);
}

/// Rays first .. first + 15 of a pair: the kernel weight of each and the packet that tests it. `twist` pairs point k
/// of a with point k ^ twist of b.
void fill_packet(const Cached& a, const Cached& b, int first, int twist, float gap, RayPacket16& rays, float* weight) {
  for (int k = 0; k < 16; ++k) {
    const int i = first + k, j = first + (k ^ twist);
    const float dx = b.x[j] - a.x[i], dy = b.y[j] - a.y[i], dz = b.z[j] - a.z[i];
    const float r2 = dx * dx + dy * dy + dz * dz;
    const float ca = dx * a.normal.x + dy * a.normal.y + dz * a.normal.z;
    const float cb = -(dx * b.normal.x + dy * b.normal.y + dz * b.normal.z);
    weight[k] = std::max(0.0f, ca) * std::max(0.0f, cb) / std::max(r2 * r2, 1e-30f);
    const float margin = std::min(0.25f, gap / std::sqrt(std::max(r2, 1e-30f)));
    rays.org_x[k] = a.x[i];
    rays.org_y[k] = a.y[i];
    rays.org_z[k] = a.z[i];
    rays.dir_x[k] = dx;
    rays.dir_y[k] = dy;
    rays.dir_z[k] = dz;
    rays.tnear[k] = margin;
    rays.tfar[k] = 1.0f - margin;
  }
}

/// Share of the exchange that is not blocked.
double visible_share(const Cached& a, const Cached& b, const RayScene& scene, int twist, const ExchangeOptions& options,
                     Counters& counters) {
  RayPacket16 rays;
  float weight[16];
  double seen = 0, total = 0;
  int passes = 1;
  for (int pass = 0; pass < passes; ++pass) {
    fill_packet(a, b, pass * kFirst, twist, 4.0f * scene.surface_offset(), rays, weight);
    const std::uint32_t blocked = scene.occluded16(rays, 16);
    for (int k = 0; k < 16; ++k) {
      total += static_cast<double>(weight[k]);
      seen += (blocked >> k) & 1u ? 0.0 : static_cast<double>(weight[k]);
    }
    if (pass == 0 && blocked != 0 && blocked != 0xFFFFu) {
      passes = std::clamp(options.partial_rays / kFirst, 1, kPoints / kFirst);
      counters.partial.fetch_add(1, std::memory_order_relaxed);
    }
  }
  counters.rays.fetch_add(static_cast<std::uint64_t>(passes) * kFirst, std::memory_order_relaxed);
  return total > 0 ? seen / total : 0.0;
}

/// What every pair of one run shares.
struct Problem {
  const ElementSet& set;
  const RayScene& scene;
  const ExchangeOptions& options;
  std::vector<Cached> cached;
  BlockVisibility blocks;
  Counters counters;
};

double pair_exchange(Problem& problem, std::size_t i, std::size_t j, bool clear) {
  const std::vector<Cached>& cached = problem.cached;
  Counters& counters = problem.counters;
  const Cached &a = cached[i], &b = cached[j];
  const int ab = in_front(a, b), ba = in_front(b, a);
  if (ab < 0 || ba < 0)
    return 0.0;
  counters.facing.fetch_add(1, std::memory_order_relaxed);
  const glm::vec3 d = b.centre - a.centre;
  const float reach = std::sqrt(a.radius2) + std::sqrt(b.radius2);
  const float ratio2 = glm::dot(d, d) / (reach * reach);
  double g;
  if (ratio2 > kFarRatio2 || (ratio2 > 0.25f * kFarRatio2 && ab > 0 && ba > 0)) {
    g = far_exchange(a, b);
  } else {
    counters.near.fetch_add(1, std::memory_order_relaxed);
    const Element &ea = problem.set.elements[i], &eb = problem.set.elements[j];
    g = exchange_area_unoccluded(ea.corner, ea.normal, eb.corner, eb.normal);
  }
  if (g <= 0.0)
    return 0.0;
  if (clear) {
    counters.clear.fetch_add(1, std::memory_order_relaxed);
    return g;
  }
  const auto twist = static_cast<int>(mix_bits(i * 0x100000001ull + j) & 15);
  return g * visible_share(a, b, problem.scene, twist, problem.options, counters);
}

/// One square block of the matrix, and its mirror image.
void fill_block(Problem& problem, std::size_t row, std::size_t column, ExchangeMatrix& m) {
  const bool clear = problem.blocks.clear(row, column);
  for (std::size_t i = row * kBlock; i < std::min(m.size, (row + 1) * kBlock); ++i)
    for (std::size_t j = column * kBlock; j < std::min(i, (column + 1) * kBlock); ++j) {
      const auto g = static_cast<float>(pair_exchange(problem, j, i, clear));
      m.g[i * m.size + j] = g;
      m.g[j * m.size + i] = g;
    }
}

} // namespace

Result<ExchangeMatrix> exchange_areas(const ElementSet& set, const PatchMesh& mesh, const RayScene& occluders,
                                      const ExchangeOptions& options, const Progress& progress,
                                      ExchangeReport* report) {
  const auto start = std::chrono::steady_clock::now();
  ExchangeMatrix m;
  m.size = set.elements.size();
  if (m.size * m.size * sizeof(float) > options.max_bytes)
    return Error{ErrorCode::limit_exceeded,
                 std::to_string(m.size) + " patches need more memory for their form factors than allowed",
                 "form factors", "use a larger --patch-size"};
  m.g.assign(m.size * m.size, 0.0f);
  Problem problem{set, occluders, options, {}, BlockVisibility(set, mesh, kBlock), {}};
  const glm::dvec3 shift = mesh.origin - occluders.origin();
  for (std::size_t i = 0; i < m.size; ++i)
    problem.cached.push_back(cache(set.elements[i], static_cast<std::uint32_t>(i), shift));

  const std::size_t blocks = (m.size + kBlock - 1) / kBlock;
  std::atomic<std::size_t> done{0};
  std::atomic<bool> stop{false};
  // Long rows first, so that the last tasks are short.
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t task) {
    const std::size_t row = blocks - 1 - task;
    for (std::size_t column = 0; column <= row && !stop; ++column)
      fill_block(problem, row, column, m);
    const std::size_t finished = done += row + 1;
    if (!progress("form factors", static_cast<double>(finished) / static_cast<double>(blocks * (blocks + 1) / 2)))
      stop = true;
  });
  if (stop)
    return interrupted_error("form factors");
  const Counters& c = problem.counters;
  if (report)
    *report = {c.facing,  c.near, c.clear,
               c.partial, c.rays, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
  return m;
}

} // namespace daylit::radiosity
