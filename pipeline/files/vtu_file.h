/// An unstructured grid (.vtu) or polygons (.vtp) in a VTK XML file, with doubt. VTK's own reader believes the counts,
/// sizes and offsets in a file: a damaged one makes it divide by zero, read beyond its buffers or take gigabytes. This
/// one reads what VTK, ParaView, meshio and their kin write (as text, base64 or raw bytes, plain, ZLib or LZ4, either
/// byte order, in pieces), and refuses the rest. Inside of this folder only.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/files/vtu_data.h"

namespace mbtfm::files {

enum class VtuKind { unstructured_grid, poly_data };
enum class VtuSection { point_data, cell_data, points, cells, polygons };

class VtuFile {
 public:
  /// @param name  of the file, for messages
  /// @throws InputError where it is no such file, ends early, or claims more numbers than it can hold
  VtuFile(std::string text, std::string name, VtuKind kind = VtuKind::unstructured_grid);
  VtuFile(const VtuFile&) = delete;

  bool has(VtuSection section, const std::string& array) const;
  /// One number for each point or cell. @throws InputError where there is no such array, or a damaged one
  std::vector<double> scalars(VtuSection section, const std::string& array) const;
  /// x, y, z of each point. @throws InputError
  std::vector<double> coordinates() const;
  /// Both ends of each cell. @throws InputError where a cell is no line of two points
  std::vector<double> line_ends() const;
  /// The points of the corners of each polygon of poly_data. @throws InputError where there are none, one has fewer
  /// than three corners, or strips of triangles are beside them
  std::vector<std::vector<int>> polygons() const;

  struct Array {
    VtuSection section;
    std::string name, type, format, offset, n_components, text = {};
  };
  struct Piece {
    std::uint64_t n_points = 0, n_cells = 0;     ///< all cells
    std::uint64_t n_polygons = 0, n_strips = 0;  ///< of these
    std::vector<Array> arrays;
  };

 private:
  const Array* find(const Piece& piece, VtuSection section, const std::string& array) const;
  std::vector<double> numbers(const Piece& piece, VtuSection section, const std::string& array,
                              std::uint64_t n_components, std::uint64_t n_tuples) const;
  void add_polygons(const Piece& piece, int n_points_before, std::vector<std::vector<int>>& all) const;

  std::string text_, name_;
  VtuEncoding encoding_;
  std::string_view appended_;  ///< of text_, behind the underscore
  VtuStorage appended_storage_ = VtuStorage::raw;
  std::vector<Piece> pieces_;
};

}  // namespace mbtfm::files
