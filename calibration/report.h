#pragma once

// What every subcommand of daylit-calibrate says at its end: as JSON, as text and as a page that needs no other file.

#include <span>
#include <string>
#include <utility>
#include <vector>

#include <glm/vec2.hpp>

#include "scene/image/image_formats.h"

namespace daylit::calibration {

struct DroppedPicture {
  std::string file, why;
};

struct Report {
  std::string title;                   ///< "Lens calibration"
  bool pass = false;                   ///< else: repeat
  std::vector<std::string> why;        ///< the reasons for the verdict, and what to do
  std::vector<std::string> used;       ///< files
  std::vector<DroppedPicture> dropped; ///< files that had no part, each with the reason
  std::string figures;                 ///< members of the JSON object beyond those above: a JSON object, or empty
  std::string text;                    ///< figures for a person, lines "name       value\n"
  std::string html;                    ///< figures and drawings of the page
};

/// One object, one line: verdict, why, used, dropped, and the figures.
std::string to_json(const Report& report);
/// What a person reads.
std::string to_text(const Report& report);
std::string to_html(const Report& report, const std::string& command_line);

/// Adds the verdict: pass when there are no faults, with `praise` as its reason.
void judge(Report& report, std::vector<std::string> faults, const std::string& praise);

/// Parts of a page.
std::string html_escaped(const std::string& text);
/// The first row is the heading.
std::string html_table(std::span<const std::vector<std::string>> rows);
/// The picture itself, reduced to at most `width_px` across.
std::string html_picture(const Rgb8Image& picture, const std::string& description, int width_px = 720);
/// A line, or points, of a plot.
struct Series {
  std::string name, colour;
  std::vector<glm::dvec2> points;
  bool line = true;
};
std::string html_plot(std::span<const Series> series, const std::string& x, const std::string& y);

} // namespace daylit::calibration
