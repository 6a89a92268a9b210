#pragma once

// Objects changed from the page, and written back to the configuration.

#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "runtime/page/session_desk.h"
#include "scene/config/config.h"
#include "scene/config/placement_text.h"

namespace daylit {

/// What of an object is to change; the rest stays. `pixel`: of the photograph, dragged to: the object moves in the
/// level plane of its foot so that `grip_m` before its position is seen there.
struct ObjectChange {
  std::optional<glm::dvec3> position, rotation_deg;
  std::optional<double> scale;
  std::optional<glm::dvec2> pixel;
  glm::dvec2 grip_m{0.0};
};

/// Where a drag begins: the object under a pixel, and how far its position is from the point of its foot's level there.
struct PickedObject {
  std::size_t object = 0;
  glm::dvec2 grip_m{0.0};
};

/// All functions: any thread; they wait for the thread that draws. Errors of SessionDesk::ask() and the session's own.
class SceneEditor {
public:
  /// Both outlive it. `file`: where `config` was read.
  SceneEditor(SessionDesk& desk, std::filesystem::path file, const RunConfig& config);

  /// The files that objects can be made of: those of the configuration, and those beside it.
  const std::vector<std::filesystem::path>& models() const { return models_; }
  Result<std::optional<PickedObject>> pick(const glm::dvec2& pixel);
  Result<void> change(std::size_t object, const ObjectChange& change);
  /// An object of models()[model] at `position`, upright. Loads it first: seconds for one that was never drawn here.
  Result<void> add(std::size_t model, const glm::dvec3& position);
  Result<void> remove(std::size_t object);
  /// One choice for all who look.
  Result<void> show(const ShownParts& parts);
  ShownParts shown() const;
  /// Writes the configuration file; comments and order stay. Error value_invalid: somebody else has changed it since it
  /// was read; nothing is written.
  Result<void> save();
  /// The session was opened anew from the file.
  void reset(const RunConfig& config);

private:
  Result<std::vector<ObjectConfig>> placements();
  Result<void> replace(std::vector<ObjectConfig> objects, std::vector<std::optional<std::size_t>> in_file);

  SessionDesk& desk_;
  std::filesystem::path file_;
  std::filesystem::path cache_folder_;
  std::vector<std::filesystem::path> models_;
  std::mutex mutex_;                                ///< one change of the list of objects at a time
  std::vector<std::optional<std::size_t>> in_file_; ///< of each object
  std::size_t was_ = 0;                             ///< objects of the file
  std::string text_;                                ///< of the file when it was read or saved
  mutable std::mutex shown_mutex_;
  ShownParts shown_;
};

} // namespace daylit
