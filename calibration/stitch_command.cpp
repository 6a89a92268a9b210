// daylit-calibrate probe-stitch: an environment map from many pictures taken by hand.

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "calibration/code_picture.h"
#include "calibration/command.h"
#include "calibration/light_bundle.h"
#include "calibration/panorama.h"
#include "calibration/rotation_bundle.h"
#include "calibration/small_turn.h"

namespace daylit::calibration {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kCovered = 0.995;    ///< of the sphere
constexpr double kOverRange = 0.005;  ///< of the light; what is lost is more
constexpr double kDisagree = 0.05;    ///< between pictures that overlap
constexpr double kOddExposure = 0.25; ///< true over stated exposure - 1
constexpr double kManyOdd = 0.25;     ///< of the pictures
constexpr double kMisaligned_deg = 0.4;
constexpr double kAligned_deg = 0.3; ///< deviation of a picture's turn beside the others
constexpr double kUnaligned = 0.25;  ///< of the pictures
constexpr double kFarTurn = 3.0;     ///< times --off
constexpr std::size_t kGapsSaid = 4; ///< and pictures of one kind

struct StitchOptions {
  std::filesystem::path lens;
  std::string response = "srgb", projection = "equirect";
  double fov_deg = 0, off_deg = 3, scale = 1;
  int height_px = 512;
};

struct Stitched {
  std::size_t count = 0;
  LightAgreement light;
  std::size_t matches = 0;
  double match_rms_deg = 0, moved_rms_deg = 0;
  std::vector<double> moved_deg; ///< of each picture, from what the list states
  Panorama map;
  bool is_aligned(std::size_t picture) const { return light.sigma_deg[picture] < kAligned_deg; }
  std::size_t aligned() const {
    return static_cast<std::size_t>(std::ranges::count_if(light.sigma_deg, [](double s) { return s < kAligned_deg; }));
  }
};

/// Pinhole of the stated field of view; the size follows from the first picture.
Result<LensModel> lens_of(const StitchOptions& options, const ListedPicture& first) {
  if (options.lens.empty() == (options.fov_deg == 0))
    return Error{ErrorCode::usage, "needs the lens of the pictures", "--lens, --fov", "give one of the two"};
  if (!options.lens.empty())
    return read_lens(options.lens);
  const auto picture = read_code_picture(first.path);
  if (!picture)
    return picture.error();
  return ideal_pinhole(picture->code.width, picture->code.height, options.fov_deg * kDegree);
}

Result<std::vector<HandHeldPicture>> read_pictures(const CommonOptions& o, const StitchOptions& options,
                                                   const Progress& progress) {
  const auto listed = read_picture_list(o.inputs.front());
  if (!listed)
    return listed.error();
  const auto response = ResponseCurve::named(options.response);
  if (!response)
    return response.error();
  const auto lens = lens_of(options, listed->front());
  if (!lens)
    return lens.error();
  std::vector<HandHeldPicture> pictures;
  for (const ListedPicture& one : *listed) {
    if (!progress("pictures", static_cast<double>(pictures.size()) / static_cast<double>(listed->size())))
      return interrupted_error("probe-stitch");
    auto picture = read_hand_held(one, *lens, *response);
    if (!picture)
      return picture.error();
    pictures.push_back(std::move(*picture));
  }
  return pictures;
}

Result<Stitched> stitch(std::vector<HandHeldPicture>& pictures, const SkyGeometry& geometry,
                        const StitchOptions& options, const Progress& progress) {
  Stitched s;
  s.count = pictures.size();
  const double off = options.off_deg * kDegree;
  const auto matches = match_pictures(pictures, 4.0 * off, progress);
  if (!matches)
    return matches.error();
  s.matches = matches->size();
  std::vector<glm::dmat3> rough;
  for (const HandHeldPicture& p : pictures)
    rough.push_back(p.world_from_camera);
  s.match_rms_deg = align_pictures(pictures, *matches, off / std::sqrt(3.0));
  auto light = agree_in_light(pictures, rough, off / std::sqrt(3.0), progress);
  if (!light)
    return light.error();
  s.light = std::move(*light);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const double moved = glm::length(turn_vector(pictures[i].world_from_camera * glm::transpose(rough[i]))) / kDegree;
    s.moved_deg.push_back(moved);
    s.light.sigma_deg[i] = std::min(s.light.sigma_deg[i], options.off_deg); // the list says as much
    s.moved_rms_deg += moved * moved / static_cast<double>(pictures.size());
  }
  s.moved_rms_deg = std::sqrt(s.moved_rms_deg);
  auto map = merge_panorama(pictures, geometry, progress);
  if (!map)
    return map.error();
  s.map = std::move(*map);
  for (Rgb& texel : s.map.radiance.texels)
    texel *= static_cast<float>(options.scale);
  return s;
}

