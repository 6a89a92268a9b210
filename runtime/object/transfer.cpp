#include "runtime/object/transfer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>

#include <glm/geometric.hpp>

#include "runtime/base/orthonormal.h"
#include "scene/core/parallel.h"
#include "scene/room/ray_scene.h"
#include "sh/sh9.h"

namespace daylit {

namespace {

/// The bits of i mirrored at the binary point (van der Corput 1935).
double radical_inverse_2(std::uint32_t i) {
  i = (i << 16) | (i >> 16);
  i = ((i & 0x00FF00FFu) << 8) | ((i & 0xFF00FF00u) >> 8);
  i = ((i & 0x0F0F0F0Fu) << 4) | ((i & 0xF0F0F0F0u) >> 4);
  i = ((i & 0x33333333u) << 2) | ((i & 0xCCCCCCCCu) >> 2);
  i = ((i & 0x55555555u) << 1) | ((i & 0xAAAAAAAAu) >> 1);
  return i * 0x1p-32;
}

/// Cosine-weighted directions around +z, pdf = cos / pi (Malley: a uniform disc, lifted).
std::vector<glm::dvec3> cosine_directions(int count) {
  std::vector<glm::dvec3> directions;
  for (int k = 0; k < count; ++k) {
    const double u = (k + 0.5) / count, angle = 2.0 * std::numbers::pi * radical_inverse_2(static_cast<unsigned>(k));
    directions.emplace_back(std::sqrt(u) * std::cos(angle), std::sqrt(u) * std::sin(angle), std::sqrt(1.0 - u));
  }
  return directions;
}

/// Unit normals of the faces around each vertex position, turned to the vertex's side. Vertices that share a position
/// (at seams) share their faces.
class IncidentFaces {
public:
  explicit IncidentFaces(const ObjectMesh& mesh) : group_(mesh.positions.size()) {
    std::vector<std::uint32_t> order(mesh.positions.size());
    std::iota(order.begin(), order.end(), 0u);
    const auto key = [&](std::uint32_t v) {
      const glm::vec3& p = mesh.positions[v];
      return std::array{p.x, p.y, p.z};
    };
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
    std::uint32_t groups = 0;
    for (std::size_t k = 0; k < order.size(); ++k) {
      groups += k > 0 && key(order[k]) != key(order[k - 1]);
      group_[order[k]] = groups;
    }
    faces_.resize(order.empty() ? 0 : groups + 1);
    for (const auto& t : mesh.triangles) {
      const glm::vec3 n =
          glm::cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]]);
      if (const float length = glm::length(n); length > 0.0f)
        for (const std::uint32_t v : t)
          faces_[group_[v]].push_back(n / length);
    }
  }

  /// The direction dips below a face that meets at this vertex.
  /// Above the smooth normal's plane and below a facet's, or the other way round.
  bool dips_below(std::uint32_t vertex, const glm::vec3& normal, const glm::vec3& w) const {
    const auto& faces = faces_[group_[vertex]];
    return std::any_of(faces.begin(), faces.end(),
                       [&](const glm::vec3& n) { return glm::dot(n, w) * glm::dot(n, normal) < 0.0f; });
  }

private:
  std::vector<std::uint32_t> group_;
  std::vector<std::vector<glm::vec3>> faces_;
};

struct Occluder {
  const ObjectMesh* mesh;
  RayScene scene;
  IncidentFaces incident;

  enum class Hit { none, front, back };
  /// What a ray from a vertex meets. A direction above the smooth normal's tangent plane may dip below a coarse mesh's
  /// own facets and leave through its far side: that hit, on the back of a face, is no occluder.
  /// Surface offset: the ray leaves the facets that it starts on.
  Hit look(std::uint32_t vertex, const glm::vec3& origin, const glm::vec3& normal, const glm::vec3& w,
           RayHit& hit) const {
    if (!scene.closest(origin, w, scene.surface_offset(), std::numeric_limits<float>::infinity(), hit))
      return Hit::none;
    const auto& t = mesh->triangles[hit.triangle];
    const glm::vec3 a = mesh->positions[t[0]];
    const glm::vec3 face = glm::cross(mesh->positions[t[1]] - a, mesh->positions[t[2]] - a);
    if (glm::dot(face, w) < 0.0f)
      return Hit::front;
    return incident.dips_below(vertex, normal, w) ? Hit::none : Hit::back;
  }
};

/// A blocked direction: where on the mesh it ends, and on which side.
struct Blocker {
  RayHit hit;
  bool on_back;
};

struct Side {
  TransferVector transfer;
  std::vector<Blocker> blockers;
  double back_fraction; ///< of the rays, that meet the back of a face
};

/// C_lm = A_l Y_lm(n) - integral over the blocked directions of cos Y_lm. With pdf = cos / pi a blocked direction
/// weighs pi / rays, whatever its angle.
Side side_transfer(const Occluder& occluder, std::uint32_t vertex, const glm::dvec3& normal,
                   const std::vector<glm::dvec3>& directions) {
  const OrthonormalBasis basis(normal);
  std::array<double, 9> sum = sh::evaluate9(normal);
  for (int i = 0; i < 9; ++i)
    sum[i] *= sh::kClampedCosine9<double>[i];
  const double weight = std::numbers::pi / static_cast<double>(directions.size());
  const glm::vec3 origin = occluder.scene.to_local(glm::dvec3(occluder.mesh->positions[vertex])) +
                           occluder.scene.surface_offset() * glm::vec3(normal);
  Side side{{}, {}, 0.0};
  std::size_t backs = 0;
  for (const glm::dvec3& d : directions) {
    RayHit hit;
    const glm::dvec3 w = d.x * basis.u + d.y * basis.v + d.z * normal;
    const Occluder::Hit seen = occluder.look(vertex, origin, glm::vec3(normal), glm::vec3(w), hit);
    if (seen == Occluder::Hit::none)
      continue;
    backs += seen == Occluder::Hit::back;
    side.blockers.push_back({hit, seen == Occluder::Hit::back});
    const std::array<double, 9> y = sh::evaluate9(w);
    for (int i = 0; i < 9; ++i)
      sum[i] -= weight * y[i];
  }
  side.back_fraction = static_cast<double>(backs) / static_cast<double>(directions.size());
  for (int i = 0; i < 9; ++i)
    side.transfer[i] = static_cast<float>(sum[i]);
  return side;
}

