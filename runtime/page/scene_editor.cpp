#include "runtime/page/scene_editor.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/window/view_control.h"
#include "scene/core/read_file.h"

namespace daylit {

namespace {

constexpr double kFar_m = 1e4; ///< from the world's origin
constexpr double kSmallest = 1e-3, kLargest = 1e3;
constexpr std::size_t kMostObjects = 64;
constexpr double kStep_m = 1e-4; ///< a file with such places reads well

Error no_such(const std::string& what) { return {ErrorCode::not_found, "there is no such " + what, "", "load again"}; }

bool is_near(const glm::dvec3& p) { return glm::all(glm::lessThan(glm::abs(p), glm::dvec3(kFar_m))); }

bool is_model(const std::filesystem::path& file) {
  const std::string extension = file.extension().string();
  return extension == ".obj" || extension == ".ply" || extension == ".glb" || extension == ".gltf";
}

std::vector<std::filesystem::path> models_of(const std::filesystem::path& file, const RunConfig& config) {
  std::vector<std::filesystem::path> models;
  for (const ObjectConfig& object : config.objects)
    models.push_back(object.model.lexically_normal());
  std::error_code none;
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  for (const auto& entry : std::filesystem::directory_iterator(folder, none))
    if (entry.is_regular_file(none) && is_model(entry.path()) &&
        entry.path().lexically_normal() != config.room_model.lexically_normal())
      models.push_back(entry.path().lexically_normal());
  std::sort(models.begin(), models.end());
  models.erase(std::unique(models.begin(), models.end()), models.end());
  return models;
}

/// Where a pixel of the photograph shows the level of the object's foot.
std::optional<glm::dvec3> foot_under(const Session& session, std::size_t object, const glm::dvec2& pixel) {
  const RenderCamera& camera = session.camera();
  return on_floor(camera.eye(), ViewControl::direction(pixel, camera), session.placements()[object].position.z);
}

Result<ObjectConfig> changed(const Session& session, std::size_t k, const ObjectChange& change) {
  ObjectConfig object = session.placements()[k];
  if (change.position)
    object.position = *change.position;
  if (change.rotation_deg)
    object.rotation_deg = *change.rotation_deg;
  if (change.scale)
    object.scale = *change.scale;
  if (change.pixel) {
    const auto foot = foot_under(session, k, *change.pixel);
    if (!foot)
      return Error{ErrorCode::not_found, "the level of the object's foot is not seen there", "", "drag it lower"};
    const auto rounded = [](double x) { return kStep_m * std::round(x / kStep_m); };
    object.position = {rounded(foot->x + change.grip_m.x), rounded(foot->y + change.grip_m.y), object.position.z};
  }
  if (!is_near(object.position) || !is_near(object.rotation_deg) ||
      !(object.scale >= kSmallest && object.scale <= kLargest))
    return Error{ErrorCode::value_invalid, "a place, angle or scale is out of range", "",
                 "metres, degrees, 0.001 to 1000"};
  return object;
}

/// Empty: it cannot be read.
std::string text_of(const std::filesystem::path& file) {
  const auto bytes = read_whole_file(file);
  return bytes ? std::string(bytes->begin(), bytes->end()) : std::string();
}

} // namespace

SceneEditor::SceneEditor(SessionDesk& desk, std::filesystem::path file, const RunConfig& config)
    : desk_(desk), file_(std::move(file)),
      cache_folder_(config.volume.has_parent_path() ? config.volume.parent_path() : std::filesystem::path(".")),
      models_(models_of(file_, config)) {
  reset(config);
}

void SceneEditor::reset(const RunConfig& config) {
  const std::lock_guard lock(mutex_);
  text_ = text_of(file_);
  was_ = config.objects.size();
  in_file_.clear();
  for (std::size_t k = 0; k < was_; ++k)
    in_file_.emplace_back(k);
  const std::lock_guard lock_shown(shown_mutex_);
  shown_ = {};
}

ShownParts SceneEditor::shown() const {
  const std::lock_guard lock(shown_mutex_);
  return shown_;
}

Result<void> SceneEditor::show(const ShownParts& parts) {
  const auto done = desk_.ask([parts](const BetweenFrames& now) -> Result<void> {
    now.session.show(parts);
    return {};
  });
  const std::lock_guard lock(shown_mutex_);
  if (done)
    shown_ = parts;
  return done;
}

Result<std::optional<PickedObject>> SceneEditor::pick(const glm::dvec2& pixel) {
  std::optional<PickedObject> picked;
  const auto asked = desk_.ask([&](const BetweenFrames& now) -> Result<void> {
    const RenderCamera& camera = now.session.camera();
    const auto k = now.session.object_at(camera.eye(), ViewControl::direction(pixel, camera));
    const auto foot = k ? foot_under(now.session, *k, pixel) : std::nullopt;
    if (foot)
      picked = PickedObject{*k, glm::dvec2(now.session.placements()[*k].position) - glm::dvec2(*foot)};
    return {};
  });
  if (!asked)
    return asked.error();
  return picked;
}

Result<void> SceneEditor::change(std::size_t object, const ObjectChange& change) {
  return desk_.ask([&](const BetweenFrames& now) -> Result<void> {
    if (object >= now.session.placements().size())
      return no_such("object");
    const auto placement = changed(now.session, object, change);
    return placement ? now.session.set_placement(object, *placement) : placement.error();
  });
}

Result<std::vector<ObjectConfig>> SceneEditor::placements() {
  std::vector<ObjectConfig> objects;
  const auto asked = desk_.ask([&](const BetweenFrames& now) -> Result<void> {
    objects = now.session.placements();
    return {};
  });
  if (!asked)
    return asked.error();
  return objects;
}

/// The meshes are read by this thread; the one that draws only takes them.
Result<void> SceneEditor::replace(std::vector<ObjectConfig> objects, std::vector<std::optional<std::size_t>> in_file) {
  auto loaded = load_virtual_objects(objects, cache_folder_, [](const std::string&, double) { return true; });
  if (!loaded)
    return loaded.error();
  const auto set = desk_.ask([&](const BetweenFrames& now) -> Result<void> {
    return now.session.set_objects(std::move(*loaded), std::move(objects));
  });
  if (set)
    in_file_ = std::move(in_file);
  return set;
}

Result<void> SceneEditor::add(std::size_t model, const glm::dvec3& position) {
  const std::lock_guard lock(mutex_);
  auto objects = placements();
  if (!objects)
    return objects.error();
  if (model >= models_.size())
    return no_such("model");
  if (objects->size() >= kMostObjects || !is_near(position))
    return Error{ErrorCode::limit_exceeded, "no more objects, or too far away", "", "take one out first"};
  ObjectConfig object;
  object.model = models_[model];
  object.position = position;
  objects->push_back(object);
  auto in_file = in_file_;
  in_file.emplace_back(std::nullopt);
  return replace(std::move(*objects), std::move(in_file));
}

Result<void> SceneEditor::remove(std::size_t object) {
  const std::lock_guard lock(mutex_);
  auto objects = placements();
  if (!objects)
    return objects.error();
  if (object >= objects->size() || object >= in_file_.size())
    return no_such("object");
  objects->erase(objects->begin() + static_cast<std::ptrdiff_t>(object));
  auto in_file = in_file_;
  in_file.erase(in_file.begin() + static_cast<std::ptrdiff_t>(object));
  return replace(std::move(*objects), std::move(in_file));
}

Result<void> SceneEditor::save() {
  const std::lock_guard lock(mutex_);
  const auto objects = placements();
  if (!objects)
    return objects.error();
  if (objects->size() != in_file_.size())
    return no_such("list of objects");
  if (text_of(file_) != text_)
    return Error{ErrorCode::value_invalid, "was changed by somebody else since it was read; nothing is written",
                 file_.string(), "reload the daemon (SIGHUP) to draw what it says now, then move the objects again"};
  std::vector<EditedObject> edited;
  for (std::size_t k = 0; k < objects->size(); ++k)
    edited.push_back({(*objects)[k], in_file_[k]});
  if (const auto written = write_objects(file_, edited, was_); !written)
    return written;
  text_ = text_of(file_);
  was_ = objects->size(); // the new ones come last, in this order
  for (std::size_t k = 0; k < was_; ++k)
    in_file_[k] = k;
  return {};
}

} // namespace daylit
