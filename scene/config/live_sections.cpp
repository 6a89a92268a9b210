// The sections of CONFIG.toml that only a live run has.

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "scene/config/config_sections.h"

namespace daylit::detail {

namespace {

constexpr int kFewestBytes = 576; ///< of a packet: GigE Vision

/// Only this machine reaches it.
bool is_loopback(const std::string& address) {
  return address == "localhost" || address == "::1" || address.starts_with("127.");
}

} // namespace

void read_camera(TomlSection& section, std::optional<CameraConfig>& camera) {
  CameraConfig c;
  const bool named = section.read("camera", c.camera);
  if (named && c.camera.empty())
    section.problem("camera", "is empty; daylit-run cameras lists ids and addresses");
  if (!section.has("camera"))
    for (const char* key : {"pixel_format", "mosaic", "exposure_us", "gain", "frame_rate", "packet_size", "size"})
      if (section.has(key))
        section.problem(key, "is only used with camera");
  section.read("pixel_format", c.pixel_format);
  section.read_word("mosaic", c.mosaic, {"rggb", "grbg", "gbrg", "bggr"});
  if (!c.mosaic.empty() && !c.pixel_format.empty() && !c.pixel_format.starts_with("Mono"))
    section.problem("mosaic", "is only for the pixel formats Mono8 to Mono16: others say it themselves");
  double number = 0.0;
  if (section.read("exposure_us", number, {1e-3, 1e9}))
    c.exposure_us = number;
  if (section.read("gain", number, {0.0, 1e6}))
    c.gain = number;
  if (section.read("frame_rate", number, {1e-3, 1e5}))
    c.frame_rate_hz = number;
  if (section.read("packet_size", c.packet_bytes, {0, 65535}) && c.packet_bytes > 0 && c.packet_bytes < kFewestBytes)
    section.problem("packet_size", "is 0 (as the camera has it) or 576 to 65535, bytes");
  section.read_size("size", c.width_px, c.height_px);
  if (named)
    camera = c;
}

namespace {

void read_exposures(TomlSection& sky, std::vector<int>& exposures_us) {
  if (!sky.read("exposures_us", exposures_us, {1, 1e8}))
    return;
  if (sky.has("exposure_us"))
    sky.problem("exposure_us", "given together with exposures_us; keep one");
  std::vector<int> sorted = exposures_us;
  std::ranges::sort(sorted);
  if (sorted.size() < 2 || sorted.size() > 8)
    sky.problem("exposures_us", "a bracket has 2 to 8 exposures");
  for (std::size_t k = 1; k < sorted.size(); ++k)
    if (sorted[k] / 2 < sorted[k - 1])
      return sky.problem("exposures_us", "neighbours have to differ by a factor of 2 at least");
}

} // namespace

void read_response(TomlSection& section, std::string& response) {
  std::string word;
  if (!section.read("response", word))
    return;
  if (word == "linear" || word == "srgb") {
    response = word;
    return;
  }
  std::filesystem::path file;
  if (section.read("response", file))
    response = file.string();
}

void read_sky_measurement(TomlSection& sky, SkyConfig& config) {
  const bool has_camera = sky.has("camera");
  for (const char* key : {"exposures_us", "response", "white", "place", "illuminance"})
    if (sky.has(key) && !has_camera)
      sky.problem(key, "is only used with camera");
  read_exposures(sky, config.exposures_us);
  read_response(sky, config.response);
  sky.read("white", config.white, {1e-9, 1e12});
  if (TomlSection place = sky.section("place")) {
    config.place.emplace();
    const bool north = place.read("latitude", config.place->latitude_deg, {-90, 90});
    const bool east = place.read("longitude", config.place->longitude_deg, {-180, 180});
    if (!north || !east)
      place.problem("", "needs latitude and longitude (degrees, east positive)");
    place.finish();
  }
  if (sky.is_text("illuminance")) {
    sky.read("illuminance", config.illuminance_file);
  } else if (double value = 0.0; sky.read("illuminance", value, {0.0, 1e12})) {
    config.illuminance = value;
  }
}

std::string sky_measurement_toml(const SkyConfig& sky) {
  std::string out;
  if (!sky.exposures_us.empty())
    out += fmt::format("exposures_us = [{}]\n", fmt::join(sky.exposures_us, ", "));
  out += fmt::format("response = {}\nwhite = {}\n", quoted(sky.response), text(sky.white));
  if (sky.place)
    out += fmt::format("place = {{ latitude = {}, longitude = {} }}\n", text(sky.place->latitude_deg),
                       text(sky.place->longitude_deg));
  if (!sky.illuminance_file.empty())
    out += "illuminance = " + quoted(sky.illuminance_file.string()) + "\n";
  else if (sky.illuminance)
    out += "illuminance = " + text(*sky.illuminance) + "\n";
  return out;
}

void read_http(TomlSection root, std::optional<HttpConfig>& http) {
  if (!root)
    return;
  HttpConfig h;
  root.read("port", h.port, {0, 65535});
  root.read("address", h.address);
  root.read("token_file", h.token_file);
  if (!is_loopback(h.address) && h.token_file.empty())
    root.problem("address",
                 "other machines may reach it: it needs token_file, a file with a secret of 16 characters at least");
  root.finish();
  http = h;
}

std::string camera_toml(const std::optional<CameraConfig>& camera) {
  if (!camera)
    return "";
  std::string out = fmt::format("camera = {}\n", quoted(camera->camera));
  if (!camera->pixel_format.empty())
    out += fmt::format("pixel_format = {}\n", quoted(camera->pixel_format));
  if (!camera->mosaic.empty())
    out += fmt::format("mosaic = {}\n", quoted(camera->mosaic));
  if (camera->exposure_us)
    out += fmt::format("exposure_us = {}\n", text(*camera->exposure_us));
  if (camera->gain)
    out += fmt::format("gain = {}\n", text(*camera->gain));
  if (camera->frame_rate_hz)
    out += fmt::format("frame_rate = {}\n", text(*camera->frame_rate_hz));
  if (camera->packet_bytes > 0)
    out += fmt::format("packet_size = {}\n", camera->packet_bytes);
  if (camera->width_px > 0)
    out += fmt::format("size = [{}, {}]\n", camera->width_px, camera->height_px);
  return out;
}

std::string http_toml(const std::optional<HttpConfig>& http) {
  if (!http)
    return "";
  std::string out = fmt::format("\n[http]\nport = {}\naddress = {}\n", http->port, quoted(http->address));
  if (!http->token_file.empty())
    out += fmt::format("token_file = {}\n", quoted(http->token_file.string()));
  return out;
}

} // namespace daylit::detail
