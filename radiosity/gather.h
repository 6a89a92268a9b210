#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/detail/whole_faces.h"
#include "radiosity/patches.h"
#include "radiosity/solve.h"
#include "scene/core/program.h"

namespace daylit::radiosity {

struct GatherOptions {
  int rays = 1024; ///< per point, over the whole sphere
  /// Not empty: group of each patch; the members of one follow each other. From afar a group counts as one: what its
  /// rays bring is shared out by area where a member meets too few of them for its part to be more than noise.
  std::span<const std::uint32_t> group = {};
  const WholeFaces* faces = nullptr; ///< of the same facets; most rays are then quicker. Kept by reference
};

/// The rays of every point, each point's turned about z by an angle of its own: a spherical Fibonacci lattice, in an
/// order in which sixteen in a row are close together.
struct RayFan {
  static constexpr std::size_t kStride = 16;
  std::vector<glm::vec3> direction;
  std::vector<float> harmonics; ///< [ray][16]: nine of them times 4 / rays (dw / pi), then zeros
  std::vector<float> band4;     ///< the same of l = 4

  static RayFan of(int rays);
};

/// Which nine coefficients: of l <= 2, or of l = 4.
enum class Bands { low, fourth };

/// What points in the air see: the patch met by each of their rays. Kept for as many points as kMostKeptRays allow;
/// those of the others are traced again whenever they are asked for, with the same result. Refers to the set, the mesh
/// and the scene it was made of.
class GatherHits {
public:
  static constexpr std::size_t kMostKeptRays = std::size_t{1} << 27; ///< half a gigabyte

  std::size_t points() const { return points_.size(); }
  std::size_t patches() const { return set_->patches.size(); }
  /// The nine rows of a point: coefficient lm = sum over patches of weights[lm][patch] * radiosity. Cleared first.
  void weights(std::size_t point, float* nine_rows, Bands bands = Bands::low) const;
  /// Marks the groups (GatherOptions::group) whose members count by themselves at the point.
  void mark_distinguished(std::size_t point, std::span<std::uint8_t> groups) const;
  /// weights() of pieces: patches up to piece_end[0], from there up to piece_end[1], and so on, summed. A group is
  /// one piece, or each of its patches is.
  void weights(std::size_t point, std::span<const std::uint32_t> piece_end, float* nine_rows,
               Bands bands = Bands::low) const;

private:
  friend Result<GatherHits> gather_hits(std::span<const glm::dvec3> points, const PatchSet& set,
                                        const SurfaceMesh& mesh, const RayScene& facets, const GatherOptions& options,
                                        const Progress& progress, std::size_t most_kept_rays);
  const PatchSet* set_ = nullptr;
  const SurfaceMesh* mesh_ = nullptr;
  const RayScene* scene_ = nullptr;
  const WholeFaces* faces_ = nullptr;
  std::vector<glm::dvec3> points_;
  std::size_t rays_ = 0;
  /// Patches [first, end) that count as one from afar.
  struct Group {
    std::uint32_t group, first, end;
    glm::dvec3 middle, normal;
    double member_m2; ///< mean area
  };
  std::vector<Group> groups_;
  static std::vector<Group> groups_of(const PatchSet& set, std::span<const std::uint32_t> group);
  bool tells_apart(const glm::dvec3& point, const Group& group) const;
  void share_out(const glm::dvec3& point, std::span<const std::uint32_t> piece, std::vector<float>& sum) const;
  /// [piece][RayFan::kStride] of the rays from a point; `piece`: of each patch, the patches of a group all in one
  /// or each in its own.
  std::vector<float> sums(std::size_t point, std::span<const std::uint32_t> piece, std::size_t pieces,
                          Bands bands) const;
  /// The patches that a point's rays meet.
  void trace(std::size_t point, std::span<std::int32_t> met) const;
  std::vector<std::int32_t> patch_; ///< [point][ray] of the first points; -1 for none or a black side
  RayFan fan_;
  RayGroups rays_in_groups_; ///< of `fan_`
};
/// `points`: metres, relative to the mesh origin. Errors: interrupted.
Result<GatherHits> gather_hits(std::span<const glm::dvec3> points, const PatchSet& set, const SurfaceMesh& mesh,
                               const RayScene& facets, const GatherOptions& options, const Progress& progress,
                               std::size_t most_kept_rays = GatherHits::kMostKeptRays);

/// Nine SH coefficients of the indirect radiance at points in the air: L_lm = integral L(x, w) Y_lm(w) dw with
/// L = B / pi of the surface met by the ray (Grosch et al. 2007, eq. 2).
/// Result: [point][coefficient][column], columns as in Radiosity. Errors: interrupted.
Result<std::vector<float>> gather_coefficients(const GatherHits& hits, const Radiosity& radiosity,
                                               const Progress& progress, Bands bands = Bands::low);
/// At some of the points, in the order asked for.
Result<std::vector<float>> gather_coefficients(const GatherHits& hits, std::span<const std::size_t> points,
                                               const Radiosity& radiosity, const Progress& progress,
                                               Bands bands = Bands::low);

/// The same from the first light, without the radiosity of the room: adjoint solves for the 9 rows of every point.
/// Cheaper where the points are fewer than a ninth of the sky regions. `report` as solve_adjoint().
Result<std::vector<float>> adjoint_coefficients(const GatherHits& hits, const PatchSet& set,
                                                const ExchangeMatrix& exchange, const FirstBounce& light,
                                                const SolveOptions& solve, const Progress& progress,
                                                SolveReport* report = nullptr, Bands bands = Bands::low);

} // namespace daylit::radiosity
