#pragma once

// Sums of a picture's pixels by the hat functions of nodes, in one pass: the pixels between the same four nodes (a
// quad) belong together, and along a few pixels of a row their solid angle and their place between the nodes are
// straight lines. A pixel is read once instead of once for each of its nodes, and 7 bytes of table go with its 12.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "scene/sky/sky_partition.h"

namespace daylit::detail {

class QuadSums {
public:
  QuadSums() = default;
  /// Takes the pixels of at most `largest_sr`; for others the weights at the centre are not exact enough. `needed`: one
  /// per node, or empty for all; pixels between four nodes with 0 are left out.
  static QuadSums make(const SkyGeometry& geometry, const SkyPartition& nodes, double largest_sr,
                       std::span<const std::uint8_t> needed = {});

  /// sums[node][colour] += integral of radiance times hat function over the pixels taken, steradians times radiance.
  /// `texels`: of a picture of the geometry, interleaved. Does not depend on the number of threads.
  void add(const float* texels, std::span<std::array<double, 3>> sums) const;
  /// The same by the portable code, for machines without AVX-512.
  void add_portable(const float* texels, std::span<std::array<double, 3>> sums) const;

  /// Size of the tables that add() reads.
  std::size_t bytes() const { return segments_.size() * sizeof(Segment) + quads_.size() * sizeof(Quad); }

private:
  static constexpr std::size_t kSegmentTexels = 5; ///< of three colours: 15 of 16 lanes
  static constexpr std::size_t kLanes = 16;
  enum Share : std::size_t { up, right_below, right_above, kShares };
  /// In integers: kStepsOfStart * start + step * (texel after the first).
  struct Line {
    std::int16_t start, step;
  };
  struct Segment {
    std::uint32_t at;    ///< number of the first texel's first colour
    std::uint16_t lanes; ///< a bit for each number that counts
    std::uint16_t count; ///< texels
    float solid_angle_sr, solid_angle_step_sr;
    std::array<Line, kShares> share;
  };
  /// The next segments lie between the nodes whose sums these slots take.
  struct Quad {
    std::array<std::uint32_t, 4> slot;
    std::uint32_t segments;
  };
  struct Part {
    std::size_t quad, segment; ///< the first
  };
  struct Pixel;
  struct Strip;
  using Lanes = std::array<float, kLanes>;
  using AddQuads = void (*)(std::span<const Quad>, const Segment*, const float* texels, Lanes* sums);

  std::vector<Segment> segments_;
  std::vector<Quad> quads_;
  std::vector<Part> part_;                ///< bands of the picture that threads take, and the end
  std::vector<std::uint32_t> first_slot_; ///< of each node's sums, and the end

  static Strip make_strip(const SkyGeometry& geometry, const SkyPartition& nodes, double largest_sr, double most_sr,
                          std::span<const std::uint8_t> needed, std::size_t row);
  static Segment first_segment(std::span<const Pixel> pixels, double most_sr_error, double most_share_error);
  static bool fit(std::span<const Pixel> pixels, double most_sr_error, double most_share_error, Segment& segment);
  static void add_quads(std::span<const Quad> quads, const Segment* segment, const float* texels, Lanes* sums);
  static void add_quads_avx512(std::span<const Quad> quads, const Segment* segment, const float* texels, Lanes* sums);
  void add_by(AddQuads kernel, const float* texels, std::span<std::array<double, 3>> sums) const;
};

} // namespace daylit::detail
