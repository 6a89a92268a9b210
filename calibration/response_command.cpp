// daylit-calibrate response: what a camera makes of light, from an exposure bracket.

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibration/bracket_options.h"
#include "calibration/response_fit.h"
#include "scene/core/atomic_file.h"

namespace daylit::calibration {

namespace {

constexpr FileKind kResponseKind{"a response of daylit", "# Response of a camera"};
constexpr double kLargeResidual = 0.15; ///< relative
constexpr double kStated = 1.12;        ///< measured over stated exposure
constexpr double kFalls = 0.15;
constexpr double kLinear = 0.02;                 ///< rms relative distance from a straight line
constexpr int kCovered = 200;                    ///< codes of 256
constexpr double kLargeStep = 2.5, kAlike = 1.1; ///< exposure over the one before; the largest over the smallest step

bool is_linear(const ResponseFit& fit) { return fit.linear_deviation < kLinear; }

struct ResponseOptions {
  BracketOptions bracket;
  std::string method = "debevec";
};

/// The step of a bracket with large steps that are all alike: a curve times anything that repeats with the step
/// explains the pictures as well (Grossberg & Nayar 2003, section 4).
std::optional<double> repeating_step(const Bracket& bracket) {
  std::set<double> times;
  for (const PlaceCodes& p : bracket.places)
    times.insert(p.time);
  double smallest = 1e300, largest = 0;
  for (auto a = times.begin(), b = std::next(a); b != times.end(); ++a, ++b) {
    smallest = std::min(smallest, *b / *a);
    largest = std::max(largest, *b / *a);
  }
  return smallest > kLargeStep && largest < kAlike * smallest ? std::optional(smallest) : std::nullopt;
}

/// Whether most places are saturated (or edges: neither has a code).
bool is_white(const PlaceCodes& shortest) {
  const auto without = std::ranges::count_if(shortest.code, [](const Rgb& code) {
    return std::max({code.r, code.g, code.b}) < 0.0f;
  });
  return 2 * without > std::ssize(shortest.code);
}

std::vector<std::string> faults_of(const ResponseFit& fit, const Bracket& bracket) {
  std::vector<std::string> faults;
  if (bracket.files.different_times() < 3)
    faults.push_back("only two exposure times; take at least three");
  if (const auto step = repeating_step(bracket); step && !is_linear(fit))
    faults.push_back(
        fmt::format("each exposure is {:.2g} times the one before: waves of the curve that repeat with that "
                    "step cannot be seen; take steps of 2 and 2.5, as 1, 2, 5, 10, 20",
                    *step));
  if (fit.residual > kLargeResidual)
    faults.push_back(
        fmt::format("the exposures disagree by {:.0f} %: the camera or something before it moved, the light "
                    "changed, or a picture was processed; use a tripod, a still scene, and one picture style",
                    100 * fit.residual));
  // The farthest only: a wrong picture moves what the others say, too.
  const auto off = [](double ratio) { return ratio > 0 ? std::abs(std::log(ratio)) : 0.0; };
  const auto worst = std::ranges::max_element(fit.stated_ratio, {}, off);
  if (off(*worst) > std::log(kStated))
    faults.push_back(
        fmt::format("{} was exposed {:.2f} times as long as stated: a wrong time, or the light changed; correct "
                    "it or leave it out",
                    bracket.places[static_cast<std::size_t>(worst - fit.stated_ratio.begin())].file, *worst));
  if (fit.fall > kFalls)
    faults.push_back(
        fmt::format("the curve falls by {:.0f} % somewhere, which no camera does: the pictures do not lie on "
                    "each other, or were brightened locally",
                    100 * fit.fall));
  if (fit.highest_code - fit.lowest_code < kCovered)
    faults.push_back(fmt::format("only codes {} to {} were seen; take longer and shorter exposures", fit.lowest_code,
                                 fit.highest_code));
  return faults;
}

std::string figures(const ResponseFit& fit, const Bracket& bracket, const std::string& method) {
  nlohmann::ordered_json j;
  j["method"] = method;
  j["residual"] = fit.residual;
  j["held_out_residual"] = fit.held_out;
  j["monotone"] = true;
  j["fall_taken_out"] = fit.fall;
  j["linear"] = is_linear(fit);
  j["linear_deviation"] = fit.linear_deviation;
  j["codes_seen"] = {fit.lowest_code, fit.highest_code};
  for (std::size_t p = 0; p < bracket.places.size(); ++p)
    j["exposures"].push_back(
        {{"file", bracket.places[p].file},
         {"exposure", bracket.places[p].time},
         {"measured_over_stated", fit.stated_ratio[p] > 0 ? nlohmann::ordered_json(fit.stated_ratio[p]) : nullptr}});
  return j.dump();
}

std::string page(const ResponseFit& fit, const Bracket& bracket) {
  const char* colours[] = {"#c33", "#393", "#33c"};
  const char* names[] = {"red", "green", "blue"};
  std::vector<Series> series;
  for (std::size_t c = 0; c < 3; ++c) {
    Series s{names[c], colours[c], {}, true};
    for (std::size_t k = 1; k < 256; ++k)
      if (fit.curve.table()[c][k] > 0.0f)
        s.points.push_back({std::log10(static_cast<double>(fit.curve.table()[c][k])), static_cast<double>(k)});
    series.push_back(std::move(s));
  }
  std::vector<std::vector<std::string>> rows{{"picture", "exposure", "measured / stated"}};
  for (std::size_t p = 0; p < bracket.places.size(); ++p)
    rows.push_back({bracket.places[p].file, fmt::format("{:.4g}", bracket.places[p].time),
                    fit.stated_ratio[p] > 0 ? fmt::format("{:.3f}", fit.stated_ratio[p]) : "not known"});
  return fmt::format("<p>Exposures agree within {:.1f} %, at places that had no part in the fit within {:.1f} %.</p>\n",
                     100 * fit.residual, 100 * fit.held_out) +
         html_plot(series, "log10 exposure", "code") + html_table(rows);
}

Result<void> run(CommonOptions& o, const ResponseOptions& options) {
  const auto bracket = read_bracket(o, options.bracket, {});
  if (!bracket)
    return bracket.error();
  Report report = report_on("Response calibration", *bracket);
  if (const auto fault = no_bracket(*bracket))
    return deliver_without_result(o, std::move(report), {*fault});
  const auto fit =
      fit_response(bracket->places, options.method == "debevec" ? ResponseMethod::debevec : ResponseMethod::robertson,
                   options.bracket.mosaic != "mono");
  if (!fit)
    return deliver_without_result(o, std::move(report),
                                  {is_white(bracket->places.front())
                                       ? "over-exposed: even the shortest exposure is white nearly everywhere; take "
                                         "shorter ones"
                                       : fit.error().what + "; " + fit.error().hint});
  const bool linear = is_linear(*fit);
  report.figures = figures(*fit, *bracket, options.method);
  report.text = fmt::format("residual   {:.2f} %, at places that had no part in the fit {:.2f} %\n",
                            100 * fit->residual, 100 * fit->held_out) +
                fmt::format("curve      monotone; {} ({:.1f} % from a straight line)\n",
                            linear ? "linear" : "not linear", 100 * fit->linear_deviation);
  report.html = page(*fit, *bracket);
  judge(report, faults_of(*fit, *bracket),
        fmt::format("{} exposures agree within {:.1f} %; the curve rises throughout{}", bracket->places.size(),
                    100 * fit->residual, linear ? ", and the camera is linear: a straight line was written" : ""));
  const ResponseCurve& curve = linear ? ResponseCurve::linear() : fit->curve;
  return deliver_result(o, kResponseKind, report, [&] { return write_file_atomically(o.output, curve.text()); });
}

} // namespace

Command add_response_command(CLI::App& app, CommonOptions& o) {
  const auto options = std::make_shared<ResponseOptions>();
  CLI::App* command =
      app.add_subcommand("response", "response of a camera (code value against light) from an exposure bracket");
  add_common_options(*command, o, "pictures of one still scene at several exposures, from a tripod",
                     "the response to write: 256 lines, exposure of each code value for R G B");
  add_bracket_options(*command, options->bracket);
  command->add_option("--method", options->method, "debevec or robertson")
      ->check(CLI::IsMember({"debevec", "robertson"}));
  return {command, [&o, options] { return run(o, *options); }};
}

} // namespace daylit::calibration
