#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <optional>

#include "pipeline/contract/errors.h"
#include "pipeline/files/polygon_text.h"

namespace mbtfm::files {
namespace {

static_assert(std::endian::native == std::endian::little);

enum class PlyFormat { ascii, little_endian, big_endian };

template <class T>
double ply_number(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

struct PlyType {
  std::string_view name, other_name;
  std::size_t n_bytes;
  double (*number)(const char* bytes);
};
constexpr PlyType kPlyTypes[] = {
    {"char", "int8", 1, ply_number<std::int8_t>},    {"uchar", "uint8", 1, ply_number<std::uint8_t>},
    {"short", "int16", 2, ply_number<std::int16_t>}, {"ushort", "uint16", 2, ply_number<std::uint16_t>},
    {"int", "int32", 4, ply_number<std::int32_t>},   {"uint", "uint32", 4, ply_number<std::uint32_t>},
    {"float", "float32", 4, ply_number<float>},      {"double", "float64", 8, ply_number<double>}};

struct PlyProperty {
  std::string_view name;
  const PlyType* type = nullptr;
  const PlyType* count = nullptr;  ///< of a list
};

struct PlyElement {
  std::string_view name;
  int n = 0;
  std::vector<PlyProperty> properties = {};
};

struct PlyHead {
  PlyFormat format = PlyFormat::ascii;
  std::vector<PlyElement> elements;
};

const PlyType* ply_type(std::string_view name, const std::string& where) {
  for (const PlyType& type : kPlyTypes)
    if (name == type.name || name == type.other_name) return &type;
  throw InputError(where, "a type of PLY's numbers", "'" + std::string(name) + "'");
}

PlyFormat ply_format(std::string_view word, const std::string& where) {
  if (word == "ascii") return PlyFormat::ascii;
  if (word == "binary_little_endian") return PlyFormat::little_endian;
  if (word == "binary_big_endian") return PlyFormat::big_endian;
  throw InputError(where, "the format ascii, binary_little_endian or binary_big_endian", "'" + std::string(word) + "'");
}

PlyHead take_head(TextRest& text) {
  PlyHead head;
  const auto magic = text.line();
  if (magic.empty() || magic.front() != "ply") throw InputError(text.where(), "the word ply", "other text");
  while (!text.is_empty()) {
    const auto words = text.line();
    const std::string_view key = words.empty() ? "comment" : words.front();
    if (key == "end_header") return head;
    if (key == "comment" || key == "obj_info") continue;
    const bool is_list = words.size() == 5 && words[1] == "list";
    if (key == "format" && words.size() == 3) {
      head.format = ply_format(words[1], text.where());
    } else if (key == "element" && words.size() == 3) {
      const int n = index_of(number_of(words[2], text.where()), text.where());
      head.elements.push_back({.name = words[1], .n = n});
    } else if (key == "property" && (words.size() == 3 || is_list) && !head.elements.empty()) {
      const PlyType* type = ply_type(words[words.size() - 2], text.where());
      const PlyType* count = is_list ? ply_type(words[2], text.where()) : nullptr;
      head.elements.back().properties.push_back({.name = words.back(), .type = type, .count = count});
    } else {
      throw InputError(text.where(), "a line of a PLY header", "'" + std::string(key.substr(0, 40)) + "...'");
    }
  }
  throw InputError(text.where(), "end_header", "the end of the file");
}

/// Before memory is taken for them: each number takes one byte at least, of text two but for the last.
void require_room(const PlyElement& element, PlyFormat format, const TextRest& text) {
  std::size_t least = 0;
  for (const PlyProperty& p : element.properties) {
    const PlyType* first = p.count != nullptr ? p.count : p.type;
    least += format == PlyFormat::ascii ? 2 : first->n_bytes;
  }
  if (static_cast<std::size_t>(element.n) * least <= text.rest().size() + 1) return;
  throw InputError(text.where(),
                   std::to_string(element.n) + " times '" + std::string(element.name) + "' in the rest of the file",
                   std::to_string(text.rest().size()) + " bytes", "the file may be damaged or cut short");
}

double take_number(TextRest& text, const PlyType& type, PlyFormat format) {
  if (format == PlyFormat::ascii) {
    const std::string_view word = text.word();
    return number_of(word, text.where());
  }
  char own[8];
  std::ranges::copy(text.bytes(type.n_bytes), own);
  if (format == PlyFormat::big_endian) std::reverse(own, own + type.n_bytes);
  return type.number(own);
}

std::vector<double> take_values(TextRest& text, const PlyProperty& property, PlyFormat format) {
  std::vector<double> values;
  const int n = property.count ? index_of(take_number(text, *property.count, format), text.where()) : 1;
  // no more than there is: an absurd count ends at the end of the file
  for (int k = 0; k < n; ++k) values.push_back(take_number(text, *property.type, format));
  return values;
}

/// Where the element has a property of the name.
std::optional<std::size_t> place_of(const PlyElement& element, std::string_view name) {
  const auto found = std::ranges::find(element.properties, name, &PlyProperty::name);
  if (found == element.properties.end()) return std::nullopt;
  return static_cast<std::size_t>(found - element.properties.begin());
}

using PlyRow = std::vector<std::vector<double>>;

void add_point(const PlyRow& row, const PlyElement& element, const std::string& where, TriangleMesh& mesh) {
  double at[3];
  const std::string_view names[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) {
    const auto place = place_of(element, names[k]);
    if (!place || row[*place].size() != 1)
      throw InputError(where, "x, y and z of each vertex", "no '" + std::string(names[k]) + "'");
    at[k] = row[*place].front();
  }
  mesh.points_um.push_back({at[0], at[1], at[2]});
}

void add_face(const PlyRow& row, const PlyElement& element, const std::string& where, TriangleMesh& mesh) {
  auto place = place_of(element, "vertex_indices");
  if (!place) place = place_of(element, "vertex_index");
  if (!place) throw InputError(where, "vertex_indices of each face", "none");
  std::vector<int> corners;
  for (const double corner : row[*place]) corners.push_back(index_of(corner, where));
  add_polygon(corners, where, mesh);
}

}  // namespace

TriangleMesh parse_ply(std::string_view whole, const std::string& name) {
  TextRest text(whole, name);
  const PlyHead head = take_head(text);
  TriangleMesh mesh;
  for (const PlyElement& element : head.elements) {
    if (element.properties.empty()) continue;
    require_room(element, head.format, text);
    PlyRow row(element.properties.size());
    for (int k = 0; k < element.n; ++k) {
      for (std::size_t p = 0; p < row.size(); ++p) row[p] = take_values(text, element.properties[p], head.format);
      const std::string where = head.format == PlyFormat::ascii ? text.where() : name;
      if (element.name == "vertex") add_point(row, element, where, mesh);
      if (element.name == "face") add_face(row, element, where, mesh);
    }
  }
  if (!text.word().empty()) throw InputError(name, "the end of the file", "more than the header states");
  return mesh;
}

}  // namespace mbtfm::files
