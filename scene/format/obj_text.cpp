#include "scene/format/obj_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "scene/format/obj_lines.h"

namespace daylit::detail {

namespace {

constexpr double kLargestNumber = 1e9;       // beyond it a double no longer resolves a tenth of a micrometre
constexpr std::uint32_t kMostCorners = 1024; // ear clipping is quadratic in the corners of one face
constexpr std::size_t kMostMaterials = 65536;

class ObjParser {
public:
  ObjParser(std::string_view text, const std::string& name) : lines_(text, name) {
    obj_.ends_with_line_break = text.ends_with('\n');
  }

  Result<ObjText> run() {
    std::string_view keyword, rest;
    while (lines_.next(keyword, rest))
      if (const Result<void> done = read_line(keyword, rest); !done)
        return done.error();
    for (const ObjFace& face : obj_.faces)
      for (std::uint32_t k = 0; k < face.corner_count; ++k)
        if (obj_.corners[face.first_corner + k].vertex >= obj_.vertices.size())
          return out_of_range(obj_.corners[face.first_corner + k].vertex + std::int64_t{1}, face.line);
    return std::move(obj_);
  }

private:
  Result<void> read_line(std::string_view keyword, std::string_view rest) {
    if (keyword == "v")
      return append(obj_.vertices, read_numbers(rest, 3, "a vertex needs three numbers"));
    if (keyword == "vn")
      return append(obj_.normals, read_numbers(rest, 3, "a normal needs three numbers"));
    if (keyword == "vt")
      return append(obj_.textures, read_numbers(rest, 1, "a texture coordinate needs a number"));
    if (keyword == "f" || keyword == "fo")
      return read_face(rest);
    if (keyword == "usemtl")
      return use_material(std::string(trimmed(rest)));
    if (keyword == "mtllib") {
      obj_.libraries.emplace_back(trimmed(rest));
      return {};
    }
    static constexpr std::array kIgnored = {"vp",         "g",         "o",      "s",        "l",
                                            "p",          "mg",        "bevel",  "c_interp", "lod",
                                            "shadow_obj", "trace_obj", "usemap", "maplib",   "d_interp"};
    if (std::find(kIgnored.begin(), kIgnored.end(), keyword) != kIgnored.end())
      return {};
    static constexpr std::array kFreeForm = {"cstype", "deg", "curv", "curv2", "surf", "bmat", "step", "call", "csh"};
    if (std::find(kFreeForm.begin(), kFreeForm.end(), keyword) != kFreeForm.end())
      return lines_.error(ErrorCode::file_malformed, "free-form curves and surfaces are not read",
                          "export the model as polygons");
    return lines_.error(ErrorCode::file_malformed, "this is not a line of an OBJ file",
                        "check that the file is a Wavefront OBJ and complete");
  }

  /// At least `least` of three numbers; what is not written is 0.
  Result<glm::dvec3> read_numbers(std::string_view rest, int least, const char* what) const {
    glm::dvec3 p(0.0);
    for (int k = 0; k < 3; ++k) {
      const std::string_view word = ObjLines::next_word(rest);
      if (word.empty() && k >= least)
        break;
      const std::optional<double> number = parse_number(word);
      if (!number)
        return lines_.error(ErrorCode::file_malformed, what, "the file may be cut off here; export the model again");
      if (!(std::abs(*number) <= kLargestNumber))
        return lines_.error(ErrorCode::value_invalid, "a number is not finite or beyond 1e9",
                            "coordinates are metres; export the model again");
      p[k] = *number;
    }
    return p;
  }

  template <class Vector>
  Result<void> append(std::vector<Vector>& list, const Result<glm::dvec3>& numbers) {
    if (!numbers)
      return numbers.error();
    list.emplace_back(*numbers);
    return {};
  }

  Result<void> read_face(std::string_view rest) {
    if (obj_.material_names.empty())
      if (const Result<void> done = use_material(""); !done)
        return done;
    ObjFace face{static_cast<std::uint32_t>(obj_.corners.size()), 0, material_, lines_.line()};
    for (std::string_view word = ObjLines::next_word(rest); !word.empty(); word = ObjLines::next_word(rest)) {
      if (const Result<void> done = read_corner(word); !done)
        return done;
      if (++face.corner_count > kMostCorners)
        return lines_.error(ErrorCode::limit_exceeded, "a face with more than 1024 corners",
                            "triangulate faces on export");
    }
    if (face.corner_count < 3)
      return lines_.error(ErrorCode::file_malformed, "a face needs at least three corners",
                          "the file may be cut off here; export the model again");
    obj_.faces.push_back(face);
    return {};
  }

  /// Index from 0 of a number that counts from 1, or, negative, back from the last of `size`; out of any range for
  /// none.
  static std::int64_t from_file(std::int64_t number, std::int64_t size) {
    const std::int64_t index = number < 0 ? size + number : number - 1;
    return index < 0 ? INT64_MAX : index;
  }

  /// v, v/vt, v//vn or v/vt/vn.
  Result<void> read_corner(std::string_view word) {
    std::array<std::int64_t, 3> index{-1, -1, -1},
        size{std::ssize(obj_.vertices), std::ssize(obj_.textures), std::ssize(obj_.normals)};
    std::int64_t written = 0;
    for (std::size_t part = 0;; ++part) {
      const std::string_view text = word.substr(0, word.find('/'));
      const std::optional<std::int64_t> number = parse_number<std::int64_t>(text);
      if (part > 2 || (!number && !(part == 1 && text.empty())))
        return lines_.error(ErrorCode::file_malformed, "a face corner is not of the form v, v/vt, v//vn or v/vt/vn",
                            "the file may be damaged; export the model again");
      if (number)
        index[part] = from_file(*number, size[part]);
      written = part == 0 ? *number : written;
      if (text.size() == word.size())
        break;
      word.remove_prefix(text.size() + 1);
    }
    if (index[0] >= std::int64_t{UINT32_MAX})
      return out_of_range(written, lines_.line());
    obj_.corners.push_back({static_cast<std::uint32_t>(index[0]), index[1], index[2]});
    return {};
  }

  Result<void> use_material(std::string name) {
    const auto [entry, is_new] =
        material_index_.try_emplace(name, static_cast<std::uint32_t>(obj_.material_names.size()));
    if (is_new && obj_.material_names.size() >= kMostMaterials)
      return lines_.error(ErrorCode::limit_exceeded, "more than 65536 materials", "");
    if (is_new)
      obj_.material_names.push_back(std::move(name));
    material_ = entry->second;
    return {};
  }

  Error out_of_range(std::int64_t corner, int line) const {
    return lines_.error_at(line, ErrorCode::file_malformed,
                           "face corner " + std::to_string(corner) + ", but the file has " +
                               std::to_string(obj_.vertices.size()) + " vertices",
                           "the file is cut off or damaged; export the model again");
  }

  ObjLines lines_;
  ObjText obj_;
  std::map<std::string, std::uint32_t, std::less<>> material_index_;
  std::uint32_t material_ = 0;
};

} // namespace

Result<ObjText> parse_obj_text(std::string_view text, const std::string& name) { return ObjParser(text, name).run(); }

} // namespace daylit::detail
