#pragma once

// Values of the command line's options. Errors: usage, naming the option.

#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "scene/core/result.h"
#include "scene/room/room.h"

namespace daylit::precompute {

/// "NX,NY,NZ", each at least 2.
Result<glm::ivec3> parse_grid(const std::string& text);
/// "X,Y,Z", metres.
Result<glm::dvec3> parse_point(const std::string& text);
/// "X0,Y0,Z0,X1,Y1,Z1", metres: a box with a volume.
Result<Bounds> parse_box(const std::string& text);
/// "2", "2%" or "2 %" as a fraction. What is no number is refused here; what cannot be reached, by the plan.
Result<double> parse_percent(const std::string& text);
/// "draft", "normal" or "high": the error that they stand for, a fraction.
Result<double> parse_quality(const std::string& name);

/// The command line (program first) without what does not decide what is in the volume: output name, threads, messages.
/// `for_time`, with a space before it, stands in the place of --time.
std::string content_arguments(const std::vector<std::string>& words, const std::string& for_time);

} // namespace daylit::precompute
