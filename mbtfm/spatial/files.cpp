#include <algorithm>
#include <cmath>

#include "mbtfm/spatial/stage.h"
#include "pipeline/files/space_files.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::spatial {
namespace {

/// As an even lattice of the smallest faces, which every reader understands.
struct Shown {
  TractionMesh lattice;
  std::vector<SurfaceTraction> rows;
};

Shown shown(const Problem& problem, const SpatialReconstruction& r) {
  const VectorXd u = problem.surface_displacement_um(r.traction_kPa);
  const std::vector<double> resolution = resolution_um(problem, r);
  const bool is_even = problem.mesh.finest_level() == 0;
  Shown all{evened(problem.mesh, problem.ground), {}};
  for (std::size_t v = 0; v < all.lattice.quads.points_um.size(); ++v) {
    const Vec2 place = all.lattice.quads.points_um[v];
    const std::vector<VertexShare> shares =
        is_even ? std::vector<VertexShare>{{static_cast<int>(v), 1}} : shares_at(problem.mesh, place);
    const auto vector = [&](const VectorXd& of) {
      Vec3 sum;
      for (const auto& [vertex, share] : shares)
        sum += share * Vec3{of[3 * vertex], of[3 * vertex + 1], of[3 * vertex + 2]};
      return sum;
    };
    SurfaceTraction& row = all.rows.emplace_back();
    row.position_um = {place.x, place.y, problem.ground.height_um(place)};
    row.traction_kPa = vector(r.traction_kPa);
    row.displacement_um = vector(u);
    row.area_um2 = all.lattice.areas_um2[v];
    const Vec3 normal = problem.ground.normal(place);
    row.normal_kPa = dot(row.traction_kPa, normal);
    row.tangential_kPa = norm(row.traction_kPa - row.normal_kPa * normal);
    if (!resolution.empty()) {
      row.resolution_um = 0;
      for (const auto& [vertex, share] : shares) *row.resolution_um += share * resolution[vertex];
    }
    if (r.covariance_kPa2.size() == 0) continue;
    const auto sigma = [&](Index c) {
      double variance = 0;
      for (const VertexShare& a : shares) {
        for (const VertexShare& b : shares)
          variance += a.share * b.share * r.covariance_kPa2(3 * a.vertex + c, 3 * b.vertex + c);
      }
      double shortened = 0;  // the covariance is about the mean, which group-l1 shrinks
      if (r.method == tractions::TractionMethod::group_l1) {
        const VectorXd& mean = summed_tractions_kPa(r);
        for (const auto& [vertex, share] : shares)
          shortened += share * (mean[3 * vertex + c] - r.traction_kPa[3 * vertex + c]);
      }
      return std::hypot(shortened, std::sqrt(std::max(0.0, variance)));
    };
    row.sigma_kPa = {sigma(0), sigma(1), sigma(2)};
  }
  return all;
}

}  // namespace

void write_tractions(const Path& csv, const Path& vtp, const Problem& problem,
                     const SpatialReconstruction& reconstruction) {
  const Shown all = shown(problem, reconstruction);
  files::write(csv, files::surface_traction_table(), all.rows);
  files::Grid grid;
  for (const auto& face : all.lattice.quads.faces) grid.cells.insert(grid.cells.end(), face.begin(), face.end());
  for (const SurfaceTraction& row : all.rows) grid.points_um.push_back(row.position_um);
  grid.point_arrays = {files::array_of("traction_kPa", all.rows, &SurfaceTraction::traction_kPa),
                       files::array_of("normal_kPa", all.rows, &SurfaceTraction::normal_kPa),
                       files::array_of("tangential_kPa", all.rows, &SurfaceTraction::tangential_kPa),
                       files::array_of("displacement_um", all.rows, &SurfaceTraction::displacement_um)};
  if (reconstruction.covariance_kPa2.size() > 0)
    grid.point_arrays.push_back(
        files::array_of("sigma_traction_kPa", all.rows, [](const SurfaceTraction& row) { return *row.sigma_kPa; }));
  if (reconstruction.resolved.size() > 0)
    grid.point_arrays.push_back(
        files::array_of("resolution_um", all.rows, [](const SurfaceTraction& row) { return *row.resolution_um; }));
  files::write_quads_vtp(vtp, grid);
}

