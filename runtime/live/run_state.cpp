#include "runtime/live/run_state.h"

#include <fmt/format.h>

namespace daylit {

namespace {

/// Black frames of a bracket are none: they are not counted.
bool is_black(const CameraReport& sky) { return sky.black > 0 && sky.blank == "black"; }

/// Empty: the sky camera gives what is needed.
std::string trouble_of_sky(const RunState& s) {
  if (!s.balance && is_black(s.sky))
    return "no sky yet: the sky camera's picture is black";
  if (!s.balance)
    return "no sky yet" + (s.sky.trouble.empty() ? "" : ": " + s.sky.trouble);
  if (!s.sky.source.connected)
    return "sky camera away, its last picture is used: " + s.sky.trouble;
  if (!s.sky.trouble.empty())
    return "sky camera, its last good picture is used: " + s.sky.trouble;
  if (is_black(s.sky))
    return fmt::format("sky camera black: its last good picture is {:.0f} s old", s.sky_age_s);
  return "";
}

/// Empty: the sky is whole.
std::string lost_light(const SkyBalance& sky) {
  if (sky.sun_restored)
    return "";
  if (sky.unexplained > 0)
    return fmt::format("; {} pixels of the sky are brighter than the camera holds", sky.over_range);
  if (!sky.sun_lost)
    return "";
  return "; the sun is brighter than the sky camera can show" +
         (sky.no_reading.empty() ? "" : ", no reading: " + sky.no_reading);
}

} // namespace

std::string in_words(const RunState& s) {
  if (!s.interior.source.connected)
    return s.interior.source.trouble.empty() ? "opening the cameras"
                                             : "interior camera away: " + s.interior.source.trouble;
  if (!s.interior.trouble.empty())
    return "interior camera: " + s.interior.trouble;
  if (!s.wanted)
    return "idle: nobody looks";
  if (std::string trouble = trouble_of_sky(s); !trouble.empty())
    return trouble;
  if (!s.interior.blank.empty())
    return fmt::format("interior picture {}: is the lens covered, or the exposure wrong?", s.interior.blank);
  if (s.interior.frozen || s.sky.frozen)
    return std::string(s.sky.frozen ? "sky" : "interior") + " camera frozen: the same picture for five seconds";
  if (s.tracking == TrackingState::lost)
    return "marker lost: the photograph is left as it is";
  return "drawing" + lost_light(*s.balance);
}

} // namespace daylit
