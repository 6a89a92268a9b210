#pragma once

#include <string>

#include "scene/core/result.h"
#include "scene/volume/radiance_matrix.h"

namespace daylit::test {

/// What matrix_text() writes, read back by the rules of Radiance, in either byte order. Error: not such a file, of
/// another size than its header says, a value that is not finite.
Result<RadianceMatrix> parse_matrix(const std::string& text, const std::string& name);

} // namespace daylit::test
