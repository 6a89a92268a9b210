#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <yaml-cpp/yaml.h>

#include "scene/core/atomic_file.h"
#include "scene/core/read_file.h"
#include "scene/lens/foreign_lens.h"
#include "scene/lens/lens.h"

namespace daylit {

namespace {

constexpr std::size_t kMaxLensFileBytes = std::size_t{1} << 20;
constexpr double kDegree = std::numbers::pi / 180.0;

/// Thrown inside this file only; parse_lens turns it into a value.
struct LensFileError {
  std::string key, expected;
};

/// All finite numbers of a sequence, a nested sequence, or the `data` of a matrix.
void collect_numbers(const YAML::Node& node, const std::string& key, std::vector<double>& out) {
  if (node.IsMap()) {
    if (!node["data"])
      throw LensFileError{key, "a list of numbers or a matrix with `data`"};
    return collect_numbers(node["data"], key, out);
  }
  if (node.IsSequence()) {
    for (const YAML::Node& item : node)
      collect_numbers(item, key, out);
    return;
  }
  const double value = node.IsScalar() ? node.as<double>(std::nan("")) : std::nan("");
  if (!std::isfinite(value) || out.size() >= 64)
    throw LensFileError{key, "at most 64 finite numbers"};
  out.push_back(value);
}

std::vector<double> numbers(const YAML::Node& root, const std::string& key) {
  std::vector<double> out;
  collect_numbers(root[key], key, out);
  return out;
}

/// The first of several spellings that the file has, or an empty string.
std::string first_key(const YAML::Node& root, std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (root[key])
      return key;
  return "";
}

void read_intrinsics(const YAML::Node& root, LensModel& lens) {
  const std::string key = first_key(root, {"camera_matrix", "K", "intrinsics"});
  if (key.empty())
    throw LensFileError{"camera_matrix", "9 numbers: fx 0 cx, 0 fy cy, 0 0 1"};
  const std::vector<double> m = numbers(root, key);
  if (key == "intrinsics" && m.size() == 4) {
    lens.fx = m[0], lens.fy = m[1], lens.cx = m[2], lens.cy = m[3];
  } else if (m.size() == 9 && m[1] == 0 && m[3] == 0 && m[6] == 0 && m[7] == 0 && m[8] == 1) {
    lens.fx = m[0], lens.cx = m[2], lens.fy = m[4], lens.cy = m[5];
  } else {
    throw LensFileError{key, key == "intrinsics" ? "4 numbers: fx fy cx cy" : "9 numbers: fx 0 cx, 0 fy cy, 0 0 1"};
  }
  if (!(lens.fx > 1e-3 && lens.fy > 1e-3 && lens.fx < 1e7 && lens.fy < 1e7))
    throw LensFileError{key, "focal lengths in pixels between 1e-3 and 1e7"};
}

void read_distortion(const YAML::Node& root, LensModel& lens) {
  const std::string key = first_key(root, {"distortion_coefficients", "distortion_coeffs", "D"});
  const std::vector<double> k = key.empty() ? std::vector<double>{} : numbers(root, key);
  std::string model = root["distortion_model"] ? root["distortion_model"].as<std::string>("?") : "";
  if (model.empty())
    model = k.size() > 5 ? "rational_polynomial" : "plumb_bob";
  auto need = [&](bool good, const char* expected) {
    if (!good)
      throw LensFileError{key.empty() ? "distortion_coefficients" : key, expected};
  };
  if (model == "equidistant" || model == "fisheye") {
    lens.kind = LensKind::equidistant;
    need(k.size() == 4, "4 numbers k1 k2 k3 k4 for the equidistant model");
  } else if (model == "plumb_bob" || model == "radtan") {
    need(k.empty() || k.size() == 4 || k.size() == 5, "k1 k2 p1 p2 [k3] for the plumb_bob model");
  } else if (model == "rational_polynomial") {
    need(k.size() == 8, "k1 k2 p1 p2 k3 k4 k5 k6 for the rational_polynomial model");
  } else if (model == "none") {
    need(k.empty(), "no coefficients for the model \"none\"");
  } else {
    throw LensFileError{"distortion_model", "plumb_bob, rational_polynomial, equidistant or none"};
  }
  std::copy(k.begin(), k.end(), lens.distortion.begin());
}

void read_size(const YAML::Node& root, LensModel& lens) {
  double width = 0, height = 0;
  if (root["resolution"]) {
    const std::vector<double> size = numbers(root, "resolution");
    if (size.size() != 2)
      throw LensFileError{"resolution", "width and height"};
    width = size[0], height = size[1];
  } else if (root["image_width"] || root["image_height"]) {
    width = root["image_width"].as<double>(-1.0);
    height = root["image_height"].as<double>(-1.0);
  } else {
    return;
  }
  if (!(width >= 1 && height >= 1 && width <= 32768 && height <= 32768) || width != std::floor(width) ||
      height != std::floor(height))
    throw LensFileError{"image_width, image_height", "whole numbers in 1..32768"};
  lens.width_px = static_cast<int>(width);
  lens.height_px = static_cast<int>(height);
}

/// Numbers typed with four digits are a rotation up to their rounding: the nearest frame is taken within 1e-3.
void read_rotation(const YAML::Node& root, LensModel& lens) {
  if (!root["world_from_camera"])
    return;
  const std::vector<double> m = numbers(root, "world_from_camera");
  if (m.size() != 9)
    throw LensFileError{"world_from_camera", "9 numbers, row-major"};
  const glm::dmat3 given(m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]);
  const glm::dmat3 excess = glm::transpose(given) * given - glm::dmat3(1.0);
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r)
      if (!(std::abs(excess[c][r]) < 1e-3))
        throw LensFileError{"world_from_camera", "a rotation: rows of length 1 at right angles"};
  if (!(glm::determinant(given) > 0))
    throw LensFileError{"world_from_camera", "a rotation without mirroring (determinant +1)"};
  const glm::dvec3 z = glm::normalize(given[2]);
  const glm::dvec3 x = glm::normalize(given[0] - z * glm::dot(z, given[0]));
  lens.world_from_camera = glm::dmat3(x, glm::cross(z, x), z);
}

