#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkCommand.h>
#include <vtkDoubleArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/text.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/files/vtu_file.h"

namespace mbtfm::files {

namespace {

/// VTK prints its errors and goes on: this takes the place of its output window while it lives and keeps what it says.
class VtkErrors {
 public:
  VtkErrors() : before_(vtkOutputWindow::GetInstance()) { vtkOutputWindow::SetInstance(window_); }
  ~VtkErrors() { vtkOutputWindow::SetInstance(before_); }
  VtkErrors(const VtkErrors&) = delete;
  VtkErrors& operator=(const VtkErrors&) = delete;
  std::string text() const { return window_->text; }

 private:
  class Window : public vtkOutputWindow {
   public:
    static Window* New();
    vtkTypeMacro(Window, vtkOutputWindow);
    void DisplayText(const char* message) override { text += message; }
    void DisplayWarningText(const char*) override {}
    std::string text = {};
  };
  vtkNew<Window> window_;
  vtkSmartPointer<vtkOutputWindow> before_;
};

VtkErrors::Window* VtkErrors::Window::New() { VTK_STANDARD_NEW_BODY(VtkErrors::Window); }

template <class Writer, class Data>
void write_xml(const Path& file, Data* data) {
  vtkNew<Writer> writer;
  const VtkErrors errors;
  writer->SetInputData(data);
  writer->SetWriteToOutputString(true);
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  writer->SetCompressorTypeToZLib();
  if (writer->Write() != 1) throw OutputError("cannot write " + file.string() + ": " + errors.text());
  write_text(file, writer->GetOutputString());
}

std::vector<Vec3> in_space(const std::vector<Vec2>& positions_um) {
  std::vector<Vec3> points;
  for (const Vec2 p : positions_um) points.push_back({p.x, p.y, 0});
  return points;
}

vtkNew<vtkPoints> points_of(const std::vector<Vec3>& positions_um) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Vec3& p : positions_um) points->InsertNextPoint(p.x, p.y, p.z);
  return points;
}

template <class Things, class Value = std::identity>
vtkNew<vtkIntArray> int_array(const char* name, const Things& things, Value value = {}) {
  vtkNew<vtkIntArray> array;
  array->SetName(name);
  for (const auto& thing : things) array->InsertNextValue(static_cast<int>(std::invoke(value, thing)));
  return array;
}

vtkNew<vtkDoubleArray> double_array(const NamedArray& values) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(values.name.c_str());
  array->SetNumberOfComponents(values.components);
  array->SetNumberOfTuples(static_cast<vtkIdType>(values.values.size()) / values.components);
  for (std::size_t k = 0; k < values.values.size(); ++k) array->SetValue(static_cast<vtkIdType>(k), values.values[k]);
  return array;
}

/// @param n  points or cells that the data has
void add(const std::vector<NamedArray>& arrays, std::size_t n, vtkFieldData* data) {
  for (const NamedArray& array : arrays) {
    MBTFM_ASSERT(array.values.size() == n * static_cast<std::size_t>(array.components));
    data->AddArray(double_array(array));
  }
}

constexpr int kEllipseCorners = 32;  // enough to look smooth

/// Points and cells of a vtkPolyData in the making. VTK numbers the cells: vertices, lines, polygons.
class Shapes {
 public:
  void add_line(const Polyline& line) { add(line, lines_); }
  void add_polygon(const Polygon& polygon) { add(polygon, polygons_); }
  vtkNew<vtkPolyData> data() const {
    vtkNew<vtkPolyData> poly;
    const vtkNew<vtkPoints> points = points_of(points_um_);
    poly->SetPoints(points);
    poly->SetLines(lines_);
    poly->SetPolys(polygons_);
    return poly;
  }

 private:
  void add(const std::vector<Vec2>& corners, vtkCellArray* cells) {
    cells->InsertNextCell(static_cast<int>(corners.size()));
    for (const Vec2 p : corners) {
      cells->InsertCellPoint(static_cast<vtkIdType>(points_um_.size()));
      points_um_.push_back({p.x, p.y, 0});
    }
  }
  std::vector<Vec3> points_um_;
  vtkNew<vtkCellArray> lines_, polygons_;
};

