// How soon an interrupt ends work that does not ask for it.

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <functional>
#include <optional>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

#include "scene/core/program.h"
#include "scene/core/prompt_exit.h"

namespace daylit {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

struct End {
  int code = -1;
  double seconds = 0.0; ///< from the interrupt to the end
};

/// Of a process that does that work, interrupted after 0.2 s.
End interrupt_during(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    watch_for_interrupt();
    work();
    _exit(kExitDone);
  }
  std::this_thread::sleep_for(200ms);
  const Clock::time_point start = Clock::now();
  kill(child, SIGINT);
  int status = 0;
  waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, std::chrono::duration<double>(Clock::now() - start).count()};
}

void work_for(std::chrono::milliseconds time) {
  for (const Clock::time_point end = Clock::now() + time; Clock::now() < end;)
    std::this_thread::sleep_for(1ms);
}

TEST(PromptExit, ends_work_that_does_not_notice_within_half_a_second) {
  const End end = interrupt_during([] {
    const PromptExit at_interrupt;
    work_for(5s);
  });
  EXPECT_EQ(end.code, kExitInterrupted);
  EXPECT_LT(end.seconds, 0.5);
}

TEST(PromptExit, lets_work_that_notices_end_by_itself) {
  const End end = interrupt_during([] {
    const PromptExit at_interrupt;
    while (!interrupted())
      work_for(10ms);
    work_for(100ms); // what is left to tidy up
    _exit(7);
  });
  EXPECT_EQ(end.code, 7);
}

TEST(PromptExit, ends_nothing_after_its_life) {
  const End end = interrupt_during([] {
    std::optional<PromptExit> at_interrupt(std::in_place);
    work_for(50ms);
    at_interrupt.reset();
    work_for(1s);
  });
  EXPECT_EQ(end.code, kExitDone);
}

} // namespace
} // namespace daylit
