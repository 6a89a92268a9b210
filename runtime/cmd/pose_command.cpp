#include "runtime/cmd/pose_command.h"

#include <cstdio>
#include <filesystem>
#include <string>

#include <glm/matrix.hpp>
#include <nlohmann/json.hpp>

#include "capture/markers/find_markers.h"
#include "capture/markers/marker_pose.h"
#include "runtime/input/photograph.h"
#include "scene/core/command_line.h"
#include "scene/core/program.h"
#include "scene/core/prompt_exit.h"

namespace daylit {

namespace {

struct Options {
  std::filesystem::path image, lens;
  std::string dictionary, response = "srgb";
  double size_m = 0;
  bool json = false;
};

/// Row by row. Marker: x right, y up, z out of it; camera: x right, y down, z forward.
nlohmann::json rows(const glm::dmat4& m) {
  auto list = nlohmann::json::array();
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      list.push_back(m[column][row]);
  return list;
}

void print(const SeenMarker& marker, const MarkerPose& pose, bool json) {
  const glm::dmat4 camera_from_marker = glm::inverse(pose.world_from_camera);
  if (!json) {
    std::printf("marker %d: %.4f %.4f %.4f m before the camera, corners off by %.3f px, ambiguity %.2f%s\n", marker.id,
                camera_from_marker[3].x, camera_from_marker[3].y, camera_from_marker[3].z, pose.reprojection_rms_px,
                pose.ambiguity, pose.tilt_uncertain() ? " (tilt uncertain)" : "");
    return;
  }
  auto corners = nlohmann::json::array();
  for (const glm::dvec2& p : marker.corner_px)
    corners.push_back(p.x), corners.push_back(p.y);
  const nlohmann::ordered_json line{{"id", marker.id},
                                    {"corners_px", corners},
                                    {"camera_from_marker", rows(camera_from_marker)},
                                    {"reprojection_px", pose.reprojection_rms_px},
                                    {"ambiguity", pose.ambiguity},
                                    {"tilt_uncertain", pose.tilt_uncertain()}};
  std::printf("%s\n", line.dump().c_str());
}

Result<void> run(const Options& options) {
  const auto lens = read_lens(options.lens);
  if (!lens)
    return lens.error();
  const auto photo = read_photograph(options.image, "linear"); // in the bytes as they are
  if (!photo)
    return photo.error();
  const auto picture = picture_of_markers(*photo, options.dictionary);
  if (!picture)
    return picture.error();
  if (const auto fits = check_lens_size(*picture, *lens, options.image.string()); !fits)
    return fits;
  const auto seen = find_markers(*picture, options.dictionary, marker_search_exponent(*photo, options.response));
  if (!seen)
    return seen.error();
  if (seen->empty())
    return Error{ErrorCode::not_found, "no marker of " + options.dictionary + " is in the picture",
                 options.image.string(),
                 "check --dictionary; the whole black square and a white margin must be visible and sharp"};
  for (const SeenMarker& marker : *seen) {
    const BoardLayout board = BoardLayout::single(options.dictionary, marker.id, options.size_m);
    const auto pose = marker_pose({marker}, *lens, board, glm::dmat4(1.0));
    if (!pose)
      return pose.error();
    print(marker, *pose, options.json);
  }
  return {};
}

} // namespace

int pose_command(int argc, char** argv) {
  Options options;
  CLI::App app{"Finds the printed markers of a picture and says where they are before the camera, each on its own.\n"
               "camera_from_marker (with --json) is row by row; marker: x right, y up, z out of it, as its authors\n"
               "print it; camera: x right, y down, z forward. ambiguity: error of the second solution over that of\n"
               "the first.",
               "daylit-run pose"};
  app.add_option("IMAGE", options.image, "PNG, JPEG, or linear EXR or .hdr")->required();
  app.add_option("--lens", options.lens, "camera YAML of ROS, Kalibr or OpenCV, for pictures of this size")->required();
  app.add_option("--dictionary", options.dictionary, "for example 6X6_250, ARUCO_ORIGINAL or APRILTAG_36h11")
      ->required();
  app.add_option("--size", options.size_m, "outer side of the black square, metres")
      ->required()
      ->check(positive_number());
  app.add_option("--response", options.response, "srgb, or linear: the code values of a PNG or JPEG are linear")
      ->check(CLI::IsMember({"srgb", "linear"}))
      ->capture_default_str();
  app.add_flag("--json", options.json, "one JSON object per marker");
  if (const auto code = parse_command_line(app, argc, argv))
    return *code;
  const PromptExit at_interrupt;
  return run_program("daylit-run pose", options.json, [&] { return run(options); });
}

} // namespace daylit
