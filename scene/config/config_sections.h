#pragma once

#include <optional>
#include <string>

#include "scene/config/config.h"
#include "scene/format/toml_section.h"
#include "scene/format/toml_text.h"

namespace daylit::detail {

// The sections that CONFIG.toml and SCENE.toml have in common. Each reads what is there and reports what is wrong.
void read_sky_picture(TomlSection sky, SkyConfig& config);
void read_pose(TomlSection root, std::optional<glm::dmat4>& world_from_camera);
void read_marker(TomlSection root, std::optional<MarkerConfig>& marker);
void read_objects(TomlSection& root, std::vector<ObjectConfig>& objects);
void read_light(TomlSection root, RunConfig& config);
void read_output(TomlSection root, OutputConfig& output);

/// True for a rotation and translation; scale and mirror images are refused.
bool is_rigid(const glm::dmat4& m);

std::string sky_picture_toml(const SkyConfig& sky);
std::string pose_toml(const std::optional<glm::dmat4>& world_from_camera);
std::string marker_toml(const std::optional<MarkerConfig>& marker);
std::string objects_toml(const std::vector<ObjectConfig>& objects);
std::string output_toml(const OutputConfig& output);

} // namespace daylit::detail
