#pragma once

// What every daylit program does the same way: exit codes, Ctrl-C, progress, error text. The only part of the
// libraries that talks to a terminal; called from main functions.

#include <chrono>
#include <functional>
#include <mutex>
#include <string>

#include "scene/core/result.h"

namespace daylit {

constexpr int kExitDone = 0, kExitFailed = 1, kExitUsage = 2, kExitInterrupted = 130;

/// Exit code that belongs to an error.
int exit_code(const Error& error);

/// Installs SIGINT/SIGTERM handlers that only set a flag.
void watch_for_interrupt();
bool interrupted();
/// Installs a SIGHUP handler: what a service is told when its configuration was changed. False: SIGHUP ends the program
/// again, as of one that is no service.
void watch_for_reload(bool watch = true);
/// Whether SIGHUP has come since the last call.
bool reload_requested();
/// The Error that long work returns when interrupted() became true.
Error interrupted_error(const std::string& where);

/// Runs `body`, prints its error to stderr (or as a JSON line on stdout when `json`), returns the exit code.
/// Exceptions that escape a third-party library are reported the same way.
int run_program(const std::string& name, bool json, const std::function<Result<void>()>& body);

/// Called by long work with a stage name and the fraction done (0..1) of that stage. Return false to stop.
using Progress = std::function<bool(const std::string& stage, double fraction)>;

/// One line on stderr, redrawn on a terminal, silent otherwise; shows elapsed time and an estimate of what is left.
class ProgressLine {
public:
  explicit ProgressLine(bool quiet);
  ~ProgressLine();
  /// Takes the line off the terminal, before anything else is printed.
  void clear();
  bool update(const std::string& stage, double fraction);
  Progress callback() {
    return [this](const std::string& stage, double fraction) { return update(stage, fraction); };
  }

private:
  std::mutex mutex_; // workers report from several threads
  bool quiet_, terminal_, drawn_ = false;
  std::string stage_;
  std::chrono::steady_clock::time_point stage_start_, last_draw_;
};

/// Caps the worker threads of parallel loops in this process; 0 = all cores.
void set_thread_count(int threads);

} // namespace daylit
