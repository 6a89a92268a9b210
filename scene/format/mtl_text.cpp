#include <algorithm>
#include <array>

#include "scene/format/obj_lines.h"
#include "scene/format/obj_text.h"

namespace daylit::detail {

namespace {

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

/// Numbers and switches that follow an option.
std::vector<std::string_view> option_values(std::string_view& rest) {
  std::vector<std::string_view> values;
  for (std::string_view after = rest, word = take_word(after);
       word == "on" || word == "off" || parse_number(word).has_value(); word = take_word(after)) {
    values.push_back(word);
    rest = after;
  }
  return values;
}

/// Options such as "-s 2 2 1" or "-clamp on", then the file.
MtlTexture read_texture(std::string_view rest) {
  MtlTexture texture;
  while (trimmed(rest).starts_with('-')) {
    const std::string_view option = take_word(rest);
    if (option == "-imfchan" || option == "-type" || option == "-texopt")
      take_word(rest);
    const std::vector<std::string_view> values = option_values(rest);
    if (option == "-clamp")
      texture.clamp = !values.empty() && values[0] == "on";
    if (option == "-s" || option == "-o")
      for (std::size_t k = 0; k < std::min<std::size_t>(values.size(), 2); ++k)
        (option == "-s" ? texture.scale : texture.offset)[static_cast<int>(k)] = parse_number(values[k]).value_or(0.0);
  }
  texture.file = trimmed(rest);
  return texture;
}

struct ColourWord {
  std::string_view keyword;
  std::optional<Rgb> MtlMaterial::*member;
};
constexpr std::array kColours = {ColourWord{"Kd", &MtlMaterial::reflectance}, ColourWord{"Ks", &MtlMaterial::specular},
                                 ColourWord{"Tf", &MtlMaterial::transmittance},
                                 ColourWord{"Ke", &MtlMaterial::emission}};

struct NumberWord {
  std::string_view keyword;
  std::optional<double> MtlMaterial::*member;
};
constexpr std::array kNumbers = {NumberWord{"Ni", &MtlMaterial::refractive_index},
                                 NumberWord{"Ns", &MtlMaterial::exponent},
                                 NumberWord{"illum", &MtlMaterial::illumination},
                                 NumberWord{"Pr", &MtlMaterial::roughness},
                                 NumberWord{"Pm", &MtlMaterial::metallic},
                                 NumberWord{"Pc", &MtlMaterial::clearcoat},
                                 NumberWord{"Pcr", &MtlMaterial::clearcoat_roughness},
                                 NumberWord{"aniso", &MtlMaterial::anisotropy},
                                 NumberWord{"anisor", &MtlMaterial::anisotropy_turns}};

struct TextureWord {
  std::string_view keyword;
  MtlTexture MtlMaterial::*member;
};
constexpr std::array kTextures = {TextureWord{"map_Kd", &MtlMaterial::texture},
                                  TextureWord{"map_Ke", &MtlMaterial::emission_map},
                                  TextureWord{"norm", &MtlMaterial::normal_map}};

/// Light that real rooms do not have, and how a texture is filtered.
constexpr std::array<std::string_view, 4> kWithoutEffect = {"Ka", "map_Ka", "sharpness", "map_aat"};

/// d and Tr may be pictures' options ("d -halo 0.5"): the number is the last word. d counts where both are given.
void read_opacity(std::string_view keyword, std::optional<double> number, MtlMaterial& m) {
  if (keyword == "d")
    m.opacity = number;
  else if (!m.opacity)
    m.opacity = 1.0 - *number;
}

Result<void> read_line(const ObjLines& lines, std::string_view keyword, std::string_view rest, MtlMaterial& m) {
  const auto is_keyword = [&](const auto& word) { return word.keyword == keyword; };
  if (const auto* word = std::ranges::find_if(kColours, is_keyword); word != kColours.end()) {
    const Result<Rgb> colour = parse_colour(lines, keyword, rest);
    if (!colour)
      return colour.error();
    m.*(word->member) = *colour;
    return {};
  }
  const auto* word = std::ranges::find_if(kNumbers, is_keyword);
  if (word != kNumbers.end() || keyword == "d" || keyword == "Tr") {
    std::string_view value = ObjLines::next_word(rest);
    if (value == "-halo")
      value = ObjLines::next_word(rest);
    const std::optional<double> number = parse_number(value);
    if (!number)
      return lines.error(ErrorCode::file_malformed, std::string(keyword) + " needs a number", "");
    if (word != kNumbers.end())
      m.*(word->member) = *number;
    else
      read_opacity(keyword, number, m);
    return {};
  }
  const auto* map = std::ranges::find_if(kTextures, is_keyword);
  if (map != kTextures.end())
    m.*(map->member) = read_texture(rest);
  if (map != kTextures.end() && (m.*(map->member)).file.empty())
    m.unread.push_back(std::string(keyword) + " without a file");
  else if (map == kTextures.end() && std::ranges::find(kWithoutEffect, keyword) == kWithoutEffect.end() &&
           parse_number(trimmed(rest)) != 0.0) // 0: of a property that is switched off
    m.unread.emplace_back(keyword);
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
