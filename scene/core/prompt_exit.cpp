#include "scene/core/prompt_exit.h"

#include <chrono>
#include <cstdio>
#include <unistd.h>

#include "scene/core/program.h"
#include "scene/core/unfinished_files.h"

namespace daylit {

namespace {
using namespace std::chrono_literals;
constexpr auto kLook = 20ms, kWait = 250ms;
} // namespace

PromptExit::PromptExit()
    : watch_([](const std::stop_token& stop) {
        auto left = kWait;
        while (left > 0ms && !stop.stop_requested()) {
          std::this_thread::sleep_for(kLook);
          left = interrupted() ? left - kLook : kWait;
        }
        if (stop.stop_requested())
          return;
        detail::remove_unfinished_files();
        std::fputs("\ninterrupted\n", stderr);
        _exit(kExitInterrupted);
      }) {}

} // namespace daylit
