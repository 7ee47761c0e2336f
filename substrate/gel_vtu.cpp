#include "substrate/gel_vtu.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/files/vtk_files.h"
#include "pipeline/numerics/memory.h"
#include "substrate/response.h"

namespace mbtfm::substrate {

namespace {

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

/// By square between the lines, x first: the tractions of the ellipses that its middle lies in.
std::vector<Vec2> tractions_kPa(const std::vector<Ellipse>& ellipses, const std::vector<Vec2>& forces_nN,
                                const std::vector<double>& x, const std::vector<double>& y) {
  const std::size_t columns = x.size() - 1;
  std::vector<Vec2> tractions(columns * (y.size() - 1));
  const auto square_of = [](const std::vector<double>& lines, double at) {
    const auto after = std::upper_bound(lines.begin(), lines.end(), at) - lines.begin();
    return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after - 1, 0, std::ssize(lines) - 2));
  };
  for (std::size_t k = 0; k < ellipses.size(); ++k) {
    const Ellipse& e = ellipses[k];
    const Vec2 traction = 1 / (std::numbers::pi * e.semi_major_um * e.semi_minor_um) * forces_nN[k];
    const double reach = e.semi_major_um;
    for (std::size_t j = square_of(y, e.centre_um.y - reach); j <= square_of(y, e.centre_um.y + reach); ++j) {
      for (std::size_t i = square_of(x, e.centre_um.x - reach); i <= square_of(x, e.centre_um.x + reach); ++i) {
        if (is_inside(e, {0.5 * (x[i] + x[i + 1]), 0.5 * (y[j] + y[j + 1])})) tractions[j * columns + i] += traction;
      }
    }
  }
  return tractions;
}

}  // namespace

void write_substrate_vtu(const std::filesystem::path& file, const Substrate& substrate,
                         const std::vector<Ellipse>& ellipses, const std::vector<Vec2>& forces_nN, int n_lines,
                         const std::optional<SurfaceShape>& shape) {
  const Extent scene = extent_of({}, ellipses);
  const Vec2 size = scene.high_um - scene.low_um;
  const double step = std::max(size.x, size.y) / n_lines;
  std::vector<double> x = graded_lines(scene.low_um.x, scene.high_um.x, step);
  std::vector<double> y = graded_lines(scene.low_um.y, scene.high_um.y, step);
  if (shape) {
    std::erase_if(x, [&](double at) { return at < shape->known.low_um.x || at > shape->known.high_um.x; });
    std::erase_if(y, [&](double at) { return at < shape->known.low_um.y || at > shape->known.high_um.y; });
  }
  constexpr double kBytes = 300;  // of a point: itself, what it moves by, the same for its file
  numerics::expect_room_for({.what = "the gel's surface in substrate.vtu",
                             .count = static_cast<double>(x.size()) * static_cast<double>(y.size()),
                             .parts = "points",
                             .bytes_each = kBytes,
                             .remedy = "choose fewer surface_lines"});
  std::vector<Vec2> points;
  for (const double y_um : y) {
    for (const double x_um : x) points.push_back({x_um, y_um});
  }
  const std::vector<Vec2> displacements = substrate.displacements_um(points, ellipses, forces_nN);

  const std::vector<double> vertical = substrate.has_vertical() ? substrate.vertical_um(points, ellipses, forces_nN)
                                                                : std::vector<double>(points.size());

  files::Grid grid;
  std::vector<Vec3> displacements_um;
  for (std::size_t i = 0; i < points.size(); ++i) {
    grid.points_um.push_back({points[i].x, points[i].y, shape ? shape->height_um(points[i]) : 0});
    displacements_um.push_back({displacements[i].x, displacements[i].y, vertical[i]});
  }
  const int columns = static_cast<int>(x.size()) - 1;
  const std::vector<Vec2> tractions = tractions_kPa(ellipses, forces_nN, x, y);
  for (int cell = 0; cell < static_cast<int>(tractions.size()); ++cell) {
    const int i = cell % columns, j = cell / columns;
    const int first = j * (columns + 1) + i, next = first + columns + 1;
    for (const int corner : {first, first + 1, next + 1, next}) grid.cells.push_back(corner);
  }
  grid.point_arrays = {files::array_of("displacement_um", displacements_um)};
  grid.cell_arrays = {files::array_of("traction_kPa", tractions)};
  files::write_grid_vtu(file, grid);
}

void write_traction_vtu(const std::filesystem::path& file, const Substrate& substrate, const SurfaceMesh& mesh,
                        const VectorXd& traction_kPa, const SurfaceShape& shape) {
  const VectorXd u = substrate.response({mesh, 3}, {mesh.points_um, Components::all})->displace(traction_kPa).col(0);
  files::Grid grid;
  for (const Vec2 p : mesh.points_um) grid.points_um.push_back({p.x, p.y, shape.height_um(p)});
  for (const auto& face : mesh.faces) grid.cells.insert(grid.cells.end(), face.begin(), face.end());
  grid.point_arrays = {{"displacement_um", 3, {u.begin(), u.end()}},
                       {"traction_kPa", 3, {traction_kPa.begin(), traction_kPa.end()}}};
  files::write_grid_vtu(file, grid);
}

void write_volume_vtu(const std::filesystem::path& file, const VolumeField& field) {
  files::Grid grid;
  grid.corners = 8;
  for (const auto& p : field.points_um) grid.points_um.push_back({p[0], p[1], p[2]});
  grid.cells = field.box_corners;
  grid.point_arrays = {files::array_of("displacement_um", field.displacement_um)};
  if (!field.stress_kPa.empty()) grid.cell_arrays = {files::array_of("stress_kPa", field.stress_kPa)};
  files::write_grid_vtu(file, grid);
}

}  // namespace mbtfm::substrate
