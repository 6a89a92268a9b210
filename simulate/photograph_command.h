#pragma once

// Photographs that never were taken: of a print on paper, and of the surroundings by a camera in the hand.

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/core/result.h"
#include "simulate/picture_file.h"

namespace daylit {

/// daylit-simulate photographs PRINT: a board or a chart before a camera of known lens, from many sides.
struct PhotographsArguments {
  std::filesystem::path print, lens, folder;
  double width_m = 0; ///< of the print with its margin
  int views = 15;
  double tilt_deg = 30; ///< of the print, at most; at least half of it
  double part = 0;      ///< of the field's half angle: what half of the print fills; 0: 0.4 of a fish-eye, else 1
  std::vector<double> distance_m{}; ///< nearest and farthest; empty: as `part` says
  double reach = 0.9;               ///< of the field's radius that the print's corners come to
  bool partly = false;              ///< the print may reach out of the picture
  double exposure = 1.0, blur_px = 0.6, noise = 0.005;
  std::vector<double> camera_from_rec709{1, 0, 0, 0, 1, 0, 0, 0, 1};
  PictureFormat format = PictureFormat::jpeg;
  std::uint32_t seed = 0;
  bool quiet = false, json = false;
};
/// Writes DIR/photograph-00.jpg ... and DIR/truth.json: the pose of each print, camera frame, metres.
Result<void> run_photographs(const PhotographsArguments& arguments);

/// daylit-simulate develop PICTURE: what a camera makes of the light of a rendered picture.
struct DevelopArguments {
  std::filesystem::path picture, output; ///< linear EXR or .hdr; PNG: codes, EXR: light without curve and limit
  std::filesystem::path lens, fall_off;  ///< multiplied in; both or neither
  double exposure = 1.0;                 ///< light of the largest code: 1 / exposure
  double mean = 0.0;                     ///< of full scale: what the camera meters the mean to; 0: `exposure` holds
  std::vector<double> camera_from_rec709{1, 0, 0, 0, 1, 0, 0, 0, 1};
  double logarithmic = 0.0; ///< a of the code ln(1 + a v) / ln(1 + a) of light v; 0: linear codes
  double noise = 0.0;       ///< photon noise: deviation of each channel at full scale
  std::uint32_t seed = 0;
  bool force = false, quiet = false, json = false;
};
/// Tells the exposure, and how many pixels are saturated.
Result<void> run_develop(const DevelopArguments& arguments);

/// daylit-simulate hand-held MAP: pictures in all directions, with rough orientations and differing exposures.
struct HandHeldArguments {
  std::filesystem::path map, folder;
  int pictures = 40;
  double fov_deg = 75;
  std::vector<int> size{960, 720};
  double off_deg = 3;  ///< error of the rough orientations: standard deviation of a turn about each axis / sqrt 3
  double stops = 8;    ///< between the longest exposure and the shortest that the camera has
  double noise = 0.01; ///< photon noise: deviation of each channel at full scale, falling with the root of light
  double exposure_error = 0.03; ///< relative deviation of the true exposure from the stated one
  double lowest_deg = -90;      ///< no picture looks further down
  std::uint32_t seed = 0;
  bool quiet = false, json = false;
};
/// Writes DIR/000.png ..., lens.yaml, list.txt with rough orientations and stated exposures, and truth.txt, the same
/// list with the true ones.
Result<void> run_hand_held(const HandHeldArguments& arguments);

} // namespace daylit
