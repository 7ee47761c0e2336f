#include "pipeline/files/vtu_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <pugixml.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/parsed.h"

namespace mbtfm::files {
namespace {

constexpr const char* kDamaged = "the file may be damaged: write it again";
constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
constexpr std::string_view kEnd = "</VTKFile>";

/// As people call it.
const char* words_of(VtuKind kind) {
  return kind == VtuKind::poly_data ? "polygons (.vtp, type PolyData)" : "an unstructured grid (.vtu)";
}
const char* type_of(VtuKind kind) { return kind == VtuKind::poly_data ? "PolyData" : "UnstructuredGrid"; }

std::optional<std::uint64_t> count_of(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(' '), end = text.find_last_not_of(' ');
  return begin == text.npos ? std::nullopt
                            : parsed<std::uint64_t>(std::string_view(text).substr(begin, end + 1 - begin));
}

/// By VtuSection.
struct Section {
  const char *element, *name;
};
constexpr Section kSections[] = {{"PointData", "point array"},
                                 {"CellData", "cell array"},
                                 {"Points", "array of points"},
                                 {"Cells", "array of cells"},
                                 {"Polys", "array of polygons"}};

std::string name_of(VtuSection section) { return kSections[static_cast<int>(section)].name; }

std::uint64_t count(const pugi::xml_node& piece, const char* attribute, const std::string& name) {
  const std::string text = piece.attribute(attribute).value();
  if (const auto value = count_of(text)) return *value;
  throw InputError(name, "a number of points or cells", attribute + ("=\"" + text + "\""), kDamaged);
}

VtuFile::Piece piece_of(const pugi::xml_node& xml, VtuKind kind, const std::string& name) {
  VtuFile::Piece piece;
  piece.n_points = count(xml, "NumberOfPoints", name);
  if (kind == VtuKind::unstructured_grid) {
    piece.n_cells = count(xml, "NumberOfCells", name);
  } else {  // kinds of cells that a file lacks need not be named
    const auto if_named = [&](const char* kind_of_cells) {
      return xml.attribute(kind_of_cells) ? count(xml, kind_of_cells, name) : 0;
    };
    piece.n_cells = piece.n_polygons = if_named("NumberOfPolys");
    piece.n_strips = if_named("NumberOfStrips");
    for (const std::uint64_t n : {piece.n_strips, if_named("NumberOfVerts"), if_named("NumberOfLines")})
      piece.n_cells = n > kMost - piece.n_cells ? kMost : piece.n_cells + n;
  }
  for (int s = 0; s < static_cast<int>(std::size(kSections)); ++s) {
    for (const pugi::xml_node& xml_array : xml.child(kSections[s].element).children("DataArray")) {
      const auto word = [&](const char* attribute) { return xml_array.attribute(attribute).value(); };
      piece.arrays.push_back({.section = static_cast<VtuSection>(s),
                              .name = word("Name"),
                              .type = word("type"),
                              .format = word("format"),
                              .offset = word("offset"),
                              .n_components = word("NumberOfComponents")});
      // its own text, not that of the keys that VTK puts into it
      for (const pugi::xml_node& part : xml_array.children()) piece.arrays.back().text += part.value();
    }
  }
  return piece;
}

/// What a file of this size may claim: as many numbers as it has bytes, eight times over for those that pack well, and
/// as many as a network of a million links has.
std::uint64_t most_numbers(std::size_t n_bytes) { return (std::uint64_t{1} << 23) + 8 * std::uint64_t{n_bytes}; }

void require_plausible_counts(const std::vector<VtuFile::Piece>& pieces, std::size_t n_bytes, const std::string& name) {
  std::uint64_t left = most_numbers(n_bytes);
  for (const VtuFile::Piece& piece : pieces) {
    // three coordinates and a label a point; two ends, an offset, a type and four numbers a cell
    const bool fits = piece.n_points <= left / 4 && piece.n_cells <= (left - 4 * piece.n_points) / 8;
    if (!fits) {
      throw InputError(name, "as many points and cells as the file can hold",
                       std::to_string(piece.n_points) + " points and " + std::to_string(piece.n_cells) + " cells in " +
                           std::to_string(n_bytes) + " bytes",
                       kDamaged);
    }
    left -= 4 * piece.n_points + 8 * piece.n_cells;
  }
}

void require_points(const std::vector<double>& points, std::uint64_t n, const std::string& name) {
  for (const double point : points)
    if (!(point >= 0 && point < static_cast<double>(n)) || point != std::floor(point))
      throw InputError(name + ": array 'connectivity'", "a point below " + std::to_string(n), shortest(point),
                       kDamaged);
}

}  // namespace

VtuFile::VtuFile(std::string text, std::string name, VtuKind kind) : text_(std::move(text)), name_(std::move(name)) {
  if (text_.find(kEnd) == text_.npos)
    throw InputError(name_, "a VTK XML file that ends with " + std::string(kEnd), "an early end or another format");
  // appended data need not be XML
  const std::size_t tag = text_.find("<AppendedData"), tag_end = tag == text_.npos ? tag : text_.find('>', tag);
  const std::string head =
      tag_end == text_.npos ? text_ : text_.substr(0, tag_end + 1) + "</AppendedData>" + std::string(kEnd);
  pugi::xml_document xml;
  if (const pugi::xml_parse_result parsed = xml.load_buffer(head.data(), head.size()); !parsed) {
    const auto line = 1 + std::count(head.begin(), head.begin() + parsed.offset, '\n');
    throw InputError(name_ + ":" + std::to_string(line), words_of(kind), parsed.description(), kDamaged);
  }
  const pugi::xml_node file = xml.child("VTKFile");
  const auto word = [&](const char* attribute) { return std::string(file.attribute(attribute).value()); };
  if (word("type") != type_of(kind)) throw InputError(name_, words_of(kind), "type '" + word("type") + "'");
  for (const pugi::xml_node& piece : file.child(type_of(kind)).children("Piece"))
    pieces_.push_back(piece_of(piece, kind, name_));
  if (pieces_.empty()) throw InputError(name_, words_of(kind), "no points");
  require_plausible_counts(pieces_, text_.size(), name_);
  encoding_ = {.is_big_endian = word("byte_order") == "BigEndian",
               .header_bytes = word("header_type") == "UInt64" ? 8 : 4,
               .compressor = word("compressor")};
  if (tag == text_.npos) return;
  const std::size_t begin = text_.find('_', tag_end), end = text_.rfind(kEnd);
  if (begin == text_.npos || end < begin || text_.find_first_not_of(" \t\r\n", end + kEnd.size()) != text_.npos)
    throw InputError(name_, "appended data after a '_', and " + std::string(kEnd) + " at the end", "none", kDamaged);
  appended_ = std::string_view(text_).substr(begin + 1, end - begin - 1);
  const std::string encoding = file.child("AppendedData").attribute("encoding").value();
  appended_storage_ = encoding == "base64" ? VtuStorage::base64 : VtuStorage::raw;
}

const VtuFile::Array* VtuFile::find(const Piece& piece, VtuSection section, const std::string& array) const {
  for (const Array& a : piece.arrays) {
    // the coordinates are the only array of points, whatever it is called
    if (a.section == section && (a.name == array || section == VtuSection::points)) return &a;
  }
  return nullptr;
}

bool VtuFile::has(VtuSection section, const std::string& array) const {
  return std::ranges::all_of(pieces_, [&](const Piece& piece) { return find(piece, section, array) != nullptr; });
}

std::vector<double> VtuFile::numbers(const Piece& piece, VtuSection section, const std::string& array,
                                     std::uint64_t n_components, std::uint64_t n_tuples) const {
  const Array* a = find(piece, section, array);
  if (a == nullptr) throw InputError(name_, name_of(section) + " '" + array + "'", "none of that name");
  const std::string where = name_ + ": array '" + array + "'";
  if (n_components != count_of(a->n_components.empty() ? "1" : a->n_components))
    throw InputError(where, std::to_string(n_components) + " components", a->n_components);
  VtuData data{.bytes = a->text,
               .storage = a->format == "binary" ? VtuStorage::base64 : VtuStorage::ascii,
               .type = a->type,
               .n_values = n_components * n_tuples};
  if (a->format == "appended") {
    const auto offset = count_of(a->offset);
    if (!offset || *offset > appended_.size())
      throw InputError(where, "an offset within the appended data", "'" + a->offset + "'", kDamaged);
    data.bytes = appended_.substr(*offset);
    data.storage = appended_storage_;
  } else if (a->format != "binary" && a->format != "ascii") {
    throw InputError(where, "the format ascii, binary or appended", "'" + a->format + "'", kDamaged);
  }
  try {
    auto decoded = decode_vtu(data, encoding_, where);
    const auto is_finite = [](double value) { return std::isfinite(value); };
    if (!std::ranges::all_of(decoded, is_finite)) throw InputError(where, "finite numbers", "NaN or infinity");
    return decoded;
  } catch (const InvalidData& error) {
    throw InputError(error.element, error.expected, error.found, kDamaged);
  }
}

std::vector<double> VtuFile::scalars(VtuSection section, const std::string& array) const {
  std::vector<double> all;
  for (const Piece& piece : pieces_) {
    const bool is_of_points = section == VtuSection::point_data;
    const auto part = numbers(piece, section, array, 1, is_of_points ? piece.n_points : piece.n_cells);
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

std::vector<double> VtuFile::coordinates() const {
  std::vector<double> all;
  for (const Piece& piece : pieces_) {
    const auto part = numbers(piece, VtuSection::points, "Points", 3, piece.n_points);
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

std::vector<double> VtuFile::line_ends() const {
  constexpr double kLine = 3;  // VTK_LINE
  std::vector<double> all;
  double n_points_before = 0, n_cells_before = 0;
  for (const Piece& piece : pieces_) {
    const auto types = numbers(piece, VtuSection::cells, "types", 1, piece.n_cells);
    const auto offsets = numbers(piece, VtuSection::cells, "offsets", 1, piece.n_cells);
    for (std::size_t k = 0; k < types.size(); ++k) {
      if (types[k] == kLine && offsets[k] == 2.0 * static_cast<double>(k + 1)) continue;
      throw InputError(name_ + ": cell " + std::to_string(static_cast<std::size_t>(n_cells_before) + k),
                       "a line of two points", "cell type " + shortest(types[k]));
    }
    const auto ends = numbers(piece, VtuSection::cells, "connectivity", 1, 2 * piece.n_cells);
    require_points(ends, piece.n_points, name_);
    for (const double end : ends) all.push_back(end + n_points_before);
    n_points_before += static_cast<double>(piece.n_points);
    n_cells_before += static_cast<double>(piece.n_cells);
  }
  return all;
}

void VtuFile::add_polygons(const Piece& piece, int n_points_before, std::vector<std::vector<int>>& all) const {
  if (piece.n_strips > 0) throw InputError(name_, "polygons", "strips of triangles: save the surface as triangles");
  if (piece.n_polygons == 0) return;
  const auto ends = numbers(piece, VtuSection::polygons, "offsets", 1, piece.n_polygons);
  double begin = 0;
  for (const double end : ends) {
    // so much a file may claim; beyond it no offset is a whole number for sure
    const bool is_one = end >= begin + 3 && end <= static_cast<double>(most_numbers(text_.size()));
    if (!is_one || end != std::floor(end))
      throw InputError(name_ + ": array 'offsets'", "three or more corners of each polygon", shortest(end), kDamaged);
    begin = end;
  }
  const auto corners = numbers(piece, VtuSection::polygons, "connectivity", 1, static_cast<std::uint64_t>(ends.back()));
  require_points(corners, piece.n_points, name_);
  auto corner = corners.begin();
  for (const double end : ends) {
    auto& polygon = all.emplace_back();
    for (; corner < corners.begin() + static_cast<std::ptrdiff_t>(end); ++corner)
      polygon.push_back(n_points_before + static_cast<int>(*corner));
  }
}

std::vector<std::vector<int>> VtuFile::polygons() const {
  std::vector<std::vector<int>> all;
  std::uint64_t n_points = 0;
  for (const Piece& piece : pieces_) {
    if (n_points + piece.n_points > std::uint64_t{std::numeric_limits<int>::max()})
      throw InputError(name_, "fewer than two billion points", "more");
    add_polygons(piece, static_cast<int>(n_points), all);
    n_points += piece.n_points;
  }
  if (all.empty()) throw InputError(name_, "polygons", "none");
  return all;
}

}  // namespace mbtfm::files