std::string where(const Gap& gap) {
  return fmt::format("azimuth {:.0f}, altitude {:.0f} degrees", std::atan2(gap.middle.y, gap.middle.x) / kDegree,
                     std::asin(std::clamp(gap.middle.z, -1.0, 1.0)) / kDegree);
}

/// One by one, or where they are many what that says of all.
void add_odd_exposures(const Stitched& s, const std::vector<HandHeldPicture>& pictures,
                       std::vector<std::string>& faults) {
  std::vector<std::string> odd;
  for (std::size_t i = 0; i < pictures.size(); ++i)
    if (const double r = s.light.measured_over_stated[i]; std::abs(std::log(r)) > std::log1p(kOddExposure))
      odd.push_back(
          fmt::format("{} was exposed {:.2f} times as long as stated beside the others", pictures[i].file, r));
  if (static_cast<double>(odd.size()) > kManyOdd * static_cast<double>(s.count))
    faults.push_back(
        fmt::format("{} of {} pictures were not exposed as stated: --response is not this camera's, or the "
                    "list has wrong exposures",
                    odd.size(), s.count));
  else
    faults.insert(faults.end(), odd.begin(), odd.end());
}

/// Pictures that were turned by far more than their orientations are said to be off.
void add_far_turns(const Stitched& s, const std::vector<HandHeldPicture>& pictures, double off_deg,
                   std::vector<std::string>& faults) {
  std::vector<std::string> far;
  for (std::size_t i = 0; i < pictures.size(); ++i)
    if (s.moved_deg[i] > kFarTurn * off_deg)
      far.push_back(fmt::format("{} by {:.0f} degrees", pictures[i].file, s.moved_deg[i]));
  if (far.empty())
    return;
  const std::size_t said = std::min(far.size(), kGapsSaid);
  faults.push_back(fmt::format(
      "{} of {} pictures had to be turned by more than {:g} times --off from what the list states ({}{}): "
      "look at their angles (azimuth counter-clockwise, roll clockwise) and names, or give a larger --off",
      far.size(), s.count, kFarTurn, fmt::join(far.begin(), far.begin() + static_cast<std::ptrdiff_t>(said), ", "),
      said < far.size() ? ", ..." : ""));
}

/// Named whatever the verdict.
void add_unaligned(const Stitched& s, const std::vector<HandHeldPicture>& pictures, Report& report) {
  for (std::size_t i = 0; i < pictures.size() && s.aligned() > 0; ++i)
    if (!s.is_aligned(i))
      report.why.push_back(fmt::format("{} overlaps too little with other pictures: its orientation is only known to "
                                       "{:.1f} degrees",
                                       pictures[i].file, s.light.sigma_deg[i]));
}

