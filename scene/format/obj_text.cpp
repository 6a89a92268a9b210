#include "scene/format/obj_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <map>

namespace daylit::detail {

namespace {

constexpr double kLargestCoordinate_m = 1e9; // beyond it a double no longer resolves a tenth of a micrometre
constexpr std::uint32_t kMostCorners = 1024; // ear clipping is quadratic in the corners of one face
constexpr std::size_t kMostMaterials = 65536;

/// Logical lines: a backslash at the end joins the next line.
class LineReader {
public:
  LineReader(std::string_view text, const std::string& name) : rest_(text), name_(name) {}

  bool next(std::string_view& line) {
    if (rest_.empty())
      return false;
    first_line_ = ++last_line_;
    line = take_physical_line();
    if (!line.ends_with('\\'))
      return true;
    joined_.clear();
    while (line.ends_with('\\') && !rest_.empty()) {
      joined_.append(line.substr(0, line.size() - 1)).push_back(' ');
      line = take_physical_line();
      ++last_line_;
    }
    joined_.append(line);
    line = joined_;
    return true;
  }

  int line() const { return first_line_; }

  Error error(ErrorCode code, std::string what, std::string hint) const {
    return {code, std::move(what), name_ + ", line " + std::to_string(first_line_), std::move(hint)};
  }

private:
  std::string_view take_physical_line() {
    const std::size_t end = rest_.find('\n');
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (line.ends_with('\r'))
      line.remove_suffix(1);
    return line;
  }

  std::string_view rest_;
  std::string name_, joined_;
  int first_line_ = 0, last_line_ = 0;
};

bool is_blank(char c) { return c == ' ' || c == '\t'; }

std::string_view trimmed(std::string_view s) {
  while (!s.empty() && is_blank(s.front()))
    s.remove_prefix(1);
  while (!s.empty() && is_blank(s.back()))
    s.remove_suffix(1);
  return s;
}

/// Removes and returns the first word; empty at the end of the line or at a comment.
std::string_view take_word(std::string_view& line) {
  line = trimmed(line);
  if (line.starts_with('#'))
    line = {};
  const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(end);
  return word;
}

std::optional<double> parse_number(std::string_view word) {
  if (word.starts_with('+'))
    word.remove_prefix(1);
  double value = 0.0;
  const auto [end, ec] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || ec == std::errc::invalid_argument)
    return std::nullopt;
  // Out of range is a huge or a vanishing number; strtod tells which (infinity or nearly zero).
  return ec == std::errc{} ? value : std::strtod(std::string(word).c_str(), nullptr);
}

class ObjParser {
public:
  ObjParser(std::string_view text, const std::string& name) : lines_(text, name) {}

  Result<ObjText> run() {
    std::string_view line;
    while (lines_.next(line)) {
      const std::string_view keyword = take_word(line);
      if (keyword.empty())
        continue;
      const Result<void> done = read_line(keyword, line);
      if (!done)
        return done.error();
    }
    for (const ObjFace& face : obj_.faces)
      for (std::uint32_t k = 0; k < face.corner_count; ++k)
        if (obj_.corners[face.first_corner + k] >= obj_.vertices.size())
          return out_of_range(obj_.corners[face.first_corner + k] + std::int64_t{1}, face.line);
    return std::move(obj_);
  }

private:
  Result<void> read_line(std::string_view keyword, std::string_view rest) {
    if (keyword == "v")
      return read_vertex(rest);
    if (keyword == "f" || keyword == "fo")
      return read_face(rest);
    if (keyword == "usemtl")
      return use_material(std::string(trimmed(rest)));
    if (keyword == "mtllib") {
      obj_.libraries.emplace_back(trimmed(rest));
      return {};
    }
    static constexpr std::array kIgnored = {"vt",         "vn",        "vp",     "g",      "o",        "s",
                                            "l",          "p",         "mg",     "bevel",  "c_interp", "lod",
                                            "shadow_obj", "trace_obj", "usemap", "maplib", "d_interp"};
    if (std::find(kIgnored.begin(), kIgnored.end(), keyword) != kIgnored.end())
      return {};
    static constexpr std::array kFreeForm = {"cstype", "deg", "curv", "curv2", "surf", "bmat", "step", "call", "csh"};
    if (std::find(kFreeForm.begin(), kFreeForm.end(), keyword) != kFreeForm.end())
      return lines_.error(ErrorCode::file_malformed, "free-form curves and surfaces are not read",
                          "export the model as polygons");
    return lines_.error(ErrorCode::file_malformed, "this is not a line of an OBJ file",
                        "check that the file is a Wavefront OBJ and complete");
  }

  Result<void> read_vertex(std::string_view rest) {
    glm::dvec3 p(0.0);
    for (int k = 0; k < 3; ++k) {
      const std::optional<double> number = parse_number(take_word(rest));
      if (!number)
        return lines_.error(ErrorCode::file_malformed, "a vertex needs three numbers",
                            "the file may be cut off here; export the model again");
      p[k] = *number;
    }
    for (int k = 0; k < 3; ++k)
      if (!(std::abs(p[k]) <= kLargestCoordinate_m))
        return lines_.error(ErrorCode::value_invalid, "vertex coordinate is not finite or beyond 1e9 m",
                            "coordinates are metres; export the model again");
    obj_.vertices.push_back(p);
    return {};
  }