/// Distance of the picture's farthest corner from the axis, in focal lengths. A picture of unknown size is taken to
/// have the axis in its middle.
double corner_radius(const LensModel& lens) {
  const double right = (lens.width_px > 0 ? lens.width_px - 1 : 2 * lens.cx) - lens.cx;
  const double below = (lens.height_px > 0 ? lens.height_px - 1 : 2 * lens.cy) - lens.cy;
  return std::hypot(std::max(lens.cx, right) / lens.fx, std::max(lens.cy, below) / lens.fy);
}

/// A curve that folds back before `limit` must do so outside the picture: two directions would share a pixel.
void refuse_fold(const LensModel& lens, double limit) {
  constexpr double kStep = 1.0 / 2048.0; // of the search in monotone_field(), twice
  if (lens.max_theta > (1.0 - kStep) * limit)
    return;
  const double theta = (1.0 - 1e-9) * lens.max_theta; // inside the field whatever the rounding
  const auto rim = lens.project({std::sin(theta), 0.0, std::cos(theta)});
  if (rim && (rim->x - lens.cx) / lens.fx >= corner_radius(lens))
    return;
  const std::string angle = std::to_string(std::floor(10.0 * lens.max_theta / kDegree) / 10.0).substr(0, 4);
  throw LensFileError{"distortion_coefficients",
                      "a curve that rises over the whole picture (it folds back " + angle +
                          " degrees from the axis; if less is used, say so with max_theta_deg, at most " + angle + ")"};
}

void read_field(const YAML::Node& root, LensModel& lens) {
  double limit = 0.5 * std::numbers::pi;
  if (root["max_theta_deg"]) {
    limit = root["max_theta_deg"].as<double>(-1.0) * kDegree;
    if (!(limit > 0 && limit < std::numbers::pi))
      throw LensFileError{"max_theta_deg", "an angle above 0 and below 180"};
  }
  lens.max_theta = monotone_field(lens.kind, lens.distortion, limit);
  if (!(lens.max_theta > 0.01))
    throw LensFileError{"distortion_coefficients", "a curve that rises near the optical axis"};
  refuse_fold(lens, limit);
}

