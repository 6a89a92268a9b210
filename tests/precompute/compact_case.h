#pragma once

// A smooth synthetic response of points to directions, and the transport that a compact basis of it is made from.

#include <cmath>
#include <memory>
#include <numbers>

#include <glm/geometric.hpp>

#include "precompute/compact_sky.h"
#include "precompute/detail/node_sharpening.h"
#include "scene/volume/compact_basis.h"
#include "scene/volume/volume.h"

namespace daylit::precompute::test_case {

inline const Progress kQuiet = [](const std::string&, double) { return true; };

constexpr int kPieces = 512;

/// Pieces of surface that each receive a wide patch of the sky, in lobes about an axis of their own.
inline glm::dvec3 axis_of(const SkyPartition& pieces, std::size_t piece) {
  return pieces.centre(static_cast<int>(piece));
}

/// Irradiance of a piece under a sun of flux 1 from d.
inline double lit(const glm::dvec3& axis, const glm::dvec3& d) { return std::exp(20.0 * (glm::dot(axis, d) - 1.0)); }

/// Row lm of a point: what it receives from each piece.
inline double row_weight(const glm::vec3& p, std::size_t lm, const glm::dvec3& axis) {
  const double turn = 0.3 * static_cast<double>(p.x) + 0.2 * static_cast<double>(lm);
  const glm::dvec3 to = glm::normalize(glm::dvec3(std::cos(turn), std::sin(turn), 0.3 + 0.2 * double(p.z)));
  return std::exp(2.0 * (glm::dot(to, axis) - 1.0)) * (1.0 + 0.1 * static_cast<double>(lm));
}

inline const Rgb kReflectance{0.9f, 0.6f, 0.3f};

struct Case {
  SkyPartition partition = *SkyPartition::fine(2048), pieces = *SkyPartition::uniform(kPieces);
  ProbeSet probes;
  std::vector<std::size_t> probe_of_point;
  SurfaceLight light; ///< each piece is an element; all elements of a patch look the same from the points
  std::size_t elements_of_patch = 1;
  double dim = 1;                  ///< light of the points with x >= 3, which are then a part of the air of their own
  std::vector<std::uint32_t> part; ///< of each point

