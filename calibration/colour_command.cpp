// daylit-calibrate colour: from a photograph of a chart with 24 patches to linear Rec. 709.

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <fmt/format.h>
#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "calibration/code_picture.h"
#include "calibration/colour_fit.h"
#include "calibration/colour_match.h"
#include "calibration/command.h"
#include "capture/hdr/response_curve.h"
#include "scene/core/atomic_file.h"

namespace daylit::calibration {

namespace {

constexpr FileKind kColourKind{"a colour file of daylit", "# Colour of a camera"};
constexpr double kLargeError = 6.0; ///< Delta E 2000, held out
constexpr double kNoChart = 15.0;
constexpr double kUpsideDown_deg = 135.0;

struct ColourOptions {
  std::string chart, mosaic = "mono", response, to_response, spot;
  std::filesystem::path reference, to;
  double illuminance = 0.0;
};

/// The picture with codes made linear where the response is known; `factor`: codes of an HDR picture are its radiance
/// times it.
struct ChartPicture {
  CodePicture picture;
  double factor = 1.0;
  bool linear = false;
};

Result<ChartPicture> read_chart_picture(const std::filesystem::path& path, const std::string& mosaic_name,
                                        const std::string& response_name) {
  const auto mosaic = mosaic_named(mosaic_name);
  if (!mosaic)
    return Error{ErrorCode::usage, mosaic.error().what, "--mosaic", mosaic.error().hint};
  auto read = read_code_picture(path, *mosaic);
  if (!read)
    return read.error();
  ChartPicture chart{std::move(*read), 1.0, false};
  chart.linear = chart.picture.bits > 8;
  if (!response_name.empty()) {
    const auto response = ResponseCurve::named(response_name);
    if (!response)
      return response.error();
    for (Rgb& texel : chart.picture.code.texels)
      for (int c = 0; c < 3; ++c)
        texel[c] = response->exposure(texel[c], c);
    chart.linear = true;
  }
  if (chart.picture.bits > 16) { // its 98th percentile is middle grey and more
    std::vector<float> y;
    for (const Rgb& texel : chart.picture.code.texels)
      y.push_back(luminance(texel));
    const auto high = y.begin() + static_cast<std::ptrdiff_t>(y.size() * 98 / 100);
    std::ranges::nth_element(y, high);
    chart.factor = *high > 0.0f ? 0.5 / static_cast<double>(*high) : 1.0;
    for (Rgb& texel : chart.picture.code.texels)
      texel *= static_cast<float>(chart.factor);
  }
  return chart;
}

Result<std::optional<ChartCorners>> corners_of(const ChartPicture& chart, const ColourOptions& options) {
  if (options.chart.empty())
    return find_chart(view_of(chart.picture.code, chart.linear));
  const auto n = parse_numbers(options.chart, 8, "--chart");
  if (!n)
    return n.error();
  ChartCorners corners;
  for (std::size_t k = 0; k < 4; ++k)
    corners[k] = {(*n)[2 * k], (*n)[2 * k + 1]};
  return std::optional(corners);
}

std::string row_text(const glm::dmat3& m) {
  std::string text;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      text += fmt::format("{}{:.7g}", r + c > 0 ? ", " : "", m[c][r]);
  return text;
}

/// What was found, in the terms of the picture as it was given.
struct ColourResult {
  ColourFit fit;
  glm::dmat3 camera_to_rec709{1.0};
  std::optional<double> luminance_scale; ///< cd m^-2 of one unit of the result
  std::optional<ColourMatch> match;      ///< to the camera of --to; of the pictures as they were given
};

std::string file_text(const ColourResult& r) {
  const ColourModel& m = r.fit.model;
  std::string text = "# Colour of a camera: linear Rec. 709 from its code values (0..1), by rows; a perfect white in "
                     "the chart's light is 1\n";
  text += fmt::format("model = \"{}\"\n", m.terms.name());
  if (m.terms.curve)
    text += fmt::format(
        "# light = (code - pedestal)^power, before the matrix\npedestal = [{:.6g}, {:.6g}, {:.6g}]\npower = "
        "{:.6g}\n",
        m.pedestal.r, m.pedestal.g, m.pedestal.b, m.power);
  if (m.terms.roots) {
    text += "# by rows, of r, g, b, sqrt(r g), sqrt(g b), sqrt(r b)\nroot_polynomial = [";
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t j = 0; j < 6; ++j)
        text += fmt::format("{}{:.7g}", c + j > 0 ? ", " : "", m.row[c][j]);
    text += "]\n";
  } else {
    text += "camera_to_rec709 = [" + row_text(r.camera_to_rec709) + "]\n";
    text += "# for [interior] of daylit-run: photograph = scale x colour_matrix x radiance\ncolour_matrix = [" +
            row_text(glm::inverse(r.camera_to_rec709)) + "]\n";
  }
  if (r.match)
    text +=
        "# from this camera's linear codes to those of the camera of --to: the colour_matrix of [interior] where the\n"
        "# sky is given in this camera's colours\ncamera_to_camera = [" +
        row_text(r.match->matrix) + "]\n";
  if (r.luminance_scale)
    text += fmt::format("# cd/m2 of a result of 1\nluminance_scale = {:.7g}\n", *r.luminance_scale);
  return text;
}

std::string figures(const ColourResult& r) {
  nlohmann::ordered_json j;
  j["delta_e_before"] = r.fit.before;
  j["delta_e_after"] = r.fit.after;
  j["delta_e_held_out"] = r.fit.held_out;
  j["model"] = r.fit.model.terms.name();
  if (!r.fit.model.terms.roots)
    for (int row = 0; row < 3; ++row)
      for (int c = 0; c < 3; ++c)
        j["camera_to_rec709"].push_back(r.camera_to_rec709[c][row]);
  for (const auto& tried : r.fit.tried)
    j["models"].push_back({{"model", tried.name}, {"delta_e_held_out", tried.held_out}});
  j["patch_delta_e_held_out"] = r.fit.patch;
  if (r.match) {
    j["camera_to_camera"] = {{"delta_e_before", r.match->before}, {"delta_e_held_out", r.match->held_out}};
    for (int row = 0; row < 3; ++row)
      for (int c = 0; c < 3; ++c)
        j["camera_to_camera"]["matrix"].push_back(r.match->matrix[c][row]);
  }
  if (r.luminance_scale)
    j["luminance_scale"] = *r.luminance_scale;
  return j.dump();
}

std::string text_of(const ColourResult& r) {
  std::string text =
      fmt::format("colours    Delta E 2000 {:.2f} before, {:.2f} after; patches that were left out in turn "
                  "{:.2f}\nmodel      {}\n",
                  r.fit.before, r.fit.after, r.fit.held_out, r.fit.model.terms.name());
  if (r.match)
    text += fmt::format(
        "cameras    Delta E 2000 {:.2f} between them before, {:.2f} after; patches that were left out in turn\n",
        r.match->before, r.match->held_out);
  if (r.luminance_scale)
    text += fmt::format("light      one unit is {:.4g} cd/m2\n", *r.luminance_scale);
  return text;
}

void mark(Rgb8Image& view, const glm::dvec2& at, int half) {
  for (int y = -half; y <= half; ++y)
    for (int x = -half; x <= half; ++x) {
      const int px = static_cast<int>(at.x) + x, py = static_cast<int>(at.y) + y;
      if (std::max(std::abs(x), std::abs(y)) < half - 1 || px < 0 || py < 0 || px >= view.width || py >= view.height)
        continue;
      std::uint8_t* texel = &view.bytes[3 * (static_cast<std::size_t>(py) * view.width + px)];
      texel[0] = 255;
      texel[1] = texel[2] = 0;
    }
}

/// The chart where it was found; each patch as measured (left half) and as it should be.
std::string page(const ColourResult& r, const ChartPicture& chart, const std::array<ChartPatch, kPatches>& patches,
                 const ChartReference& reference) {
  Rgb8Image view = view_of(chart.picture.code, chart.linear);
  for (const ChartPatch& patch : patches)
    mark(view, patch.px, std::max(4, view.width / 80));
  constexpr int kSide = 40;
  RgbImage swatches(6 * kSide, 4 * kSide);
  for (int y = 0; y < swatches.height; ++y)
    for (int x = 0; x < swatches.width; ++x) {
      const auto p = static_cast<std::size_t>(6 * (y / kSide) + x / kSide);
      swatches.at(x, y) = Rgb(x % kSide < kSide / 2 ? r.fit.model.apply(patches[p].code, patches[p].at) : reference[p]);
    }
  std::vector<std::vector<std::string>> rows{{"model", "Delta E 2000, patches left out in turn"}};
  for (const auto& tried : r.fit.tried)
    rows.push_back({tried.name, fmt::format("{:.2f}", tried.held_out)});
  return html_picture(view, "The chart; what was measured lies inside the red squares.") +
         html_picture(to_srgb8(swatches, 1.0f), "Each patch as measured (left) and as it is (right).") +
         html_table(rows);
}

/// The chart before the other camera, and the matrix to it.
Result<ColourMatch> match_to(const ColourOptions& options, const ChartPicture& first,
                             const std::array<ChartPatch, kPatches>& patches, const ChartReference& reference) {
  const auto second = read_chart_picture(options.to, options.mosaic, options.to_response);
  if (!second)
    return second.error();
  const std::string other = options.to.string();
  if (!first.linear || !second->linear)
    return Error{ErrorCode::usage, "a matrix between two cameras needs linear codes of both",
                 first.linear ? other : first.picture.file, "give --response and --to-response, or raw pictures"};
  const auto corners = find_chart(view_of(second->picture.code, true));
  const auto seen = corners ? sample_chart(second->picture.code, *corners) : std::nullopt;
  const auto fit = seen ? fit_colour(*seen, reference, true) : Result<ColourFit>(Error{});
  const auto match = fit ? match_colours(patches, *seen, fit->model.matrix()) : std::nullopt;
  if (!match)
    return Error{ErrorCode::value_invalid, "no chart with 24 patches was found", other,
                 "photograph it larger and evenly lit"};
  ColourMatch given = *match; // codes of HDR pictures were scaled
  given.matrix *= first.factor / second->factor;
  return given;
}

/// cd m^-2 of one unit of the result, by what a luminance meter read at a pixel.
Result<double> scale_of_spot(const std::string& spot, const ChartPicture& chart, const ColourModel& model) {
  const auto n = parse_numbers(spot, 3, "--spot");
  if (!n)
    return n.error();
  const RgbImage& code = chart.picture.code;
  const double x = (*n)[0], y = (*n)[1];
  if (!(x >= 0 && y >= 0 && x < code.width && y < code.height && (*n)[2] > 0))
    return Error{ErrorCode::usage, "lies outside of the picture, or reads nothing", "--spot", "X,Y,CD/M2"};
  const double measured = static_cast<double>(
      luminance(Rgb(model.apply(glm::dvec3(code.at(static_cast<int>(x), static_cast<int>(y))), {0.0, 0.0}))));
  if (!(measured > 0))
    return Error{ErrorCode::value_invalid, "is black in the picture", "--spot", "choose a brighter place"};
  return (*n)[2] / measured;
}

std::vector<std::string> faults_of(const ColourResult& r, const std::array<ChartPatch, kPatches>& patches,
                                   const ChartCorners& corners, bool upside_down) {
  std::vector<std::string> faults;
  if (const auto saturated = std::ranges::count_if(patches, &ChartPatch::saturated); saturated > 0)
    faults.push_back(
        fmt::format("over-exposed: {} of {} patches are saturated and had no part; expose so that the white "
                    "patch is below the top of the range",
                    saturated, kPatches));
  if (upside_down || std::abs(turn_of(corners)) > kUpsideDown_deg)
    faults.push_back("chart upside down: turn the chart, or the picture, so that the row of greys is at the bottom");
  if (!upside_down && r.fit.held_out > kLargeError)
    faults.push_back(
        fmt::format("patches that were left out are {:.1f} off: reflections on the chart, light that is not "
                    "even, coloured surroundings, or another chart than --reference says",
                    r.fit.held_out));
  return faults;
}

Result<void> run(CommonOptions& o, const ColourOptions& options) {
  if (o.inputs.size() != 1)
    return Error{ErrorCode::usage, "takes one picture", "INPUT", "run it once for each picture"};
  const auto reference =
      options.reference.empty() ? Result<ChartReference>(published_chart()) : read_chart_reference(options.reference);
  if (!reference)
    return reference.error();
  const auto chart = read_chart_picture(o.inputs.front(), options.mosaic, options.response);
  if (!chart)
    return chart.error();
  const auto corners = corners_of(*chart, options);
  if (!corners)
    return corners.error();
  Report report;
  report.title = "Colour calibration";
  const auto no_result = [&](const std::string& why) {
    report.dropped.push_back({chart->picture.file, why});
    return deliver_without_result(o, report, {why});
  };
  if (!*corners)
    return no_result(
        "no chart with 24 patches was found: photograph it larger and evenly lit, or give the middles of its "
        "corner patches with --chart");
  const auto patches = sample_chart(chart->picture.code, **corners);
  if (!patches)
    return no_result("a patch of the chart lies outside the picture");
  auto fit = fit_colour(*patches, *reference, chart->linear);
  if (!fit)
    return no_result(fit.error().what + "; " + fit.error().hint);
  const bool upside_down = looks_upside_down(*patches, *reference);
  if (fit->held_out > kNoChart && !upside_down)
    return no_result(fmt::format("no chart with 24 patches: what looks most like one is off by {:.0f} (Delta E 2000); "
                                 "photograph it larger and evenly lit, or give the middles of its corner patches with "
                                 "--chart",
                                 fit->held_out));
  ColourResult result{std::move(*fit), {}, std::nullopt, std::nullopt};
  result.camera_to_rec709 = result.fit.model.matrix() * chart->factor;
  if (options.illuminance > 0) // luminance of a perfectly white surface: E / pi
    result.luminance_scale = options.illuminance / std::numbers::pi;
  if (!options.spot.empty()) {
    const auto scale = scale_of_spot(options.spot, *chart, result.fit.model);
    if (!scale)
      return scale.error();
    result.luminance_scale = *scale;
  }
  if (!options.to.empty()) {
    const auto match = match_to(options, *chart, *patches, *reference);
    if (!match)
      return match.error();
    result.match = *match;
  }
  report.used.push_back(chart->picture.file);
  report.figures = figures(result);
  report.text = text_of(result);
  report.html = page(result, *chart, *patches, *reference);
  judge(report, faults_of(result, *patches, **corners, upside_down),
        fmt::format("patches that were left out in turn are {:.1f} off (Delta E 2000), before calibration {:.1f}",
                    result.fit.held_out, result.fit.before));
  return deliver_result(o, kColourKind, report, [&] { return write_file_atomically(o.output, file_text(result)); });
}

} // namespace

