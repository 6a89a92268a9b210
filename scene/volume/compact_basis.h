#pragma once

// A basis for thousands of sky directions in a small file, in two steps. The sky lights the surfaces: the irradiance of
// each element (a source) is a sparse sum over the sky's nodes, kept at full angular resolution. The surfaces light the
// probes: for each cluster of neighbouring probes the transport from all sources is a product of two factors, whose
// rank follows from the error (clustered low-rank transport, as Sloan et al. 2003 have it for transfer vectors):
//   irradiance[source, c]  = sum_node light[source, node] radiance[node, c]
//   amplitude[k, c]        = scale[k] sum_i source_factor[k, i] irradiance[source[i], c]
//   field[probe, lm, c]    = sum_k probe_factor[k, probe, lm, c] amplitude[k, c]
// A source of a cluster is an element, or an aggregated source: neighbouring elements that the cluster sees as one
// (aggregation of distant sources as in hierarchical matrices, Hackbusch 2015). Components that carry much light have
// 16 bits a number, the others 8.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/volume/first_light.h"

namespace daylit {

/// Real orthonormal SH coefficients of radiance, index l*l+l+m, l <= 2.
using Sh9Rgb = std::array<Rgb, 9>;
/// Those of l = 4, index m + 4: what irradiance takes next, because its kernel has no band 3 (sh/band4.h).
using Band4Rgb = std::array<Rgb, 9>;

/// Components of one storage type, cluster by cluster.
template <class T>
struct Components {
  std::vector<float> scale;     ///< of each component
  std::vector<T> source_factor; ///< [component, source of the cluster]
  std::vector<T> probe_factor;  ///< [component, probe of the cluster, lm, channel]

  std::size_t bytes() const {
    return sizeof(float) * scale.size() + sizeof(T) * (source_factor.size() + probe_factor.size());
  }
};

/// From the sources to nine coefficients per probe.
struct CompactFactors {
  struct Cluster {
    std::uint32_t probes = 0, sources = 0;
    std::uint32_t strong = 0, weak = 0; ///< components of 16 and of 8 bits
  };
  std::vector<Cluster> cluster;
  std::vector<std::uint32_t> probe;  ///< ids, cluster by cluster, each at most once
  std::vector<std::uint32_t> source; ///< cluster by cluster: element, or sources + aggregated source
  Components<std::int16_t> strong;
  Components<std::int8_t> weak;

  std::size_t bytes() const;
};

struct CompactBasis {
  /// Sources [first, end) as one: the sum of aggregate_weight * irradiance. They follow each other.
  struct Aggregate {
    std::uint32_t first = 0, end = 0;
  };
  FirstLight light;              ///< irradiance of each source
  std::vector<float> light_unit; ///< of each source: what 1 is in radiance unit x sr; empty: not known
  std::vector<Aggregate> aggregate;
  std::vector<float> aggregate_weight; ///< of each source
  CompactFactors nine;                 ///< coefficients of l <= 2
  CompactFactors band4;                ///< of l = 4, of the probes where they change irradiance; no clusters: not known

  std::size_t sources() const { return light.sources(); }
  std::size_t bytes() const;
};

/// Where the parts of a cluster begin.
struct ClusterOffsets {
  struct Part {
    std::size_t component = 0, source_factor = 0, probe_factor = 0;
  };
  std::size_t probe = 0, source = 0;
  Part strong, weak;
};
std::vector<ClusterOffsets> cluster_offsets(const CompactFactors& factors); ///< of each cluster, and the end

/// Coefficients at all probes, those of no cluster zero; `result` has one entry per probe of the volume, and so has
/// `band4` unless it is empty: then that part is not read. Independent of the thread count.
void combine(const CompactBasis& basis, std::span<const Rgb> region_radiance, std::span<Sh9Rgb> result,
             std::span<Band4Rgb> band4 = {});

/// Sizes agree, indices are in range, numbers are finite.
Result<void> check_compact(const CompactBasis& basis, int regions, std::size_t probes);

} // namespace daylit
