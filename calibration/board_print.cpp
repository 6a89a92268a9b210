#include "calibration/board_print.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "calibration/charuco.h"
#include "calibration/colour_fit.h"
#include "calibration/colour_science.h"
#include "capture/markers/find_markers.h"

namespace daylit::calibration {

namespace {

constexpr Rgb kInk(0.0f), kPaper(1.0f), kFrame(0.06f);

void add_marker(BoardPrint& print, const MarkerPrint& marker, const glm::dvec2& corner, double side_m) {
  const double cell = side_m / marker.cells_per_side;
  print.rectangles.push_back({corner, glm::dvec2(side_m), kInk});
  for (int y = 0; y < marker.cells_per_side; ++y)
    for (int x = 0; x < marker.cells_per_side; ++x)
      if (marker.white[static_cast<std::size_t>(y * marker.cells_per_side + x)])
        print.rectangles.push_back({corner + cell * glm::dvec2(x, y), glm::dvec2(cell), kPaper});
}

} // namespace

/// The square in the top left corner is black.
Result<BoardPrint> board_print(const Target& target) {
  const int columns = target.size.columns + 1, rows = target.size.rows + 1;
  BoardPrint print{target.square_m * glm::dvec2(columns + 2, rows + 2), {}};
  const glm::dvec2 origin(target.square_m);
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x)
      if ((x + y) % 2 == 0)
        print.rectangles.push_back({origin + target.square_m * glm::dvec2(x, y), glm::dvec2(target.square_m), kInk});
  for (int id = 0; !target.dictionary.empty() && id < columns * rows / 2; ++id) {
    const auto marker = marker_print(target.dictionary, id);
    if (!marker)
      return marker.error();
    const glm::dvec2 square = square_of_marker(id, columns, true);
    add_marker(print, *marker, origin + target.square_m * square + 0.5 * (target.square_m - target.marker_m),
               target.marker_m);
  }
  return print;
}

BoardPrint chart_print(double width_m) {
  const double step = width_m / 6.6, patch = 0.84 * step;
  BoardPrint print{{width_m + step, 4.6 * step + step}, {}};
  print.rectangles.push_back({glm::dvec2(0.5 * step), {width_m, 4.6 * step}, kFrame});
  const ChartReference reference = published_chart();
  for (int k = 0; k < static_cast<int>(kPatches); ++k) {
    Rgb colour(reference[static_cast<std::size_t>(k)]);
    for (int c = 0; c < 3; ++c)
      colour[c] = srgb_encode(std::clamp(colour[c], 0.0f, 1.0f));
    print.rectangles.push_back({glm::dvec2(0.8 + k % 6 + 0.08, 0.8 + k / 6 + 0.08) * step, glm::dvec2(patch), colour});
  }
  return print;
}

std::string svg_of(const BoardPrint& print) {
  std::string svg = fmt::format("<svg xmlns='http://www.w3.org/2000/svg' width='{0:.4f}mm' height='{1:.4f}mm' "
                                "viewBox='0 0 {0:.4f} {1:.4f}' shape-rendering='crispEdges'>\n"
                                "<rect width='100%' height='100%' fill='#fff'/>\n",
                                1e3 * print.size_m.x, 1e3 * print.size_m.y);
  for (const auto& r : print.rectangles)
    svg +=
        fmt::format("<rect x='{:.4f}' y='{:.4f}' width='{:.4f}' height='{:.4f}' fill='rgb({:.0f},{:.0f},{:.0f})'/>\n",
                    1e3 * r.corner_m.x, 1e3 * r.corner_m.y, 1e3 * r.side_m.x, 1e3 * r.side_m.y, 255 * r.colour.r,
                    255 * r.colour.g, 255 * r.colour.b);
  return svg + "</svg>\n";
}

/// Each pixel is what lies in its middle.
Rgb8Image picture_of(const BoardPrint& print, double pixels_per_metre) {
  Rgb8Image picture{static_cast<int>(std::lround(print.size_m.x * pixels_per_metre)),
                    static_cast<int>(std::lround(print.size_m.y * pixels_per_metre)),
                    {}};
  picture.bytes.assign(3 * static_cast<std::size_t>(picture.width) * picture.height, 255);
  for (const auto& r : print.rectangles) {
    const glm::dvec2 low = r.corner_m * pixels_per_metre, high = (r.corner_m + r.side_m) * pixels_per_metre;
    const auto first = [](double edge) { return static_cast<int>(std::ceil(edge - 0.5)); };
    for (int y = std::max(first(low.y), 0); y < std::min(first(high.y), picture.height); ++y)
      for (int x = std::max(first(low.x), 0); x < std::min(first(high.x), picture.width); ++x)
        for (int c = 0; c < 3; ++c)
          picture.bytes[3 * (static_cast<std::size_t>(y) * picture.width + x) + c] =
              static_cast<std::uint8_t>(std::lround(255.0f * r.colour[c]));
  }
  return picture;
}

} // namespace daylit::calibration