const char* how_lambda(const SpatialReconstruction& r) { return r.lambda_by ? name_of(*r.lambda_by) : "given"; }

Figures summary_of(const Problem& problem, const SpatialReconstruction& r, const Balance& balance) {
  Figures figures;
  const auto add = [&](const std::string& name, double value) { figures.emplace_back(name, value); };
  const auto add_vector = [&](const std::string& name, const std::string& unit, const Vec3& value) {
    add(name + "_x_" + unit, value.x);
    add(name + "_y_" + unit, value.y);
    add(name + "_z_" + unit, value.z);
  };
  figures.emplace_back("method", std::string(name_of(r.method)));
  add("total_force_nN", balance.total_force_nN);
  if (r.covariance_kPa2.size() > 0) add("total_force_sigma_nN", balance.total_force_sigma_nN);
  add("normal_force_nN", balance.normal_force_nN);
  add_vector("net_force", "nN", balance.force_nN);
  add_vector("moment", "nN_um", balance.moment_nN_um);
  if (r.covariance_kPa2.size() > 0) {
    add_vector("net_force_sigma", "nN", balance.force_sigma_nN);
    add_vector("moment_sigma", "nN_um", balance.moment_sigma_nN_um);
    add("net_force_sigma_along_nN", balance.net_force_sigma_nN);
    add("moment_sigma_along_nN_um", balance.net_moment_sigma_nN_um);
  }
  if (balance.imbalance) add("imbalance_chi_squared", *balance.imbalance);
  if (r.flipped_z_chi_squared) add("flipped_z_chi_squared", *r.flipped_z_chi_squared);
  add_vector("centre", "um", balance.centre_um);
  add("strain_energy_fJ", balance.strain_energy_fJ);
  add("contractile_moment_nN_um", balance.contractile_moment_nN_um);
  if (r.covariance_kPa2.size() > 0) add("contractile_moment_sigma_nN_um", balance.contractile_moment_sigma_nN_um);
  add("relative_l2", r.relative_l2);
  add("noise_um", r.noise_um);
  if (r.chi_squared > 0) add("chi_squared_per_datum", r.chi_squared);
  if (r.degrees > 0) add("effective_unknowns", r.degrees);
  if (r.resolved.size() > 0) add("median_resolution_um", numerics::median(resolution_um(problem, r)));
  if (r.lambda) {
    const double unit = lambda_per_um_per_kPa(problem);
    add("lambda_um_per_kPa", *r.lambda / unit);
    figures.emplace_back("lambda_by", std::string(how_lambda(r)));
    if (r.summands && r.summands->lambda) add("lambda_of_sums_um_per_kPa", *r.summands->lambda / unit);
  }
  figures.emplace_back("tractions_over", problem.expected.where);
  figures.emplace_back("n_unknowns", std::int64_t{problem.n_unknowns()});
  const int finest = problem.mesh.finest_level();
  add("spacing_x_um", std::ldexp(problem.mesh.spacing_um.x, -finest));
  add("spacing_y_um", std::ldexp(problem.mesh.spacing_um.y, -finest));
  const Vec2 largest = problem.mesh.size_um(*std::ranges::min_element(problem.mesh.leaves, {}, &Leaf::level));
  add("largest_spacing_um", std::max(largest.x, largest.y));
  figures.emplace_back("n_beads", std::int64_t{problem.observed.n_beads});
  figures.emplace_back("n_beads_flagged", std::int64_t{problem.observed.n_flagged});
  figures.emplace_back("n_beads_above", std::int64_t{problem.observed.n_above});
  figures.emplace_back("n_beads_below_base", std::int64_t{problem.observed.n_below_base});
  figures.emplace_back("n_beads_beyond_surface", std::int64_t{problem.observed.n_beyond});
  add("bead_distance_um", problem.observed.distance_um);
  add("median_depth_um", problem.observed.depth_um);
  for (const auto& figure : r.figures) figures.push_back(figure);
  for (const auto& figure : problem.figures) figures.push_back(figure);
  return figures;
}

}  // namespace mbtfm::spatial
