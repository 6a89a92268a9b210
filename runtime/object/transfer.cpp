#include "runtime/object/transfer.h"

#include <algorithm>
#include <utility>

#include "runtime/object/vertex_rays.h"
#include "scene/core/parallel.h"
#include "scene/core/parallel_stage.h"
#include "sh/sh9.h"

namespace daylit {

namespace {

constexpr double kBuriedFraction = 0.5;
constexpr float kDark = 0.3f * 0.886226925f; // of L_00 of the unshadowed vector, pi Y_00
constexpr std::size_t kChunk = 64;           ///< vertices

/// A side of the surface at every vertex: its members of VertexTransfer, and what its rays end on.
struct Side {
  TransferVector VertexTransfer::*direct, VertexTransfer::*bounce;
  float VertexTransfer::*again;
  float normal; ///< times the vertex's
  std::vector<std::vector<SeenPoint>> seen{};
  std::vector<std::uint8_t> buried{};
  std::vector<float> first{}; ///< L_00 of the light that is reflected once
};

/// C_lm = A_l Y_lm(n) - integral over the blocked directions of cos Y_lm.
void look_from(const VertexRays& rays, const ObjectMesh& mesh, Side& side, std::uint32_t v, VertexTransfer& transfer) {
  const glm::vec3 n = side.normal * mesh.normals[v];
  SideView view = rays.look(v, n);
  const std::array<double, 9> y = sh::evaluate9(glm::dvec3(n));
  for (int i = 0; i < 9; ++i)
    (transfer.*side.direct)[i] = static_cast<float>(sh::kClampedCosine9<double>[i] * y[i]) - view.blocked[i];
  side.seen[v] = std::move(view.seen);
}

/// Transfer vectors of light that leaves the two sides of the surface at each vertex.
struct Leaving {
  std::vector<TransferVector> front, back;
};

/// The vector at the point where a ray ends.
TransferVector leaving_at(const ObjectMesh& mesh, const SeenPoint& p, const Leaving& leaving) {
  const auto& t = mesh.triangles[p.triangle];
  const std::vector<TransferVector>& side = p.on_back ? leaving.back : leaving.front;
  const float u = static_cast<float>(p.u) / 65535.0f, v = static_cast<float>(p.v) / 65535.0f;
  const TransferVector &a = side[t[0]], &b = side[t[1]], &c = side[t[2]];
  TransferVector mixed;
  for (std::size_t i = 0; i < mixed.size(); ++i)
    mixed[i] = (1.0f - u - v) * a[i] + u * b[i] + v * c[i];
  return mixed;
}

/// Sum over the blocked rays of the vectors where they end, by the number of all rays.
TransferVector mean_behind(const ObjectMesh& mesh, const std::vector<SeenPoint>& seen, int rays,
                           const Leaving& leaving) {
  TransferVector sum{};
  for (const SeenPoint& p : seen) {
    const TransferVector there = leaving_at(mesh, p, leaving);
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] += there[i];
  }
  for (float& s : sum)
    s /= static_cast<float>(rays);
  return sum;
}

/// Whether a vertex is buried in another part: most of its rays meet backs of faces, and little light reaches these.
/// Backs of a sheet are lit.
bool is_buried(const ObjectMesh& mesh, const std::vector<SeenPoint>& seen, int rays,
               const std::vector<VertexTransfer>& transfer) {
  int backs = 0;
  float light = 0.0f;
  for (const SeenPoint& p : seen)
    if (p.on_back) {
      ++backs;
      light += transfer[mesh.triangles[p.triangle][0]].back[0];
    }
  return backs > kBuriedFraction * rays && light < kDark * static_cast<float>(backs);
}

/// Buried vertices beside one that is not take the mean of those neighbours: their triangles come out into the light.
/// What lies deeper stays as dark as it is: it can be seen through an opening.
void fill_buried(const ObjectMesh& mesh, const std::vector<std::uint8_t>& buried,
                 TransferVector VertexTransfer::*vector, std::vector<VertexTransfer>& transfer) {
  std::vector<TransferVector> sum(transfer.size(), TransferVector{});
  std::vector<int> neighbours(transfer.size(), 0);
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k)
      for (const std::uint32_t other : {t[(k + 1) % 3], t[(k + 2) % 3]})
        if (buried[t[k]] && !buried[other]) {
          for (int i = 0; i < 9; ++i)
            sum[t[k]][i] += (transfer[other].*vector)[i];
          ++neighbours[t[k]];
        }
  for (std::size_t v = 0; v < transfer.size(); ++v)
    if (neighbours[v] > 0)
      for (int i = 0; i < 9; ++i)
        (transfer[v].*vector)[i] = sum[v][i] / static_cast<float>(neighbours[v]);
}

