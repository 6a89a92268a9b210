#include <fmt/format.h>

#include "capture/markers/find_markers.h"
#include "runtime/doctor/doctor.h"
#include "runtime/input/interior_input.h"
#include "scene/lens/fall_off.h"
#include "scene/model/object_mesh.h"
#include "scene/sky/sky_lens.h"
#include "scene/volume/room_model.h"
#include "scene/volume/volume.h"
#include "scene/volume/volume_file.h"

namespace daylit {

namespace {

bool is_in_room(const LightFieldSampler& sampler, const glm::dvec3& point) {
  std::array<std::uint32_t, 8> probe{};
  std::array<float, 8> weight{};
  return sampler.weights(point, probe, weight) > 0;
}

Finding check_lens(const std::string& subject, const std::filesystem::path& file) {
  const auto lens = read_lens(file);
  if (!lens)
    return failure(subject, lens.error());
  return all_well(subject, fmt::format("{}: {} x {} pixels", file.string(), lens->width_px, lens->height_px));
}

/// Middle of the object's box, in the world.
glm::dvec3 middle_of(const ObjectMesh& mesh, const ObjectConfig& object) {
  Bounds bounds;
  for (const glm::vec3& v : mesh.positions)
    bounds.include(glm::dvec3(v));
  return glm::dvec3(object_transform(object) * glm::dvec4((bounds.min + bounds.max) / 2.0, 1.0));
}

/// With `on` its height is not known here: daylit-run says where it was set down.
Finding check_object(const ObjectConfig& object, std::size_t k, const LightFieldSampler* sampler) {
  const std::string subject = fmt::format("object {}", k + 1);
  const auto mesh = read_object_mesh(object.model);
  if (!mesh)
    return failure(subject, mesh.error());
  const std::string found = fmt::format("{}: {} triangles", object.model.string(), mesh->triangles.size());
  if (!object.on && sampler && !is_in_room(*sampler, middle_of(*mesh, object)))
    return warning(subject,
                   found + ", and its middle is where the volume has no light: outside the room or in furniture",
                   "correct its position (metres, z up)");
  return all_well(subject, found);
}

Finding check_pose(const glm::dmat4& world_from_camera, const LightFieldSampler& sampler) {
  const glm::dvec3 eye(world_from_camera[3]);
  const std::string found = fmt::format("camera at ({:.2f}, {:.2f}, {:.2f}) m", eye.x, eye.y, eye.z);
  if (is_in_room(sampler, eye))
    return all_well("pose", found);
  return warning("pose", found + ": not in the air of the room",
                 "right where it looks in through a window; else correct [pose]: metres, z up, camera x right, y down");
}

/// Of a projection fisheye.
Finding check_sky_lens(const std::filesystem::path& file) {
  const auto lens = read_lens(file);
  const auto note = lens ? sky_lens_note(*lens) : std::nullopt;
  return note ? warning("sky lens", file.string() + ": " + *note, "give the file of daylit-calibrate fisheye")
              : check_lens("sky lens", file);
}

/// Pictures that stand for cameras are read as daylit-run reads them.
Findings check_pictures(const RunConfig& config) {
  Findings all;
  if (config.sky.projection == "fisheye")
    if (Finding lens = check_sky_lens(config.sky.lens); lens.level != Finding::Level::error)
      all.push_back(std::move(lens)); // else the picture's reader says it
  const auto sky = read_sky(config.sky);
  all.push_back(sky ? all_well("sky picture", config.sky.image.string()) : failure("sky picture", sky.error()));
  const auto interior = read_interior(config);
  all.push_back(interior ? all_well("camera picture", config.interior.image.string())
                         : failure("camera picture", interior.error()));
  return all;
}

Findings check_live_lenses(const RunConfig& config) {
  Findings all;
  if (config.sky.projection == "fisheye")
    all.push_back(check_sky_lens(config.sky.lens));
  if (!config.sky.fall_off.empty()) {
    const auto fall_off = read_fall_off(config.sky.fall_off);
    all.push_back(fall_off ? all_well("sky fall-off", config.sky.fall_off.string())
                           : failure("sky fall-off", fall_off.error()));
  }
  all.push_back(check_lens("interior lens", config.interior.lens));
  if (config.marker) {
    const auto board = board_of(*config.marker);
    all.push_back(board ? all_well("marker", config.marker->dictionary) : failure("marker", board.error()));
  }
  for (const auto& [subject, name] :
       {std::pair{"sky response", config.sky.response}, {"interior response", config.interior.response}})
    if (const auto response = ResponseCurve::named(name); !response)
      all.push_back(failure(subject, response.error()));
  return all;
}

} // namespace

Findings check_inputs(const RunConfig& config) {
  Findings all = config.is_live() ? check_live_lenses(config) : check_pictures(config);
  const auto volume = read_volume(config.volume);
  if (!volume)
    all.push_back(failure("volume", volume.error()));
  else if (const auto same = check_room_model(config.room_model, volume->provenance); !same)
    all.push_back(failure("volume", same.error()));
  else
    all.push_back(all_well("volume", fmt::format("{}: {} probes, {} directions of the sky", config.volume.string(),
                                                 volume->probes.size(), volume->partition.size())));
  std::optional<LightFieldSampler> sampler;
  if (volume)
    if (auto made = LightFieldSampler::make(*volume))
      sampler = std::move(*made);
  if (sampler && config.world_from_camera)
    all.push_back(check_pose(*config.world_from_camera, *sampler));
  for (std::size_t k = 0; k < config.objects.size(); ++k)
    all.push_back(check_object(config.objects[k], k, sampler ? &*sampler : nullptr));
  return all;
}

} // namespace daylit
