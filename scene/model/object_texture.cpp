#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "scene/model/triangle_soup.h"

namespace daylit::detail {

namespace {

constexpr double kTexelsPerEdge = 8.0;
constexpr std::size_t kMostTriangles = 60'000; // made by dividing; larger meshes stay as they are
constexpr std::size_t kMostTexels = std::size_t{1} << 25;

/// A texture and its halved copies, linear.
class Mipmaps {
public:
  explicit Mipmaps(const Rgb8Image& image) {
    RgbImage level(image.width, image.height);
    for (std::size_t i = 0; i < level.texels.size(); ++i)
      for (int c = 0; c < 3; ++c)
        level.texels[i][c] = srgb_decode(static_cast<float>(image.bytes[3 * i + static_cast<std::size_t>(c)]) / 255.0f);
    levels_.push_back(std::move(level));
    while (levels_.back().width > 1 || levels_.back().height > 1)
      levels_.push_back(halved(levels_.back()));
  }

  /// Mean over about `texels` x `texels` texels around uv.
  Rgb mean(const glm::vec2& uv, double texels) const {
    const double level = std::log2(std::max(texels, 1.0));
    const auto k = static_cast<std::size_t>(std::clamp(std::lround(level), 0L, static_cast<long>(levels_.size()) - 1));
    const RgbImage& image = levels_[k];
    const glm::vec2 p = (uv - glm::floor(uv)) * glm::vec2(image.width, image.height) - 0.5f;
    const glm::vec2 lower = glm::floor(p), t = p - lower;
    const auto at = [&](int dx, int dy) {
      const int x = (static_cast<int>(lower.x) + dx + image.width) % image.width;
      const int y = (static_cast<int>(lower.y) + dy + image.height) % image.height;
      return image.at(x, y);
    };
    return (1 - t.y) * ((1 - t.x) * at(0, 0) + t.x * at(1, 0)) + t.y * ((1 - t.x) * at(0, 1) + t.x * at(1, 1));
  }

private:
  static RgbImage halved(const RgbImage& in) {
    RgbImage out(std::max(in.width / 2, 1), std::max(in.height / 2, 1));
    for (int y = 0; y < out.height; ++y)
      for (int x = 0; x < out.width; ++x) {
        const int x0 = std::min(2 * x, in.width - 1), x1 = std::min(2 * x + 1, in.width - 1);
        const int y0 = std::min(2 * y, in.height - 1), y1 = std::min(2 * y + 1, in.height - 1);
        out.at(x, y) = 0.25f * (in.at(x0, y0) + in.at(x1, y0) + in.at(x0, y1) + in.at(x1, y1));
      }
    return out;
  }
  std::vector<RgbImage> levels_;
};

/// Longest edge in texels.
double texel_span(const SoupTriangle& t, const TriangleSoup& soup) {
  if (t.texture < 0)
    return 0.0;
  const Rgb8Image& image = soup.textures[static_cast<std::size_t>(t.texture)];
  const glm::vec2 size(image.width, image.height);
  double longest = 0.0;
  for (std::size_t k = 0; k < 3; ++k)
    longest = std::max(longest, static_cast<double>(glm::length((t.corner[(k + 1) % 3].uv - t.corner[k].uv) * size)));
  return longest;
}

/// A triangle as n x n, on the lattice of its barycentric coordinates. A point on an edge has the same bits from both
/// sides: the term of the third corner is zero, and a sum of two does not depend on their order.
void divide(const SoupTriangle& t, int n, const TriangleSoup& from, TriangleSoup& to) {
  const auto first = static_cast<std::uint32_t>(to.positions.size());
  const auto first_normal = static_cast<std::int32_t>(to.normals.size());
  const bool has_normals = t.corner[0].normal >= 0 && t.corner[1].normal >= 0 && t.corner[2].normal >= 0;
  const auto blend = [n](int i, int j, const auto& a, const auto& b, const auto& c) {
    const auto fi = static_cast<float>(i), fj = static_cast<float>(j), fk = static_cast<float>(n - i - j);
    return (fk * a + fi * b + fj * c) / static_cast<float>(n);
  };
  std::vector<glm::vec2> uv;
  std::vector<Rgb> colour;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i) {
      const auto& p = from.positions;
      to.positions.push_back(blend(i, j, p[t.corner[0].position], p[t.corner[1].position], p[t.corner[2].position]));
      if (has_normals) {
        const auto normal = [&](std::size_t k) { return from.normals[static_cast<std::size_t>(t.corner[k].normal)]; };
        to.normals.push_back(blend(i, j, normal(0), normal(1), normal(2)));
      }
      uv.push_back(blend(i, j, t.corner[0].uv, t.corner[1].uv, t.corner[2].uv));
      colour.push_back(blend(i, j, t.corner_colour[0], t.corner_colour[1], t.corner_colour[2]));
    }
  const auto index = [n](int i, int j) { return static_cast<std::uint32_t>(j * (n + 1) - j * (j - 1) / 2 + i); };
  const auto add = [&](std::array<std::uint32_t, 3> v) {
    SoupTriangle small = t;
    for (std::size_t k = 0; k < 3; ++k) {
      const bool usable = has_normals && glm::length(to.normals[static_cast<std::size_t>(first_normal) + v[k]]) > 1e-6f;
      small.corner[k] = {first + v[k], usable ? first_normal + static_cast<std::int32_t>(v[k]) : -1, uv[v[k]]};
      small.corner_colour[k] = colour[v[k]];
    }
    to.triangles.push_back(small);
  };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i + j < n; ++i) {
      add({index(i, j), index(i + 1, j), index(i, j + 1)});
      if (i + j + 1 < n)
        add({index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)});
    }
}

} // namespace

