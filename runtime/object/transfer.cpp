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
constexpr float kOpen = 0.886226925f; // L_00 of the unshadowed vector, pi Y_00
constexpr float kDark = 0.3f * kOpen;
constexpr std::size_t kChunk = 64; ///< vertices

/// C_lm = A_l Y_lm(n) - integral over the blocked directions of cos Y_lm.
TransferVector open_part(const glm::vec3& n, const SideView& view) {
  const std::array<double, 9> y = sh::evaluate9(glm::dvec3(n));
  TransferVector open;
  for (int i = 0; i < 9; ++i)
    open[i] = static_cast<float>(sh::kClampedCosine9<double>[i] * y[i]) - view.blocked[i];
  return open;
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
                 std::vector<VertexTransfer>& transfer) {
  std::vector<TransferVector> sum(transfer.size(), TransferVector{});
  std::vector<int> neighbours(transfer.size(), 0);
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k)
      for (const std::uint32_t other : {t[(k + 1) % 3], t[(k + 2) % 3]})
        if (buried[t[k]] && !buried[other]) {
          for (int i = 0; i < 9; ++i)
            sum[t[k]][i] += transfer[other].front[i];
          ++neighbours[t[k]];
        }
  for (std::size_t v = 0; v < transfer.size(); ++v)
    if (neighbours[v] > 0)
      for (int i = 0; i < 9; ++i)
        transfer[v].front[i] = sum[v][i] / static_cast<float>(neighbours[v]);
}

} // namespace

float hidden_fraction(const TransferVector& transfer) { return std::clamp(1.0f - transfer[0] / kOpen, 0.0f, 1.0f); }

Result<std::vector<VertexTransfer>> compute_transfer(const ObjectMesh& mesh, const TransferSettings& settings,
                                                     const Progress& progress) {
  const auto scene =
      RayScene::build(std::vector<glm::dvec3>(mesh.positions.begin(), mesh.positions.end()), mesh.triangles);
  if (!scene)
    return scene.error();
  const VertexRays rays(mesh, *scene, settings.rays_per_vertex);
  const std::size_t vertices = mesh.positions.size();
  std::vector<VertexTransfer> transfer(vertices);
  std::vector<std::vector<SeenPoint>> seen(vertices); // from the front
  const auto looked = parallel_stage("self-shadow", (vertices + kChunk - 1) / kChunk, 1, progress, [&](std::size_t c) {
    for (std::size_t v = c * kChunk; v < std::min((c + 1) * kChunk, vertices); ++v) {
      const glm::vec3& n = mesh.normals[v];
      SideView front = rays.look(static_cast<std::uint32_t>(v), n);
      transfer[v].front = open_part(n, front);
      seen[v] = std::move(front.seen);
      if (!settings.closed)
        transfer[v].back = open_part(-n, rays.look(static_cast<std::uint32_t>(v), -n));
    }
  });
  if (!looked)
    return looked.error();
  std::vector<std::uint8_t> buried(vertices);
  parallel_for(std::size_t{0}, vertices,
               [&](std::size_t v) { buried[v] = is_buried(mesh, seen[v], rays.rays(), transfer); });
  fill_buried(mesh, buried, transfer);
  return transfer;
}

} // namespace daylit
