// daylit-calibrate merge: a bracket and a response to one HDR picture.

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibration/bracket_options.h"
#include "calibration/fisheye_picture.h"
#include "capture/frames/recording.h"
#include "capture/hdr/bracket.h"
#include "capture/hdr/bracket_cycle.h"
#include "scene/image/image_formats.h"
#include "scene/lens/fall_off.h"

namespace daylit::calibration {

namespace {

constexpr double kStated = 1.25;    ///< measured over stated exposure
constexpr double kOverRange = 0.02; ///< of the light in pixels that are brighter than the shortest exposure holds
constexpr float kDim = 0.1f;        ///< of the largest code
constexpr double kHardlyAny = 0.01; ///< of the places
constexpr double kGhosts = 0.05;    ///< of the pixels
constexpr float kBright = 0.4f;     ///< of white: what the 80th percentile of the preview becomes

struct MergeOptions {
  BracketOptions bracket;
  std::string response;
  double scale = 1.0, illuminance = 0.0; ///< 0: no reading
  std::filesystem::path lens, vignette;
  bool every = false;
};

/// What was merged, and what is known about it.
struct Merged {
  MergedBracket bracket;
  std::vector<double> measured_over_stated; ///< of each exposure beside the one before; 0: not known
  double over_range_light = 0.0;            ///< share of the picture's light
  double scale = 1.0;
  std::optional<double> illuminance; ///< on the plane through the lens, across its axis; in lx where absolute
  bool absolute = false;             ///< cd/m2; else in proportion to it
};

std::vector<double> exposure_ratios(const std::vector<PlaceCodes>& places, const ResponseCurve& response) {
  std::vector<double> ratios{1.0};
  for (std::size_t p = 1; p < places.size(); ++p) {
    const auto ratio = measured_ratio(places[p - 1], places[p], response);
    ratios.push_back(ratio ? *ratio * places[p - 1].time / places[p].time : 0.0);
  }
  return ratios;
}

double light_over_range(const MergedBracket& merged) {
  double over = 0, all = 0;
  for (std::size_t i = 0; i < merged.radiance.texels.size(); ++i) {
    const auto y = static_cast<double>(luminance(merged.radiance.texels[i]));
    all += y;
    over += merged.over_range_mask[i] ? y : 0.0;
  }
  return all > 0 ? over / all : 0.0;
}

/// Whether hardly any place of the longest exposure is bright; places without a code may be.
bool under_exposed(const PlaceCodes& longest) {
  const auto bright = std::ranges::count_if(longest.code, [](const Rgb& code) {
    return std::min({code.r, code.g, code.b}) < 0.0f || std::max({code.r, code.g, code.b}) > kDim;
  });
  return static_cast<double>(bright) < kHardlyAny * static_cast<double>(longest.code.size());
}

std::vector<std::string> faults_of(const Merged& m, const Bracket& bracket) {
  std::vector<std::string> faults;
  if (under_exposed(bracket.places.back()))
    faults.push_back(
        "under-exposed: hardly anything is brighter than a tenth of the range in the longest exposure; add a "
        "longer one");
  const auto pixels = static_cast<double>(m.bracket.radiance.texels.size());
  if (m.over_range_light > kOverRange)
    faults.push_back(
        fmt::format("{} pixels are brighter than the shortest exposure holds, with {:.0f} % of the light or "
                    "more; add a shorter exposure",
                    m.bracket.over_range, 100 * m.over_range_light));
  if (static_cast<double>(m.bracket.ghosts) > kGhosts * pixels)
    faults.push_back(
        fmt::format("{:.0f} % of the pixels saw different things in different exposures: the camera moved, "
                    "the light changed, or the response is not this camera's",
                    100 * static_cast<double>(m.bracket.ghosts) / pixels));
  for (std::size_t p = 1; p < m.measured_over_stated.size(); ++p)
    if (const double r = m.measured_over_stated[p]; r > 0 && (r > kStated || r < 1 / kStated))
      faults.push_back(fmt::format("{} was exposed {:.2f} times as long as stated beside {}: a wrong time, another "
                                   "response, or the light changed",
                                   bracket.places[p].file, r, bracket.places[p - 1].file));
  return faults;
}

std::string figures(const Merged& m, const Bracket& bracket) {
  nlohmann::ordered_json j;
  j["over_range_pixels"] = m.bracket.over_range;
  j["over_range_light"] = m.over_range_light;
  j["ghost_pixels"] = m.bracket.ghosts;
  j["unit"] = m.absolute ? "cd/m2" : "relative";
  j["scale"] = m.scale;
  if (m.illuminance)
    j[m.absolute ? "illuminance_lx" : "illuminance_relative"] = *m.illuminance;
  for (std::size_t p = 0; p < bracket.places.size(); ++p)
    j["exposures"].push_back(
        {{"file", bracket.places[p].file},
         {"exposure", bracket.places[p].time},
         {"measured_over_stated",
          m.measured_over_stated[p] > 0 ? nlohmann::ordered_json(m.measured_over_stated[p]) : nullptr}});
  return j.dump();
}

/// Exposed by its brighter part, because around the circle of a fish-eye it is dark; over-range pixels magenta.
Rgb8Image preview(const MergedBracket& merged) {
  std::vector<float> y;
  for (std::size_t i = 0; i < merged.radiance.texels.size(); i += 17)
    if (const float l = luminance(merged.radiance.texels[i]); l > 0.0f)
      y.push_back(l);
  float exposure = 1.0f;
  if (!y.empty()) {
    const auto high = y.begin() + static_cast<std::ptrdiff_t>(y.size() * 4 / 5);
    std::ranges::nth_element(y, high);
    exposure = kBright / *high;
  }
  Rgb8Image view = to_srgb8(merged.radiance, exposure);
  for (std::size_t i = 0; i < merged.over_range_mask.size(); ++i)
    if (merged.over_range_mask[i]) {
      view.bytes[3 * i] = view.bytes[3 * i + 2] = 255;
      view.bytes[3 * i + 1] = 0;
    }
  return view;
}

/// Merges while the pictures are read, so that one is in memory at a time.
Result<Bracket> merge_files(const CommonOptions& o, const MergeOptions& options, const ResponseCurve& response,
                            Merged& out) {
  std::optional<BracketMerger> merger;
  const auto take = [&](const CodePicture& picture, double time,
                        const std::vector<std::uint8_t>& ignored) -> Result<void> {
    if (const Result<void> known = check_response_given(picture, options.response); !known)
      return known;
    if (!merger)
      merger.emplace(picture.code.width, picture.code.height, MergeSettings{response, usual_noise(picture.bits)});
    return merger->add(picture.code, time, ignored);
  };
  auto bracket = read_bracket(o, options.bracket, take);
  if (bracket && merger)
    out.bracket = merger->result();
  return bracket;
}

/// Divides the fall-off out, measures the illuminance, sets the scale.
Result<void> calibrate_light(const MergeOptions& options, Merged& m) {
  m.scale = options.scale;
  m.absolute = m.absolute || options.illuminance > 0;
  if (options.lens.empty() && (!options.vignette.empty() || options.illuminance > 0))
    return Error{ErrorCode::usage, "needs the lens of the pictures",
                 options.vignette.empty() ? "--illuminance" : "--vignette", "give --lens FILE"};
  if (!options.lens.empty()) {
    const auto lens = read_lens(options.lens);
    if (!lens)
      return lens.error();
    const auto fall_off = options.vignette.empty() ? Result<FallOff>(FallOff{}) : read_fall_off(options.vignette);
    if (!fall_off)
      return fall_off.error();
    RgbImage& radiance = m.bracket.radiance;
    const auto sensitivity = pixel_sensitivity(*lens, *fall_off, radiance.width, radiance.height);
    if (!sensitivity)
      return sensitivity.error();
    divide(radiance, *sensitivity);
    const double measured = illuminance_at(m.bracket.radiance, *lens);
    if (options.illuminance > 0)
      m.scale = options.illuminance / measured;
    m.illuminance = m.scale * measured;
  }
  for (Rgb& texel : m.bracket.radiance.texels)
    texel *= static_cast<float>(m.scale);
  return {};
}

std::string text_of(const Merged& m) {
  std::string text = fmt::format("range      {} pixels over it, {:.2f} % of the light\n", m.bracket.over_range,
                                 100 * m.over_range_light) +
                     fmt::format("ghosts     {} pixels shown as the shortest exposure that is not too dark saw them\n",
                                 m.bracket.ghosts) +
                     fmt::format("unit       {}, scale {:.4g}\n", m.absolute ? "cd/m2" : "relative", m.scale);
  if (m.illuminance)
    text += m.absolute
                ? fmt::format("light      {:.1f} lx on the plane across the lens axis\n", *m.illuminance)
                : fmt::format("light      {:.4g} on the plane across the lens axis, not in lx: give --illuminance "
                              "for that\n",
                              *m.illuminance);
  return text;
}

/// A frame of a recording: the exposure it was asked for, and the one that its pixels show (0: not known).
struct LearnedFrame {
  std::uint64_t id = 0;
  double asked = 0.0, learned = 0.0;
};

/// Numbered names beside the output: out.exr becomes out-00012.exr.
std::filesystem::path numbered(const std::filesystem::path& path, std::uint64_t number) {
  return path.parent_path() / fmt::format("{}-{:05d}{}", path.stem().string(), number, path.extension().string());
}

/// Exposure times of the cycle, microseconds: as given, or as the recording says they were asked for.
Result<std::vector<double>> cycle_times(const Recording& recording, const std::string& given) {
  if (!given.empty())
    return parse_numbers(given, 0, "--exposures");
  std::set<double> asked;
  for (std::size_t k = 0; k < recording.size(); ++k)
    asked.insert(recording.exposure_us(k));
  return std::vector<double>(asked.begin(), asked.end());
}

Report recording_report(const std::vector<LearnedFrame>& frames, const CycleReport& cycle, const Merged* m) {
  Report report;
  report.title = "Merge of a recording";
  nlohmann::ordered_json j{{"unknown_frames", cycle.unknown}};
  std::vector<std::vector<std::string>> rows{{"frame", "asked for, us", "exposed, us"}};
  std::size_t late = 0;
  for (const LearnedFrame& f : frames) {
    j["frames"].push_back({{"id", f.id}, {"asked_us", f.asked}, {"exposed_us", f.learned}});
    rows.push_back({std::to_string(f.id), fmt::format("{:g}", f.asked),
                    f.learned > 0 ? fmt::format("{:g}", f.learned) : "not known"});
    (f.learned > 0 ? report.used : report.why).push_back(std::to_string(f.id));
    late += f.learned > 0 && f.learned != f.asked ? 1 : 0;
  }
  for (const std::string& id : std::exchange(report.why, {}))
    report.dropped.push_back(
        {"frame " + id, "its exposure is not known: the first two cycles, or none of the exposures"});
  j["late_frames"] = late;
  report.text = fmt::format("frames     {}, {} of them with another exposure than asked for\n", frames.size(), late);
  if (m) {
    j["over_range_pixels"] = m->bracket.over_range;
    j["ghost_pixels"] = m->bracket.ghosts;
    if (m->illuminance)
      j[m->absolute ? "illuminance_lx" : "illuminance_relative"] = *m->illuminance;
    report.html = html_picture(preview(m->bracket), "The last merged picture; over-range pixels are magenta.");
  }
  report.figures = j.dump();
  report.html += html_table(rows);
  return report;
}

/// Merges what a cycling camera recorded; the exposure of each frame is learned from its pixels.
Result<void> run_recording(CommonOptions& o, const MergeOptions& options, const ResponseCurve& response) {
  const auto recording = Recording::open(o.inputs.front());
  if (!recording)
    return recording.error();
  const auto times = cycle_times(*recording, options.bracket.exposures);
  if (!times)
    return times.error();
  const auto first = recording->read(0);
  if (!first)
    return first.error();
  auto cycle = BracketCycle::create(*times, {response, usual_noise(first->format.bits)});
  if (!cycle)
    return times->size() < 2 ? deliver_without_result(o, recording_report({}, {}, nullptr),
                                                      {"one exposure only: a bracket needs two at least"})
                             : Result<void>(cycle.error());
  if (const Result<void> good = check_outputs(o, kExrKind); !good)
    return good;
  std::vector<LearnedFrame> frames;
  std::optional<Merged> last;
  ProgressLine progress(o.quiet || o.json);
  for (std::size_t k = 0; k < recording->size(); ++k) {
    if (!progress.update("frames", static_cast<double>(k) / static_cast<double>(recording->size())))
      return interrupted_error("recording");
    const auto frame = recording->read(k);
    if (!frame)
      return frame.error();
    auto code = linear_picture(*frame);
    if (!code)
      return code.error();
    const auto time = cycle->add(std::move(*code), frame->time_ns);
    if (!time)
      return time.error();
    frames.push_back({frame->id, frame->exposure_us, time->value_or(0.0)});
    const bool wanted = options.every ? *time == *std::ranges::min_element(*times) : k + 1 == recording->size();
    auto merged = wanted ? cycle->merged() : std::nullopt;
    if (!merged)
      continue;
    last = Merged{};
    last->bracket = std::move(merged->bracket);
    if (const Result<void> good = calibrate_light(options, *last); !good)
      return good;
    const std::filesystem::path path = options.every ? numbered(o.output, k) : o.output;
    if (const Result<void> written = write_exr(path, last->bracket.radiance); !written)
      return written;
  }
  progress.clear();
  Report report = recording_report(frames, cycle->report(), last ? &*last : nullptr);
  if (!last)
    return deliver_without_result(
        o, std::move(report),
        {"the exposures cannot be distinguished: each has to be seen twice, and no two may be both "
         "black or both white"});
  judge(report, {}, fmt::format("the exposures of {} frames are known", report.used.size()));
  return deliver(o, report);
}

Result<void> run(CommonOptions& o, const MergeOptions& options) {
  const auto response = response_or_linear(options.response);
  if (!response)
    return response.error();
  if (o.inputs.size() == 1 && std::filesystem::is_directory(o.inputs.front()))
    return run_recording(o, options, *response);
  Merged m;
  const auto bracket = merge_files(o, options, *response, m);
  if (!bracket)
    return bracket.error();
  Report report = report_on("Exposure merge", *bracket);
  if (const auto fault = no_bracket(*bracket))
    return deliver_without_result(o, std::move(report), {*fault});
  m.measured_over_stated = exposure_ratios(bracket->places, *response);
  if (interrupted())
    return interrupted_error("merge");
  m.absolute = bracket->files.luminance;
  if (const Result<void> good = calibrate_light(options, m); !good)
    return good;
  m.over_range_light = light_over_range(m.bracket);
  report.figures = figures(m, *bracket);
  report.text = text_of(m);
  report.html =
      html_picture(preview(m.bracket), "The merged picture; what is brighter than the shortest exposure holds is "
                                       "magenta.") +
      fmt::format("<pre>{}</pre>\n", html_escaped(report.text));
  judge(report, faults_of(m, *bracket), fmt::format("{} exposures agree", bracket->places.size()));
  return deliver_result(o, kExrKind, report, [&] { return write_exr(o.output, m.bracket.radiance); });
}

} // namespace

Command add_merge_command(CLI::App& app, CommonOptions& o) {
  const auto options = std::make_shared<MergeOptions>();
  CLI::App* command = app.add_subcommand("merge", "an exposure bracket to one HDR picture (EXR, float)");
  add_common_options(*command, o, "pictures of one scene at several exposures, or a recording of a camera that cycles",
                     "the EXR picture to write");
  add_bracket_options(*command, options->bracket);
  command->add_option("--response", options->response,
                      "linear, srgb, or a response file; not given: linear, for pictures of more than 8 bits");
  command->add_flag("--every", options->every,
                    "of a recording: a picture for every frame of the shortest exposure, numbered as the frames");
  command->add_option("--lens", options->lens, "lens file: the illuminance at the lens is printed");
  command->add_option("--vignette", options->vignette, "fall-off file, divided out");
  CLI::Option* scale = command->add_option("--scale", options->scale, "factor on the result")->check(positive_number());
  command->add_option("--illuminance", options->illuminance, "reading at the lens, lx: the result is scaled to it")
      ->check(positive_number())
      ->excludes(scale);
  return {command, [&o, options] { return run(o, *options); }};
}

} // namespace daylit::calibration
