#include "pipeline/files/triangle_mesh.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <unordered_map>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/names.h"
#include "pipeline/files/polygon_text.h"
#include "pipeline/files/text.h"
#include "pipeline/files/vtu_data.h"
#include "pipeline/files/vtu_file.h"

namespace mbtfm::files {
namespace {

constexpr std::size_t kStlHead = 84, kStlTriangle = 50;  // bytes
constexpr const char* kStlHint = "the file may be damaged or cut short: export it again";

struct PointHash {
  std::size_t operator()(Vec3 p) const {
    const std::hash<double> hash;
    return hash(p.x) + 0x9E3779B97F4A7C15u * (hash(p.y) + 0x9E3779B97F4A7C15u * hash(p.z));
  }
};

/// Corners by their coordinates: where these are equal, the point is one.
class PointsByPlace {
 public:
  int add(Vec3 at, TriangleMesh& mesh) {
    const auto [found, is_new] = points_.try_emplace(at, static_cast<int>(mesh.points_um.size()));
    if (is_new) mesh.points_um.push_back(at);
    return found->second;
  }

 private:
  std::unordered_map<Vec3, int, PointHash> points_;
};

std::uint32_t claimed_triangles(std::string_view stl) {
  std::uint32_t n = 0;
  std::memcpy(&n, stl.data() + kStlHead - sizeof(n), sizeof(n));
  return n;
}

TriangleMesh parse_binary_stl(std::string_view text, const std::string& name) {
  if (text.size() < kStlHead)
    throw InputError(name, "a binary STL file of at least 84 bytes", std::to_string(text.size()) + " bytes", kStlHint);
  const std::uint32_t n = claimed_triangles(text);
  const std::size_t n_bytes = kStlHead + kStlTriangle * std::size_t{n};
  if (text.size() != n_bytes) {
    throw InputError(name,
                     "a binary STL file of " + std::to_string(n_bytes) + " bytes: 84 and 50 for each of its " +
                         std::to_string(n) + " triangles",
                     std::to_string(text.size()) + " bytes", kStlHint);
  }
  TriangleMesh mesh;
  PointsByPlace points;
  for (std::uint32_t k = 0; k < n; ++k) {
    float numbers[12];  // a normal, three corners
    std::memcpy(numbers, text.data() + kStlHead + kStlTriangle * k, sizeof(numbers));
    auto& triangle = mesh.triangles.emplace_back();
    for (int c = 0; c < 3; ++c) {
      const float* at = numbers + 3 + 3 * c;
      triangle[c] = points.add({at[0], at[1], at[2]}, mesh);
    }
  }
  return mesh;
}

TriangleMesh parse_text_stl(std::string_view text, const std::string& name) {
  TextRest rest(text, name);
  TriangleMesh mesh;
  PointsByPlace points;
  std::vector<int> corners;
  bool is_whole = false;
  while (!rest.is_empty()) {
    const auto words = rest.line();
    if (words.empty()) continue;
    const std::string key = lower_case(std::string(words.front()));
    is_whole = key == "endsolid";
    if (key == "vertex") {
      if (words.size() != 4) throw InputError(rest.where(), "vertex x y z", std::to_string(words.size()) + " words");
      const auto number = [&](int k) { return number_of(words[k], rest.where()); };
      corners.push_back(points.add({number(1), number(2), number(3)}, mesh));
    } else if (key == "endloop") {
      add_polygon(corners, rest.where(), mesh);
      corners.clear();
    } else if (key != "solid" && key != "facet" && key != "outer" && key != "endfacet" && key != "endsolid") {
      throw InputError(rest.where(), "a line of an STL file", "'" + std::string(words.front().substr(0, 40)) + "'");
    }
  }
  if (!is_whole) throw InputError(rest.where(), "endsolid at the end", "the end of the file", kStlHint);
  return mesh;
}

/// Binary ones may begin with the word of text ones.
TriangleMesh parse_stl(std::string_view text, const std::string& name) {
  const bool fits =
      text.size() >= kStlHead && text.size() == kStlHead + kStlTriangle * std::size_t{claimed_triangles(text)};
  const bool is_text = lower_case(std::string(text.substr(0, 5))) == "solid" && text.find('\0') == text.npos;
  return !fits && is_text ? parse_text_stl(text, name) : parse_binary_stl(text, name);
}

enum class PlyFormat { ascii, little_endian, big_endian };

struct PlyProperty {
  std::string_view name;
  const NumberType* type = nullptr;
  const NumberType* count = nullptr;  ///< of a list
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

const NumberType* ply_type(std::string_view name, const std::string& where) {
  constexpr std::string_view kOldNames[][2] = {{"char", "int8"},     {"uchar", "uint8"},   {"short", "int16"},
                                               {"ushort", "uint16"}, {"int", "int32"},     {"uint", "uint32"},
                                               {"float", "float32"}, {"double", "float64"}};
  const auto old = std::ranges::find(kOldNames, name, [](const auto& names) { return names[0]; });
  if (const NumberType* type = number_type(old == std::end(kOldNames) ? name : (*old)[1])) return type;
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
      const NumberType* type = ply_type(words[words.size() - 2], text.where());
      const NumberType* count = is_list ? ply_type(words[2], text.where()) : nullptr;
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
    const NumberType* first = p.count != nullptr ? p.count : p.type;
    least += format == PlyFormat::ascii ? 2 : first->n_bytes;
  }
  if (static_cast<std::size_t>(element.n) * least <= text.rest().size() + 1) return;
  throw InputError(text.where(),
                   std::to_string(element.n) + " times '" + std::string(element.name) + "' in the rest of the file",
                   std::to_string(text.rest().size()) + " bytes", "the file may be damaged or cut short");
}

double take_number(TextRest& text, const NumberType& type, PlyFormat format) {
  if (format == PlyFormat::ascii) {
    const std::string_view word = text.word();
    return number_of(word, text.where());
  }
  return type.number_at(text.bytes(type.n_bytes).data(), format == PlyFormat::big_endian);
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

/// In any of its three formats.
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

/// Corner i, i/j, i//k or i/j/k of a face: i from 1, or from -1 back.
int obj_corner(std::string_view word, int n_points, const std::string& where) {
  const double i = number_of(word.substr(0, word.find('/')), where);
  const int corner = index_of(i < 0 ? n_points + i : i - 1, where);
  if (corner >= n_points)
    throw InputError(where, "one of the " + std::to_string(n_points) + " points before", brief(i));
  return corner;
}

TriangleMesh parse_obj(std::string_view text, const std::string& name) {
  TextRest rest(text, name);
  TriangleMesh mesh;
  while (!rest.is_empty()) {
    auto words = rest.line();
    words.erase(std::ranges::find_if(words, [](std::string_view w) { return w.starts_with('#'); }), words.end());
    if (words.empty()) continue;
    if (words.front() == "v") {
      if (words.size() < 4) throw InputError(rest.where(), "v x y z", std::to_string(words.size()) + " words");
      const auto number = [&](int k) { return number_of(words[k], rest.where()); };
      mesh.points_um.push_back({number(1), number(2), number(3)});
    } else if (words.front() == "f") {
      std::vector<int> corners;
      for (std::size_t k = 1; k < words.size(); ++k)
        corners.push_back(obj_corner(words[k], static_cast<int>(mesh.points_um.size()), rest.where()));
      add_polygon(corners, rest.where(), mesh);
    }
  }
  return mesh;
}

TriangleMesh parse_vtp(std::string text, const std::string& name) {
  const VtuFile file(std::move(text), name, VtuKind::poly_data);
  TriangleMesh mesh;
  const auto x = file.coordinates();
  for (std::size_t k = 0; k < x.size(); k += 3) mesh.points_um.push_back({x[k], x[k + 1], x[k + 2]});
  for (const auto& corners : file.polygons()) add_polygon(corners, name, mesh);
  return mesh;
}

TriangleMesh parse_mesh(std::string text, const std::string& name, const std::string& extension) {
  if (extension == ".stl") return parse_stl(text, name);
  if (extension == ".ply") return parse_ply(text, name);
  if (extension == ".obj") return parse_obj(text, name);
  return parse_vtp(std::move(text), name);
}

}  // namespace

TriangleMesh read_triangle_mesh(const Path& file, double length_unit_um) {
  const std::string extension = lower_case(file.extension().string()), name = file.string();
  const std::string_view known[] = {".stl", ".ply", ".obj", ".vtp"};
  if (std::ranges::find(known, extension) == std::end(known))
    throw InputError(name, "a surface of triangles: .stl, .ply, .obj or .vtp", "the extension '" + extension + "'");
  std::string text = read_text(file);
  if (text.empty()) throw InputError(name, "a surface of triangles", "an empty file");
  constexpr std::size_t kMostBytes = std::size_t{1} << 32;  // a point takes 3 at least, and is counted with int
  if (text.size() > kMostBytes) throw InputError(name, "at most 4 GiB", std::to_string(text.size()) + " bytes");
  TriangleMesh mesh = parse_mesh(std::move(text), name, extension);
  if (mesh.triangles.empty()) throw InputError(name, "triangles", "none");
  for (Vec3& p : mesh.points_um) p = length_unit_um * p;
  try {
    check(mesh);
  } catch (const InvalidData& error) {
    throw InputError(name + ": " + error.element, error.expected, error.found);
  }
  return mesh;
}

}  // namespace mbtfm::files
