// What a bake may take of the machine's memory, and what it does where that is not enough.

#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "precompute/memory_need.h"
#include "precompute/planned_bake.h"
#include "scene/room/room_formats.h"
#include "tests/packaging/shell.h"

namespace daylit::precompute {
namespace {

const std::string kRoom = DAYLIT_SOURCE_DIR "/tests/fixtures/truth/s3_furnace.obj";

TEST(Memory, more_of_anything_needs_more_and_a_larger_error_less) {
  BakeReport counts;
  counts.patches = counts.elements = 4000;
  counts.probes_valid = 10000;
  counts.exchange.bytes = 100 << 20;
  const SkyPartition fine = *SkyPartition::parse("fine:4096");
  BakeOptions options;
  const double need = needed_memory(counts, fine, options);
  for (std::size_t* count : {&counts.patches, &counts.elements, &counts.probes_valid, &counts.exchange.bytes}) {
    const std::size_t before = *count;
    *count *= 4;
    EXPECT_GT(needed_memory(counts, fine, options), 1.05 * need);
    *count = before;
  }
  EXPECT_GT(needed_memory(counts, *SkyPartition::parse("fine:16384"), options), need);
  options.compact_error *= 2;
  EXPECT_LT(needed_memory(counts, fine, options), 0.9 * need);
  EXPECT_LT(needed_memory(counts, *SkyPartition::uniform(64), options), need);
}

TEST(Memory, of_the_machine_a_part_is_taken_and_what_is_wanted_where_it_is_said) {
  EXPECT_GT(*allowed_memory(0), 1e8);
  EXPECT_EQ(*allowed_memory(3e9), 3e9) << "no ulimit here";
  EXPECT_LT(*allowed_memory(0), *allowed_memory(1e18));
}

TEST(Memory, a_bake_that_needs_more_is_refused_before_it_starts_and_an_error_is_offered_that_fits) {
  const auto room = read_room(kRoom);
  ASSERT_TRUE(room) << room.error().message();
  PlanRequest request;
  std::string stages;
  const auto refused_at = [&](double gigabytes) -> std::string {
    request.memory_bytes = 1e9 * gigabytes;
    stages.clear();
    bool planned = false;
    const auto baked = bake_to_error(
        *room, request, nullptr,
        [&](const std::string& stage, double) {
          stages += planned ? stage : "";
          return true;
        },
        [&](const std::string&) { planned = true; });
    return baked ? "" : baked.error().message();
  };
  request.max_error = 0.01;
  const auto planned = plan_bake(*room, request, [](const std::string&, double) { return true; });
  ASSERT_TRUE(planned) << planned.error().message();
  const std::string message = refused_at(0.32);
  EXPECT_NE(message.find("GB of memory"), std::string::npos) << message;
  EXPECT_NE(message.find("--max-error"), std::string::npos) << message;
  EXPECT_EQ(stages, "") << "nothing was begun";
  const std::size_t at = message.find("--max-error ") + 12;
  request.max_error = std::stod(message.substr(at)) / 100;
  EXPECT_EQ(refused_at(0.32), "") << "what was offered fits";
}

/// The program under `ulimit -v` of some megabytes.
ShellOutcome bake_within(int megabytes, const std::string& options) {
  const std::string out = ::testing::TempDir() + "memory" + std::to_string(::getpid()) + ".volume";
  const ShellOutcome outcome = shell("ulimit -v " + std::to_string(1000 * megabytes) +
                                     "; timeout -s KILL 60 " DAYLIT_BINARY_DIR "/bin/daylit-precompute " + kRoom +
                                     " --threads 2 --force --quiet -o " + out + " " + options);
  std::filesystem::remove(out);
  return outcome;
}

TEST(Memory, a_limit_of_the_shell_ends_in_a_volume_or_in_a_refusal) {
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "a sanitizer takes terabytes of addresses";
#endif
  const ShellOutcome enough = bake_within(2000, "--max-error 6");
  EXPECT_EQ(enough.exit_code, 0) << enough.text;
  for (const int megabytes : {150, 400, 700, 800, 900, 1000}) {
    const ShellOutcome less = bake_within(megabytes, "--max-error 1");
    EXPECT_TRUE(less.exit_code == 0 || (less.exit_code == 1 && less.text.find("--memory") != std::string::npos))
        << megabytes << " MB: exit " << less.exit_code << "\n"
        << less.text;
  }
}

} // namespace
} // namespace daylit::precompute
