#include <string>

#include "runtime/doctor/doctor.h"
#include "runtime/input/camera_pictures.h"
#include "scene/lens/lens.h"

namespace daylit {

namespace {

void add(Findings& all, Findings more) {
  all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

/// Bytes of a pixel by the name of its format: "RGB8" has three, "BayerRG12" two.
std::size_t pixel_bytes(const std::string& format) {
  const std::size_t digits = format.find_last_not_of("0123456789") + 1;
  const bool is_wide = digits < format.size() && std::stoi(format.substr(digits, 3)) > 8;
  return (format.starts_with("RGB") ? 3u : 1u) * (is_wide ? 2u : 1u);
}

/// 0 where neither the configuration nor the lens file says how large pictures are.
std::size_t frame_bytes(const CameraConfig& camera, const std::filesystem::path& lens_file) {
  const auto lens = read_lens(lens_file);
  const auto settings = camera_settings(camera, lens ? *lens : LensModel{});
  if (!settings || !settings->width_px)
    return 0;
  return static_cast<std::size_t>(*settings->width_px) * static_cast<std::size_t>(*settings->height_px) *
         pixel_bytes(camera.pixel_format);
}

Findings check_cameras(const RunConfig& config, const Machine& machine) {
  Findings all;
  const std::vector<FoundCamera> found = find_cameras();
  const auto check = [&](const CameraConfig& camera, const std::string& subject, const std::filesystem::path& lens) {
    Findings one = check_camera(camera, subject, found, machine, frame_bytes(camera, lens));
    const bool answers = one.front().level == Finding::Level::ok;
    add(all, std::move(one));
    if (answers)
      all.push_back(check_frame(camera, subject, lens));
  };
  check(*config.sky.camera, "sky camera", config.sky.lens);
  check(*config.interior.camera, "interior camera", config.interior.lens);
  if (config.sky.camera->camera == config.interior.camera->camera)
    all.push_back(failure("cameras", "[sky] and [interior] name the same camera", "name each by its id"));
  return all;
}

} // namespace

Findings examine(const std::filesystem::path& path) {
  const auto config = read_run_config(path);
  if (!config)
    return {failure("configuration", config.error())};
  const Machine machine = read_machine();
  Findings all{all_well("configuration", path.string())};
  add(all, check_inputs(*config));
  if (config->is_live())
    add(all, check_cameras(*config, machine));
  add(all, check_disks(*config));
  if (config->http)
    add(all, check_http(*config->http));
  return all;
}

} // namespace daylit
