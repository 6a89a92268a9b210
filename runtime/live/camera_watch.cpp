#include "runtime/live/camera_watch.h"

#include <algorithm>
#include <cstring>
#include <span>

#include "scene/core/checksum.h"

namespace daylit {

namespace {

using namespace std::chrono_literals;

constexpr int kBlackFraction = 256; ///< of the range: no sample above a 256th of it

/// The largest code value of 8 bits, or the largest high byte of two: of 16 bits the 256th of the range that counts.
int largest_sample(const CameraFrame& frame) {
  if (frame.format.bytes_per_sample() == 1)
    return frame.bytes.empty() ? 0 : *std::max_element(frame.bytes.begin(), frame.bytes.end());
  int largest = 0;
  for (std::size_t i = 0; i + 1 < frame.bytes.size(); i += 2)
    largest = std::max(largest, frame.bytes[i] | frame.bytes[i + 1] << 8);
  return largest;
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
  const bool black = black_is_unusable_ && largest_sample(frame) * kBlackFraction <= (1 << frame.format.bits);
  const std::lock_guard lock(mutex_);
  if (!seen_ || checksum != checksum_)
    changed_ = Clock::now();
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
  r.frozen = seen_ && source.connected && Clock::now() - changed_ > frozen_after_;
  r.frame_age_s = used_ > 0 ? seconds_since(used_taken_ns_) : -1;
  r.trouble = source.connected ? trouble_ : source.trouble;
  r.likely_cause = likely_cause(source);
  return r;
}

} // namespace daylit
