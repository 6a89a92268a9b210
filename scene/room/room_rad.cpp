#include "scene/room/room_rad.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

#include "scene/format/rad_text.h"
#include "scene/room/face_collector.h"
#include "scene/room/radiance_material.h"

namespace daylit {

namespace {

constexpr int kMostDepth = 16;             // of files that name files
constexpr std::size_t kMostFiles = 10'000; // with all copies
constexpr std::size_t kMostCorners = 1024, kMostVertices = 30'000'000;
constexpr double kLargestCoordinate = 1e12;

/// A material's definition; the room's material is made when a surface first uses it.
struct Definition {
  detail::RadPrimitive primitive;
  std::optional<std::uint32_t> material;
};

class RadRoom {
public:
  RadRoom(const std::string& name, const ReadFile& read_file) : name_(name), read_file_(read_file) {}

  Result<RoomFile> run(std::string_view text, UpAxis up) {
    if (const Result<void> done = read(text, name_, {glm::dmat4(1.0), "", 0}); !done)
      return done.error();
    if (up == UpAxis::y)
      for (glm::dvec3& v : faces_.vertices)
        v = glm::dvec3(v.x, -v.z, v.y);
    if (sources_ > 0)
      file_.report.notes.push_back(
          fmt::format("{} sources left out: the sky is given to the other programs", sources_));
    file_.report.counted_in_faces = true;
    file_.room.vertices = std::move(faces_.vertices);
    if (const Result<void> done = detail::collect_faces(faces_, name_, file_.room, file_.report); !done)
      return done.error();
    file_.content_hash = content_hash(file_.room);
    return std::move(file_);
  }

private:
  /// Where a file stands in the scene.
  struct Place {
    glm::dmat4 transform;
    std::string modifier; ///< of all its surfaces; empty: their own
    int depth;
  };

  Result<void> read(std::string_view text, const std::string& file, const Place& place) {
    detail::RadReader reader(text, file);
    while (true) {
      auto item = reader.next();
      if (!item)
        return item.error();
      if (!*item)
        return {};
      const Result<void> done =
          (*item)->xform ? follow(*(*item)->xform, file, place) : take(std::move(*(*item)->primitive), file, place);
      if (!done)
        return done;
    }
  }

  Result<void> follow(const detail::RadXform& xform, const std::string& file, const Place& place) {
    files_ += xform.transforms.size();
    if (place.depth >= kMostDepth || files_ > kMostFiles)
      return Error{ErrorCode::limit_exceeded, "too many files within files", at(file, xform.line),
                   "at most 16 deep and 10000 with all copies: does a file name itself?"};
    const Result<std::vector<std::uint8_t>> bytes = read_file_(xform.file);
    if (!bytes) {
      Error error = bytes.error();
      error.where = at(file, xform.line) + ", " + error.where;
      return error;
    }
    const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    for (const glm::dmat4& transform : xform.transforms)
      if (const Result<void> done = read(
              text, xform.file,
              {place.transform * transform, place.modifier.empty() ? xform.modifier : place.modifier, place.depth + 1});
          !done)
        return done;
    return {};
  }

  Result<void> take(detail::RadPrimitive p, const std::string& file, const Place& place) {
    static const std::set<std::string> other = {"sphere", "bubble", "cone", "cup",     "cylinder",
                                                "tube",   "ring",   "mesh", "instance"};
    if (other.contains(p.type))
      return Error{ErrorCode::value_invalid,
                   fmt::format("{} \"{}\" is not read: only polygons are", p.type, p.identifier), at(file, p.line),
                   "replace it by polygons, or leave it out"};
    if (p.type == "polygon")
      return add_polygon(p, file, place);
    if (p.type == "source") {
      ++sources_;
    } else if (p.type == "alias") {
      if (const auto known = definitions_.find(p.words.front()); known != definitions_.end())
        definitions_[p.identifier] = known->second;
      else
        return undefined(p.words.front(), at(file, p.line));
    } else {
      const std::string name = p.identifier;
      definitions_[name] = {std::move(p), std::nullopt};
    }
    return {};
  }

  Result<void> add_polygon(const detail::RadPrimitive& p, const std::string& file, const Place& place) {
    const std::size_t corners = p.numbers.size() / 3;
    if (p.numbers.size() % 3 != 0 || corners < 3 || corners > kMostCorners)
      return Error{ErrorCode::file_malformed,
                   fmt::format("polygon \"{}\" has {} numbers", p.identifier, p.numbers.size()), at(file, p.line),
                   "three for each of 3 to 1024 corners"};
    if (faces_.vertices.size() > kMostVertices)
      return Error{ErrorCode::limit_exceeded, "more than 30 million corners with all copies", at(file, p.line), ""};
    const auto material = material_of(place.modifier.empty() ? p.modifier : place.modifier, at(file, p.line));
    if (!material)
      return material.error();
    faces_.faces.push_back({static_cast<std::uint32_t>(faces_.corners.size()), static_cast<std::uint32_t>(corners),
                            *material, static_cast<int>(faces_.faces.size()) + 1});
    for (std::size_t k = 0; k < corners; ++k) {
      const glm::dvec3 v(place.transform * glm::dvec4(p.numbers[3 * k], p.numbers[3 * k + 1], p.numbers[3 * k + 2], 1));
      if (!(std::abs(v.x) < kLargestCoordinate && std::abs(v.y) < kLargestCoordinate &&
            std::abs(v.z) < kLargestCoordinate))
        return Error{ErrorCode::value_invalid, "a corner is not finite or absurdly large", at(file, p.line),
                     "check the options of !xform"};
      faces_.corners.push_back({.vertex = static_cast<std::uint32_t>(faces_.vertices.size())});
      faces_.vertices.push_back(v);
    }
    return {};
  }

  Result<std::uint32_t> material_of(const std::string& modifier, const std::string& where) {
    const auto known = definitions_.find(modifier);
    if (known == definitions_.end())
      return undefined(modifier, where);
    Definition& definition = known->second;
    if (definition.material)
      return *definition.material;
    const detail::RadPrimitive& p = definition.primitive;
    auto material = detail::radiance_material(p.identifier, p.type, p.numbers);
    if (!material) {
      Error error = material.error();
      error.where = where;
      return error;
    }
    if (const std::string missing = detail::left_out(p.type, p.numbers); !missing.empty())
      file_.report.notes.push_back(fmt::format("material \"{}\" ({}): {} is left out", p.identifier, p.type, missing));
    if (p.modifier != "void")
      file_.report.notes.push_back(
          fmt::format("material \"{}\": its pattern \"{}\" is not read", p.identifier, p.modifier));
    definition.material = static_cast<std::uint32_t>(file_.room.materials.size());
    file_.room.materials.push_back(std::move(*material));
    return *definition.material;
  }

  static Error undefined(const std::string& modifier, const std::string& where) {
    return {ErrorCode::value_invalid, "the modifier \"" + modifier + "\" is not defined", where,
            "put the file that defines it first: !xform materials.rad"};
  }
  static std::string at(const std::string& file, int line) { return file + ", line " + std::to_string(line); }

  const std::string& name_;
  const ReadFile& read_file_;
  RoomFile file_;
  detail::ObjText faces_;
  std::map<std::string, Definition> definitions_;
  std::size_t files_ = 0, sources_ = 0;
};

} // namespace

Result<RoomFile> parse_rad_room(std::string_view text, const std::string& name, const ReadFile& read_file, UpAxis up) {
  return RadRoom(name, read_file).run(text, up);
}

} // namespace daylit
