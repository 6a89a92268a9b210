#pragma once

// Room models as OBJ text, built of the pieces that rooms are made of.

#include <functional>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

namespace daylit::bench {

/// A rectangle across an axis; u and v are the two other axes in the order x, y, z (metres).
struct Rectangle {
  double u0 = 0, v0 = 0, u1 = 0, v1 = 0;
};

/// A space of a model, metres.
struct Space {
  glm::dvec3 low{0.0}, high{0.0};
};

class ModelWriter {
public:
  /// Material of the faces that follow.
  void material(const std::string& name);
  void face(std::span<const glm::dvec3> corners);
  void face(std::initializer_list<glm::dvec3> corners) { face(std::span(corners.begin(), corners.size())); }
  void rectangle(int axis, double at, const Rectangle& r);
  /// A rectangle without its holes, which do not overlap; as many upright strips as the holes need.
  void panel(int axis, double at, const Rectangle& r, const std::vector<Rectangle>& holes = {});
  /// The four sides of an opening through a wall.
  void reveal(int axis, double from, double to, const Rectangle& opening);
  /// Bit k of `faces` keeps face k: 0 floor, 1 ceiling, 2 low y, 3 high y, 4 low x, 5 high x.
  void box(const Space& space, unsigned faces = 0b111111u);
  /// A box without its underside that stands on something; remembered as filled.
  void solid(const Space& space);
  /// Points (u, v) of a surface, u and v from 0 to 1, as `nu` x `nv` quadrilaterals of two triangles each; one where
  /// two of the four corners meet.
  void surface(int nu, int nv, const std::function<glm::dvec3(double, double)>& at);

  /// Insides of solids: no air.
  const std::vector<Space>& filled() const { return filled_; }
  std::size_t faces() const { return face_count_; }
  std::string obj(const std::string& library) const { return "mtllib " + library + "\n" + vertices_ + faces_; }

private:
  std::string vertices_, faces_;
  std::vector<Space> filled_;
  std::size_t vertex_count_ = 0, face_count_ = 0;
};

} // namespace daylit::bench
