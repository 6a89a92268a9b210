#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec3.hpp>

#include "radiosity/detail/aimed_rays.h"
#include "radiosity/detail/patch_numbers.h"
#include "radiosity/detail/ray_fan.h"
#include "radiosity/detail/whole_faces.h"
#include "radiosity/patches.h"
#include "scene/core/program.h"

namespace daylit::radiosity {

struct GatherOptions {
  int rays = 1024; ///< per point, over the whole sphere
  /// Not empty: group of each patch; the members of one follow each other, and those of each half of it, and of each
  /// half of these, are neighbours. What the rays of a run of 2^k members bring is divided by area where fewer meet too
  /// few rays for their part to be more than noise; from afar a group counts as one.
  std::span<const std::uint32_t> group = {};
  const WholeFaces* faces = nullptr; ///< of the same facets; most rays are then quicker. Kept by reference
};

/// What points in the air see: the patch met by each of their rays. Kept for as many points as kMostKeptBytes allow;
/// those of the others are traced again whenever they are needed, with the same result. Refers to the set, the mesh
/// and the scene it was made of.
class GatherHits {
public:
  static constexpr std::size_t kMostKeptBytes = std::size_t{1} << 30;

  std::size_t points() const { return points_; }
  std::size_t patches() const { return set_->patches.size(); }
  /// Rays of their own for small holes, at points to which they bring more than their share of the light, `radiosity`
  /// of each patch. Once, before add_rays(). Error: interrupted.
  Result<void> aim_at(std::span<const HoleOutline> holes, std::span<const float> radiosity, const Progress& progress);
  /// More rays from some points, once: as often as `more` says for each point all directions again, turned about z by
  /// equal steps. Error: interrupted.
  Result<void> add_rays(std::span<const std::uint16_t> more, const Progress& progress);
  /// Mean over the directions from a point of the radiosity that is met there, and the variance of a ray of its fans.
  std::array<double, 2> moments(std::size_t point, std::span<const float> radiosity) const;
  /// The nine rows of a point, steradian / pi: coefficient lm = sum over patches of weights[lm][patch] * radiosity, and
  /// irradiance in the same way. Overwritten.
  void weights(std::size_t point, float* nine_rows, Bands bands = Bands::low) const;
  /// weights() of aggregated patches, summed: those up to aggregate_end[0], from there up to aggregate_end[1], and so
  /// on. A group is one aggregate, or each of its patches is.
  void weights(std::size_t point, std::span<const std::uint32_t> aggregate_end, float* nine_rows,
               Bands bands = Bands::low) const;
  /// Adds to rays[p] how many rays of the point meet patch p, each kRay; an aimed one in proportion to its solid angle,
  /// at least 1. Several threads may add to the list.
  void count_rays(std::size_t point, std::span<std::uint64_t> rays) const;
  static constexpr std::uint64_t kRay = 4096;
  /// Sets groups[g] (GatherOptions::group) to 1 where members, or runs of them, count by themselves at the point.
  void mark_distinguished(std::size_t point, std::span<std::uint8_t> groups) const;

private:
  friend Result<GatherHits> gather_hits(std::span<const glm::dvec3> points, const PatchSet& set,
                                        const SurfaceMesh& mesh, const RayScene& facets, const GatherOptions& options,
                                        const Progress& progress, std::size_t most_kept_bytes);
  /// Patches [first, end) that count as one from afar.
  struct Group {
    std::uint32_t group, first, end;
    glm::dvec3 middle, normal;
    double member_m2; ///< mean area
    double radius;    ///< of the sphere about the middle that holds the middles of the patches
  };
  static std::vector<Group> groups_of(const PatchSet& set, std::span<const std::uint32_t> group);
  /// Members of a group that only count together at the point: 1, 2, 4 and so on, up to all.
  std::size_t members_together(const glm::dvec3& point, const Group& group) const;
  void divide_by_area(const glm::dvec3& point, std::span<const std::uint32_t> aggregate_of,
                      std::vector<float>& sum) const;
  // A fan: all directions from a point, turned by an angle of its own. Fan p is the first one of point p.
  template <class Visit>
  void for_each_fan(std::size_t point, const Visit& visit) const;
  std::size_t fans_of(std::size_t point) const;
  std::size_t point_of(std::size_t fan) const;
  std::int32_t met_along(const glm::dvec3& origin, const glm::vec3& direction) const;
  void drop_covered(std::size_t fan, std::span<std::int32_t> met) const;
  Result<void> keep_fans(const Progress& progress);
  /// [aggregate][RayFan::kStride] of the rays of a fan; `aggregate_of` each patch.
  std::vector<float> sums(std::size_t fan, std::span<const std::uint32_t> aggregate_of, std::size_t aggregates,
                          Bands bands) const;
  /// The patches that a fan's rays meet: those kept, or else traced again.
  std::vector<std::int32_t> met(std::size_t fan) const;
  void trace(std::size_t fan, std::span<std::int32_t> met) const;
  /// Fills in what is WholeFaces::kUnknown, sixteen rays at a time.
  void trace_facets(std::size_t fan, std::span<std::int32_t> met) const;

  const PatchSet* set_ = nullptr;
  const SurfaceMesh* mesh_ = nullptr;
  const RayScene* scene_ = nullptr;
  const WholeFaces* faces_ = nullptr;
  std::size_t points_ = 0, most_kept_bytes_ = 0;
  std::vector<glm::dvec3> origin_;      ///< of each fan
  std::vector<glm::vec2> turn_;         ///< of each fan: cosine and sine of the angle
  std::vector<std::size_t> first_more_; ///< fan of each point after its first, and the end; empty: there are none
  std::vector<AimedRays> aimed_;        ///< of each point; empty: none has any
  std::size_t rays_ = 0;                ///< of a fan
  std::vector<Group> groups_;
  PatchNumbers patch_; ///< [fan][ray] of the first fans; -1 for none or a black side
  RayFan fan_;
  RayGroups rays_in_groups_; ///< of `fan_`
};
/// `points`: metres, relative to the mesh origin. Errors: interrupted.
Result<GatherHits> gather_hits(std::span<const glm::dvec3> points, const PatchSet& set, const SurfaceMesh& mesh,
                               const RayScene& facets, const GatherOptions& options, const Progress& progress,
                               std::size_t most_kept_bytes = GatherHits::kMostKeptBytes);

} // namespace daylit::radiosity