/// Sum over the blocked rays of value(vertex, on_back), interpolated to where they end, by the number of all rays.
template <class Value, class ValueAt>
Value mean_behind(const ObjectMesh& mesh, const std::vector<Blocker>& blockers, std::size_t rays, ValueAt value_at) {
  Value sum{};
  for (const Blocker& b : blockers) {
    const auto& t = mesh.triangles[b.hit.triangle];
    const float weight[3] = {1.0f - b.hit.u - b.hit.v, b.hit.u, b.hit.v};
    for (int k = 0; k < 3; ++k) {
      const Value there = value_at(t[k], b.on_back);
      for (std::size_t i = 0; i < there.size(); ++i)
        sum[i] += weight[k] / static_cast<float>(rays) * there[i];
    }
  }
  return sum;
}

/// Every edge has exactly one twin of opposite direction.
bool is_closed(const ObjectMesh& mesh) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges, twins;
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      edges.emplace_back(t[k], t[(k + 1) % 3]);
      twins.emplace_back(t[(k + 1) % 3], t[k]);
    }
  std::sort(edges.begin(), edges.end());
  std::sort(twins.begin(), twins.end());
  return edges == twins;
}

/// Buried vertices beside one that is not take the mean of those neighbours: their triangles come out into the light.
/// What lies deeper stays as dark as it is: it can be seen through an opening.
void fill_buried(const ObjectMesh& mesh, const std::vector<bool>& buried, TransferVector VertexTransfer::*side,
                 std::vector<VertexTransfer>& transfer) {
  std::vector<TransferVector> sum(transfer.size(), TransferVector{});
  std::vector<int> neighbours(transfer.size(), 0);
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k)
      for (const std::uint32_t other : {t[(k + 1) % 3], t[(k + 2) % 3]})
        if (buried[t[k]] && !buried[other]) {
          for (int i = 0; i < 9; ++i)
            sum[t[k]][i] += (transfer[other].*side)[i];
          ++neighbours[t[k]];
        }
  for (std::size_t v = 0; v < transfer.size(); ++v)
    if (neighbours[v] > 0)
      for (int i = 0; i < 9; ++i)
        (transfer[v].*side)[i] = sum[v][i] / static_cast<float>(neighbours[v]);
}

constexpr double kBuriedFraction = 0.5;

} // namespace

/// Three passes: direct transfer, then the mean transfer of what the blocked directions meet (one reflection), then the
/// mean of that (two), of which only the ratio of L_00 is kept: the rest of the series is taken as constant in
/// direction.
Result<std::vector<VertexTransfer>> compute_transfer(const ObjectMesh& mesh, const TransferSettings& settings) {
  std::vector<glm::dvec3> positions(mesh.positions.begin(), mesh.positions.end());
  Result<RayScene> scene = RayScene::build(positions, mesh.triangles);
  if (!scene)
    return scene.error();
  const Occluder occluder{&mesh, std::move(*scene), IncidentFaces(mesh)};
  const std::vector<glm::dvec3> directions = cosine_directions(std::max(settings.rays_per_vertex, 1));
  const bool closed = is_closed(mesh);
  const auto vertices = static_cast<std::uint32_t>(mesh.positions.size());
  std::vector<VertexTransfer> transfer(vertices);
  std::vector<std::vector<Blocker>> blockers(vertices);
  std::vector<std::uint8_t> is_buried(vertices, 0);
  const auto for_each_vertex = [&](const auto& work) {
    parallel_for(tbb::blocked_range<std::uint32_t>(0, vertices, 64), [&](const auto& range) {
      for (std::uint32_t v = range.begin(); v != range.end(); ++v)
        work(v);
    });
  };
  for_each_vertex([&](std::uint32_t v) {
    const glm::dvec3 n(mesh.normals[v]);
    Side front = side_transfer(occluder, v, n, directions);
    transfer[v].front = front.transfer;
    blockers[v] = std::move(front.blockers);
    is_buried[v] = front.back_fraction > kBuriedFraction;
    if (!closed)
      transfer[v].back = side_transfer(occluder, v, -n, directions).transfer;
  });
  const std::vector<bool> buried(is_buried.begin(), is_buried.end());
  fill_buried(mesh, buried, &VertexTransfer::front, transfer);
  for_each_vertex([&](std::uint32_t v) {
    transfer[v].bounce =
        mean_behind<TransferVector>(mesh, blockers[v], directions.size(), [&](std::uint32_t there, bool back) {
          return back ? transfer[there].back : transfer[there].front;
        });
  });
  fill_buried(mesh, buried, &VertexTransfer::bounce, transfer);
  for_each_vertex([&](std::uint32_t v) {
    const auto second =
        mean_behind<std::array<float, 1>>(mesh, blockers[v], directions.size(), [&](std::uint32_t there, bool back) {
          return std::array{back ? 0.0f : transfer[there].bounce[0]};
        });
    const float first = transfer[v].bounce[0];
    transfer[v].again = first > 0.0f ? std::clamp(second[0] / first, 0.0f, 1.0f) : 0.0f;
  });
  return transfer;
}

} // namespace daylit
