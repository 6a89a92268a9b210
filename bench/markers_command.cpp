// daylit-bench markers: sequences of pictures of a printed board from a hand-held camera with blur and noise, and how
// far the poses that are found in them are from the true ones.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include <CLI/CLI.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "bench/command.h"
#include "bench/timing.h"
#include "capture/markers/marker_tracker.h"
#include "capture/markers/pose_filter.h"
#include "simulate/board_picture.h"

namespace daylit::bench {
namespace {

constexpr double kPi = std::numbers::pi, kDegree = kPi / 180, kFramesPerSecond = 25;
constexpr double kFlip_deg = 10; // no view is closer than 10 degrees to face on: a mirrored tilt is 20 off at least

struct Arguments {
  std::vector<std::string> dictionaries{"6X6_250", "APRILTAG_36h11"};
  int poses = 2000, frames = 50, columns = 4, rows = 3, width = 1280, height = 960;
  double side_m = 0.06, gap_m = 0.015, fov_deg = 60, blur_px = 0.7, noise = 1;
  std::vector<double> tilt_deg{10, 70}, distance_m{0.4, 2.0};
};

/// A hand-held camera that circles the board a little: distance, tilt, direction and roll swing about their means.
class HandHeldPath {
public:
  HandHeldPath(const Arguments& a, std::mt19937& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    const auto between = [&](const std::vector<double>& ends, double edge) {
      return ends[0] + edge + (ends[1] - ends[0] - 2 * edge) * unit(random);
    };
    tilt_ = between(a.tilt_deg, 0.02 * (a.tilt_deg[1] - a.tilt_deg[0]));
    tilt_swing_ = std::min({3.0, tilt_ - a.tilt_deg[0], a.tilt_deg[1] - tilt_});
    distance_ = between(a.distance_m, 0.02 * (a.distance_m[1] - a.distance_m[0]));
    distance_swing_ = std::min({0.05 * distance_, distance_ - a.distance_m[0], a.distance_m[1] - distance_});
    direction_ = 360 * unit(random), roll_ = 360 * unit(random);
    target_ = 0.03 * distance_ * glm::dvec2(unit(random) - 0.5, unit(random) - 0.5);
    for (double& phase : phase_)
      phase = 2 * kPi * unit(random);
  }

