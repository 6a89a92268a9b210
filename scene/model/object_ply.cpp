#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <sstream>

#include <glm/geometric.hpp>

#include "scene/model/triangle_soup.h"

// PLY (Turk 1994): a text header that lists elements and their properties, then the elements as text or binary.

namespace daylit::detail {

namespace {

constexpr std::uint64_t kMaxElements = std::uint64_t{1} << 28;
constexpr std::size_t kMaxHeaderLines = 1000, kMaxPolygonCorners = 1000;

enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::optional<Scalar> scalar_named(const std::string& name) {
  static const std::pair<const char*, Scalar> kNames[] = {
      {"char", Scalar::int8},      {"int8", Scalar::int8},       {"uchar", Scalar::uint8},
      {"uint8", Scalar::uint8},    {"short", Scalar::int16},     {"int16", Scalar::int16},
      {"ushort", Scalar::uint16},  {"uint16", Scalar::uint16},   {"int", Scalar::int32},
      {"int32", Scalar::int32},    {"uint", Scalar::uint32},     {"uint32", Scalar::uint32},
      {"float", Scalar::float32},  {"float32", Scalar::float32}, {"double", Scalar::float64},
      {"float64", Scalar::float64}};
  for (const auto& [known, type] : kNames)
    if (name == known)
      return type;
  return std::nullopt;
}

std::size_t size_of(Scalar type) {
  constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

struct Property {
  std::string name;
  Scalar type = Scalar::float32;
  std::optional<Scalar> count_type; ///< of a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { ascii, little, big };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t body = 0; ///< offset of the first element
};

/// Thrown inside this file only; parse_ply_soup turns it into a value.
struct PlyError {
  std::string what;
};

void parse_header_line(const std::string& line, Header& header) {
  std::istringstream words(line);
  std::string word, a, b, c;
  words >> word;
  if (word == "format") {
    words >> a;
    if (a != "ascii" && a != "binary_little_endian" && a != "binary_big_endian")
      throw PlyError{"unknown PLY format \"" + a.substr(0, 40) + "\""};
    header.encoding = a == "ascii" ? Encoding::ascii : a == "binary_big_endian" ? Encoding::big : Encoding::little;
  } else if (word == "element") {
    Element element;
    if (!(words >> element.name >> element.count) || element.count > kMaxElements)
      throw PlyError{"a PLY element with a bad count"};
    header.elements.push_back(std::move(element));
  } else if (word == "property") {
    if (header.elements.empty() || !(words >> a >> b))
      throw PlyError{"a PLY property out of place"};
    Property property{b, Scalar::float32, std::nullopt};
    if (a == "list") {
      words >> a >> c;
      property = {c, Scalar::float32, scalar_named(b)};
      if (!property.count_type || *property.count_type >= Scalar::float32)
        throw PlyError{"a PLY list with a bad count type"};
    }
    const auto type = scalar_named(a);
    if (!type)
      throw PlyError{"unknown PLY type \"" + a.substr(0, 40) + "\""};
    property.type = *type;
    header.elements.back().properties.push_back(std::move(property));
  } else if (word != "ply" && word != "comment" && word != "obj_info" && !word.empty()) {
    throw PlyError{"unknown PLY header line \"" + line.substr(0, 40) + "\""};
  }
}

Header read_header(std::span<const std::uint8_t> bytes) {
  Header header;
  std::size_t position = 0;
  for (std::size_t lines = 0; lines < kMaxHeaderLines; ++lines) {
    std::size_t end = position;
    while (end < bytes.size() && bytes[end] != '\n')
      ++end;
    if (end == bytes.size())
      throw PlyError{"the file ends inside the PLY header"};
    std::string line(bytes.begin() + static_cast<std::ptrdiff_t>(position),
                     bytes.begin() + static_cast<std::ptrdiff_t>(end));
    if (!line.empty() && line.back() == '\r')
      line.pop_back();
    position = end + 1;
    if (line == "end_header") {
      header.body = position;
      return header;
    }
    parse_header_line(line, header);
  }
  throw PlyError{"the PLY header does not end"};
}

/// Reads one number after another; throws at the end of the file.
class Body {
public:
  Body(std::span<const std::uint8_t> bytes, Encoding encoding) : bytes_(bytes), encoding_(encoding) {}

  double number(Scalar type) { return encoding_ == Encoding::ascii ? text_number() : binary_number(type); }

  /// Each element takes at least this many bytes, so its count is bounded by the file.
  void expect(const Element& element) const {
    std::uint64_t least = 0;
    for (const Property& p : element.properties)
      least += encoding_ == Encoding::ascii ? 2 : size_of(p.count_type ? *p.count_type : p.type);
    if (least == 0 || element.count * least > bytes_.size() - position_ + 1)
      throw PlyError{"the file is too short for its " + std::to_string(element.count) + " elements \"" +
                     element.name.substr(0, 40) + "\""};
  }

private:
  double text_number() {
    while (position_ < bytes_.size() && std::isspace(bytes_[position_]))
      ++position_;
    const char* begin = reinterpret_cast<const char*>(bytes_.data());
    double value = 0;
    const auto [end, code] = std::from_chars(begin + position_, begin + bytes_.size(), value);
    if (code != std::errc())
      throw PlyError{position_ >= bytes_.size() ? "the file ends too early" : "a number cannot be read"};
    position_ = static_cast<std::size_t>(end - begin);
    return value;
  }

  double binary_number(Scalar type) {
    const std::size_t size = size_of(type);
    if (bytes_.size() - position_ < size)
      throw PlyError{"the file ends too early"};
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < size; ++i)
      bits |= std::uint64_t{bytes_[position_ + (encoding_ == Encoding::big ? size - 1 - i : i)]} << (8 * i);
    position_ += size;
    switch (type) {
    case Scalar::int8:
      return static_cast<std::int8_t>(bits);
    case Scalar::int16:
      return static_cast<std::int16_t>(bits);
    case Scalar::int32:
      return static_cast<std::int32_t>(bits);
    case Scalar::float32:
      return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    case Scalar::float64:
      return std::bit_cast<double>(bits);
    default:
      return static_cast<double>(bits);
    }
  }

  std::span<const std::uint8_t> bytes_;
  Encoding encoding_;
  std::size_t position_ = 0;
};

std::size_t list_count(Body& body, const Property& property) {
  const double count = body.number(*property.count_type);
  if (!(count >= 0 && count <= 1e6 && count == std::floor(count)))
    throw PlyError{"a list with a bad length"};
  return static_cast<std::size_t>(count);
}

void skip(Body& body, const Property& property) {
  const std::size_t n = property.count_type ? list_count(body, property) : 1;
  for (std::size_t i = 0; i < n; ++i)
    body.number(property.type);
}

/// Which of x y z nx ny nz red green blue a property is, or -1.
int vertex_slot(const std::string& name) {
  static const char* const kSlots[] = {"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"};
  for (int i = 0; i < 9; ++i)
    if (name == kSlots[i])
      return i;
  return -1;
}

double colour_scale(Scalar type) { return type == Scalar::uint8 ? 255.0 : type == Scalar::uint16 ? 65535.0 : 1.0; }

/// `colour`: of the vertices, stays empty where the file gives none.
void read_vertices(Body& body, const Element& element, TriangleSoup& soup, std::vector<Rgb>& colour) {
  std::array<bool, 9> has{};
  std::array<double, 9> value{};
  for (const Property& p : element.properties)
    if (const int slot = vertex_slot(p.name); slot >= 0 && !p.count_type)
      has[static_cast<std::size_t>(slot)] = true;
  if (!has[0] || !has[1] || !has[2])
    throw PlyError{"the vertices have no x, y, z"};
  const bool normals = has[3] && has[4] && has[5], colours = has[6] && has[7] && has[8];
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& p : element.properties) {
      const int slot = p.count_type ? -1 : vertex_slot(p.name);
      if (slot < 0) {
        skip(body, p);
        continue;
      }
      value[static_cast<std::size_t>(slot)] = body.number(p.type) / (slot >= 6 ? colour_scale(p.type) : 1.0);
      if (!(std::abs(value[static_cast<std::size_t>(slot)]) < 1e15))
        throw PlyError{"vertex " + std::to_string(i) + " has a value that is NaN, infinite or above 1e15"};
    }
    soup.positions.emplace_back(value[0], value[1], value[2]);
    if (normals)
      soup.normals.emplace_back(value[3], value[4], value[5]);
    if (colours) {
      colour.emplace_back(value[6], value[7], value[8]);
      for (int c = 0; c < 3; ++c)
        if (!(colour.back()[c] >= 0 && colour.back()[c] <= 1))
          throw PlyError{"vertex " + std::to_string(i) + " has a colour (reflectance) outside 0..1"};
    }
  }
}

