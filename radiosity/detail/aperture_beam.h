#pragma once

// Parallel light through an opening: which part of a patch it meets.

#include <array>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "radiosity/patches.h"
#include "scene/sky/sky_partition.h"

namespace daylit::radiosity {

/// Directions that stand for the regions of a partition, region after region: the same number for each, one in every
/// square of n x n equal shares of its solid angle and in every row and column of n^2 (Chiu, Shirley & Wang 1994),
/// since the edges of shadows run along the rows of a plain grid.
struct SkyDirections {
  std::vector<glm::dvec3> w; ///< unit
  std::vector<std::int32_t> region;
  std::vector<double> solid_angle_sr; ///< of the share that a direction stands for

  /// At least `count` directions, and at least 2 x 2 in a constant region. A node may be its own direction alone.
  static SkyDirections make(const SkyPartition& partition, int count);
};

/// A convex piece of an opening, at most eight corners (metres, relative to the mesh origin).
struct AperturePiece {
  std::vector<glm::dvec3> corner;
  glm::dvec3 inward{0.0};
  std::uint32_t aperture = 0;
};
std::vector<AperturePiece> aperture_pieces(const std::vector<Aperture>& apertures, const glm::dvec3& origin);

/// Directions that come in through one piece, one array per coordinate.
struct EnteringDirections {
  std::vector<float> x, y, z;
  std::vector<std::uint32_t> number; ///< in SkyDirections

  /// Of the angles with an axis.
  std::vector<float> cosines(const glm::dvec3& axis) const;
};

/// Directions for all of the sky, and which of them come in through each piece.
struct SkySweep {
  SkyDirections sky;
  std::vector<EnteringDirections> entering;

  SkySweep(const SkyPartition& partition, const std::vector<AperturePiece>& pieces, int count);
};

/// One patch and one piece of an opening. Seen along a direction w, the opening's shadow on the patch's plane is
/// its outline moved by -h w / (n . w), h the height of a corner over the plane: an exact clip gives the lit part.
class ApertureBeam {
public:
  /// The part of the piece in front of the patch counts; empty() when there is none.
  ApertureBeam(const Patch& patch, const AperturePiece& piece);
  bool empty() const { return front_.size() < 3; }
  /// The corners of the piece in front of the patch.
  const std::vector<glm::dvec3>& front() const { return front_; }

  /// Only directions whose cosine with the axis is at least cos_spread() can meet the patch through the opening.
  const glm::dvec3& axis() const { return axis_; }
  float cos_spread() const { return cos_spread_; }

  struct LitPart {
    std::array<glm::dvec2, 12> corner; ///< in the patch's plane
    int size = 0;
    double area_m2 = 0;
  };
  LitPart lit(const glm::dvec3& w) const;
  /// A point of the lit part, uniform; metres, relative to the mesh origin.
  glm::dvec3 point(const LitPart& part, glm::dvec2 u) const;

private:
  glm::dvec3 origin_, axis_u_, axis_v_, normal_;
  std::array<glm::dvec2, 3> triangle_;
  double area_m2_;
  bool covers_patch(const LitPart& shadow) const;
  /// As they are; u, v and height over the patch's plane, in the order in which their shadows turn left.
  std::vector<glm::dvec3> front_, corner_;
  glm::dvec3 axis_{0.0}; ///< towards the middle of the piece
  float cos_spread_ = -2;
};

/// Decides without rays that nothing can stand between a patch and an opening, nor outside the opening.
class OpenPaths {
public:
  OpenPaths(const SurfaceMesh& mesh, const std::vector<Aperture>& apertures, const std::vector<AperturePiece>& pieces);
  /// True only when no facet and no other opening meets the hull of the two, except by touching it, and nothing lies
  /// beyond the opening. `front`: the corners of the piece that count.
  bool clear(const Patch& patch, std::size_t piece, const std::vector<glm::dvec3>& front) const;

private:
  struct Box {
    glm::dvec3 lo, hi;
    void include(const glm::dvec3& p);
  };
  struct Sheet {
    glm::dvec3 point, normal;
    Box box;
  };
  void add_sheets(const SurfaceMesh& mesh, const std::vector<Aperture>& apertures);
  bool parted(const Sheet& sheet, const Patch& patch, const std::vector<glm::dvec3>& front, const Box& hull) const;

  std::vector<Sheet> sheets_; ///< planes of the mesh, then the openings
  std::size_t first_opening_ = 0;
  std::vector<bool> open_outside_; ///< per piece
  const std::vector<AperturePiece>& pieces_;
  double tolerance_m_ = 0;
};

} // namespace daylit::radiosity