vtkNew<vtkUnstructuredGrid> grid_of(const Network& network, const std::vector<Vec2>& positions_um) {
  vtkNew<vtkUnstructuredGrid> grid;
  const vtkNew<vtkPoints> points = points_of(in_space(positions_um));
  grid->SetPoints(points);
  grid->GetPointData()->AddArray(int_array("adhesion_id", network.adhesion_id));
  if (!network.held_by_cut.empty()) grid->GetPointData()->AddArray(int_array("held_by_cut", network.held_by_cut));
  grid->Allocate(static_cast<vtkIdType>(network.links.size()));
  for (const Link& link : network.links) {
    const vtkIdType ends[2] = {link.vertex_a, link.vertex_b};
    grid->InsertNextCell(VTK_LINE, 2, ends);
  }
  grid->GetCellData()->AddArray(int_array("fibre_id", network.links, &Link::fibre_id));
  add({array_of("rest_length_um", network.links, &Link::rest_length_um),
       array_of("share", network.links, &Link::share)},
      network.links.size(), grid->GetCellData());
  return grid;
}

/// An id or the number of a vertex. @throws InputError
int whole_number(double value, const std::string& where) {
  constexpr double kLargest = std::numeric_limits<int>::max();
  if (value == std::floor(value) && std::abs(value) <= kLargest) return static_cast<int>(value);
  throw InputError(where, "whole numbers", shortest(value));
}

std::vector<int> whole_numbers(const VtuFile& vtu, VtuSection section, const std::string& array, const Path& file) {
  std::vector<int> numbers;
  for (const double value : vtu.scalars(section, array))
    numbers.push_back(whole_number(value, file.string() + ": array '" + array + "'"));
  return numbers;
}

Network network_of(const VtuFile& vtu, const Path& file) {
  Network network;
  const std::vector<double> xyz_um = vtu.coordinates(), ends = vtu.line_ends();
  for (std::size_t at = 0; at < xyz_um.size(); at += 3) network.vertices_um.push_back({xyz_um[at], xyz_um[at + 1]});
  network.adhesion_id = whole_numbers(vtu, VtuSection::point_data, "adhesion_id", file);
  if (vtu.has(VtuSection::point_data, "held_by_cut"))
    for (const int is_held : whole_numbers(vtu, VtuSection::point_data, "held_by_cut", file))
      network.held_by_cut.push_back(is_held != 0);
  const std::vector<int> fibre_id = whole_numbers(vtu, VtuSection::cell_data, "fibre_id", file);
  const std::vector<double> rest_um = vtu.scalars(VtuSection::cell_data, "rest_length_um");
  std::vector<double> share(fibre_id.size(), 1.0);
  if (vtu.has(VtuSection::cell_data, "share")) share = vtu.scalars(VtuSection::cell_data, "share");
  for (std::size_t k = 0; k < fibre_id.size(); ++k) {
    const std::string where = file.string() + ": cell " + std::to_string(k);
    network.links.push_back({.vertex_a = whole_number(ends[2 * k], where),
                             .vertex_b = whole_number(ends[2 * k + 1], where),
                             .fibre_id = fibre_id[k],
                             .rest_length_um = rest_um[k],
                             .share = share[k]});
  }
  try {
    check(network);
  } catch (const InvalidData& error) {
    throw InputError(file.string() + ": " + error.element, error.expected, error.found);
  }
  return network;
}

}  // namespace

Network read_network(const Path& file) { return network_of(VtuFile(read_text(file), file.string()), file); }

void write_network(const Path& file, const Network& network) {
  check(network);
  const auto grid = grid_of(network, network.vertices_um);
  write_xml<vtkXMLUnstructuredGridWriter>(file, grid.Get());
}

