#include "runtime/live/camera_watch.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

#include "scene/core/checksum.h"

namespace daylit {

namespace {

using namespace std::chrono_literals;

constexpr int kBlackFraction = 256; ///< of the range: no sample above a 256th of it
constexpr int kWhiteFraction = 50;  ///< of the range: no sample further from its end

/// Stops at the first that does not.
template <class Holds>
bool holds_for_all(const CameraFrame& frame, const Holds& holds) {
  if (frame.format.bytes_per_sample() == 1)
    return std::ranges::all_of(frame.bytes, holds);
  for (std::size_t i = 0; i + 1 < frame.bytes.size(); i += 2)
    if (!holds(frame.bytes[i] | frame.bytes[i + 1] << 8))
      return false;
  return true;
}

/// "black", "white", or empty: there is something in it.
std::string blank_of(const CameraFrame& frame) {
  const int range = 1 << frame.format.bits;
  if (holds_for_all(frame, [&](int sample) { return sample * kBlackFraction <= range; }))
    return "black";
  const bool white = holds_for_all(frame, [&](int sample) { return (range - 1 - sample) * kWhiteFraction <= range; });
  return white ? "white" : "";
}

double seconds_since(std::int64_t taken_ns) {
  const auto now = std::chrono::steady_clock::now().time_since_epoch() / 1ns;
  return 1e-9 * static_cast<double>(now - taken_ns);
}

std::string likely_cause(const SourceReport& r) {
  if (r.damaged == 0 && r.missing == 0)
    return "";
  if (r.damaged >= r.missing)
    return "packets are lost between camera and machine: give packet_size as large as network card and switch take "
           "(jumbo "
           "frames), a larger receive buffer (sysctl net.core.rmem_max), or a lower frame_rate";
  return "whole frames are missing: the machine or the camera's link is too slow; lower frame_rate";
}

} // namespace

double age_s(const CameraFrame& frame) { return seconds_since(frame.taken_ns); }

bool CameraWatch::accept(const CameraFrame& frame) {
  const std::uint64_t checksum = checksum64(std::as_bytes(std::span(frame.bytes)));
  std::string blank = blank_of(frame);
  const bool black = black_is_unusable_ && blank == "black";
  const std::lock_guard lock(mutex_);
  blank_ = std::move(blank);
  looked_ = Clock::now();
  if (!seen_ || checksum != checksum_)
    changed_ = looked_;
  seen_ = true;
  checksum_ = checksum;
  if (frame.width_px != width_px_ || frame.height_px != height_px_) {
    ++refused_;
    trouble_ = "its frames are " + std::to_string(frame.width_px) + " x " + std::to_string(frame.height_px) +
               ", expected are " + std::to_string(width_px_) + " x " + std::to_string(height_px_) +
               ": another program has changed it, or it cannot do that size; give size and a lens file for it";
    return false;
  }
  black_ += black;
  return !black;
}

void CameraWatch::refuse(const std::string& why) {
  const std::lock_guard lock(mutex_);
  ++refused_;
  trouble_ = why;
}

void CameraWatch::used(const CameraFrame& frame) {
  const std::lock_guard lock(mutex_);
  ++used_;
  used_taken_ns_ = frame.taken_ns;
  trouble_.clear();
}

CameraReport CameraWatch::report(const SourceReport& source) const {
  const std::lock_guard lock(mutex_);
  CameraReport r;
  r.source = source;
  r.used = used_;
  r.refused = refused_;
  r.black = black_;
  r.blank = blank_;
  r.frozen = seen_ && source.connected && looked_ - changed_ > frozen_after_;
  r.frame_age_s = used_ > 0 ? seconds_since(used_taken_ns_) : -1;
  r.trouble = source.connected ? trouble_ : source.trouble;
  r.likely_cause = likely_cause(source);
  return r;
}

} // namespace daylit
