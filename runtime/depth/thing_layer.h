#pragma once

// Real things that the room's model lacks, as a layer over what is drawn into the photograph: where they hide the
// objects, and where the change of light is theirs and not that of the wall behind them.
//
// Edges are softer than the depth picture: a pixel at the edge of a thing mixes its colour with that of what is behind,
// p = a F + (1 - a) B, and the photograph says how much (Porter & Duff 1984; the mean colours F and B of the two sides
// are those of the pixels around). Where they are too much alike, a is the part of the pixels around that show the
// thing.

#include <cstddef>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "runtime/base/photo_pixels.h"
#include "runtime/depth/real_things.h"
#include "runtime/object/object_rays.h"

namespace daylit {

/// In the photograph's pixels.
struct ThingLayer {
  std::vector<float> part;  ///< of the pixel that a thing fills, 0..1
  std::vector<float> hides; ///< of the objects in the pixel, the part that a thing stands before, 0..1
  /// What is added to pixels where an object stands behind the edge of a thing: the colour that was behind it goes.
  std::vector<std::pair<std::size_t, Rgb>> edges;
  /// What the photograph of a thing is multiplied with in a pixel.
  std::function<Rgb(int x, int y)> light_ratio;
};

/// Of `photo`, taken by `camera`. `coverage`: per pixel, the part of it that virtual objects fill, as if the things
/// were not there.
class ThingLayerMaker {
public:
  ThingLayerMaker(const RealThings& things, const RenderCamera& camera, const PhotoPixels& photo);
  /// light_ratio stays as it is.
  void make(const ObjectRays& objects, const std::function<float(int x, int y)>& coverage, ThingLayer& layer) const;
  /// Depth of the thing in a photograph's pixel, metres; 0 where it shows none.
  float z(int x, int y) const;
  /// Empty where there is none.
  std::optional<ThingPoint> point(int x, int y) const;

private:
  struct Sides;
  glm::ivec2 drawn(int x, int y) const;
  bool is_edge(int x, int y) const;
  Sides sides(int x, int y) const;
  float part(int x, int y, Rgb& contrast) const;
  float nearest_z(int x, int y) const;
  double object_z(const ObjectRays& objects, int x, int y) const;

  const RealThings& things_;
  const RenderCamera& camera_;
  const PhotoPixels photo_;
};

} // namespace daylit
