// daylit-calibrate vignette: fall-off of a lens, from an evenly lit surface or from a lamp seen at several angles.

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibration/code_picture.h"
#include "calibration/command.h"
#include "calibration/sun_spot.h"
#include "calibration/vignette_fit.h"
#include "capture/hdr/response_curve.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kScatter = 0.03;    ///< relative, held out
constexpr double kUneven = 0.05;     ///< relative, of a ring, apart from a slope
constexpr double kReach = 0.8;       ///< of the lens's field
constexpr double kHighest = 1.1;     ///< relative sensitivity: no lens has more towards its edge
constexpr double kSaturated = 0.001; ///< of the pixels
constexpr float kTop = 0.98f;

struct VignetteOptions {
  std::filesystem::path lens;
  std::string response, mosaic = "mono";
  bool lamp = false;
};

double saturated_part(const CodePicture& picture, const LensModel& lens) {
  if (picture.bits > 16)
    return 0.0;
  std::size_t inside = 0, top = 0;
  for (int y = 0; y < picture.code.height; ++y)
    for (int x = 0; x < picture.code.width; ++x)
      if (lens.covers({x, y})) {
        const Rgb& code = picture.code.at(x, y);
        ++inside;
        top += std::max({code.r, code.g, code.b}) >= kTop ? 1 : 0;
      }
  return inside > 0 ? static_cast<double>(top) / static_cast<double>(inside) : 0.0;
}

/// All lamps are one source: their light is the same, seen at different angles.
std::string add_samples(const RgbImage& picture, const LensModel& lens, bool lamp, std::size_t source,
                        std::vector<FallOffSample>& samples) {
  if (!lamp) {
    const std::vector<FallOffSample> rings = ring_samples(picture, lens, source);
    samples.insert(samples.end(), rings.begin(), rings.end());
    return rings.empty() ? "no ring around the axis lies whole in the picture" : "";
  }
  std::string why;
  const auto spot = find_sun(picture, lens, INFINITY, why);
  if (!spot)
    return "no lamp: nothing small is much brighter than the rest";
  samples.push_back({std::acos(std::clamp(spot->direction.z, -1.0, 1.0)), spot_light(picture, lens, *spot), 0});
  return "";
}

std::string page(const FallOffFit& fit) {
  Series samples{"measured", "#36c", {}, false}, curve{"fall-off", "#c60", {}, true};
  for (std::size_t i = 0; i < fit.theta.size(); ++i)
    samples.points.push_back({fit.theta[i] / kDegree, fit.relative[i]});
  for (double t = 0; t <= fit.reach; t += 0.01)
    curve.points.push_back({t / kDegree, fit.fall_off.at(t)});
  const Series series[] = {curve, samples};
  return html_plot(series, "angle from the axis, degrees", "relative sensitivity");
}

std::vector<std::string> faults_of(const FallOffFit& fit, const LensModel& lens) {
  std::vector<std::string> faults;
  if (fit.held_out > kScatter)
    faults.push_back(fmt::format("samples scatter by {:.1f} %: light that is not even, or a lamp that is not steady",
                                 100 * fit.held_out));
  if (fit.uneven > kUneven)
    faults.push_back(
        fmt::format("the light varies by {:.0f} % around a ring, other than along one line: it is not even; "
                    "hold the paper closer, or turn it and take several pictures",
                    100 * fit.uneven));
  if (fit.reach < kReach * lens.max_theta)
    faults.push_back(
        fmt::format("samples reach {:.0f} of {:.0f} degrees; see the light at the edge of the picture, too",
                    fit.reach / kDegree, lens.max_theta / kDegree));
  if (const double most = *std::ranges::max_element(fit.relative); most > kHighest)
    faults.push_back(
        fmt::format("{:.0f} % more light than on the axis, which no lens gathers: the surface is not evenly "
                    "lit",
                    100 * (most - 1)));
  return faults;
}