std::vector<std::string> faults_of(const Stitched& s, const std::vector<HandHeldPicture>& pictures, double off_deg) {
  std::vector<std::string> faults;
  if (s.map.coverage < kCovered) {
    std::string list;
    for (std::size_t g = 0; g < std::min(s.map.gaps.size(), kGapsSaid); ++g)
      list += (g ? "; " : "") + where(s.map.gaps[g]);
    faults.push_back(
        fmt::format("{:.1f} % of the sphere is in no picture and filled from around; take pictures towards {}",
                    100 * (1 - s.map.coverage), list));
  }
  if (s.map.over_range > kOverRange)
    faults.push_back(fmt::format("{:.1f} % of the light or more is in what even the shortest exposure has saturated; "
                                 "take shorter exposures of it",
                                 100 * s.map.over_range));
  if (s.aligned() == 0)
    faults.push_back("nothing could be aligned: no two pictures overlap and show more than an even surface; let "
                     "neighbours overlap by a third, and expose them so that both show it");
  else if (static_cast<double>(s.count - s.aligned()) > kUnaligned * static_cast<double>(s.count))
    faults.push_back(
        fmt::format("{} of {} pictures could not be aligned and are as stated: they overlap too little with "
                    "others; let neighbours overlap by a third",
                    s.count - s.aligned(), s.count));
  if (s.match_rms_deg > kMisaligned_deg)
    faults.push_back(
        fmt::format("matched features are {:.1f} degrees apart: the camera was moved instead of turned, or "
                    "--lens is not its lens",
                    s.match_rms_deg));
  if (s.light.disagreement > kDisagree)
    faults.push_back(
        fmt::format("pictures that overlap differ by {:.0f} %: the light changed, or --response is not this "
                    "camera's",
                    100 * s.light.disagreement));
  add_odd_exposures(s, pictures, faults);
  add_far_turns(s, pictures, off_deg, faults);
  return faults;
}

std::string figures(const Stitched& s, const std::vector<HandHeldPicture>& pictures) {
  nlohmann::ordered_json j;
  j["coverage"] = s.map.coverage;
  j["gaps"] = nlohmann::ordered_json::array();
  for (const Gap& gap : s.map.gaps)
    j["gaps"].push_back({{"azimuth_deg", std::atan2(gap.middle.y, gap.middle.x) / kDegree},
                         {"altitude_deg", std::asin(std::clamp(gap.middle.z, -1.0, 1.0)) / kDegree},
                         {"solid_angle_sr", gap.solid_angle_sr}});
  j["over_range_light"] = s.map.over_range;
  j["overlaps_matched"] = s.matches;
  j["match_rms_deg"] = s.match_rms_deg;
  j["moved_rms_deg"] = s.moved_rms_deg;
  j["disagreement"] = s.light.disagreement;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    nlohmann::ordered_json m = nlohmann::ordered_json::array();
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        m.push_back(pictures[i].world_from_camera[c][r]);
    j["pictures"].push_back({{"file", pictures[i].file},
                             {"aligned", s.is_aligned(i)},
                             {"sigma_deg", s.light.sigma_deg[i]},
                             {"turned_deg", s.moved_deg[i]},
                             {"exposure", pictures[i].exposure},
                             {"measured_over_stated", s.light.measured_over_stated[i]},
                             {"world_from_camera", m}});
  }
  return j.dump();
}

std::string text_of(const Stitched& s) {
  return fmt::format(
      "aligned    {} of {} pictures, {} overlaps, features {:.2f} degrees apart (rms); turned by {:.1f}\n"
      "exposures  overlapping pictures differ by {:.1f} % (rms)\n"
      "covered    {:.1f} % of the sphere, {} gaps; over range {:.2f} % of the light\n",
      s.aligned(), s.count, s.matches, s.match_rms_deg, s.moved_rms_deg, 100 * s.light.disagreement,
      100 * s.map.coverage, s.map.gaps.size(), 100 * s.map.over_range);
}

