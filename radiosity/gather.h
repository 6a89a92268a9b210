#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/elements.h"
#include "radiosity/solve.h"
#include "scene/program.h"

namespace daylit::radiosity {

struct GatherOptions {
  int rays = 1024; ///< per point, over the whole sphere
};

/// The rays of every point, each point's turned about z by an angle of its own: a spherical Fibonacci lattice, in an
/// order in which sixteen in a row are close together.
struct RayFan {
  static constexpr std::size_t kStride = 16;
  std::vector<glm::vec3> direction;
  std::vector<float> harmonics; ///< [ray][16]: nine of them times 4 / rays (dw / pi), then zeros

  static RayFan of(int rays);
};

/// What points in the air see: the element met by each of their rays. Kept for as many points as kMostKeptRays allow;
/// those of the others are traced again whenever they are asked for, with the same result. Refers to the set, the mesh
/// and the scene it was made of.
class GatherHits {
public:
  static constexpr std::size_t kMostKeptRays = std::size_t{1} << 27; ///< half a gigabyte

  std::size_t points() const { return points_.size(); }
  std::size_t elements() const { return set_->elements.size(); }
  /// The nine rows of a point: coefficient lm = sum over elements of weights[lm][element] * radiosity. Cleared first.
  void weights(std::size_t point, float* nine_rows) const;
  const RayFan& fan() const { return fan_; }
  /// The element met by each ray of a point, in the order of the fan; -1 for none or a black side.
  std::vector<std::int32_t> met(std::size_t point) const;

private:
  friend Result<GatherHits> gather_hits(std::span<const glm::dvec3> points, const ElementSet& set,
                                        const PatchMesh& mesh, const RayScene& patches, const GatherOptions& options,
                                        const Progress& progress, std::size_t most_kept_rays);
  const ElementSet* set_ = nullptr;
  const PatchMesh* mesh_ = nullptr;
  const RayScene* scene_ = nullptr;
  std::vector<glm::dvec3> points_;
  std::size_t rays_ = 0;
  std::vector<std::int32_t> element_; ///< [point][ray] of the first points; -1 for none or a black side
  RayFan fan_;
};
/// `points`: metres, relative to the mesh origin. Errors: interrupted.
Result<GatherHits> gather_hits(std::span<const glm::dvec3> points, const ElementSet& set, const PatchMesh& mesh,
                               const RayScene& patches, const GatherOptions& options, const Progress& progress,
                               std::size_t most_kept_rays = GatherHits::kMostKeptRays);

/// Nine SH coefficients of the indirect radiance at points in the air: L_lm = integral L(x, w) Y_lm(w) dw with
/// L = B / pi of the surface met by the ray (Grosch et al. 2007, eq. 2).
/// Result: [point][coefficient][column], columns as in Radiosity. Errors: interrupted.
Result<std::vector<float>> gather_coefficients(const GatherHits& hits, const Radiosity& radiosity,
                                               const Progress& progress);

/// The same from the first light, without the radiosity of the room: adjoint solves for the 9 rows of every point.
/// Cheaper where the points are fewer than a ninth of the sky regions. `report` as solve_adjoint().
Result<std::vector<float>> adjoint_coefficients(const GatherHits& hits, const ElementSet& set,
                                                const ExchangeMatrix& exchange, const FirstBounce& light,
                                                const SolveOptions& solve, const Progress& progress,
                                                SolveReport* report = nullptr);

} // namespace daylit::radiosity
