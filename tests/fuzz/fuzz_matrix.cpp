#include <cmath>
#include <cstdlib>

#include "scene/volume/radiance_matrix.h"

// A matrix that is accepted is finite, of the size it states, and comes back from every format.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace daylit;
  const auto matrix = parse_matrix(std::string(data, data + size), "fuzz.mtx");
  if (!matrix)
    return 0;
  if (matrix->value.size() != static_cast<std::size_t>(matrix->rows) * static_cast<std::size_t>(matrix->columns))
    std::abort();
  for (const Rgb& c : matrix->value)
    if (!std::isfinite(c.r) || !std::isfinite(c.g) || !std::isfinite(c.b))
      std::abort();
  for (const MatrixFormat format : {MatrixFormat::ascii, MatrixFormat::float32, MatrixFormat::float64}) {
    const auto again = parse_matrix(matrix_text(*matrix, format, "again"), "again.mtx");
    if (!again || again->value != matrix->value)
      std::abort();
  }
  return 0;
}
