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

/// A number, or the numbers of an array; NaN for another thing in it.
std::vector<double> numbers(const toml::node& node) {
  std::vector<double> list;
  if (node.is_number())
    list.push_back(node.value_or(0.0));
  if (const toml::array* array = node.as_array())
    for (const toml::node& n : *array)
      list.push_back(n.value_or(std::numeric_limits<double>::quiet_NaN()));
  return list;
}

/// A key of an object and the value that it should have.
struct Wanted {
  std::string key, value;
  std::vector<double> number; ///< the same; what the file has is left as it is written where it is equal
  bool is_default = false;    ///< as if it were left out
};

std::vector<Wanted> wanted_of(const ObjectConfig& o) {
  std::vector<Wanted> wanted;
  if (const detail::PlaceText place = detail::place_text(o); !place.key.empty())
    wanted.push_back({place.key, place.value, place.number, !o.on && o.position == glm::dvec3(0.0)});
  const glm::dvec3& r = o.rotation_deg;
  wanted.push_back({"rotation", detail::text(r), {r.x, r.y, r.z}, r == glm::dvec3(0.0)});
  wanted.push_back({"scale", detail::text(o.scale), {o.scale}, o.scale == 1.0});
  return wanted;
}

/// A new value where there is another; a key that was left out comes after the model's.
std::optional<Edit> edit_of(const std::string& text, const toml::table& table, const Wanted& wanted) {
  const toml::node* node = table.get(wanted.key);
  if (node && numbers(*node) == wanted.number)
    return std::nullopt;
  if (node)
    return Edit{byte_at(text, node->source().begin), byte_at(text, node->source().end), wanted.value};
  const toml::node* model = table.get("model");
  if (wanted.is_default || !model)
    return std::nullopt;
  const std::size_t after = byte_at(text, model->source().end),
                    line_end = std::min(text.find('\n', after), text.size());
  if (table.is_inline())
    return Edit{after, after, ", " + wanted.key + " = " + wanted.value};
  return Edit{line_end, line_end, "\n" + wanted.key + " = " + wanted.value};
}

std::size_t line_begin(const std::string& text, std::size_t at) {
  return at == 0 ? 0 : text.rfind('\n', at - 1) + 1; // npos + 1 = 0
}

/// First bytes of all [headers], rising.
void collect_headers(const std::string& text, const toml::table& table, std::vector<std::size_t>& begins) {
  for (const auto& [key, node] : table)
    if (const toml::table* inner = node.as_table(); inner && !inner->is_inline()) {
      begins.push_back(line_begin(text, byte_at(text, inner->source().begin)));
      collect_headers(text, *inner, begins);
    } else if (const toml::array* list = node.as_array())
      for (const toml::node& element : *list)
        if (const toml::table* one = element.as_table(); one && !one->is_inline())
          begins.push_back(line_begin(text, byte_at(text, one->source().begin)));
  std::sort(begins.begin(), begins.end());
}

/// Lines of comment right above a header belong to it: the byte where they begin.
std::size_t with_comment_above(const std::string& text, std::size_t header) {
  while (header > 0 && text[line_begin(text, header - 1)] == '#')
    header = line_begin(text, header - 1);
  return header;
}

/// From its header to the next one.
Edit removal_of(const std::string& text, const toml::table& root, const toml::table& table) {
  std::vector<std::size_t> begins;
  collect_headers(text, root, begins);
  const std::size_t begin = line_begin(text, byte_at(text, table.source().begin));
  const auto next = std::upper_bound(begins.begin(), begins.end(), begin);
  const std::size_t end = next == begins.end() ? text.size() : with_comment_above(text, *next);
  return {with_comment_above(text, begin), std::max(begin, end), ""};
}

/// Where text after an object, and before what follows it, comes.
std::size_t end_of(const std::string& text, const toml::table& root, const toml::table& table) {
  std::size_t end = removal_of(text, root, table).end;
  while (end > 0 && text[end - 1] == '\n')
    --end;
  return end;
}