  double light_at(std::size_t point) const { return probes.positions[probe_of_point[point]].x >= 3.0f ? dim : 1.0; }
  /// Of element e.
  float weight(std::size_t point, std::size_t lm, std::size_t e) const {
    return static_cast<float>(light_at(point) *
                              row_weight(probes.positions[probe_of_point[point]], lm,
                                         axis_of(pieces, e / elements_of_patch * elements_of_patch)) /
                              static_cast<double>(elements_of_patch));
  }
};

/// Only directions with y > -0.5 light anything. Further bounces: every piece passes a hundredth of the light on its
/// cluster, a patch, to the next one.
inline Case make_case(int side, std::size_t elements_of_patch = 1) {
  Case c;
  c.elements_of_patch = elements_of_patch;
  for (int k = 0; k < side * side * side; ++k) {
    c.probes.positions.emplace_back(k % side, k / side % side, k / side / side);
    c.probes.valid.push_back(k % 7 != 3);
    if (k % 7 != 3)
      c.probe_of_point.push_back(static_cast<std::size_t>(k));
  }
  c.light.patches = kPieces / elements_of_patch;
  c.light.elements = kPieces;
  std::vector<radiosity::FirstBounceRow> rows;
  for (std::size_t e = 0; e < c.light.elements; ++e) {
    c.light.parent.push_back(static_cast<std::uint32_t>(e / elements_of_patch));
    c.light.element_fraction.push_back(1.0f / static_cast<float>(elements_of_patch));
    radiosity::FirstBounceRow row;
    for (int r = 0; r < c.partition.size(); ++r)
      if (const glm::dvec3 d = c.partition.centre(r); d.y > -0.5 && lit(axis_of(c.pieces, e), d) > 1e-4) {
        row.region.push_back(r);
        row.irradiance.emplace_back(static_cast<float>(lit(axis_of(c.pieces, e), d) * c.partition.solid_angle_sr(r)));
      }
    if (row.region.empty())
      continue;
    c.light.source.push_back(static_cast<std::uint32_t>(e));
    c.light.reflectance.push_back(kReflectance);
    c.light.cluster.push_back(c.light.parent[e]);
    c.light.cluster_fraction.push_back(c.light.element_fraction[e]);
    rows.push_back(std::move(row));
  }
  detail::sharpen_nodes(c.partition, rows);
  c.light.light = std::move(rows);
  c.light.clusters = c.light.patches;
  c.light.bounced.assign(c.light.patches * 3 * c.light.clusters, 0.0f);
  for (std::size_t s = 0; s < c.light.clusters; ++s)
    for (std::size_t channel = 0; channel < 3; ++channel)
      c.light.bounced[((s + 1) % c.light.patches * 3 + channel) * c.light.clusters + s] = 0.01f;
  return c;
}

/// The field of a sun of flux 1 from d, by its definition.
inline std::vector<Sh9Rgb> exact_field(const Case& c, const glm::dvec3& d) {
  std::vector<glm::dvec3> radiosity(c.light.elements, glm::dvec3(0.0));
  const std::size_t n = c.elements_of_patch;
  for (std::size_t s = 0; s < c.light.source.size(); ++s) {
    const double e = lit(axis_of(c.pieces, c.light.source[s]), d);
    radiosity[c.light.source[s]] += e * glm::dvec3(kReflectance);
    const std::size_t next = (c.light.source[s] / n + 1) % c.light.patches;
    for (std::size_t element = next * n; element < (next + 1) * n; ++element)
      radiosity[element] += e / static_cast<double>(n) * glm::dvec3(0.01);
  }
  std::vector<Sh9Rgb> field(c.probes.size());
  for (std::size_t p = 0; p < c.probe_of_point.size(); ++p)
    for (std::size_t lm = 0; lm < 9; ++lm) {
      glm::dvec3 sum(0.0);
      for (std::size_t e = 0; e < c.light.elements; ++e)
        sum += double(c.weight(p, lm, e)) * radiosity[e];
      field[c.probe_of_point[p]][lm] = Rgb(sum);
    }
  return field;
}

/// `band4`: not 0: rows of l = 4, as those of the nine in another order and times this.
inline Result<CompactBasis> try_compress(const Case& c, double error, const Progress& progress,
                                         CompactReport* report = nullptr, bool distinguished = false, float band4 = 0) {
  const auto mark = [&](std::span<const std::uint32_t>, std::span<Sight> patches) {
    std::ranges::fill(patches, distinguished ? Sight::of_elements : Sight::of_patch);
  };
  const auto rows = [&](std::span<const std::uint32_t> points, std::span<const std::uint32_t> end, float* out) {
    for (const std::uint32_t point : points)
      for (std::size_t lm = 0; lm < 9; ++lm)
        for (std::size_t k = 0, e = 0; k < end.size(); ++k)
          for (*out++ = 0.0f; e < end[k]; ++e)
            out[-1] += c.weight(point, lm, e);
  };
  GatherRows gather{mark, rows};
  if (band4 != 0)
    gather.band4_rows = [&](std::span<const std::uint32_t> points, std::span<const std::uint32_t> end, float* out) {
      for (const std::uint32_t point : points)
        for (std::size_t m = 0; m < 9; ++m)
          for (std::size_t k = 0, e = 0; k < end.size(); ++k)
            for (*out++ = 0.0f; e < end[k]; ++e)
              out[-1] += band4 * c.weight(point, 8 - m, e);
    };
  const ProbeClusters clusters = probe_clusters(c.probes, c.probe_of_point, c.part, 40);
  SurfaceLight light = c.light;
  for (std::size_t k = 0; k < clusters.size(); ++k)
    light.fraction_for_probes.insert(light.fraction_for_probes.end(), light.cluster_fraction.begin(),
                                     light.cluster_fraction.end());
  return compact_sky(light, gather, clusters, c.probe_of_point, c.partition, {.error = error}, progress, report);
}

inline CompactBasis compress(const Case& c, double error, CompactReport* report = nullptr, bool distinguished = false,
                             float band4 = 0) {
  auto basis = try_compress(c, error, kQuiet, report, distinguished, band4);
  EXPECT_TRUE(basis) << basis.error().message();
  return *basis;
}

/// A sun of flux 1 from a direction, on the nodes.
inline std::vector<Rgb> sun(const SkyPartition& partition, const glm::dvec3& d) {
  std::vector<Rgb> radiance(static_cast<std::size_t>(partition.size()), Rgb(0.0f));
  for (const RegionWeight& w : partition.interpolation(d))
    radiance[static_cast<std::size_t>(w.region)] +=
        Rgb(static_cast<float>(w.weight / partition.solid_angle_sr(w.region)));
  return radiance;
}

/// `dim_ones`: over the points with x >= 3 alone.
inline double relative_error(const Case& c, const CompactBasis& basis, const glm::dvec3& d, bool dim_ones = false) {
  std::vector<Sh9Rgb> field(c.probes.size());
  combine(basis, sun(c.partition, d), field);
  const std::vector<Sh9Rgb> truth = exact_field(c, d);
  double error = 0, power = 0;
  for (const std::size_t p : c.probe_of_point)
    for (std::size_t row = 0; row < 27 && (!dim_ones || c.probes.positions[p].x >= 3.0f); ++row) {
      const double t = static_cast<double>(truth[p][row / 3][static_cast<int>(row % 3)]);
      const double e = static_cast<double>(field[p][row / 3][static_cast<int>(row % 3)]) - t;
      error += e * e;
      power += t * t;
    }
  return std::sqrt(error / power);
}

inline BasisVolume volume_of(const Case& c) {
  return {.partition = c.partition,
          .probes = c.probes,
          .stored_region = {},
          .basis = {},
          .compact = std::make_shared<const CompactBasis>(compress(c, 0.02)),
          .room = {},
          .apertures = {},
          .provenance = {}};
}

} // namespace daylit::precompute::test_case
