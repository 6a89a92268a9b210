// Any bytes as a volume: an error, or a volume that keeps the rules and can be combined and sampled. The checksum
// would stop almost every mutation at once, so it is put right first.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <vector>

#include "scene/detail/volume_identity.h"
#include "scene/volume_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace daylit;
  std::vector<std::uint8_t> file(data, data + size);
  std::uint64_t length = 0;
  if (size >= 8)
    std::memcpy(&length, data, 8);
  if (size >= 8 && length <= size - 8) {
    const std::span<const std::byte> bytes = std::as_bytes(std::span(file)), head = bytes.first(8 + length);
    const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
    const std::size_t key = text.find(detail::kChecksumKey), digits = key + detail::kChecksumKey.size();
    if (key != std::string_view::npos && digits + detail::kNoChecksum.size() <= text.size()) {
      const std::span<const std::byte> rest = bytes.subspan(8 + length);
      const std::string sum = detail::volume_checksum(head, digits, std::span(&rest, 1));
      std::copy(sum.begin(), sum.end(), file.begin() + static_cast<std::ptrdiff_t>(digits));
    }
  }
  const Result<BasisVolume> volume = parse_volume(file, "fuzz.volume");
  if (!volume)
    return 0;
  if (!check_volume(*volume))
    std::abort();
  const LightField field = combine(*volume, std::vector<Rgb>(volume->partition.size(), Rgb(1.0f)));
  if (const auto sampler = LightFieldSampler::make(*volume))
    (void)sampler->sample(field, {1.0, 2.0, 1.0});
  return 0;
}
