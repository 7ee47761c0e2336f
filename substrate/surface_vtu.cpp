#include "substrate/surface_vtu.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "pipeline/contract/csv.h"
#include "substrate/scene.h"

namespace mbtfm::substrate {

namespace {

constexpr int kLinesInside = 160;  // over the longer side of the scene: half a micrometre for a cell of 80
constexpr int kLinesOutside = 12;  // on either side, growing
constexpr double kGrowth = 1.25;   // of a step over the one before: 12 steps reach 68 inner ones

std::vector<double> graded_lines(double low, double high, double step) {
  std::vector<double> before;
  double reach = 0;
  double size = step;
  for (int k = 0; k < kLinesOutside; ++k) before.push_back(reach += size *= kGrowth);
  std::vector<double> lines;
  for (auto d = before.rbegin(); d != before.rend(); ++d) lines.push_back(low - *d);
  const int n = std::max(1, static_cast<int>(std::ceil((high - low) / step)));
  for (int k = 0; k <= n; ++k) lines.push_back(low + (high - low) * k / n);
  for (const double d : before) lines.push_back(high + d);
  return lines;
}

bool is_inside(const Ellipse& e, Vec2 point) {
  const Vec2 along = {std::cos(e.angle_rad), std::sin(e.angle_rad)};
  const Vec2 offset = point - e.centre_um;
  return std::hypot(dot(offset, along) / e.semi_major_um, cross(along, offset) / e.semi_minor_um) <= 1;
}

Vec2 traction_kPa(const std::vector<Ellipse>& ellipses, const std::vector<Vec2>& forces_nN, Vec2 point) {
  Vec2 sum;
  for (std::size_t j = 0; j < ellipses.size(); ++j) {
    if (!is_inside(ellipses[j], point)) continue;
    sum += 1 / (std::numbers::pi * ellipses[j].semi_major_um * ellipses[j].semi_minor_um) * forces_nN[j];
  }
  return sum;
}

/// A data array of XML, written as it grows.
class Text {
 public:
  void line(std::string_view text) { (text_ += text) += '\n'; }
  void numbers(std::initializer_list<double> values) {
    for (const double value : values) number(value);
    text_ += '\n';
  }
  const std::string& text() const { return text_; }

 private:
  void number(double value) {
    char buffer[32];
    const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
    text_.append(buffer, end) += ' ';
  }
  std::string text_;
};

}  // namespace

void write_substrate_vtu(const std::filesystem::path& file, const Substrate& substrate,
                         const std::vector<Ellipse>& ellipses, const std::vector<Vec2>& forces_nN) {
  const Extent scene = extent_of({}, ellipses);
  const Vec2 size = scene.high_um - scene.low_um;
  const double step = std::max(size.x, size.y) / kLinesInside;
  const std::vector<double> x = graded_lines(scene.low_um.x, scene.high_um.x, step);
  const std::vector<double> y = graded_lines(scene.low_um.y, scene.high_um.y, step);
  std::vector<Vec2> points;
  for (const double y_um : y) {
    for (const double x_um : x) points.push_back({x_um, y_um});
  }
  const std::vector<Vec2> displacements = substrate.displacements_um(points, ellipses, forces_nN);

  const std::size_t columns = x.size() - 1;
  const std::size_t n_cells = columns * (y.size() - 1);
  Text out;
  out.line(R"(<?xml version="1.0"?>)");
  out.line(R"(<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian">)");
  out.line("<UnstructuredGrid>");
  out.line("<Piece NumberOfPoints=\"" + std::to_string(points.size()) + "\" NumberOfCells=\"" +
           std::to_string(n_cells) + "\">");
  out.line(R"(<PointData Vectors="displacement_um">)");
  out.line(R"(<DataArray type="Float64" Name="displacement_um" NumberOfComponents="3" format="ascii">)");
  for (const Vec2 u : displacements) out.numbers({u.x, u.y, 0});
  out.line("</DataArray></PointData>");
  out.line(R"(<CellData><DataArray type="Float64" Name="traction_kPa" NumberOfComponents="3" format="ascii">)");
  for (std::size_t cell = 0; cell < n_cells; ++cell) {
    const std::size_t i = cell % columns, j = cell / columns;
    const Vec2 t = traction_kPa(ellipses, forces_nN, {0.5 * (x[i] + x[i + 1]), 0.5 * (y[j] + y[j + 1])});
    out.numbers({t.x, t.y, 0});
  }
  out.line("</DataArray></CellData>");
  out.line(R"(<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">)");
  for (const Vec2 p : points) out.numbers({p.x, p.y, 0});
  out.line("</DataArray></Points>");
  out.line(R"(<Cells><DataArray type="Int64" Name="connectivity" format="ascii">)");
  for (std::size_t cell = 0; cell < n_cells; ++cell) {
    const std::size_t first = cell / columns * x.size() + cell % columns;
    const std::size_t next = first + x.size();
    out.line(std::to_string(first) + ' ' + std::to_string(first + 1) + ' ' + std::to_string(next + 1) + ' ' +
             std::to_string(next));
  }
  out.line(R"(</DataArray><DataArray type="Int64" Name="offsets" format="ascii">)");
  for (std::size_t cell = 1; cell <= n_cells; ++cell) out.line(std::to_string(4 * cell));
  out.line(R"(</DataArray><DataArray type="UInt8" Name="types" format="ascii">)");
  for (std::size_t cell = 0; cell < n_cells; ++cell) out.line("9");
  out.line("</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>");
  write_text(file, out.text());
}

}  // namespace mbtfm::substrate
