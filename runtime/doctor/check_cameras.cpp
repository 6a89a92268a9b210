#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include "runtime/doctor/doctor.h"
#include "runtime/input/camera_pictures.h"
#include "scene/core/seconds.h"
#include "scene/lens/lens.h"

namespace daylit {

namespace {

constexpr int kJumbo_bytes = 8000; ///< from here on a network takes jumbo frames
constexpr double kFrameWait_s = 10.0;

std::string list_of(const std::vector<FoundCamera>& found) {
  std::string text;
  for (const FoundCamera& camera : found)
    text += (text.empty() ? "" : ", ") + camera.id + (camera.address.empty() ? "" : " at " + camera.address);
  return text.empty() ? "none answers" : "there are: " + text;
}

/// A whole packet, headers included, must fit through the network card.
Finding check_packets(const CameraConfig& camera, const std::string& subject, const NetworkInterface& network) {
  const std::string found = fmt::format("network {} takes packets of {} bytes", network.name, network.mtu_bytes);
  if (camera.packet_bytes > network.mtu_bytes)
    return failure(subject, fmt::format("{}, packet_size is {}: no frame arrives", found, camera.packet_bytes),
                   fmt::format("ip link set dev {} mtu 9000 (card and switch must take it), or a smaller packet_size",
                               network.name));
  if (network.mtu_bytes < kJumbo_bytes && !network.is_loopback)
    return warning(
        subject, found + ": many small packets, each of which can be lost",
        fmt::format("ip link set dev {} mtu 9000, if the switch takes jumbo frames; packet_size = 9000", network.name));
  return all_well(subject, found);
}

/// The kernel drops what a busy program has not taken yet: two frames should fit.
Finding check_socket(const std::string& subject, const Machine& machine, std::size_t frame_bytes) {
  const auto wanted = static_cast<std::int64_t>(2 * frame_bytes);
  const std::string found = fmt::format("receive buffers of up to {} kB for frames of {} kB",
                                        machine.most_socket_bytes / 1000, frame_bytes / 1000);
  if (machine.most_socket_bytes >= wanted)
    return all_well(subject, found);
  return warning(subject, found + ": packets are lost whenever the processor is busy",
                 fmt::format("sysctl -w net.core.rmem_max={}; a line in /etc/sysctl.d keeps it", wanted));
}

} // namespace

Findings check_camera(const CameraConfig& camera, const std::string& subject, const std::vector<FoundCamera>& found,
                      const Machine& machine, std::size_t frame_bytes) {
  const auto here = std::find_if(found.begin(), found.end(), [&](const FoundCamera& c) {
    return c.id == camera.camera || c.address == camera.camera;
  });
  const std::string address = here == found.end() ? camera.camera : here->address;
  const NetworkInterface* network = network_of(machine, address);
  if (here == found.end())
    return {failure(subject, fmt::format("{} does not answer; {}", camera.camera, list_of(found)),
                    "look at its power and cable; its address must lie in a network of this machine "
                    "(arv-tool-0.8 network), and a firewall must let UDP port 3956 through")};
  Findings all{all_well(subject, fmt::format("{} answers{}", here->id, address.empty() ? "" : " at " + address))};
  if (address.empty()) // USB
    return all;
  if (!network) {
    all.push_back(failure(subject, address + " lies in no network of this machine: no frame can arrive",
                          "give camera or network card an address in the same network (arv-tool-0.8 network)"));
    return all;
  }
  all.push_back(check_packets(camera, subject, *network));
  if (frame_bytes > 0)
    all.push_back(check_socket(subject, machine, frame_bytes));
  return all;
}

Finding check_frame(const CameraConfig& camera, const std::string& subject, const std::filesystem::path& lens_file) {
  const auto lens = read_lens(lens_file);
  const auto settings = camera_settings(camera, lens ? *lens : LensModel{});
  auto source = settings ? open_camera(*settings) : Result<std::unique_ptr<FrameSource>>(settings.error());
  if (!source)
    return failure(subject, source.error());
  std::optional<CameraFrame> frame;
  for (const double end = wall_seconds() + kFrameWait_s; !frame && wall_seconds() < end;)
    if (auto next = (*source)->next(std::chrono::milliseconds(100)))
      frame = std::move(*next);
  const SourceReport report = (*source)->report();
  if (!frame && report.damaged > 0)
    return failure(subject, fmt::format("{} frames came, none whole: packets are lost", report.damaged),
                   "larger packets and receive buffers; a cable and a port of its own");
  if (!frame)
    return failure(subject, report.trouble.empty() ? "no frame came" : report.trouble,
                   "end what else uses the camera (another daylit-run?); see what it takes with arv-tool-0.8 features");
  const std::string found = fmt::format("sends {} x {} pixels, {} of {} bits", frame->width_px, frame->height_px,
                                        name_of(frame->format.mosaic), frame->format.bits);
  if (lens && lens->width_px > 0 && (frame->width_px != lens->width_px || frame->height_px != lens->height_px))
    return failure(subject, fmt::format("{}; its lens file is for {} x {}", found, lens->width_px, lens->height_px),
                   "set size to the lens file's, or calibrate the lens at this size (daylit-calibrate)");
  return all_well(subject, found);
}

} // namespace daylit
