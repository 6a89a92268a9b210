#include "scene/core/program.h"

#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

namespace daylit {

namespace {
std::atomic<bool> g_interrupted{false};
std::atomic<bool> g_reload{false};
void on_signal(int) { g_interrupted.store(true, std::memory_order_relaxed); }
void on_reload(int) { g_reload.store(true, std::memory_order_relaxed); }

int report(const std::string& name, bool json, const Error& error) {
  std::fprintf(stderr, "%s: %s\n", name.c_str(), error.message().c_str());
  if (json) {
    const nlohmann::json line = {{"error", error.what}, {"where", error.where}, {"hint", error.hint}};
    std::printf("%s\n", line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
  }
  return exit_code(error);
}
} // namespace

int exit_code(const Error& error) {
  if (error.code == ErrorCode::interrupted)
    return kExitInterrupted;
  return error.code == ErrorCode::usage ? kExitUsage : kExitFailed;
}

void watch_for_interrupt() {
  struct sigaction action = {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return g_interrupted.load(std::memory_order_relaxed); }

void watch_for_reload(bool watch) {
  struct sigaction action = {};
  action.sa_handler = watch ? on_reload : SIG_DFL;
  action.sa_flags = SA_RESTART;
  sigaction(SIGHUP, &action, nullptr);
}

bool reload_requested() { return g_reload.exchange(false, std::memory_order_relaxed); }

Error interrupted_error(const std::string& where) { return {ErrorCode::interrupted, "interrupted", where, ""}; }

int run_program(const std::string& name, bool json, const std::function<Result<void>()>& body) {
  try {
    const Result<void> result = body();
    const bool written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
    if (result && !written)
      return report(name, json,
                    {ErrorCode::io, "what was printed could not be written", "stdout", "is the disk full?"});
    return result ? kExitDone : report(name, json, result.error());
  } catch (const std::bad_alloc&) {
    return report(name, json, {ErrorCode::limit_exceeded, "out of memory", "", "use a coarser setting"});
  } catch (const std::exception& e) {
    return report(name, json, {ErrorCode::io, e.what(), "internal", "please report this with the command line"});
  }
}

ProgressLine::ProgressLine(bool quiet)
    : quiet_(quiet), terminal_(::isatty(2) == 1), stage_start_(std::chrono::steady_clock::now()),
      last_draw_(stage_start_) {}

ProgressLine::~ProgressLine() { clear(); }

void ProgressLine::clear() {
  const std::lock_guard lock(mutex_);
  if (drawn_)
    std::fprintf(stderr, "\r\033[K");
  drawn_ = false;
}

bool ProgressLine::update(const std::string& stage, double fraction) {
  const std::lock_guard lock(mutex_);
  using namespace std::chrono;
  const auto now = steady_clock::now();
  if (stage != stage_) {
    stage_ = stage;
    stage_start_ = now;
  }
  if (!quiet_ && terminal_ && now - last_draw_ > milliseconds(100)) {
    last_draw_ = now;
    drawn_ = true;
    const double spent = duration<double>(now - stage_start_).count();
    const double left = fraction > 0.01 ? spent * (1.0 - fraction) / fraction : 0.0;
    const int filled = static_cast<int>(fraction * 30.0 + 0.5);
    std::fprintf(stderr, "\r\033[K%-14s [%.*s%*s] %3.0f %%  %.1f s, %.0f s left", stage.c_str(), filled,
                 "##############################", 30 - filled, "", 100.0 * fraction, spent, left);
    std::fflush(stderr);
  }
  return !interrupted();
}

void set_thread_count(int threads) {
  static std::unique_ptr<tbb::global_control> control;
  control.reset();
  if (threads > 0)
    control = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                    static_cast<std::size_t>(threads));
}

} // namespace daylit