void read_polygon(Body& body, const Property& property, std::uint64_t face, const std::vector<Rgb>& colour,
                  TriangleSoup& soup) {
  const std::size_t n = list_count(body, property);
  if (n > kMaxPolygonCorners)
    throw PlyError{"face " + std::to_string(face) + " has more than 1000 corners"};
  std::vector<SoupCorner> corners(n);
  for (SoupCorner& corner : corners) {
    const double index = body.number(property.type);
    if (!(index >= 0 && index < static_cast<double>(soup.positions.size()) && index == std::floor(index)))
      throw PlyError{"face " + std::to_string(face) + " uses a vertex that does not exist"};
    corner.position = static_cast<std::uint32_t>(index);
    if (!soup.normals.empty() && glm::length(soup.normals[corner.position]) > 1e-6f)
      corner.normal = static_cast<std::int32_t>(corner.position);
    if (!colour.empty())
      corner.colour = colour[corner.position];
  }
  if (!append_polygon(corners, 0, soup))
    throw PlyError{"face " + std::to_string(face) + " is a concave polygon; triangulate it on export"};
}

TriangleSoup read_soup(std::span<const std::uint8_t> bytes, Rgb fallback) {
  const Header header = read_header(bytes);
  Body body(bytes.subspan(header.body), header.encoding);
  TriangleSoup soup;
  std::vector<Rgb> colour;
  for (const Element& element : header.elements) {
    body.expect(element);
    if (element.name == "vertex" && soup.positions.empty()) {
      read_vertices(body, element, soup, colour);
      continue;
    }
    for (std::uint64_t i = 0; i < element.count; ++i)
      for (const Property& p : element.properties)
        if (element.name == "face" && p.count_type && (p.name == "vertex_indices" || p.name == "vertex_index"))
          read_polygon(body, p, i, colour, soup);
        else
          skip(body, p);
  }
  soup.surfaces.materials.push_back({.base_colour = colour.empty() ? fallback : Rgb(1.0f)});
  return soup;
}

} // namespace

Result<TriangleSoup> parse_ply_soup(std::span<const std::uint8_t> bytes, const std::string& name, Rgb fallback) {
  try {
    return read_soup(bytes, fallback);
  } catch (const PlyError& error) {
    return Error{ErrorCode::file_malformed, error.what, name, "the file is truncated or damaged: export it again"};
  }
}

} // namespace daylit::detail
