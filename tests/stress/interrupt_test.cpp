// A program that was started a moment ago and is interrupted.

#include <chrono>
#include <csignal>
#include <fstream>
#include <string>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/stress/good_files.h"

namespace daylit {
namespace {

using namespace test;
using namespace std::chrono_literals;

bool catches_interrupt(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("SigCgt:"))
      return (std::stoull(line.substr(7), nullptr, 16) >> (SIGINT - 1)) & 1;
  return false;
}

/// A pipe that takes nothing more.
int full_pipe() {
  int ends[2];
  EXPECT_EQ(pipe(ends), 0);
  const int flags = fcntl(ends[1], F_GETFL);
  fcntl(ends[1], F_SETFL, flags | O_NONBLOCK);
  while (write(ends[1], "x", 1) == 1)
    ;
  fcntl(ends[1], F_SETFL, flags);
  return ends[1];
}

/// A program that cannot write its help stands still where it reads its command line.
TEST(Interrupt, is_caught_before_a_program_reads_its_command_line) {
  const int pipe = full_pipe();
  for (const std::string name :
       {"daylit-bench", "daylit-calibrate", "daylit-precompute", "daylit-probe", "daylit-run", "daylit-simulate"}) {
    if (!has_program(name))
      continue;
    const pid_t child = fork();
    if (child == 0) {
      dup2(pipe, STDOUT_FILENO);
      execl((DAYLIT_PROGRAM_FOLDER "/" + name).c_str(), name.c_str(), "--help", nullptr);
      _exit(1);
    }
    const auto end = std::chrono::steady_clock::now() + 10s;
    while (!catches_interrupt(child) && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(1ms);
    EXPECT_TRUE(catches_interrupt(child)) << name;
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  }
}

} // namespace
} // namespace daylit