/// Gaps magenta; exposed by its median.
std::string page(const Stitched& s) {
  std::vector<float> y;
  for (std::size_t k = 0; k < s.map.seen.size(); k += 13)
    if (s.map.seen[k])
      y.push_back(luminance(s.map.radiance.texels[k]));
  float exposure = 1.0f;
  if (!y.empty()) {
    const auto middle = y.begin() + static_cast<std::ptrdiff_t>(y.size() / 2);
    std::ranges::nth_element(y, middle);
    exposure = *middle > 0.0f ? 0.25f / *middle : 1.0f;
  }
  Rgb8Image view = to_srgb8(s.map.radiance, exposure);
  for (std::size_t k = 0; k < s.map.seen.size(); ++k)
    if (s.map.seen[k] == 0) {
      view.bytes[3 * k] = view.bytes[3 * k + 2] = 255;
      view.bytes[3 * k + 1] = 0;
    }
  return html_picture(view, "The map; magenta: no picture shows it, filled from around in the file.");
}

Result<void> run(CommonOptions& o, const StitchOptions& options) {
  if (o.inputs.size() != 1)
    return Error{ErrorCode::usage, "takes one list of pictures", "INPUT", "a line for each picture"};
  const auto projection = parse_projection(options.projection, 0.0, {1, 0, 0}, {0, 0, 1});
  if (!projection)
    return projection.error();
  const bool equirect = std::holds_alternative<EquirectProjection>(*projection);
  const auto geometry = SkyGeometry::make((equirect ? 2 : 1) * options.height_px, options.height_px, *projection);
  if (!geometry)
    return geometry.error();
  ProgressLine progress(o.quiet || o.json);
  auto pictures = read_pictures(o, options, progress.callback());
  if (!pictures)
    return pictures.error();
  const auto stitched = stitch(*pictures, **geometry, options, progress.callback());
  progress.clear();
  if (!stitched)
    return stitched.error();
  Report report;
  report.title = "Stitched environment map";
  report.figures = figures(*stitched, *pictures);
  report.text = text_of(*stitched);
  report.html = page(*stitched) + fmt::format("<pre>{}</pre>\n", html_escaped(report.text));
  for (const HandHeldPicture& picture : *pictures)
    report.used.push_back(picture.file);
  judge(report, faults_of(*stitched, *pictures, options.off_deg),
        fmt::format("{:.1f} % of the sphere from {} pictures that agree within {:.1f} %", 100 * stitched->map.coverage,
                    pictures->size(), 100 * stitched->light.disagreement));
  add_unaligned(*stitched, *pictures, report);
  return deliver_result(o, kExrKind, report, [&] { return write_exr(o.output, stitched->map.radiance); });
}

} // namespace

Command add_stitch_command(CLI::App& app, CommonOptions& o) {
  const auto options = std::make_shared<StitchOptions>();
  CLI::App* command = app.add_subcommand(
      "probe-stitch", "an environment map from pictures taken by hand in all directions, at differing exposures");
  add_common_options(*command, o, "list: PICTURE EXPOSURE AZIMUTH ALTITUDE ROLL (degrees) on each line",
                     "the EXR picture to write");
  command->add_option("--lens", options->lens, "lens file of the pictures");
  command->add_option("--fov", options->fov_deg, "instead of --lens: horizontal field of view, degrees")
      ->check(CLI::Range(5.0, 150.0));
  command->add_option("--response", options->response, "linear, srgb, or a response file")->capture_default_str();
  command->add_option("--off", options->off_deg, "how far orientations may be off, degrees")
      ->check(CLI::Range(0.1, 20.0))
      ->capture_default_str();
  command->add_option("--projection", options->projection, "of the map: equirect or angular")
      ->check(CLI::IsMember({"equirect", "angular"}))
      ->capture_default_str();
  command->add_option("--height", options->height_px, "of the map, pixels")
      ->check(CLI::Range(64, 4096))
      ->capture_default_str();
  command->add_option("--scale", options->scale, "factor on the result")->check(positive_number());
  return {command, [&o, options] { return run(o, *options); }};
}

} // namespace daylit::calibration
