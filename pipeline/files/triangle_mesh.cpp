#include "pipeline/files/triangle_mesh.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <unordered_map>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/polygon_text.h"
#include "pipeline/files/text.h"
#include "pipeline/files/vtu_file.h"

namespace mbtfm::files {
namespace {

constexpr std::size_t kStlHead = 84, kStlTriangle = 50;  // bytes
constexpr const char* kStlHint = "the file may be damaged or cut short: export it again";

std::string lower(std::string_view word) {
  std::string small(word);
  std::ranges::transform(small, small.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return small;
}

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
    const std::string key = lower(words.front());
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
  const bool is_text = lower(text.substr(0, 5)) == "solid" && text.find('\0') == text.npos;
  return !fits && is_text ? parse_text_stl(text, name) : parse_binary_stl(text, name);
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
  const std::string extension = lower(file.extension().string()), name = file.string();
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
