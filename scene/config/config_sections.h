#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scene/config/config.h"
#include "scene/format/toml_section.h"
#include "scene/format/toml_text.h"

namespace daylit::detail {

// The sections that CONFIG.toml and SCENE.toml have in common. Each reads what is there and reports what is wrong.
void read_sky_picture(TomlSection sky, SkyConfig& config);
/// camera and its settings, or none; the keys are known in both cases.
void read_camera(TomlSection& section, std::optional<CameraConfig>& camera);
/// "linear", "srgb", or a file.
void read_response(TomlSection& section, std::string& response);
/// What makes radiance of a sky camera's frames.
void read_sky_measurement(TomlSection& sky, SkyConfig& config);
void read_http(TomlSection root, std::optional<HttpConfig>& http);
void read_pose(TomlSection root, std::optional<glm::dmat4>& world_from_camera);
void read_marker(TomlSection root, std::optional<MarkerConfig>& marker);
void read_objects(TomlSection& root, std::vector<ObjectConfig>& objects);
/// `glossy` of [room].
void read_glossy_room(TomlSection& room, RunConfig& config);
void read_light(TomlSection root, RunConfig& config);
void read_output(TomlSection root, OutputConfig& output);

/// True for a rotation and translation; scale and mirror images are refused.
bool is_rigid(const glm::dmat4& m);

/// What is wrong with a look_at(); null: nothing.
const char* wrong_view(const glm::dvec3& position, const glm::dvec3& target);

std::string camera_toml(const std::optional<CameraConfig>& camera);
std::string sky_measurement_toml(const SkyConfig& sky);
std::string http_toml(const std::optional<HttpConfig>& http);
std::string sky_picture_toml(const SkyConfig& sky);
std::string pose_toml(const std::optional<glm::dmat4>& world_from_camera);
std::string marker_toml(const std::optional<MarkerConfig>& marker);
std::string objects_toml(const std::vector<ObjectConfig>& objects);
/// The key that says where an object is, and its value; empty where it has none.
struct PlaceText {
  std::string key, value;
  std::vector<double> number;
};
PlaceText place_text(const ObjectConfig& object);
std::string glossy_room_toml(const std::map<std::string, double>& glossy);
std::string light_toml(const RunConfig& config);
std::string output_toml(const OutputConfig& output);

} // namespace daylit::detail
