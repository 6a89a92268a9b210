// Compiled once for each set of vector instructions: the loops are plain, the compiler makes vectors of them.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "radiosity/detail/face_rays.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "radiosity/detail/face_rays.h"

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace daylit::radiosity {
namespace HWY_NAMESPACE {

/// A ray from the apex of the pyramid over the face passes inside when it lies on the inner side of its three sides.
void MeetFace(const SeenFace& f, const RayComponents& rays, std::int32_t plane_of_face, float* nearest,
              std::int32_t* plane) {
  const glm::vec3 a = f.edge[0], b = f.edge[1], c = f.edge[2], n = f.nearness;
  const float *x = rays.x, *y = rays.y, *z = rays.z;
  for (std::size_t k = 0; k < rays.count; ++k) {
    const float in_a = a.x * x[k] + a.y * y[k] + a.z * z[k], in_b = b.x * x[k] + b.y * y[k] + b.z * z[k],
                in_c = c.x * x[k] + c.y * y[k] + c.z * z[k], near = n.x * x[k] + n.y * y[k] + n.z * z[k];
    const bool met = (std::min(std::min(in_a, in_b), in_c) >= 0.0f) & (near > nearest[k]);
    nearest[k] = met ? near : nearest[k];
    plane[k] = met ? plane_of_face : plane[k];
  }
}

/// Raw pointers, so that the loop below vectorises.
struct PlanePointers {
  const float *along_u[3], *along_v[3], *start_u, *start_v;
  const std::int32_t *width, *height, *first_cell;

  explicit PlanePointers(const PlaneViews& v)
      : along_u{v.along_u[0].data(), v.along_u[1].data(), v.along_u[2].data()}, along_v{v.along_v[0].data(),
                                                                                        v.along_v[1].data(),
                                                                                        v.along_v[2].data()},
        start_u(v.start_u.data()), start_v(v.start_v.data()), width(v.width.data()), height(v.height.data()),
        first_cell(v.first_cell.data()) {}
};

void FindCells(const PlaneViews& planes, const RayComponents& rays, const float* nearness, const std::int32_t* plane,
               float* __restrict u, float* __restrict v, std::int32_t* __restrict cell) {
  const PlanePointers p(planes);
  const float *x = rays.x, *y = rays.y, *z = rays.z;
  for (std::size_t k = 0; k < rays.count; ++k) {
    const std::int32_t i = plane[k] < 0 ? 0 : plane[k];
    const float distance = plane[k] < 0 ? 0.0f : 1.0f / nearness[k];
    u[k] = p.start_u[i] + distance * (p.along_u[0][i] * x[k] + p.along_u[1][i] * y[k] + p.along_u[2][i] * z[k]);
    v[k] = p.start_v[i] + distance * (p.along_v[0][i] * x[k] + p.along_v[1][i] * y[k] + p.along_v[2][i] * z[k]);
    const auto cu = static_cast<std::int32_t>(u[k]), cv = static_cast<std::int32_t>(v[k]);
    const bool known = (plane[k] >= 0) & (u[k] > -1.0f) & (v[k] > -1.0f) & (cu < p.width[i]) & (cv < p.height[i]);
    cell[k] = known ? p.first_cell[i] + cv * p.width[i] + cu : 0;
  }
}

} // namespace HWY_NAMESPACE
} // namespace daylit::radiosity
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace daylit::radiosity {

HWY_EXPORT(MeetFace);
HWY_EXPORT(FindCells);

void meet_face(const SeenFace& face, const RayComponents& rays, std::int32_t plane_of_face, float* nearest,
               std::int32_t* plane) {
  HWY_DYNAMIC_DISPATCH(MeetFace)(face, rays, plane_of_face, nearest, plane);
}

void find_cells(const PlaneViews& planes, const RayComponents& rays, const float* nearness, const std::int32_t* plane,
                float* u, float* v, std::int32_t* cell) {
  HWY_DYNAMIC_DISPATCH(FindCells)(planes, rays, nearness, plane, u, v, cell);
}

} // namespace daylit::radiosity
#endif
