#include "runtime/gl/triangle_raster.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "runtime/base/lane_vector.h"
#include "scene/core/parallel.h"

namespace daylit {

namespace {

constexpr int kPixels = 4, kLanes = kPixels * TriangleRaster::kSamples; // of a row, with all their samples
constexpr int kBandRows = 16;
constexpr float kOverlap = 1e-5f; // neighbours share their edge, so that rounding leaves no hole between them

/// Samples from the first pixel's centre, in the standard pattern of graphics cards.
alignas(64) constexpr float kSampleX[kLanes] = {-0.125f, 0.375f, -0.375f, 0.125f, 0.875f, 1.375f, 0.625f, 1.125f,
                                                1.875f,  2.375f, 1.625f,  2.125f, 2.875f, 3.375f, 2.625f, 3.125f};
alignas(64) constexpr float kSampleY[kLanes] = {-0.375f, -0.125f, 0.125f, 0.375f, -0.375f, -0.125f, 0.125f, 0.375f,
                                                -0.375f, -0.125f, 0.125f, 0.375f, -0.375f, -0.125f, 0.125f, 0.375f};

/// Linear over the picture: at the centre of the box's first pixel, per column, per row.
struct Slope {
  float at = 0.0f, per_x = 0.0f, per_y = 0.0f;
};

/// Barycentric weights of the second and third corner, and 1 / depth.
struct SetUp {
  Slope b, c, nearness;
  float number = 0.0f;
};

/// Columns in groups of kPixels; `stride`: lanes from row to row.
struct Area {
  int row0 = 0, row1 = 0, group0 = 0, group1 = 0;
  std::size_t stride = 0;
};

DAYLIT_LANE_CLONES void draw_triangle(const SetUp& t, const Area& area, float* samples, float* nearest) {
  const float number = t.number;
  alignas(64) float lane_b[kLanes], lane_c[kLanes], lane_n[kLanes];
  DAYLIT_EACH_LANE {
    lane_b[k] = kSampleX[k] * t.b.per_x + kSampleY[k] * t.b.per_y;
    lane_c[k] = kSampleX[k] * t.c.per_x + kSampleY[k] * t.c.per_y;
    lane_n[k] = kSampleX[k] * t.nearness.per_x + kSampleY[k] * t.nearness.per_y;
  }
  for (int row = area.row0; row < area.row1; ++row)
    for (int group = area.group0; group < area.group1; ++group) {
      const float x = static_cast<float>(group * kPixels), y = static_cast<float>(row);
      const float b0 = t.b.at + x * t.b.per_x + y * t.b.per_y, c0 = t.c.at + x * t.c.per_x + y * t.c.per_y,
                  n0 = t.nearness.at + x * t.nearness.per_x + y * t.nearness.per_y;
      const std::size_t first = static_cast<std::size_t>(row) * area.stride + static_cast<std::size_t>(group) * kLanes;
      float *sample = samples + first, *near = nearest + first;
      DAYLIT_EACH_LANE {
        const float b = b0 + lane_b[k], c = c0 + lane_c[k], n = n0 + lane_n[k], a = 1.0f - b - c;
        const float bc = b < c ? b : c, least = a < bc ? a : bc, before = near[k], shown = sample[k];
        const float drawn = least >= -kOverlap ? n : 0.0f; // 0: behind everything
        near[k] = drawn > before ? drawn : before;
        sample[k] = drawn > before ? number : shown;
      }
    }
}

} // namespace

void TriangleRaster::start(const RenderCamera& camera, const PixelBox& box) {
  camera_ = camera;
  box_ = {box.x0 / kPixels * kPixels, box.y0, (box.x1 + kPixels - 1) / kPixels * kPixels, box.y1};
  const std::size_t count = static_cast<std::size_t>(kSamples) * static_cast<std::size_t>(box_.width()) *
                            static_cast<std::size_t>(box_.height());
  samples_.assign(count, 0.0f);
  nearness_.assign(count, 0.0f);
}

TriangleRaster::Corner TriangleRaster::project(const glm::dvec3& p) const {
  const double n = 1.0 / p.z;
  return {camera_.fx * p.x * n + camera_.cx - box_.x0, camera_.fy * p.y * n + camera_.cy - box_.y0, n};
}

void TriangleRaster::append(const std::array<Corner, 3>& corners, float number) {
  Triangle t;
  t.corner = corners;
  t.number = number;
  const auto& [a, b, c] = corners;
  const double left = std::min({a.x, b.x, c.x}), right = std::max({a.x, b.x, c.x});
  const double top = std::min({a.y, b.y, c.y}), bottom = std::max({a.y, b.y, c.y});
  const auto first = [](double from, int end) { // pixel whose samples may be at `from` or beyond
    return static_cast<int>(std::clamp(std::ceil(from - 0.375), 0.0, static_cast<double>(end)));
  };
  t.column0 = first(left, box_.width());
  t.column1 = first(right + 0.75, box_.width());
  t.row0 = first(top, box_.height());
  t.row1 = first(bottom + 0.75, box_.height());
  if (t.column0 >= t.column1 || t.row0 >= t.row1)
    return;
  for (int band = t.row0 / kBandRows; band * kBandRows < t.row1; ++band)
    bands_[static_cast<std::size_t>(band)].push_back(static_cast<std::uint32_t>(triangles_.size()));
  triangles_.push_back(t);
}

/// Appends what lies beyond the near plane.
void TriangleRaster::cut(const std::array<glm::dvec3, 3>& in_camera, float number) {
  std::array<glm::dvec3, 4> kept;
  std::size_t count = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 &p = in_camera[k], &q = in_camera[(k + 1) % 3];
    if (p.z >= kNearPlane_m)
      kept[count++] = p;
    if ((p.z >= kNearPlane_m) != (q.z >= kNearPlane_m)) {
      kept[count] = p + (kNearPlane_m - p.z) / (q.z - p.z) * (q - p);
      kept[count++].z = kNearPlane_m;
    }
  }
  for (std::size_t k = 2; k < count; ++k)
    append({project(kept[0]), project(kept[k - 1]), project(kept[k])}, number);
}

