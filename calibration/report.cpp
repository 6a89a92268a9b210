#include "calibration/report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace daylit::calibration {

namespace {

const char* verdict(const Report& report) { return report.pass ? "pass" : "repeat"; }

/// RFC 4648.
std::string base64(std::span<const std::uint8_t> bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(bytes.size() - i, 3);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < left ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      out += k <= left ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

/// Mean of blocks of whole pixels.
Rgb8Image reduced(const Rgb8Image& picture, int width_px) {
  const int block = std::max(1, (picture.width + width_px - 1) / width_px);
  Rgb8Image out{picture.width / block, picture.height / block, {}};
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (int c = 0; c < 3; ++c) {
        int sum = 0;
        for (int v = 0; v < block; ++v)
          for (int u = 0; u < block; ++u)
            sum += picture.bytes[3 * (static_cast<std::size_t>(y * block + v) * picture.width + x * block + u) + c];
        out.bytes.push_back(static_cast<std::uint8_t>(sum / (block * block)));
      }
  return out;
}

} // namespace

std::string to_json(const Report& report) {
  nlohmann::ordered_json j;
  j["verdict"] = verdict(report);
  j["why"] = report.why;
  j["used"] = report.used;
  j["dropped"] = nlohmann::json::array();
  for (const DroppedPicture& d : report.dropped)
    j["dropped"].push_back({{"file", d.file}, {"why", d.why}});
  if (!report.figures.empty())
    j.update(nlohmann::ordered_json::parse(report.figures));
  return j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string to_text(const Report& report) {
  std::string text = fmt::format("pictures   {} count, {} left out\n", report.used.size(), report.dropped.size());
  for (const DroppedPicture& d : report.dropped)
    text += fmt::format("           {}: {}\n", d.file, d.why);
  text += report.text + fmt::format("verdict    {}\n", verdict(report));
  for (const std::string& why : report.why)
    text += "           " + why + "\n";
  return text;
}

std::string to_html(const Report& report, const std::string& command_line) {
  std::string html =
      fmt::format("<!doctype html><html lang='en'><meta charset='utf-8'><title>{0}</title>\n"
                  "<style>body{{font:16px sans-serif;max-width:60em;margin:2em auto}}svg,img{{width:100%}}"
                  "td,th{{padding:.2em .8em;text-align:left}}</style>\n<h1>{0}: {1}</h1>\n<ul>\n",
                  html_escaped(report.title), verdict(report));
  for (const std::string& why : report.why)
    html += "<li>" + html_escaped(why) + "</li>\n";
  html += "</ul>\n" + report.html;
  if (!report.dropped.empty()) {
    std::vector<std::vector<std::string>> rows{{"left out", "why"}};
    for (const DroppedPicture& d : report.dropped)
      rows.push_back({d.file, d.why});
    html += html_table(rows);
  }
  return html + "<p>Run again: <code>" + html_escaped(command_line) + "</code></p></html>\n";
}

void judge(Report& report, std::vector<std::string> faults, const std::string& praise) {
  report.pass = faults.empty();
  report.why = report.pass ? std::vector<std::string>{praise} : std::move(faults);
}

std::string html_escaped(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

std::string html_table(std::span<const std::vector<std::string>> rows) {
  std::string html = "<table>";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    html += "<tr>";
    for (const std::string& cell : rows[r])
      html += fmt::format("<{0}>{1}</{0}>", r == 0 ? "th" : "td", html_escaped(cell));
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

std::string html_picture(const Rgb8Image& picture, const std::string& description, int width_px) {
  const auto png = png_bytes(reduced(picture, width_px));
  if (!png)
    return "<p>(no picture)</p>\n";
  return fmt::format("<img alt='{}' src='data:image/png;base64,{}'>\n<p>{}</p>\n", html_escaped(description),
                     base64(*png), html_escaped(description));
}

std::string html_plot(std::span<const Series> series, const std::string& x, const std::string& y) {
  constexpr double kWidth = 800, kHeight = 400, kEdge = 50;
  glm::dvec2 low(INFINITY), high(-INFINITY);
  for (const Series& s : series)
    for (const glm::dvec2& p : s.points) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
  if (!(high.x > low.x) || !(high.y > low.y))
    return "";
  const auto at = [&](const glm::dvec2& p) {
    const glm::dvec2 part = (p - low) / (high - low);
    return glm::dvec2(kEdge + part.x * (kWidth - 2 * kEdge), kHeight - kEdge - part.y * (kHeight - 2 * kEdge));
  };
  std::string svg = fmt::format("<svg viewBox='0 0 {} {}' role='img' aria-label='{} against {}'>\n", kWidth, kHeight,
                                html_escaped(y), html_escaped(x));
  for (const Series& s : series) {
    if (s.line)
      svg += fmt::format("<polyline fill='none' stroke='{}' stroke-width='2' points='", s.colour);
    for (const glm::dvec2& p : s.points)
      svg += s.line ? fmt::format("{:.1f},{:.1f} ", at(p).x, at(p).y)
                    : fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='2' fill='{}'/>", at(p).x, at(p).y, s.colour);
    svg += s.line ? "'/>\n" : "\n";
  }
  svg += fmt::format("<rect x='{0}' y='{0}' width='{1}' height='{2}' fill='none' stroke='#888'/>\n", kEdge,
                     kWidth - 2 * kEdge, kHeight - 2 * kEdge);
  const auto label = [&](double px, double py, const char* anchor, const std::string& text) {
    svg += fmt::format("<text x='{:.0f}' y='{:.0f}' text-anchor='{}'>{}</text>\n", px, py, anchor, html_escaped(text));
  };
  label(kEdge, kHeight - kEdge + 20, "middle", fmt::format("{:.3g}", low.x));
  label(kWidth - kEdge, kHeight - kEdge + 20, "middle", fmt::format("{:.3g}", high.x));
  label(kWidth / 2, kHeight - 10, "middle", x);
  label(kEdge - 5, kHeight - kEdge, "end", fmt::format("{:.3g}", low.y));
  label(kEdge - 5, kEdge + 5, "end", fmt::format("{:.3g}", high.y));
  label(kEdge, kEdge - 12, "start", y);
  double key = kEdge + 10;
  for (const Series& s : series) {
    svg += fmt::format("<text x='{:.0f}' y='{:.0f}' fill='{}'>{}</text>\n", kEdge + 10, key += 18, s.colour,
                       html_escaped(s.name));
  }
  return svg + "</svg>\n";
}

} // namespace daylit::calibration
