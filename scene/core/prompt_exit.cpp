#include "scene/core/prompt_exit.h"

#include <chrono>
#include <cstdio>
#include <thread>
#include <unistd.h>

#include "scene/core/program.h"
#include "scene/core/unfinished_files.h"

namespace daylit {

namespace {
using namespace std::chrono_literals;
constexpr auto kLook = 20ms, kWait = 250ms;
} // namespace

void leave_promptly_when_interrupted() {
  std::thread([] {
    while (!interrupted())
      std::this_thread::sleep_for(kLook);
    std::this_thread::sleep_for(kWait);
    detail::remove_unfinished_files();
    std::fputs("\ninterrupted\n", stderr);
    _exit(kExitInterrupted);
  }).detach();
}

} // namespace daylit
