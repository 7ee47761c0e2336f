#include "substrate/given_load.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/text.h"
#include "substrate/response.h"

namespace mbtfm::substrate {

Load read_forces(const Path& adhesions_file, const Path& file) {
  std::map<int, Ellipse> ellipse_of_id;
  for (const Adhesion& adhesion : files::read_adhesions(adhesions_file)) {
    ellipse_of_id[adhesion.adhesion_id] = ellipse_of(adhesion);
  }
  Load load;
  const files::CsvTable table(file);
  if (table.has("fz_nN")) {
    for (int row = 0; row < table.n_rows(); ++row) load.into_the_gel_nN.push_back(table.number(row, "fz_nN"));
  }
  for (const AdhesionForce& force : files::read_adhesion_forces(file)) {
    const auto found = ellipse_of_id.find(force.adhesion_id);
    if (found == ellipse_of_id.end()) {
      throw InputError(file.string(), "the adhesion_id of a row of " + adhesions_file.string(),
                       "'" + std::to_string(force.adhesion_id) + "'",
                       "both files must come from the same segmentation");
    }
    load.ellipses.push_back(found->second);
    load.forces_nN.push_back(force.force_nN);
  }
  return load;
}

SurfaceLoad read_surface_tractions(const Path& file) {
  const files::CsvTable table(file);
  const std::vector<Vec2> points = files::read_points(file);
  const Vec2 spacing = files::lattice_spacing_um(points, file);
  std::map<std::array<long long, 2>, int> vertex_at;
  const auto place = [&](Vec2 p) {
    return std::array{std::llround((p.x - points[0].x) / spacing.x), std::llround((p.y - points[0].y) / spacing.y)};
  };
  SurfaceLoad load{{points, {}}, VectorXd(3 * static_cast<Index>(points.size()))};
  for (int row = 0; row < table.n_rows(); ++row) {
    const Vec2 p = points[row];
    const auto at = place(p);
    if (!vertex_at.emplace(at, row).second) table.fail(row, "x_um", "each place of the lattice once");
    const Vec2 off =
        p - points[0] - Vec2{static_cast<double>(at[0]) * spacing.x, static_cast<double>(at[1]) * spacing.y};
    if (norm(off) > 0.01 * std::min(spacing.x, spacing.y)) table.fail(row, "x_um", "a place of an even lattice");
    load.traction_kPa.segment<3>(3 * row) << table.number(row, "tx_kPa"), table.number(row, "ty_kPa"),
        table.has("tz_kPa") ? table.number(row, "tz_kPa") : 0;
  }
  for (const auto& [at, vertex] : vertex_at) {
    std::array<int, 4> face{};
    constexpr std::array<std::array<int, 2>, 4> kRound = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    bool is_whole = true;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto corner = vertex_at.find({at[0] + kRound[k][0], at[1] + kRound[k][1]});
      is_whole = is_whole && corner != vertex_at.end();
      if (is_whole) face[k] = corner->second;
    }
    if (is_whole) load.mesh.faces.push_back(face);
  }
  if (load.mesh.faces.empty())
    throw InputError(file.string(), "tractions on a lattice", "no four of them around a square");
  return load;
}

Load read_tractions(const Path& file) {
  const files::CsvTable table(file);
  const bool is_in_space = table.has("tz_kPa");
  Load load;
  int row = 0;
  for (const GroundPatch& patch : files::read_tractions(file)) {
    const double into_the_gel = is_in_space ? table.number(row, "tz_kPa") : 0;
    ++row;
    if (patch.traction_kPa == Vec2{} && into_the_gel == 0) continue;
    if (is_in_space) load.into_the_gel_nN.push_back(patch.area_um2 * into_the_gel);
    const double radius = std::sqrt(patch.area_um2 / std::numbers::pi);
    load.ellipses.push_back({patch.position_um, radius, radius, 0});
    load.forces_nN.push_back(patch.area_um2 * patch.traction_kPa);
  }
  return load;
}

VectorXd lengths_nN(const Load& load) {
  VectorXd forces_nN(2 * std::ssize(load.ellipses));
  for (std::size_t j = 0; j < load.ellipses.size(); ++j)
    forces_nN.segment<2>(2 * static_cast<Index>(j)) << norm(load.forces_nN[j]), load.into_nN(j);
  return forces_nN;
}

