#pragma once

// The sphere of directions cut into N regions. Every partition has the horizon as a border: bands of altitude,
// each divided into equal azimuth cells; lower half = mirror image of the upper half.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/sky/sky_image.h"

namespace daylit {

namespace detail {
struct TexelMatrix;
}

/// sin(altitude) in [sin_low, sin_high), `cells` equal azimuth cells, the first one centred on azimuth 0 (+x) when
/// `centred`, else starting there. Regions are numbered first_region + cell, cells counter-clockwise.
struct SkyBand {
  double sin_low = 0, sin_high = 0;
  int cells = 1;
  int first_region = 0;
  bool centred = false;
};

/// A region of unequal size: `cells` azimuth cells from `cell` on, in `bands` bands from `band` on, of bands that all
/// have the same number of cells.
struct SkyRectangle {
  int band = 0, cell = 0, bands = 1, cells = 1;
};

/// A region and its weight in the radiance of a direction.
struct RegionWeight {
  int region = 0;
  double weight = 0;
};

/// Regions are constant, or nodes: between the centres of neighbouring regions the transport is interpolated
/// linearly, in azimuth within a band and in altitude between bands. A node then stands for the radiance weighted by
/// its hat function, so that a small sun moves through the sky without jumps; the horizon is no border any more.
class SkyPartition {
public:
  /// N equal-solid-angle regions (N even, 2..100000), as square as bands allow.
  static Result<SkyPartition> uniform(int regions);
  /// Tregenza's 145 patches (scene/volume/radiance_matrix.h) above the horizon and their mirror image below: 290
  /// regions.
  static SkyPartition tregenza();
  /// Reinhart MF:K (K = 1 is Tregenza; 2 is 577 + 577) with the zenith cap undivided. 1 <= K <= 12.
  static Result<SkyPartition> reinhart(int k);
  /// About N nodes, evenly spaced, in bands of a multiple of four: every vertical plane along an axis passes through
  /// nodes, so that the hat functions of the directions that a window in it sees end at the plane.
  static Result<SkyPartition> fine(int nodes);
  /// "uniform:64", "tregenza", "reinhart:2", "fine:4096".
  static Result<SkyPartition> parse(const std::string& text);
  /// Bands from a file: checked to cover the sphere once and to have the horizon as a border.
  static Result<SkyPartition> from_bands(std::vector<SkyBand> bands, std::string name);

  /// Unequal regions: rectangles of the cells of `bands`, kMostCells at most. Checked to cover every cell once and not
  /// to cross the horizon.
  static constexpr int kMostCells = 1 << 14;
  static Result<SkyPartition> from_rectangles(std::vector<SkyBand> bands, std::vector<SkyRectangle> rectangles,
                                              std::string name);

  int size() const { return size_; }
  const std::string& name() const { return name_; }            ///< as parse() reads it
  const std::vector<SkyBand>& bands() const { return bands_; } ///< from nadir to zenith
  bool interpolated() const { return interpolated_; }
  /// Cells are numbered as regions are without rectangles: first_region + cell.
  int region_of_cell(int cell) const {
    return region_of_cell_.empty() ? cell : region_of_cell_[static_cast<std::size_t>(cell)];
  }
  /// One per region; empty where every cell of the bands is a region by itself.
  const std::vector<SkyRectangle>& rectangles() const { return rectangles_; }
  /// Its cells, upwards and around: both 1 without rectangles. sample() at fractions of these stays within a cell.
  SkyRectangle extent(int region) const;
  /// The same regions as nodes, or as constants.
  SkyPartition with_interpolation(bool on) const;
  int region_of(const glm::dvec3& unit_direction) const;
  double solid_angle_sr(int region) const;
  /// Unit vector to the middle of the region (mean direction).
  glm::dvec3 centre(int region) const;
  /// Direction at relative position (s, t) in [0,1)^2 of a region; uniform in solid angle.
  glm::dvec3 sample(int region, double s, double t) const;

  /// Values of the hat functions at a direction: weights >= 0 that sum to 1, some possibly of the same region.
  std::array<RegionWeight, 4> interpolation(const glm::dvec3& unit_direction) const;
  /// Integral of a region's hat function over the sphere.
  double hat_sr(int region) const;

private:
  std::vector<SkyBand> bands_;
  std::string name_;
  int size_ = 0;
  bool interpolated_ = false;
  std::vector<SkyRectangle> rectangles_;
  std::vector<std::int32_t> region_of_cell_; ///< of the bands' cells; empty without rectangles
  std::vector<double> node_altitude_;        ///< of the centres of each band's regions, radians
  int band_of(double sin_altitude) const;
  const SkyBand& band_of_region(int region) const;
  /// A region's limits: sines of altitude, first azimuth and width.
  struct Limits {
    double sin_low, sin_high, azimuth, width;
    bool whole_turn;
  };
  Limits limits(int region) const;
};

/// Which pixels make up which region, worked out once for a geometry and a partition; the runtime reduces every frame
/// of a sky camera with the same one. A sparse matrix from pixels to regions, row by row: the steradians that each
/// pixel gives to a region.
class RegionSums {
public:
  /// `needed`: one per region, 0 for regions that are not wanted: they come out black, and pixels that only they
  /// have are not read. Empty: all are needed.
  static RegionSums make(std::shared_ptr<const SkyGeometry> geometry, const SkyPartition& partition,
                         std::span<const std::uint8_t> needed = {});
  /// Mean radiance per region; of nodes: the integral of radiance times hat function over the region's solid angle.
  /// `sky` must have the geometry given to make(), or one of equal size and projection. Independent of the thread
  /// count.
  std::vector<Rgb> reduce(const SkyImage& sky) const;
  /// Part of each needed region's solid angle that the camera sees; the rest takes the fill.
  double covered_fraction(int region) const;
  /// Size of the tables that reduce() reads, bytes.
  std::size_t bytes() const;

private:
  /// mean = sum * per_sr + fill, the fill by where the region's centre lies
  struct Divisor {
    double per_sr = 0;
    float fill_above = 0, fill_below = 0;
  };
  std::shared_ptr<const SkyGeometry> geometry_;
  std::shared_ptr<const detail::TexelMatrix> texels_;
  std::vector<double> covered_, gap_; ///< steradians
  std::vector<Divisor> divisor_;
  std::vector<std::uint32_t> unseen_; ///< regions that met no texel and have no gap
  std::vector<glm::dvec3> centre_;

  void measure_coverage(const SkyPartition& partition);
  void set_divisors(const SkyPartition& partition, std::span<const std::uint8_t> needed);
};

/// Solid-angle mean radiance of every region, pixels split where a border crosses them; directions that the image
/// does not cover take its ground fill. Double accumulation, result independent of thread count.
std::vector<Rgb> region_radiance(const SkyImage& sky, const SkyPartition& partition);

} // namespace daylit