Result<std::int32_t> add_texture(TriangleSoup& soup, Result<Rgb8Image> texture, const std::string& where) {
  if (!texture)
    return texture.error();
  if (texture->width < 1 || texture->height < 1)
    return Error{ErrorCode::file_malformed, "an empty texture", where, "export the object again"};
  std::size_t bytes = texture->bytes.size();
  for (const Rgb8Image& other : soup.textures)
    bytes += other.bytes.size();
  if (bytes > 3 * kMostTexels)
    return Error{ErrorCode::limit_exceeded, "textures of more than 33 million texels in all", where,
                 "scale them down: light is kept at vertices, finer ones show no more"};
  soup.textures.push_back(std::move(*texture));
  return static_cast<std::int32_t>(soup.textures.size()) - 1;
}

void resolve_textures(TriangleSoup& soup) {
  if (soup.textures.empty())
    return;
  double span = 0.0;
  for (const SoupTriangle& t : soup.triangles)
    span = std::max(span, texel_span(t, soup));
  const double most = std::sqrt(static_cast<double>(kMostTriangles) /
                                static_cast<double>(std::max<std::size_t>(soup.triangles.size(), 1)));
  const int n = static_cast<int>(std::clamp(std::ceil(span / kTexelsPerEdge), 1.0, std::max(std::floor(most), 1.0)));
  if (n > 1) {
    TriangleSoup fine;
    for (const SoupTriangle& t : soup.triangles)
      divide(t, n, soup, fine);
    soup.positions = std::move(fine.positions);
    soup.normals = std::move(fine.normals);
    soup.triangles = std::move(fine.triangles);
    soup.vertex_colour.clear();
  }
  std::vector<Mipmaps> maps(soup.textures.begin(), soup.textures.end());
  for (SoupTriangle& t : soup.triangles)
    for (std::size_t k = 0; k < 3 && t.texture >= 0; ++k)
      t.corner_colour[k] *= maps[static_cast<std::size_t>(t.texture)].mean(t.corner[k].uv, texel_span(t, soup));
  soup.textures.clear();
}

} // namespace daylit::detail
