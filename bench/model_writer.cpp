#include "bench/model_writer.h"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <glm/common.hpp>

namespace daylit::bench {

namespace {

/// To a micrometre, so that points that coincide are equal; never -0.
glm::dvec3 rounded(const glm::dvec3& p) { return glm::round(1e6 * p) / 1e6 + 0.0; }

glm::dvec3 across(int axis, double at, double u, double v) {
  return axis == 0 ? glm::dvec3(at, u, v) : axis == 1 ? glm::dvec3(u, at, v) : glm::dvec3(u, v, at);
}

} // namespace

void ModelWriter::material(const std::string& name) { faces_ += "usemtl " + name + "\n"; }

void ModelWriter::face(std::span<const glm::dvec3> corners) {
  for (const glm::dvec3& corner : corners) {
    const glm::dvec3 c = rounded(corner);
    fmt::format_to(std::back_inserter(vertices_), "v {} {} {}\n", c.x, c.y, c.z);
  }
  faces_ += 'f';
  for (std::size_t k = 0; k < corners.size(); ++k)
    fmt::format_to(std::back_inserter(faces_), " {}", ++vertex_count_);
  faces_ += '\n';
  ++face_count_;
}

void ModelWriter::rectangle(int axis, double at, const Rectangle& r) {
  face({across(axis, at, r.u0, r.v0), across(axis, at, r.u1, r.v0), across(axis, at, r.u1, r.v1),
        across(axis, at, r.u0, r.v1)});
}

void ModelWriter::panel(int axis, double at, const Rectangle& r, const std::vector<Rectangle>& holes) {
  std::vector<double> cuts{r.u0, r.u1};
  for (const Rectangle& hole : holes)
    cuts.insert(cuts.end(), {hole.u0, hole.u1});
  std::sort(cuts.begin(), cuts.end());
  cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    std::vector<Rectangle> here;
    for (const Rectangle& hole : holes)
      if (hole.u0 <= cuts[i] && hole.u1 >= cuts[i + 1])
        here.push_back(hole);
    std::sort(here.begin(), here.end(), [](const Rectangle& a, const Rectangle& b) { return a.v0 < b.v0; });
    double v = r.v0;
    for (const Rectangle& hole : here) {
      if (hole.v0 > v)
        rectangle(axis, at, {cuts[i], v, cuts[i + 1], hole.v0});
      v = hole.v1;
    }
    if (v < r.v1)
      rectangle(axis, at, {cuts[i], v, cuts[i + 1], r.v1});
  }
}

void ModelWriter::reveal(int axis, double from, double to, const Rectangle& o) {
  const auto side = [&](double u0, double v0, double u1, double v1) {
    face({across(axis, from, u0, v0), across(axis, from, u1, v1), across(axis, to, u1, v1), across(axis, to, u0, v0)});
  };
  side(o.u0, o.v0, o.u1, o.v0);
  side(o.u1, o.v0, o.u1, o.v1);
  side(o.u1, o.v1, o.u0, o.v1);
  side(o.u0, o.v1, o.u0, o.v0);
}

void ModelWriter::box(const Space& s, unsigned faces) {
  const Rectangle floor{s.low.x, s.low.y, s.high.x, s.high.y}, along_x{s.low.x, s.low.z, s.high.x, s.high.z},
      along_y{s.low.y, s.low.z, s.high.y, s.high.z};
  const Rectangle* const of_axis[] = {&along_y, &along_x, &floor};
  for (unsigned f = 0; f < 6; ++f) {
    const int axis = f < 2 ? 2 : f < 4 ? 1 : 0;
    if (faces >> f & 1u)
      rectangle(axis, f % 2 == 0 ? s.low[axis] : s.high[axis], *of_axis[axis]);
  }
}

void ModelWriter::surface(int nu, int nv, const std::function<glm::dvec3(double, double)>& at) {
  const auto triangle = [this](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    if (rounded(a) != rounded(b) && rounded(b) != rounded(c) && rounded(c) != rounded(a))
      face({a, b, c});
  };
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      const double u0 = double(i) / nu, u1 = double(i + 1) / nu, v0 = double(j) / nv, v1 = double(j + 1) / nv;
      const glm::dvec3 a = at(u0, v0), b = at(u1, v0), c = at(u1, v1), d = at(u0, v1);
      triangle(a, b, c);
      triangle(a, c, d);
    }
}

void ModelWriter::solid(const Space& space) {
  box(space, 0b111110u);
  filled_.push_back(space);
}

} // namespace daylit::bench
