#include "scene/config/placement_text.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

#include "scene/config/config_sections.h"
#include "scene/core/atomic_file.h"
#include "scene/core/read_file.h"

namespace daylit {

namespace {

/// Text to put between two places of the file, in bytes.
struct Edit {
  std::size_t begin = 0, end = 0;
  std::string text;
};

/// Byte of a line and column, both from 1; columns count characters of UTF-8.
std::size_t byte_at(const std::string& text, const toml::source_position& at) {
  std::size_t i = 0;
  for (unsigned line = 1; line < at.line && i < text.size(); ++i)
    line += text[i] == '\n' ? 1 : 0;
  for (unsigned column = 1; column < at.column && i < text.size(); ++column)
    for (++i; i < text.size() && (static_cast<unsigned char>(text[i]) & 0xC0u) == 0x80u; ++i) {
    }
  return i;
}

/// The numbers of an array; empty where there is another thing in it.
std::vector<double> numbers(const toml::node& node) {
  std::vector<double> list;
  if (const toml::array* array = node.as_array())
    for (const toml::node& n : *array)
      list.push_back(n.value_or(std::numeric_limits<double>::quiet_NaN()));
  return list;
}

/// A new value for the key that says where the object is; the key after the model's where it was left out.
std::optional<Edit> edit_of(const std::string& text, const toml::table& table, const ObjectConfig& object) {
  const detail::PlaceText place = detail::place_text(object);
  const toml::node* node = place.key.empty() ? nullptr : table.get(place.key);
  if (node && numbers(*node) == place.number)
    return std::nullopt;
  if (node)
    return Edit{byte_at(text, node->source().begin), byte_at(text, node->source().end), place.value};
  const toml::node* model = table.get("model");
  if (place.key.empty() || !model)
    return std::nullopt;
  const std::size_t after = byte_at(text, model->source().end),
                    line_end = std::min(text.find('\n', after), text.size());
  if (table.is_inline())
    return Edit{after, after, ", " + place.key + " = " + place.value};
  return Edit{line_end, line_end, "\n" + place.key + " = " + place.value};
}

Error other_objects(const std::filesystem::path& path) {
  return {ErrorCode::value_invalid, "the file has other objects than it had when it was read", path.string(),
          "start daylit-run again"};
}

} // namespace

/// From the last object to the first, so that places in the text stay right.
Result<std::string> with_placements(const std::string& text, std::span<const ObjectConfig> objects,
                                    const std::filesystem::path& path) {
  const auto file = detail::parse_config_text(text, path);
  if (!file)
    return file.error();
  const toml::array* tables = file->root.get_as<toml::array>("object");
  if (!tables || tables->size() != objects.size())
    return other_objects(path);
  std::string out = text;
  for (std::size_t k = objects.size(); k-- > 0;) {
    const toml::table* table = tables->get_as<toml::table>(k);
    if (!table)
      return other_objects(path);
    if (const auto edit = edit_of(text, *table, objects[k]))
      out.replace(edit->begin, edit->end - edit->begin, edit->text);
  }
  return out;
}

Result<void> write_placements(const std::filesystem::path& path, std::span<const ObjectConfig> objects) {
  const auto bytes = read_whole_file(path);
  if (!bytes)
    return bytes.error();
  const auto edited = with_placements(std::string(bytes->begin(), bytes->end()), objects, path);
  if (!edited)
    return edited.error();
  return write_file_atomically(path, *edited);
}

} // namespace daylit