/// work(v) for every vertex.
template <class Work>
void for_each_vertex(const std::vector<VertexTransfer>& transfer, const Work& work) {
  parallel_for(tbb::blocked_range<std::size_t>(0, transfer.size(), kChunk), [&](const auto& range) {
    for (std::size_t v = range.begin(); v != range.end(); ++v)
      work(v);
  });
}

/// C + rho S.
Leaving leaving(const std::vector<VertexTransfer>& transfer) {
  Leaving sum{std::vector<TransferVector>(transfer.size()), std::vector<TransferVector>(transfer.size())};
  for_each_vertex(transfer, [&](std::size_t v) {
    const VertexTransfer& t = transfer[v];
    for (std::size_t i = 0; i < t.front.size(); ++i) {
      sum.front[v][i] = t.front[i] + kBounceReflectance * t.bounce[i];
      sum.back[v][i] = t.back[i] + kBounceReflectance * t.bounce_back[i];
    }
  });
  return sum;
}

/// Sum of L_00 over the vertices.
double all_of(const std::vector<VertexTransfer>& transfer, TransferVector VertexTransfer::*vector) {
  double sum = 0.0;
  for (const VertexTransfer& t : transfer)
    sum += static_cast<double>((t.*vector)[0]);
  return sum;
}

/// S = G (C + rho S), G the mean over the rays, by Jacobi steps until one adds next to nothing. With S_1 of the first
/// step and a geometric series, S = S_1 / (1 - rho again): the ratio of L_00 gives `again`.
void reflect(const ObjectMesh& mesh, int rays, std::span<Side> sides, std::vector<VertexTransfer>& transfer) {
  constexpr int kMostSteps = 10;
  constexpr double kSettled = 0.005; // of the sum
  for (Side& side : sides)
    side.first.resize(transfer.size());
  bool settled = false;
  for (int step = 0; step < kMostSteps && !settled; ++step) {
    const Leaving light = leaving(transfer);
    settled = true;
    for (Side& side : sides) {
      const double before = all_of(transfer, side.bounce);
      for_each_vertex(transfer, [&](std::size_t v) {
        transfer[v].*side.bounce = mean_behind(mesh, side.seen[v], rays, light);
        if (step == 0)
          side.first[v] = std::max((transfer[v].*side.bounce)[0], 0.0f);
      });
      fill_buried(mesh, side.buried, side.bounce, transfer);
      const double after = all_of(transfer, side.bounce);
      settled = settled && after - before <= kSettled * after;
    }
  }
  for (const Side& side : sides)
    for_each_vertex(transfer, [&](std::size_t v) {
      const float all = (transfer[v].*side.bounce)[0];
      if (all > side.first[v])
        transfer[v].*side.again = std::min((1.0f - side.first[v] / all) / kBounceReflectance, 1.0f);
    });
}

} // namespace

Result<std::vector<VertexTransfer>> compute_transfer(const ObjectMesh& mesh, const TransferSettings& settings,
                                                     const Progress& progress) {
  const auto rays = VertexRays::make(mesh, settings.rays_per_vertex);
  if (!rays)
    return rays.error();
  const std::size_t vertices = mesh.positions.size();
  std::vector<VertexTransfer> transfer(vertices);
  std::vector<Side> sides{{&VertexTransfer::front, &VertexTransfer::bounce, &VertexTransfer::again, 1.0f}};
  if (!settings.closed)
    sides.push_back({&VertexTransfer::back, &VertexTransfer::bounce_back, &VertexTransfer::again_back, -1.0f});
  for (Side& side : sides) {
    side.seen.resize(vertices);
    side.buried.resize(vertices);
  }
  const auto looked = parallel_stage("self-shadow", (vertices + kChunk - 1) / kChunk, 1, progress, [&](std::size_t c) {
    for (std::size_t v = c * kChunk; v < std::min((c + 1) * kChunk, vertices); ++v)
      for (Side& side : sides)
        look_from(*rays, mesh, side, static_cast<std::uint32_t>(v), transfer[v]);
  });
  if (!looked)
    return looked.error();
  for_each_vertex(
      transfer, [&](std::size_t v) { sides[0].buried[v] = is_buried(mesh, sides[0].seen[v], rays->rays(), transfer); });
  fill_buried(mesh, sides[0].buried, sides[0].direct, transfer);
  reflect(mesh, rays->rays(), sides, transfer);
  return transfer;
}

} // namespace daylit