Result<void> run(CommonOptions& o, const VignetteOptions& options) {
  const auto lens = read_lens(options.lens);
  if (!lens)
    return lens.error();
  const auto response = response_or_linear(options.response);
  if (!response)
    return response.error();
  const auto mosaic = mosaic_named(options.mosaic);
  if (!mosaic)
    return Error{ErrorCode::usage, mosaic.error().what, "--mosaic", mosaic.error().hint};
  Report report;
  report.title = "Fall-off calibration";
  std::vector<FallOffSample> samples;
  ProgressLine progress(o.quiet || o.json);
  for (std::size_t i = 0; i < o.inputs.size(); ++i) {
    if (!progress.update("pictures", static_cast<double>(i) / static_cast<double>(o.inputs.size())))
      return interrupted_error("vignette");
    auto picture = read_code_picture(o.inputs[i], *mosaic);
    if (!picture)
      return picture.error();
    if (const Result<void> known = check_response_given(*picture, options.response); !known)
      return known;
    if (const Result<void> good = check_mosaic_given(*picture); !good)
      return good;
    std::string why;
    if (lens->width_px > 0 && (picture->code.width != lens->width_px || picture->code.height != lens->height_px))
      why = fmt::format("is {} x {} pixels, the lens {} x {}", picture->code.width, picture->code.height,
                        lens->width_px, lens->height_px);
    else if (const double part = saturated_part(*picture, *lens); part > (options.lamp ? 0.0 : kSaturated))
      why = fmt::format("over-exposed: {:.3g} % of it is saturated", 100 * part);
    if (picture->bits <= 16)
      for (Rgb& texel : picture->code.texels)
        for (int c = 0; c < 3; ++c)
          texel[c] = response->exposure(texel[c], c);
    if (why.empty())
      why = add_samples(picture->code, *lens, options.lamp, report.used.size(), samples);
    if (why.empty())
      report.used.push_back(picture->file);
    else
      report.dropped.push_back({picture->file, why});
  }
  progress.clear();
  const auto fit = fit_fall_off(samples);
  if (!fit)
    return deliver_without_result(o, report, {fit.error().what + "; " + fit.error().hint});
  nlohmann::ordered_json j{{"coefficients", fit->fall_off.coefficient},
                           {"rms", fit->rms},
                           {"held_out_rms", fit->held_out},
                           {"uneven", fit->uneven},
                           {"reach_deg", fit->reach / kDegree},
                           {"at_reach", fit->at_reach}};
  report.figures = j.dump();
  report.text =
      fmt::format("fall-off   to {:.3f} at {:.0f} degrees; samples off by {:.2f} %, those left out by {:.2f} %\n",
                  fit->at_reach, fit->reach / kDegree, 100 * fit->rms, 100 * fit->held_out);
  report.html = page(*fit);
  judge(report, faults_of(*fit, *lens),
        fmt::format("samples that were left out agree within {:.1f} %", 100 * fit->held_out));
  return deliver_result(o, kFallOffKind, report, [&] { return write_fall_off(o.output, fit->fall_off); });
}

} // namespace

Command add_vignette_command(CLI::App& app, CommonOptions& o) {
  const auto options = std::make_shared<VignetteOptions>();
  CLI::App* command = app.add_subcommand("vignette", "fall-off of a lens towards its edge");
  add_common_options(*command, o, "pictures of an evenly lit surface; with --lamp, of one lamp at different angles",
                     "the fall-off file to write");
  command->add_option("--lens", options->lens, "lens file of the camera")->required();
  command->add_flag("--lamp", options->lamp,
                    "each picture shows one small steady lamp, the camera turned between them");
  command->add_option("--response", options->response,
                      "linear, srgb, or a response file; not given: linear, for pictures of more than 8 bits");
  command->add_option("--mosaic", options->mosaic,
                      "what a picture with one channel is: mono, rggb, grbg, gbrg or bggr");
  return {command, [&o, options] { return run(o, *options); }};
}

} // namespace daylit::calibration