void TriangleRaster::draw(const Mesh& mesh) {
  if (box_.empty())
    return;
  const glm::dmat3 axes(camera_.world_from_camera);
  const glm::dvec3 eye = camera_.eye() - mesh.origin;
  in_camera_.resize(mesh.positions.size());
  corners_.resize(mesh.positions.size());
  parallel_for(tbb::blocked_range<std::size_t>(0, in_camera_.size(), 1024), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      in_camera_[i] = (glm::dvec3(mesh.positions[i]) - eye) * axes; // transpose of a rotation
      if (in_camera_[i].z >= kNearPlane_m)
        corners_[i] = project(in_camera_[i]);
    }
  });
  triangles_.clear();
  bands_.resize(static_cast<std::size_t>((box_.height() + kBandRows - 1) / kBandRows));
  for (auto& band : bands_)
    band.clear();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& v = mesh.triangles[i];
    const float number = mesh.numbered ? static_cast<float>(i + 1) : 0.0f;
    if (std::all_of(v.begin(), v.end(), [&](std::uint32_t k) { return in_camera_[k].z >= kNearPlane_m; }))
      append({corners_[v[0]], corners_[v[1]], corners_[v[2]]}, number);
    else
      cut({in_camera_[v[0]], in_camera_[v[1]], in_camera_[v[2]]}, number);
  }
  parallel_for(0, static_cast<int>(bands_.size()), [&](int band) { draw_band(band); });
}

void TriangleRaster::draw_band(int band) {
  const int first = band * kBandRows, last = std::min(first + kBandRows, box_.height());
  for (const std::uint32_t index : bands_[static_cast<std::size_t>(band)]) {
    const Triangle& t = triangles_[index];
    const auto& [a, b, c] = t.corner;
    const double abx = b.x - a.x, aby = b.y - a.y, acx = c.x - a.x, acy = c.y - a.y, whole = abx * acy - aby * acx;
    if (whole == 0.0)
      continue;
    const auto slope = [&](double per_x, double per_y, double at_a) {
      return Slope{static_cast<float>(at_a - per_x * a.x - per_y * a.y), static_cast<float>(per_x),
                   static_cast<float>(per_y)};
    };
    const double scale = 1.0 / whole, bx = acy * scale, by = -acx * scale, cx = -aby * scale, cy = abx * scale;
    const double nb = b.nearness - a.nearness, nc = c.nearness - a.nearness;
    draw_triangle(
        {slope(bx, by, 0.0), slope(cx, cy, 0.0), slope(bx * nb + cx * nc, by * nb + cy * nc, a.nearness), t.number},
        {std::max(t.row0, first), std::min(t.row1, last), t.column0 / kPixels, (t.column1 + kPixels - 1) / kPixels,
         static_cast<std::size_t>(kSamples * box_.width())},
        samples_.data(), nearness_.data());
  }
}

void TriangleRaster::find_shown(float apart) {
  shown_.resize(samples_.size() / kSamples);
  parallel_for(tbb::blocked_range<std::size_t>(0, shown_.size(), 8192), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const float *sample = &samples_[i * kSamples], *near = &nearness_[i * kSamples];
      float number = 0.0f, nearest = near[0], farthest = near[0];
      bool all = true;
      for (int s = 0; s < kSamples; ++s) {
        number = number > 0.0f ? number : sample[s];
        all = all && sample[s] > 0.0f;
        nearest = std::max(nearest, near[s]);
        farthest = std::min(farthest, near[s]);
      }
      shown_[i] = all && nearest - farthest <= apart * nearest * farthest ? number : -number;
    }
  });
}

std::vector<std::uint8_t> TriangleRaster::used_vertices(const Mesh& mesh) const {
  std::vector<std::uint8_t> used(mesh.positions.size(), 0);
  const auto use = [&](float number) {
    if (number > 0.0f)
      for (const std::uint32_t v : mesh.triangles[static_cast<std::size_t>(number) - 1])
        used[v] = 1;
  };
  for (std::size_t i = 0; i < shown_.size(); ++i)
    if (shown_[i] != 0.0f)
      for (int s = 0; s < kSamples; ++s)
        use(samples_[i * kSamples + static_cast<std::size_t>(s)]);
  return used;
}

} // namespace daylit