Command add_colour_command(CLI::App& app, CommonOptions& o) {
  const auto options = std::make_shared<ColourOptions>();
  CLI::App* command =
      app.add_subcommand("colour", "from camera colours to linear Rec. 709, by a chart with 24 patches");
  add_common_options(*command, o, "a picture of the chart, evenly lit", "the colour file to write (TOML)");
  command->add_option("--reference", options->reference,
                      "colours of the chart: 24 lines of sRGB, or a table of reflectances; else as published");
  command->add_option("--chart", options->chart,
                      "pixels X,Y of the middles of four patches: dark skin, bluish green, black, white; else found");
  command->add_option("--response", options->response,
                      "linear, srgb, or a response file; else fitted where it is needed");
  command->add_option("--mosaic", options->mosaic,
                      "what a picture with one channel is: mono, rggb, grbg, gbrg or bggr");
  command->add_option("--illuminance", options->illuminance, "reading on the chart, lx: gives the absolute scale")
      ->check(positive_number());
  command
      ->add_option("--spot", options->spot,
                   "X,Y,CD/M2: a luminance meter's reading at a pixel: gives the absolute scale")
      ->excludes("--illuminance");
  command->add_option("--to", options->to, "the same chart by another camera: the matrix to its colours");
  command->add_option("--to-response", options->to_response, "of the other camera: linear, srgb, or a response file");
  return {command, [&o, options] { return run(o, *options); }};
}

} // namespace daylit::calibration
