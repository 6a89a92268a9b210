#pragma once

#include <string>

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "scene/image/rgb_image.h"

namespace daylit::detail {

// Writing. Numbers are written so that reading gives the same bits.
std::string text(double value);
std::string text(const glm::dvec3& v);
std::string text(const Rgb& c);
std::string text(const glm::dmat4& m);
std::string quoted(const std::string& value);

} // namespace daylit::detail
