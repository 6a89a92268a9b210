#include "scene/format/obj_lines.h"
#include "scene/format/obj_text.h"

namespace daylit::detail {

namespace {

constexpr double kIllumGlass = 7.0; // "transparency: refraction on, reflection: Fresnel on"
constexpr std::size_t kMostMaterials = 65536;

/// One number means grey, three mean r g b.
Result<Rgb> parse_colour(const ObjLines& lines, std::string_view keyword, std::string_view rest) {
  glm::dvec3 c(0.0);
  int count = 0;
  for (std::string_view word = ObjLines::next_word(rest); !word.empty() && count < 3;
       word = ObjLines::next_word(rest), ++count) {
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

/// The file of a texture: what is left after options such as "-s 1 1 1" or "-clamp on".
std::string texture_file(std::string_view rest) {
  while (trimmed(rest).starts_with('-')) {
    take_word(rest);
    for (std::string_view after = rest, word = take_word(after);
         word == "on" || word == "off" || parse_number(word).has_value(); word = take_word(after))
      rest = after;
  }
  return std::string(trimmed(rest));
}

Result<void> read_colour(const ObjLines& lines, std::string_view keyword, std::string_view rest, MtlMaterial& m) {
  const Result<Rgb> colour = parse_colour(lines, keyword, rest);
  if (!colour)
    return colour.error();
  if (keyword == "Kd")
    m.reflectance = *colour;
  else if (keyword == "Tf")
    m.transmittance = *colour;
  else
    m.emits = *colour != Rgb(0.0f);
  return {};
}

Result<void> read_line(const ObjLines& lines, std::string_view keyword, std::string_view rest, MtlMaterial& m) {
  if (keyword == "Kd" || keyword == "Tf" || keyword == "Ke")
    return read_colour(lines, keyword, rest, m);
  if (keyword == "Ni" || keyword == "illum") {
    const std::optional<double> number = parse_number(ObjLines::next_word(rest));
    if (!number)
      return lines.error(ErrorCode::file_malformed, std::string(keyword) + " needs a number", "");
    if (keyword == "Ni")
      m.refractive_index = *number;
    else
      m.is_glass = *number == kIllumGlass;
  } else if (keyword == "map_Kd") {
    m.texture = texture_file(rest);
  } else if (keyword == "d" || keyword == "Tr") {
    m.has_dissolve = true;
  }
  return {};
}

} // namespace

Result<std::vector<MtlMaterial>> parse_mtl_text(std::string_view text, const std::string& name) {
  ObjLines lines(text, name);
  std::vector<MtlMaterial> materials;
  std::string_view keyword, rest;
  while (lines.next(keyword, rest)) {
    if (keyword == "newmtl") {
      if (materials.size() >= kMostMaterials)
        return lines.error(ErrorCode::limit_exceeded, "more than 65536 materials", "");
      materials.emplace_back().name = trimmed(rest);
    } else if (!materials.empty()) {
      if (const Result<void> done = read_line(lines, keyword, rest, materials.back()); !done)
        return done.error();
    } else if (keyword == "Kd" || keyword == "Tf") {
      return lines.error(ErrorCode::file_malformed, "a colour before the first newmtl", "");
    }
  }
  return materials;
}

} // namespace daylit::detail