  Result<void> read_face(std::string_view rest) {
    if (obj_.material_names.empty())
      if (const Result<void> done = use_material(""); !done)
        return done;
    ObjFace face{static_cast<std::uint32_t>(obj_.corners.size()), 0, material_, lines_.line()};
    for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
      const std::optional<std::int64_t> corner = parse_corner(word);
      if (!corner)
        return lines_.error(ErrorCode::file_malformed, "a face corner is not of the form v, v/vt, v//vn or v/vt/vn",
                            "the file may be damaged; export the model again");
      const std::int64_t index = *corner < 0 ? static_cast<std::int64_t>(obj_.vertices.size()) + *corner : *corner - 1;
      if (index < 0 || index >= std::int64_t{UINT32_MAX})
        return out_of_range(*corner, lines_.line());
      if (++face.corner_count > kMostCorners)
        return lines_.error(ErrorCode::limit_exceeded, "a face with more than 1024 corners",
                            "triangulate faces on export");
      obj_.corners.push_back(static_cast<std::uint32_t>(index));
    }
    if (face.corner_count < 3)
      return lines_.error(ErrorCode::file_malformed, "a face needs at least three corners",
                          "the file may be cut off here; export the model again");
    obj_.faces.push_back(face);
    return {};
  }

  static std::optional<std::int64_t> parse_corner(std::string_view word) {
    std::array<std::int64_t, 3> index{};
    for (int part = 0; part < 3; ++part) {
      const std::size_t end = std::min(word.find('/'), word.size());
      const std::string_view text = word.substr(0, end);
      const auto [stop, ec] = std::from_chars(text.data(), text.data() + text.size(), index[part]);
      const bool may_be_empty = part == 1 && text.empty();
      if (!may_be_empty && (ec != std::errc{} || stop != text.data() + text.size()))
        return std::nullopt;
      if (end == word.size())
        return index[0];
      word.remove_prefix(end + 1);
    }
    return std::nullopt;
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
    Error error = lines_.error(ErrorCode::file_malformed,
                               "face corner " + std::to_string(corner) + ", but the file has " +
                                   std::to_string(obj_.vertices.size()) + " vertices",
                               "the file is cut off or damaged; export the model again");
    error.where = error.where.substr(0, error.where.rfind(' ') + 1) + std::to_string(line);
    return error;
  }

  LineReader lines_;
  ObjText obj_;
  std::map<std::string, std::uint32_t, std::less<>> material_index_;
  std::uint32_t material_ = 0;
};

constexpr double kIllumGlass = 7.0; // "transparency: refraction on, reflection: Fresnel on"

/// One number means grey, three mean r g b.
Result<Rgb> parse_colour(const LineReader& lines, std::string_view keyword, std::string_view rest) {
  glm::dvec3 c(0.0);
  int count = 0;
  for (std::string_view word = take_word(rest); !word.empty() && count < 3; word = take_word(rest), ++count) {
    const std::optional<double> number = parse_number(word);
    if (!number)
      return lines.error(ErrorCode::file_malformed, std::string(keyword) + " needs numbers r g b",
                         "spectral and XYZ colours are not read");
    c[count] = *number;
  }
  if (count == 1)
    return Rgb(static_cast<float>(c.x));
  if (count != 3)
    return lines.error(ErrorCode::file_malformed, std::string(keyword) + " needs three numbers",
                       "the file may be cut off here; export the model again");
  return Rgb(c);
}

Result<void> read_mtl_line(const LineReader& lines, std::string_view keyword, std::string_view rest, MtlMaterial& m) {
  if (keyword == "Kd" || keyword == "Tf" || keyword == "Ke") {
    const Result<Rgb> colour = parse_colour(lines, keyword, rest);
    if (!colour)
      return colour.error();
    if (keyword == "Kd")
      m.reflectance = *colour;
    else if (keyword == "Tf")
      m.transmittance = *colour;
    else
      m.emits = *colour != Rgb(0.0f);
  } else if (keyword == "Ni" || keyword == "illum") {
    const std::optional<double> number = parse_number(take_word(rest));
    if (!number)
      return lines.error(ErrorCode::file_malformed, std::string(keyword) + " needs a number", "");
    if (keyword == "Ni")
      m.refractive_index = *number;
    else
      m.is_glass = *number == kIllumGlass;
  } else if (keyword == "map_Kd") {
    m.has_texture = true;
  } else if (keyword == "d" || keyword == "Tr") {
    m.has_dissolve = true;
  }
  return {};
}

} // namespace

Result<ObjText> parse_obj_text(std::string_view text, const std::string& name) {
  Result<ObjText> obj = ObjParser(text, name).run();
  if (obj)
    obj->ends_with_line_break = text.ends_with('\n');
  return obj;
}

Result<std::vector<MtlMaterial>> parse_mtl_text(std::string_view text, const std::string& name) {
  LineReader lines(text, name);
  std::vector<MtlMaterial> materials;
  std::string_view line;
  while (lines.next(line)) {
    const std::string_view keyword = take_word(line);
    if (keyword == "newmtl") {
      if (materials.size() >= kMostMaterials)
        return lines.error(ErrorCode::limit_exceeded, "more than 65536 materials", "");
      materials.emplace_back().name = trimmed(line);
    } else if (!keyword.empty() && !materials.empty()) {
      const Result<void> done = read_mtl_line(lines, keyword, line, materials.back());
      if (!done)
        return done.error();
    } else if (keyword == "Kd" || keyword == "Tf") {
      return lines.error(ErrorCode::file_malformed, "a colour before the first newmtl", "");
    }
  }
  return materials;
}

} // namespace daylit::detail
