#include <algorithm>
#include <array>

#include "scene/image/image_formats.h"

// The first bytes are set to the magic number, so that every input reaches the decoder under test.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr auto kMagic = std::to_array<std::uint8_t>({'#', '?'});
  std::vector<std::uint8_t> bytes(data, data + size);
  if (bytes.size() >= kMagic.size())
    std::copy(kMagic.begin(), kMagic.end(), bytes.begin());
  (void)daylit::read_hdr_image(bytes, "fuzz");
  return 0;
}
