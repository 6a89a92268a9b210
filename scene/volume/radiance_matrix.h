#pragma once

// Matrices of daylight coefficients for Radiance (dctimestep, rmtxop), and the sky patches that they refer
// to.

#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/image/rgb_image.h"
#include "scene/sky/sky_partition.h"

namespace daylit {

/// Rows are sensors, columns sky patches; values are irradiance per patch radiance, steradian.
struct RadianceMatrix {
  int rows = 0, columns = 0;
  std::vector<Rgb> value; ///< [row][column]

  Rgb& at(int row, int column) { return value[static_cast<std::size_t>(row) * columns + column]; }
  const Rgb& at(int row, int column) const { return value[static_cast<std::size_t>(row) * columns + column]; }
};

enum class MatrixFormat { ascii, float32, float64 };

/// Header (#?RADIANCE, the comment, NROWS, NCOLS, NCOMP=3, byte order, FORMAT), a blank line, then the values row by
/// row: ascii one sensor per line, nine digits; binary little-endian.
std::string matrix_text(const RadianceMatrix& matrix, MatrixFormat format, const std::string& comment);

/// The sky patches of Reinhart's subdivision MF:K as gendaymtx and reinhart.cal number them: patch 0 is the ground (the
/// whole lower hemisphere), then 7 K rows from the horizon up, each 90 / (7 K + 1/2) degrees high with K times the
/// cells of Tregenza's row, and the zenith cap of half a row. In a row the first cell is centred on north (+y), and
/// they run clockwise seen from above, over east (+x).
class ReinhartPatches {
public:
  /// K = 1 is Tregenza (145 + ground), 2: 577 + 1, 4: 2305 + 1. 1 <= K <= 12.
  static Result<ReinhartPatches> make(int k);

  int size() const { return size_; } ///< ground included
  int patch_of(const glm::dvec3& unit_direction) const;
  double solid_angle_sr(int patch) const;
  /// Middle of the patch in altitude and azimuth; the ground's is -z.
  glm::dvec3 centre(int patch) const;
  /// Direction at (s, t) in [0,1)^2 of a patch; uniform in solid angle.
  glm::dvec3 sample(int patch, double s, double t) const;

  /// The radiance of every region of a partition under a sky that is 1 in this patch and 0 elsewhere: mean over a
  /// constant region, integral with the hat function over the region's solid angle for a node. Closed forms.
  std::vector<RegionWeight> region_radiances(int patch, const SkyPartition& partition) const;

private:
  struct Row {
    double sin_low, sin_high, altitude;
    int cells, first;
  };
  std::vector<Row> rows_; ///< from the horizon; the last is the cap
  int size_ = 0;
  const Row& row_of(int patch) const;
};

} // namespace daylit
