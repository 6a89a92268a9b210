#include "scene/model/object_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <numeric>

#include <glm/geometric.hpp>

#include "scene/core/lower_case.h"
#include "scene/core/read_file.h"
#include "scene/format/foreign_model.h"
#include "scene/model/lobe_file.h"
#include "scene/model/mesh_edit.h"
#include "scene/model/triangle_soup.h"

namespace daylit {

namespace detail {

namespace {

glm::dvec3 twice_area(const TriangleSoup& soup, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  const glm::dvec3 p(soup.positions[a]);
  return glm::cross(glm::dvec3(soup.positions[b]) - p, glm::dvec3(soup.positions[c]) - p);
}

/// Smallest signed double area of the fan around corner `start`, against the polygon's normal; > 0: a valid fan.
double worst_fan_area(const std::vector<SoupCorner>& corners, std::size_t start, const glm::dvec3& normal,
                      const TriangleSoup& soup) {
  const std::size_t n = corners.size();
  double worst = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i + 1 < n; ++i)
    worst =
        std::min(worst, glm::dot(normal, twice_area(soup, corners[start].position, corners[(start + i) % n].position,
                                                    corners[(start + i + 1) % n].position)));
  return worst;
}

/// The corner with the least x, then y, then z: whichever corner the outline begins with, and from either side.
std::size_t first_in_space(const std::vector<SoupCorner>& corners, const TriangleSoup& soup) {
  const auto key = [&](const SoupCorner& c) {
    const glm::vec3& p = soup.positions[c.position];
    return std::array{p.x, p.y, p.z};
  };
  return static_cast<std::size_t>(std::ranges::min_element(corners, {}, key) - corners.begin());
}

} // namespace

bool append_polygon(const std::vector<SoupCorner>& corners, std::uint32_t material, TriangleSoup& soup) {
  const std::size_t n = corners.size();
  if (n < 3)
    return true;
  std::size_t start = 0;
  if (n > 3) {
    glm::dvec3 normal{0.0}; // Newell: the sum over a fan is the same from every corner
    for (std::size_t i = 1; i + 1 < n; ++i)
      normal += twice_area(soup, corners[0].position, corners[i].position, corners[i + 1].position);
    const std::size_t candidates = std::min<std::size_t>(n, 256);
    double best = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < candidates; ++i) {
      const double worst = worst_fan_area(corners, i, normal, soup);
      if (worst > best)
        best = worst, start = i;
    }
    // Both diagonals of a rectangle are as good: that through the corner that comes first in space.
    if (n == 4 && worst_fan_area(corners, 1 - start % 2, normal, soup) >= best - 1e-6 * std::abs(best))
      start = first_in_space(corners, soup);
    if (best < -1e-9 * glm::dot(normal, normal))
      return false;
  }
  for (std::size_t i = 1; i + 1 < n; ++i)
    soup.triangles.push_back({{corners[start], corners[(start + i) % n], corners[(start + i + 1) % n]}, material});
  return true;
}

} // namespace detail

namespace {

using detail::SoupTriangle;
using detail::TriangleSoup;

constexpr std::size_t kMostFileBytes = std::size_t{1} << 31;

/// glTF by its name or its first bytes.
bool is_gltf(const std::filesystem::path& path, std::span<const std::uint8_t> bytes) {
  const std::string extension = lower_case(path.extension().string());
  return extension == ".gltf" || extension == ".glb" || (bytes.size() > 4 && std::memcmp(bytes.data(), "glTF", 4) == 0);
}

Result<detail::TriangleSoup> parse_gltf_beside(const std::filesystem::path& path, std::span<const std::uint8_t> bytes,
                                               Rgb fallback) {
  return detail::parse_gltf_soup(
      bytes, path.string(),
      [&](const std::string& file) { return read_whole_file(path.parent_path() / file, kMostFileBytes); }, fallback);
}

bool starts_with_ply(std::span<const std::uint8_t> bytes) {
  return bytes.size() > 4 && std::memcmp(bytes.data(), "ply", 3) == 0 && (bytes[3] == '\n' || bytes[3] == '\r');
}

} // namespace

Result<ObjectMesh> read_object_mesh(const std::filesystem::path& path, Rgb fallback, std::vector<std::string>* notes) {
  for (int c = 0; c < 3; ++c)
    if (!(fallback[c] >= 0 && fallback[c] <= 1))
      return Error{ErrorCode::value_invalid, "reflectance outside 0..1", path.string(), ""};
  auto bytes = read_whole_file(path, kMostFileBytes);
  if (!bytes)
    return bytes.error();
  if (bytes->empty())
    return Error{ErrorCode::file_malformed, "the file is empty", path.string(), "export the model again"};
  if (const auto foreign = detail::refuse_foreign_model(path, "glTF (.glb or .gltf), OBJ or PLY"))
    return *foreign;
  auto soup = is_gltf(path, *bytes)     ? parse_gltf_beside(path, *bytes, fallback)
              : starts_with_ply(*bytes) ? detail::parse_ply_soup(*bytes, path.string(), fallback)
                                        : detail::parse_obj_soup(*bytes, path, fallback);
  if (!soup)
    return soup.error();
  if (const auto added = detail::add_lobes(path, *soup); !added)
    return added.error();
  auto mesh = detail::build_mesh(std::move(*soup), notes);
  if (mesh.triangles.empty())
    return Error{ErrorCode::file_malformed, "the object has no triangle with area", path.string(),
                 "an OBJ, PLY or glTF file with faces is needed"};
  return mesh;
}

} // namespace daylit
