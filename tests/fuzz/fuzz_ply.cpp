#include <cstdint>

#include "scene/model/triangle_soup.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  (void)daylit::detail::parse_ply_soup({data, size}, "fuzz", daylit::Rgb(0.5f));
  return 0;
}
