// Any bytes as cached transfer vectors of an object of as many vertices as fit: an error, or coefficients in range.
// Key and checksum are put right first, so that the content itself is judged.

#include <cmath>
#include <cstdlib>
#include <cstring>

#include "runtime/object/transfer.h"
#include "scene/core/checksum.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace daylit;
  constexpr std::size_t kHeader_bytes = 48;
  std::vector<std::uint8_t> file(data, data + size);
  if (size >= kHeader_bytes) {
    const std::uint64_t hash = checksum64(std::as_bytes(std::span(file).subspan(kHeader_bytes)));
    std::memcpy(file.data() + 24, "0123456789abcdef", 16);
    std::memcpy(file.data() + 40, &hash, sizeof(hash));
  }
  const std::size_t vertices = size > kHeader_bytes ? (size - kHeader_bytes) / sizeof(VertexTransfer) : 0;
  const auto transfer = parse_transfer(file, "fuzz.transfer", "0123456789abcdef", vertices);
  if (!transfer)
    return 0;
  for (const VertexTransfer& t : *transfer)
    for (const TransferVector* side : {&t.front, &t.back})
      for (const float c : *side)
        if (!(std::fabs(c) < 4.0f))
          std::abort();
  return 0;
}
