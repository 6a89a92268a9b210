#include "bench/room_bake.h"

#include <csignal>
#include <fstream>

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "scene/core/program.h"
#include "scene/core/seconds.h"

extern char** environ;

namespace daylit::bench {

namespace {

constexpr unsigned kPoll_us = 20'000;
constexpr double kGrace_s = 3; ///< between asking a program to end and ending it

Result<pid_t> start(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                    const std::filesystem::path& log) {
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words)
    argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  for (const auto& [descriptor, ending] : {std::pair{STDOUT_FILENO, ".out"}, {STDERR_FILENO, ".err"}})
    posix_spawn_file_actions_addopen(&files, descriptor, (log.string() + ending).c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                     0644);
  pid_t pid = 0;
  const int failed = posix_spawn(&pid, program.c_str(), &files, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (failed != 0)
    return Error{ErrorCode::io, "the program cannot be started", program.string(), "build it first"};
  return pid;
}

std::string last_line(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string line, last;
  while (std::getline(stream, line))
    last = line.empty() || line.starts_with("Run with --help") ? last : line;
  return last;
}

double seconds(const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); }

} // namespace

Result<ProgramRun> run_program_of_build(const std::string& program, const std::vector<std::string>& arguments,
                                        double limit_s, const std::filesystem::path& log) {
  const double began = wall_seconds();
  const auto pid = start(std::filesystem::read_symlink("/proc/self/exe").parent_path() / program, arguments, log);
  if (!pid)
    return pid.error();
  ProgramRun run;
  rusage use{};
  int status = 0;
  double asked = 0;
  while (wait4(*pid, &status, WNOHANG, &use) == 0) {
    const double now = wall_seconds();
    run.out_of_time = run.out_of_time || now - began > limit_s;
    if (asked == 0 && (run.out_of_time || interrupted())) {
      kill(*pid, SIGINT);
      asked = now;
    } else if (asked > 0 && now - asked > kGrace_s) {
      kill(*pid, SIGKILL);
    }
    usleep(kPoll_us);
  }
  if (interrupted())
    return interrupted_error(program);
  run.wall_s = wall_seconds() - began;
  run.cpu_s = seconds(use.ru_utime) + seconds(use.ru_stime);
  run.peak_gb = static_cast<double>(use.ru_maxrss) * 1024 / 1e9;
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  std::ifstream out(log.string() + ".out");
  run.report = nlohmann::json::parse(out, nullptr, false);
  run.last_words = last_line(log.string() + ".err");
  return run;
}

} // namespace daylit::bench