double largest_traction_kPa(const SurfaceLoad& load) {
  double largest = 0;
  for (Index k = 0; k < load.traction_kPa.size(); k += 3)
    largest = std::max(largest, load.traction_kPa.segment<3>(k).norm());
  return largest;
}

namespace {

struct UnitLoads {
  Loads loads;
  VectorXd amounts;  ///< nN of each ellipse, kPa at each vertex of a lattice
};
UnitLoads unit_loads(const Load& load) {
  if (load.lattice) return {{load.lattice->mesh, 3}, load.lattice->traction_kPa};
  VectorXd amounts = VectorXd::Zero(3 * static_cast<Index>(load.ellipses.size()));
  for (std::size_t j = 0; j < load.ellipses.size(); ++j) {
    amounts.segment<3>(3 * static_cast<Index>(j)) << load.forces_nN[j].x, load.forces_nN[j].y, load.into_nN(j);
  }
  return {{load.ellipses, 3}, amounts};
}

/// Without z_um those of the surface.
std::vector<Vec3> read_points_in_space(const Path& file, const std::optional<SurfaceShape>& shape) {
  const files::CsvTable table(file);
  const bool has_depth = table.has("z_um");
  std::vector<Vec3> points;
  for (const Vec2 p : files::read_points(file)) {
    const int row = static_cast<int>(points.size());
    const double of_surface = shape ? shape->height_um(p) : 0;
    points.push_back(
        {p.x, p.y, has_depth ? table.number(row, "z_um", shape ? Range::any() : Range::not_negative()) : of_surface});
  }
  return points;
}

Figures figures_of(std::size_t n_points, double largest_um) {
  return {{"n_points", static_cast<std::int64_t>(n_points)}, {"largest_displacement_um", largest_um}};
}

}  // namespace

Figures write_in_space(const Path& file, const Path& points, const Substrate& model, const Load& load,
                       const std::optional<SurfaceShape>& shape) {
  const std::vector<Vec3> points_um = read_points_in_space(points, shape);
  Observations observed{points_um, Components::all};
  // on the surface, to the last digit
  if (!files::CsvTable(points).has("z_um")) observed.points_um = files::read_points(points);
  const auto [loads, amounts] = unit_loads(load);
  const VectorXd u = model.response(loads, observed)->displace(amounts).col(0);
  std::vector<BeadInSpace> field;
  double largest_um = 0;
  for (std::size_t i = 0; i < points_um.size(); ++i) {
    const Eigen::Vector3d at_point = u.segment<3>(3 * static_cast<Index>(i));
    field.push_back({.position_um = points_um[i],
                     .displacement_um = {at_point.x(), at_point.y(), at_point.z()},
                     .sigma_um = 0,
                     .sigma_z_um = 0,
                     .flag = {}});
    largest_um = std::max(largest_um, at_point.norm());
  }
  files::write_displacement_in_space(file, field);
  return figures_of(points_um.size(), largest_um);
}

Figures write_at_points(const Path& file, const Path& points, const Substrate& model, const Load& load) {
  const std::vector<Vec2> points_um = files::read_points(points);
  const std::vector<Vec2> displacements = model.displacements_um(points_um, load.ellipses, load.forces_nN);
  double largest_um = 0;
  DisplacementField field;
  for (std::size_t i = 0; i < points_um.size(); ++i) {
    field.push_back({.position_um = points_um[i], .displacement_um = displacements[i], .sigma_um = 0, .flag = {}});
    largest_um = std::max(largest_um, norm(displacements[i]));
  }
  const Figures figures = figures_of(points_um.size(), largest_um);
  if (!model.has_vertical()) {
    files::write_displacement(file, field);
    return figures;
  }
  const std::vector<double> vertical = model.vertical_um(points_um, load.ellipses, load.forces_nN);
  files::CsvText csv({"x_um", "y_um", "ux_um", "uy_um", "sigma_um", "uz_um"});
  for (std::size_t i = 0; i < points_um.size(); ++i) {
    csv.add(points_um[i].x)
        .add(points_um[i].y)
        .add(displacements[i].x)
        .add(displacements[i].y)
        .add(0.0)
        .add(vertical[i]);
    csv.end_row();
  }
  files::write_text(file, csv.str());
  return figures;
}

}  // namespace mbtfm::substrate