HeightMap read_surface(const Path& file) {
  const VtuFile vtp(read_text(file), file.string(), VtuKind::poly_data);
  const std::vector<double> xyz_um = vtp.coordinates();
  const auto n = static_cast<int>(xyz_um.size() / 3);
  const auto x = [&](int k) { return xyz_um[3 * static_cast<std::size_t>(k)]; };
  const auto y = [&](int k) { return xyz_um[3 * static_cast<std::size_t>(k) + 1]; };
  HeightMap map;
  while (map.n_x < n && y(map.n_x) == y(0)) ++map.n_x;
  map.n_y = map.n_x > 0 ? n / map.n_x : 0;
  const std::string where = file.string() + ": array 'Points'";
  constexpr const char* kHint = "make the file with mbtfm-surface, which reads meshes and tables of points, too";
  if (n == 0 || map.n_x * map.n_y != n || map.n_x < 2 || map.n_y < 2)
    throw InputError(where, "the points of a lattice, x running fastest", std::to_string(n) + " others", kHint);
  map.origin_um = {x(0), y(0)};
  map.spacing_um = {(x(n - 1) - x(0)) / (map.n_x - 1), (y(n - 1) - y(0)) / (map.n_y - 1)};
  for (int k = 0; k < n; ++k) {
    const Vec2 due = map.vertex_um(static_cast<std::size_t>(k));
    constexpr double kRounding = 1e-5;  // of a spacing: single precision of a lattice of a hundred
    if (std::abs(x(k) - due.x) > kRounding * std::abs(map.spacing_um.x) * map.n_x ||
        std::abs(y(k) - due.y) > kRounding * std::abs(map.spacing_um.y) * map.n_y) {
      throw InputError(where + ", point " + std::to_string(k),
                       "x, y = " + brief(due.x) + ", " + brief(due.y) + " um, of an even lattice",
                       brief(x(k)) + ", " + brief(y(k)), kHint);
    }
    map.z_um.push_back(xyz_um[3 * static_cast<std::size_t>(k) + 2]);
  }
  if (vtp.has(VtuSection::point_data, "height_sigma_um"))
    map.sigma_um = vtp.scalars(VtuSection::point_data, "height_sigma_um");
  try {
    check(map);
  } catch (const InvalidData& error) {
    throw InputError(file.string() + ": " + error.element, error.expected, error.found, kHint);
  }
  return map;
}

void write_surface(const Path& file, const HeightMap& map) {
  check(map);
  Grid grid{.points_um = {}, .point_arrays = {}, .cell_arrays = {}};
  for (std::size_t k = 0; k < map.z_um.size(); ++k) {
    const Vec2 at = map.vertex_um(k);
    grid.points_um.push_back({at.x, at.y, map.z_um[k]});
  }
  for (int j = 0; j + 1 < map.n_y; ++j) {
    for (int i = 0; i + 1 < map.n_x; ++i) {
      const int first = i + map.n_x * j, next = first + map.n_x;
      grid.cells.insert(grid.cells.end(), {first, first + 1, next + 1, next});
    }
  }
  if (!map.sigma_um.empty()) grid.point_arrays = {array_of("height_sigma_um", map.sigma_um)};
  write_quads_vtp(file, grid);
}

ContractedNetwork read_contracted_network(const Path& file) {
  const VtuFile vtu(read_text(file), file.string());
  return {.network = network_of(vtu, file), .link_force_nN = vtu.scalars(VtuSection::cell_data, "force_nN")};
}

void write_contracted_network(const Path& file, const Network& network, const std::vector<Vec2>& positions_um,
                              const std::vector<double>& link_force_nN, const std::vector<CableState>& link_states) {
  check(network);
  MBTFM_ASSERT(positions_um.size() == network.vertices_um.size() && link_force_nN.size() == network.links.size() &&
               link_states.size() == network.links.size());
  const auto grid = grid_of(network, positions_um);
  grid->GetCellData()->AddArray(double_array(array_of("force_nN", link_force_nN)));
  grid->GetCellData()->AddArray(int_array("state", link_states));  // 0 slack, 1 taut, 2 collapsed
  std::vector<Vec2> moves_um;
  for (std::size_t v = 0; v < positions_um.size(); ++v) moves_um.push_back(positions_um[v] - network.vertices_um[v]);
  grid->GetPointData()->AddArray(double_array(array_of("contraction_um", moves_um)));
  write_xml<vtkXMLUnstructuredGridWriter>(file, grid.Get());
}