Error other_objects(const std::filesystem::path& path) {
  return {ErrorCode::value_invalid, "the file has other objects than it had when it was read", path.string(),
          "start daylit-run again"};
}

Error one_line(const std::filesystem::path& path) {
  return {ErrorCode::value_invalid, "objects in one line cannot be added or taken out", path.string(),
          "give each a [[object]] section of its own"};
}

std::string new_objects_text(std::span<const EditedObject> objects, const std::filesystem::path& folder) {
  std::vector<ObjectConfig> added;
  for (const EditedObject& e : objects)
    if (!e.in_file) {
      added.push_back(e.object);
      added.back().model = e.object.model.lexically_proximate(folder);
    }
  std::string out = detail::objects_toml(added);
  while (out.ends_with('\n'))
    out.pop_back();
  return out.empty() ? out : "\n" + out;
}

/// All changes of a file with the objects `tables`, at least one.
Result<std::vector<Edit>> edits_of(const std::string& text, const toml::table& root, const toml::array& tables,
                                   std::span<const EditedObject> objects, const std::filesystem::path& path) {
  std::vector<Edit> edits;
  for (std::size_t k = 0; k < tables.size(); ++k) {
    const toml::table* table = tables.get_as<toml::table>(k);
    if (!table)
      return other_objects(path);
    const auto now =
        std::find_if(objects.begin(), objects.end(), [k](const EditedObject& e) { return e.in_file == k; });
    if (now == objects.end() && table->is_inline())
      return one_line(path);
    if (now == objects.end())
      edits.push_back(removal_of(text, root, *table));
    else
      for (const Wanted& wanted : wanted_of(now->object))
        if (auto edit = edit_of(text, *table, wanted))
          edits.push_back(std::move(*edit));
  }
  const std::string added = new_objects_text(objects, path.parent_path());
  const toml::table* last = tables.get_as<toml::table>(tables.size() - 1);
  if (!added.empty() && last->is_inline())
    return one_line(path);
  if (!added.empty())
    edits.push_back({end_of(text, root, *last), end_of(text, root, *last), added});
  return edits;
}

} // namespace

/// From the last place to the first, so that places in the text stay right.
Result<std::string> with_objects(const std::string& text, std::span<const EditedObject> objects, std::size_t was,
                                 const std::filesystem::path& path) {
  const auto file = detail::parse_config_text(text, path);
  if (!file)
    return file.error();
  const toml::array* tables = file->root.get_as<toml::array>("object");
  if ((tables ? tables->size() : 0) != was)
    return other_objects(path);
  if (!tables) {
    const std::string added = new_objects_text(objects, path.parent_path());
    return added.empty() ? text : text + (text.ends_with('\n') ? "" : "\n") + added.substr(1) + "\n";
  }
  auto edits = edits_of(text, file->root, *tables, objects, path);
  if (!edits)
    return edits.error();
  std::stable_sort(edits->begin(), edits->end(), [](const Edit& a, const Edit& b) { return a.begin < b.begin; });
  std::string out = text;
  for (auto edit = edits->rbegin(); edit != edits->rend(); ++edit)
    out.replace(edit->begin, edit->end - edit->begin, edit->text);
  return out;
}

Result<void> write_objects(const std::filesystem::path& path, std::span<const EditedObject> objects, std::size_t was) {
  const auto bytes = read_whole_file(path);
  if (!bytes)
    return bytes.error();
  const auto edited = with_objects(std::string(bytes->begin(), bytes->end()), objects, was, path);
  if (!edited)
    return edited.error();
  return write_file_atomically(path, *edited);
}

Result<void> write_placements(const std::filesystem::path& path, std::span<const ObjectConfig> objects) {
  std::vector<EditedObject> edited;
  for (const ObjectConfig& object : objects)
    edited.push_back({object, edited.size()});
  return write_objects(path, edited, objects.size());
}

} // namespace daylit