LensModel lens_of(const YAML::Node& file) {
  if (!file.IsMap())
    throw LensFileError{"camera_matrix", "a camera YAML with keys such as camera_matrix"};
  const YAML::Node root = file["cam0"] && file["cam0"].IsMap() ? file["cam0"] : file;
  if (root["camera_model"] && root["camera_model"].as<std::string>("?") != "pinhole")
    throw LensFileError{"camera_model", "pinhole"};
  LensModel lens;
  read_intrinsics(root, lens);
  read_distortion(root, lens);
  read_size(root, lens);
  read_rotation(root, lens);
  read_field(root, lens);
  return lens;
}

/// OpenCV starts its files with "%YAML:1.0", which YAML 1.2 does not allow.
std::string without_opencv_directive(const std::string& text) {
  if (text.rfind("%YAML:", 0) != 0)
    return text;
  const std::size_t end = text.find('\n');
  return end == std::string::npos ? std::string() : text.substr(end + 1);
}

} // namespace

Result<LensModel> read_lens(const std::filesystem::path& path) {
  const auto file = InputFile::open(path); // of a Radiance picture the beginning is enough
  if (!file)
    return file.error();
  std::vector<std::uint8_t> bytes(std::min(file->size(), kMaxLensFileBytes + 1));
  bytes.resize(file->read(bytes));
  const std::string text(bytes.begin(), bytes.end());
  if (bytes.size() > kMaxLensFileBytes && !detail::is_radiance(text))
    return Error{ErrorCode::limit_exceeded, "is larger than 1 MB, which no lens file is", path.string(),
                 "name the lens file, not the picture"};
  return parse_lens(text, path.string());
}

Result<LensModel> parse_lens(const std::string& text, const std::string& name) {
  if (detail::is_ocam(text))
    return detail::parse_ocam(text, name);
  if (detail::is_radiance(text))
    return detail::parse_radiance_view(text, name);
  try {
    return lens_of(YAML::Load(without_opencv_directive(text)));
  } catch (const LensFileError& error) {
    return Error{ErrorCode::value_invalid, "expected " + error.expected, name + ", key " + error.key,
                 "a camera file as ROS, Kalibr or OpenCV write it is read"};
  } catch (const std::exception& error) {
    return Error{ErrorCode::file_malformed, std::string("not a readable YAML file (") + error.what() + ")", name,
                 "a camera file as ROS, Kalibr or OpenCV write it is read"};
  }
}

Result<void> write_lens(const std::filesystem::path& path, const LensModel& lens) {
  std::ostringstream out;
  out.precision(17);
  const bool equidistant = lens.kind == LensKind::equidistant;
  const bool rational = lens.distortion[5] != 0 || lens.distortion[6] != 0 || lens.distortion[7] != 0;
  const int count = equidistant ? 4 : rational ? 8 : 5;
  out << kLensKind.start << " angles in degrees, the rest as ROS and Kalibr write it\n";
  out << "image_width: " << lens.width_px << "\nimage_height: " << lens.height_px << "\n";
  out << "camera_matrix:\n  rows: 3\n  cols: 3\n  dt: d\n  data: [" << lens.fx << ", 0, " << lens.cx << ", 0, "
      << lens.fy << ", " << lens.cy << ", 0, 0, 1]\n";
  out << "distortion_model: " << (equidistant ? "equidistant" : rational ? "rational_polynomial" : "plumb_bob") << "\n";
  out << "distortion_coefficients:\n  rows: 1\n  cols: " << count << "\n  dt: d\n  data: [";
  for (int i = 0; i < count; ++i)
    out << (i ? ", " : "") << lens.distortion[static_cast<std::size_t>(i)];
  out << "]\nmax_theta_deg: " << lens.max_theta / kDegree << "\nworld_from_camera: [";
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      out << (r + c ? ", " : "") << lens.world_from_camera[c][r];
  out << "]\n";
  return write_file_atomically(path, out.str());
}

} // namespace daylit