  /// Camera x right, y down, z forward; board x right, y up, z out of it.
  glm::dmat4 camera_from_board(double seconds) const {
    const auto swing = [&](int k, double hertz) { return std::sin(2 * kPi * hertz * seconds + phase_[k]); };
    const double tilt = kDegree * (tilt_ + tilt_swing_ * swing(0, 0.5)), roll = kDegree * (roll_ + 5 * swing(1, 0.4)),
                 around = kDegree * (direction_ + 5 * swing(2, 0.3)),
                 distance = distance_ + distance_swing_ * swing(3, 0.6);
    const glm::dvec3 out(std::sin(tilt) * std::cos(around), std::sin(tilt) * std::sin(around), std::cos(tilt));
    const glm::dvec3 target(target_, 0.0), eye = target + distance * out, forward = -out;
    const glm::dvec3 side = glm::normalize(glm::cross(forward, glm::dvec3(-std::sin(around), std::cos(around), 0.0)));
    const glm::dvec3 other = glm::cross(forward, side);
    const glm::dvec3 right = std::cos(roll) * side + std::sin(roll) * other, down = glm::cross(forward, right);
    return glm::inverse(
        glm::dmat4(glm::dvec4(right, 0), glm::dvec4(down, 0), glm::dvec4(forward, 0), glm::dvec4(eye, 1)));
  }

private:
  double tilt_ = 0, tilt_swing_ = 0, distance_ = 0, distance_swing_ = 0, direction_ = 0, roll_ = 0;
  glm::dvec2 target_{0.0};
  double phase_[4] = {};
};

struct PoseErrors {
  std::vector<double> position_pct, angle_deg; ///< of the distance
  int flips = 0;
  void add(const glm::dmat4& found, const glm::dmat4& truth) {
    position_pct.push_back(100 * glm::length(glm::dvec3(found[3] - truth[3])) / glm::length(glm::dvec3(truth[3])));
    const glm::dmat3 r = glm::transpose(glm::dmat3(found)) * glm::dmat3(truth);
    angle_deg.push_back(std::acos(std::clamp(0.5 * (r[0][0] + r[1][1] + r[2][2] - 1), -1.0, 1.0)) / kDegree);
    flips += angle_deg.back() > kFlip_deg;
  }
};

double at_fraction(std::vector<double> v, double fraction) {
  if (v.empty())
    return 0;
  std::sort(v.begin(), v.end());
  return v[std::min(v.size() - 1, static_cast<std::size_t>(fraction * static_cast<double>(v.size())))];
}

nlohmann::json to_json(const PoseErrors& e) {
  return {{"position_pct_median", at_fraction(e.position_pct, 0.5)},
          {"position_pct_95", at_fraction(e.position_pct, 0.95)},
          {"position_pct_worst", at_fraction(e.position_pct, 1)},
          {"angle_deg_median", at_fraction(e.angle_deg, 0.5)},
          {"angle_deg_95", at_fraction(e.angle_deg, 0.95)},
          {"angle_deg_worst", at_fraction(e.angle_deg, 1)},
          {"flips", e.flips}};
}

struct Tally {
  PoseErrors single_frame, filtered;
  std::vector<double> reprojection_px, search_ms;
  int poses = 0, found = 0, uncertain = 0, lost = 0;
};

void follow(const LensModel& lens, const BoardCamera& camera, const PrintedBoard& board, const HandHeldPath& path,
            std::uint32_t seed, int frames, Tally& tally) {
  MarkerTracker tracker(board.layout);
  PoseFilter filter(lens, board.layout, glm::dmat4(1.0));
  for (int frame = 0; frame < frames; ++frame) {
    const double seconds = frame / kFramesPerSecond;
    const glm::dmat4 truth = path.camera_from_board(seconds);
    const Rgb8Image picture = camera.picture(board, truth, seed + static_cast<std::uint32_t>(frame));
    Result<MarkerPose> pose = Error{};
    tally.search_ms.push_back(1e3 * wall_time_once([&] {
                                const auto seen = tracker.find(picture);
                                pose = seen ? refined_marker_pose(picture, *seen, lens, board.layout, glm::dmat4(1.0))
                                            : seen.error();
                              }));
    ++tally.poses;
    if (pose) {
      ++tally.found;
      tally.uncertain += pose->tilt_uncertain();
      tally.reprojection_px.push_back(pose->reprojection_rms_px);
      tally.single_frame.add(glm::inverse(pose->world_from_camera), truth);
    }
    const TrackedPose tracked = filter.update(pose ? &*pose : nullptr, seconds);
    if (tracked.usable())
      tally.filtered.add(glm::inverse(tracked.world_from_camera), truth);
    else
      ++tally.lost;
  }
}

Result<nlohmann::json> measure(const Arguments& a, const std::string& dictionary) {
  std::vector<int> ids;
  for (int k = 0; k < a.columns * a.rows; ++k)
    ids.push_back(k);
  const auto layout = BoardLayout::grid(dictionary, ids, a.columns, a.side_m, a.gap_m);
  if (!layout)
    return layout.error();
  const auto board = PrintedBoard::print(*layout, 0.5 * a.gap_m + 1e-6);
  if (!board)
    return board.error();
  CameraQuality quality;
  quality.blur_px = a.blur_px;
  quality.noise.floor *= a.noise, quality.noise.photon *= a.noise * a.noise;
  const LensModel lens = ideal_pinhole(a.width, a.height, a.fov_deg * kDegree);
  const BoardCamera camera(lens, quality);
  Tally tally;
  for (int first = 0; first < a.poses; first += a.frames) {
    if (interrupted())
      return interrupted_error("pose " + std::to_string(first));
    std::mt19937 random(static_cast<unsigned>(first) + 1);
    follow(lens, camera, *board, HandHeldPath(a, random), static_cast<std::uint32_t>(first),
           std::min(a.frames, a.poses - first), tally);
  }
  return nlohmann::json{{"dictionary", dictionary},
                        {"poses", tally.poses},
                        {"found", tally.found},
                        {"tilt_uncertain", tally.uncertain},
                        {"lost", tally.lost},
                        {"reprojection_px_median", at_fraction(tally.reprojection_px, 0.5)},
                        {"reprojection_px_worst", at_fraction(tally.reprojection_px, 1)},
                        {"search_ms", median(tally.search_ms)},
                        {"single_frame", to_json(tally.single_frame)},
                        {"filtered", to_json(tally.filtered)}};
}

void print_row(const nlohmann::json& row) {
  std::printf("%-15s %d of %d found, %d uncertain, %d lost, corners off by %.3f px, %.1f ms\n",
              row["dictionary"].get<std::string>().c_str(), row["found"].get<int>(), row["poses"].get<int>(),
              row["tilt_uncertain"].get<int>(), row["lost"].get<int>(), row["reprojection_px_median"].get<double>(),
              row["search_ms"].get<double>());
  for (const char* kind : {"single_frame", "filtered"}) {
    const auto& e = row[kind];
    std::printf(
        "  %-13s position %.2f %% (95 %%: %.2f, worst %.2f), angle %.2f deg (95 %%: %.2f, worst %.2f), %d flips\n",
        kind, e["position_pct_median"].get<double>(), e["position_pct_95"].get<double>(),
        e["position_pct_worst"].get<double>(), e["angle_deg_median"].get<double>(), e["angle_deg_95"].get<double>(),
        e["angle_deg_worst"].get<double>(), e["flips"].get<int>());
  }
}

Result<void> run(const Arguments& a, const CommonOptions& options) {
  nlohmann::json rows;
  for (const std::string& dictionary : a.dictionaries) {
    auto row = measure(a, dictionary);
    if (!row)
      return row.error();
    if (!options.json)
      print_row(*row);
    rows.push_back(std::move(*row));
  }
  return deliver({{"machine", machine()},
                  {"board", {{"columns", a.columns}, {"rows", a.rows}, {"side_m", a.side_m}, {"gap_m", a.gap_m}}},
                  {"camera", {{"size", {a.width, a.height}}, {"fov_deg", a.fov_deg}, {"blur_px", a.blur_px}}},
                  {"tilt_deg", a.tilt_deg},
                  {"distance_m", a.distance_m},
                  {"dictionaries", rows}},
                 options);
}

} // namespace

Command add_markers(CLI::App& program) {
  auto a = std::make_shared<Arguments>();
  CLI::App* parser =
      program.add_subcommand("markers", "poses of a marker board in simulated pictures of a moving camera");
  parser->add_option("--dictionaries", a->dictionaries, "marker families")->delimiter(',')->capture_default_str();
  parser->add_option("--poses", a->poses, "pictures per family")->check(CLI::Range(1, 1000000))->capture_default_str();
  parser->add_option("--frames", a->frames, "pictures of one sequence")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  parser->add_option("--columns", a->columns, "of the board; 1 with --rows 1: a single marker")
      ->check(CLI::Range(1, 50));
  parser->add_option("--rows", a->rows, "of the board")->check(CLI::Range(1, 50));
  parser->add_option("--side", a->side_m, "of a marker, metres")->check(CLI::PositiveNumber)->capture_default_str();
  parser->add_option("--tilt", a->tilt_deg, "least,most angle from face on, degrees")->expected(2)->delimiter(',');
  parser->add_option("--distance", a->distance_m, "least,most distance, metres")->expected(2)->delimiter(',');
  parser->add_option("--width", a->width, "of the pictures, pixels")
      ->check(CLI::Range(64, 8192))
      ->capture_default_str();
  parser->add_option("--height", a->height, "of the pictures, pixels")
      ->check(CLI::Range(64, 8192))
      ->capture_default_str();
  parser->add_option("--blur", a->blur_px, "standard deviation of the point spread, pixels")
      ->check(CLI::Range(0.0, 16.0));
  parser->add_option("--noise", a->noise, "times the noise of a usual sensor")->check(CLI::Range(0.0, 100.0));
  return {parser, [a](const CommonOptions& options) { return run(*a, options); }};
}

} // namespace daylit::bench