void write_cell_vtp(const Path& file, const Cell& cell) {
  check(cell);
  Shapes shapes;
  struct Label {
    int fibre_id = 0;
    int fibre_type = 0;  // from 1, as kFibreTypes; 0: no fibre
    int adhesion_id = 0;
    int adhesion_origin = 0;  // 1 image, 2 drawn, 3 anchor, 4 candidate, 5 beads; 0: none
  };
  std::vector<Label> labels;
  std::vector<Polygon> rings = cell.holes_um;
  rings.insert(rings.begin(), cell.outline_um);
  for (Polyline& ring : rings) {
    ring.push_back(ring.front());
    shapes.add_line(ring);
    labels.push_back({});
  }
  for (const Fibre& f : cell.fibres) {
    shapes.add_line(f.points_um);
    labels.push_back({.fibre_id = f.fibre_id, .fibre_type = 1 + static_cast<int>(f.type)});
  }
  for (const Adhesion& a : cell.adhesions) {
    shapes.add_polygon(ellipse_corners(a, kEllipseCorners));
    labels.push_back({.adhesion_id = a.adhesion_id, .adhesion_origin = 1 + static_cast<int>(a.origin)});
  }
  const auto poly = shapes.data();
  poly->GetCellData()->AddArray(int_array("fibre_id", labels, &Label::fibre_id));
  poly->GetCellData()->AddArray(int_array("fibre_type", labels, &Label::fibre_type));
  poly->GetCellData()->AddArray(int_array("adhesion_id", labels, &Label::adhesion_id));
  poly->GetCellData()->AddArray(int_array("adhesion_origin", labels, &Label::adhesion_origin));
  write_xml<vtkXMLPolyDataWriter>(file, poly.Get());
}

void write_points_vtp(const Path& file, const std::vector<Vec2>& points_um, const std::vector<NamedArray>& arrays) {
  write_points_vtp(file, in_space(points_um), arrays);
}

void write_points_vtp(const Path& file, const std::vector<Vec3>& points_um, const std::vector<NamedArray>& arrays) {
  vtkNew<vtkPolyData> poly;
  const vtkNew<vtkPoints> points = points_of(points_um);
  poly->SetPoints(points);
  vtkNew<vtkCellArray> vertices;
  for (vtkIdType i = 0; i < points->GetNumberOfPoints(); ++i) vertices->InsertNextCell(1, &i);
  poly->SetVerts(vertices);
  add(arrays, points_um.size(), poly->GetPointData());
  write_xml<vtkXMLPolyDataWriter>(file, poly.Get());
}

void write_ellipses_vtp(const Path& file, const std::vector<Adhesion>& adhesions,
                        const std::vector<NamedArray>& arrays) {
  check(adhesions);
  Shapes shapes;
  for (const Adhesion& a : adhesions) shapes.add_polygon(ellipse_corners(a, kEllipseCorners));
  const auto poly = shapes.data();
  poly->GetCellData()->AddArray(int_array("adhesion_id", adhesions, &Adhesion::adhesion_id));
  add(arrays, adhesions.size(), poly->GetCellData());
  write_xml<vtkXMLPolyDataWriter>(file, poly.Get());
}

void write_quads_vtp(const Path& file, const Grid& grid) {
  MBTFM_ASSERT(grid.corners == 4);
  vtkNew<vtkCellArray> quads;
  for (std::size_t first = 0; first < grid.cells.size(); first += 4) {
    vtkIdType corners[4];
    std::copy_n(grid.cells.begin() + static_cast<std::ptrdiff_t>(first), 4, corners);
    quads->InsertNextCell(4, corners);
  }
  vtkNew<vtkPolyData> poly;
  poly->SetPoints(points_of(grid.points_um));
  poly->SetPolys(quads);
  add(grid.point_arrays, grid.points_um.size(), poly->GetPointData());
  add(grid.cell_arrays, grid.cells.size() / grid.corners, poly->GetCellData());
  write_xml<vtkXMLPolyDataWriter>(file, poly.Get());
}

void write_grid_vtu(const Path& file, const Grid& grid) {
  vtkNew<vtkUnstructuredGrid> data;
  data->SetPoints(points_of(grid.points_um));
  const int type = grid.corners == 4 ? VTK_QUAD : grid.corners == 6 ? VTK_QUADRATIC_TRIANGLE : VTK_HEXAHEDRON;
  data->Allocate(static_cast<vtkIdType>(grid.cells.size()) / grid.corners);
  for (std::size_t first = 0; first < grid.cells.size(); first += grid.corners) {
    vtkIdType corners[8];
    std::copy_n(grid.cells.begin() + static_cast<std::ptrdiff_t>(first), grid.corners, corners);
    data->InsertNextCell(type, grid.corners, corners);
  }
  add(grid.point_arrays, grid.points_um.size(), data->GetPointData());
  add(grid.cell_arrays, grid.cells.size() / grid.corners, data->GetCellData());
  write_xml<vtkXMLUnstructuredGridWriter>(file, data.Get());
}

}  // namespace mbtfm::files
