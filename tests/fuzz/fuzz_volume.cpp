// Any bytes as a volume: an error, or a volume that keeps the rules and can be combined and sampled. The checksum
// would stop almost every mutation at once, so it is put right first.

#include <cstdint>
#include <cstdlib>
#include <vector>

#include "tests/scene/volume_kinds.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace daylit;
  std::vector<std::uint8_t> file(data, data + size);
  test::sign_volume(file);
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
