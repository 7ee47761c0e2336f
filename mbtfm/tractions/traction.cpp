#include "mbtfm/tractions/traction.h"

#include <cmath>

#include "mbtfm/inverse/rows.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/tables.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/numerics/distributions.h"
#include "pipeline/numerics/memory.h"
#include "pipeline/stage/parameters.h"
#include "substrate/compliance.h"
#include "substrate/greens/models.h"

namespace mbtfm::tractions {

void declare(stage::ParameterList& list, TractionParameters& p) {
  list.table("traction");
  list.add("method", p.method);
  list.add("gel_model", p.gel_model);
  list.add("lambda_by", p.lambda_by);
  list.add("lambda_um_per_kPa", p.lambda_um_per_kPa, Range::between(1e-12, 1e12));
  list.add("spacing_um", p.spacing_um, Range::mesh_um());
  list.add("padding", p.padding, Range::between(1, 8));
  list.add("read_out", p.read_out);
  list.add("gaussian_um", p.gaussian_um, Range::zero_or_size_um());
  list.add("element_um", p.element_um, Range::mesh_um());
  list.add("grow_um", p.grow_um, Range::zero_or_size_um());
}

Reconstruction reconstruct(const TractionInputs& inputs, const TractionParameters& parameters, int threads) {
  const TractionMethod method = parameters.method.value_or(TractionMethod::fttc);
  FlatMethod* by = flat_method(method);
  if (!by)
    throw UsageError(std::string(name_of(method)) +
                     " takes beads in space: give a displacement_3d.csv, with z_um and uz_um, or choose fttc, "
                     "sparse, trpf, bem or adhesion-forces");
  Reconstruction r = by(inputs, parameters, threads);
  for (AdhesionForce& f : r.forces) {
    if (!f.sigma_nN) continue;
    const numerics::MagnitudeInterval interval = numerics::magnitude_interval_95(norm(f.force_nN), *f.sigma_nN);
    f.low_nN = interval.low;
    f.high_nN = interval.high;
  }
  return r;
}

namespace {

/// Distance over which an ellipse would have to grow to hold the point, about: by its axes' scaling.
double reach_um(const Adhesion& a, Vec2 point_um) {
  const Vec2 d = point_um - a.position_um;
  const double c = std::cos(a.angle_rad), s = std::sin(a.angle_rad);
  const double along = c * d.x + s * d.y, across = c * d.y - s * d.x;
  // (along/(A + g))² + (across/(B + g))² = 1 falls as g grows: its root by bisection, to far below a lattice spacing
  const double half_major = 0.5 * a.major_axis_um, half_minor = 0.5 * a.minor_axis_um;
  const auto is_inside = [&](double g) {
    return std::pow(along / (half_major + g), 2) + std::pow(across / (half_minor + g), 2) <= 1;
  };
  if (is_inside(0)) return 0;
  double low = 0, high = norm(d);
  for (int i = 0; i < 30; ++i) {
    const double middle = 0.5 * (low + high);
    (is_inside(middle) ? high : low) = middle;
  }
  return high;
}

}  // namespace

std::vector<int> adhesion_of_patches(const std::vector<Vec2>& positions_um, const std::vector<Adhesion>& adhesions,
                                     double grow_um) {
  std::vector<int> owner(positions_um.size(), -1);
  for (std::size_t p = 0; p < positions_um.size(); ++p) {
    double nearest = grow_um;
    for (std::size_t a = 0; a < adhesions.size(); ++a) {
      if (norm(positions_um[p] - adhesions[a].position_um) > 0.5 * adhesions[a].major_axis_um + nearest) continue;
      const double reach = reach_um(adhesions[a], positions_um[p]);
      if (reach > nearest || (reach == nearest && owner[p] >= 0)) continue;
      nearest = reach;
      owner[p] = static_cast<int>(a);
    }
  }
  return owner;
}

std::vector<Vec2> positions_of(const std::vector<GroundPatch>& patches) {
  std::vector<Vec2> positions;
  for (const GroundPatch& p : patches) positions.push_back(p.position_um);
  return positions;
}

std::vector<AdhesionForce> forces_by_adhesion(const std::vector<GroundPatch>& patches,
                                              const std::vector<Adhesion>& adhesions, double grow_um) {
  const std::vector<Vec2> positions = positions_of(patches);
  const std::vector<int> owner = adhesion_of_patches(positions, adhesions, grow_um);
  std::vector<AdhesionForce> forces;
  for (const Adhesion& a : adhesions) {
    forces.push_back(
        {.adhesion_id = a.adhesion_id, .force_nN = {}, .sigma_nN = {}, .connected = false, .moment_nN_um = 0});
  }
  for (std::size_t p = 0; p < patches.size(); ++p) {
    if (owner[p] < 0) continue;
    const auto a = static_cast<std::size_t>(owner[p]);
    const Vec2 force = patches[p].area_um2 * patches[p].traction_kPa;
    forces[a].force_nN += force;
    *forces[a].moment_nN_um += cross(positions[p] - adhesions[a].position_um, force);
  }
  return forces;
}

MatrixXd even_forces_um_per_nN(const TractionInputs& inputs, GelModel gel_model, int threads) {
  const auto n_beads = static_cast<double>(inputs.beads.size());
  numerics::expect_room_for({.what = "the compliance of the adhesions",
                             .count = n_beads,
                             .parts = "beads",
                             .bytes_each = 6 * 4 * sizeof(double) * static_cast<double>(inputs.adhesions.size()),
                             .remedy = "leave --adhesions out, or take fewer beads"});
  return greens::make_greens(inputs.gel, {.model = substrate::kind_of(gel_model)}, threads)
      ->compliance_um_per_nN(points_of(inputs.beads), substrate::ellipses_of(inputs.adhesions));
}

std::vector<AdhesionForce> forces_with_errors(const std::vector<Adhesion>& adhesions, const VectorXd& forces_nN,
                                              const MatrixXd& covariance_nN2) {
  std::vector<AdhesionForce> forces;
  for (Index a = 0; a < std::ssize(adhesions); ++a) {
    const Eigen::Vector2d f = forces_nN.segment<2>(2 * a);
    forces.push_back({.adhesion_id = adhesions[a].adhesion_id,
                      .force_nN = {f.x(), f.y()},
                      .sigma_nN = inverse::error_along(f, covariance_nN2.block<2, 2>(2 * a, 2 * a)),
                      .connected = false,
                      .moment_nN_um = 0});
  }
  return forces;
}

TractionSums sums_of(const Reconstruction& reconstruction, const TractionInputs& inputs, double grow_um) {
  const std::vector<GroundPatch>& patches = reconstruction.patches;
  TractionSums sums;
  const std::vector<Vec2> positions = positions_of(patches);
  std::vector<bool> is_near(patches.size(), true);
  sums.where = "the whole field";
  if (!inputs.outline_um.empty()) {
    sums.where = "the outline";
    for (std::size_t i = 0; i < patches.size(); ++i) {
      is_near[i] = contains(inputs.outline_um, positions[i]) ||
                   distance_to_boundary_um(inputs.outline_um, positions[i]) <= grow_um;
    }
  } else if (!inputs.adhesions.empty()) {
    sums.where = "the adhesions";
    const std::vector<int> owner = adhesion_of_patches(positions, inputs.adhesions, grow_um);
    for (std::size_t i = 0; i < patches.size(); ++i) is_near[i] = owner[i] >= 0;
  }
  // The moment of forces that do not quite balance depends on its centre: that of the force magnitudes is the cell's.
  Vec2 centre;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!is_near[i]) continue;
    const Vec2 force = patches[i].area_um2 * patches[i].traction_kPa;
    centre += norm(force) * positions[i];
    sums.total_force_nN += norm(force);
    sums.net_force_nN += force;
    sums.strain_energy_fJ += 0.5 * dot(force, patches[i].displacement_um);
  }
  if (sums.total_force_nN > 0) centre = 1 / sums.total_force_nN * centre;
  if (reconstruction.magnitudes) {
    VectorXd near = VectorXd::Zero(std::ssize(patches));
    for (std::size_t i = 0; i < patches.size(); ++i) near[static_cast<Index>(i)] = is_near[i] ? 1 : 0;
    sums.total_force_nN = near.dot(reconstruction.magnitudes->expected_nN);
    sums.total_force_sigma_nN = std::sqrt(std::max(0.0, near.dot(reconstruction.magnitudes->covariance_nN2 * near)));
  }
  double inward = 0, weight = 0;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (!is_near[i]) continue;
    const Vec2 force = patches[i].area_um2 * patches[i].traction_kPa;
    const Vec2 arm = positions[i] - centre;
    sums.moment_nN_um[0][0] += arm.x * force.x;
    sums.moment_nN_um[0][1] += arm.x * force.y;
    sums.moment_nN_um[1][0] += arm.y * force.x;
    sums.moment_nN_um[1][1] += arm.y * force.y;
    inward -= dot(arm, force) * norm(force);
    weight += norm(arm) * dot(force, force);
  }
  if (weight > 0) sums.inward_share = inward / weight;
  return sums;
}

namespace {

using files::kResult;

struct PatchRow {
  GroundPatch patch;
  std::optional<Vec2> sigma_kPa;
};
files::Table<PatchRow> patch_table() {
  using Row = PatchRow;
  return {.file = "traction.csv",
          .columns = {{"x_um", files::x_of(&Row::patch, &GroundPatch::position_um)},
                      {"y_um", files::y_of(&Row::patch, &GroundPatch::position_um)},
                      {"tx_kPa", files::x_of(&Row::patch, &GroundPatch::traction_kPa)},
                      {"ty_kPa", files::y_of(&Row::patch, &GroundPatch::traction_kPa)},
                      {"area_um2", files::member(&Row::patch, &GroundPatch::area_um2)},
                      {"ux_um", files::x_of(&Row::patch, &GroundPatch::displacement_um), kResult},
                      {"uy_um", files::y_of(&Row::patch, &GroundPatch::displacement_um), kResult},
                      {"sigma_x_kPa", files::member(&Row::sigma_kPa, &Vec2::x), kResult},
                      {"sigma_y_kPa", files::member(&Row::sigma_kPa, &Vec2::y), kResult}}};
}

struct LambdaRow {
  ScanPoint point;
  double length_um = 0, gcv = 0, curvature = 0, evidence = 0, risk = 0;
};
files::Table<LambdaRow> lambda_table() {
  using Row = LambdaRow;
  return {.file = "traction_lambda.csv",
          .columns = {{"lambda", files::member(&Row::point, &ScanPoint::lambda), kResult},
                      {"length_um", &Row::length_um, kResult},
                      {"misfit", files::member(&Row::point, &ScanPoint::misfit), kResult},
                      {"norm", files::member(&Row::point, &ScanPoint::norm), kResult},
                      {"degrees", files::member(&Row::point, &ScanPoint::degrees), kResult},
                      {"gcv", &Row::gcv, kResult},
                      {"l_curve_curvature", &Row::curvature, kResult},
                      {"log_evidence", &Row::evidence, kResult},
                      {"risk", &Row::risk, kResult}}};
}

}  // namespace

std::string pages_of_tables() { return page_of(patch_table()) + page_of(lambda_table()); }

void write_tractions(const Path& file, const std::vector<GroundPatch>& patches, const std::vector<Vec2>& sigmas_kPa) {
  std::vector<PatchRow> rows;
  for (const GroundPatch& patch : patches) rows.push_back({.patch = patch, .sigma_kPa = {}});
  for (std::size_t i = 0; i < sigmas_kPa.size(); ++i) rows[i].sigma_kPa = sigmas_kPa[i];
  files::Table<PatchRow> table = patch_table();
  if (sigmas_kPa.empty()) table.columns = table.columns.without({"sigma_x_kPa", "sigma_y_kPa"});
  write(file, table, rows);
}

void write_tractions_vtp(const Path& file, const std::vector<GroundPatch>& patches) {
  files::write_points_vtp(file, positions_of(patches),
                          {files::array_of("traction_kPa", patches, &GroundPatch::traction_kPa),
                           files::array_of("displacement_um", patches, &GroundPatch::displacement_um),
                           files::array_of("area_um2", patches, &GroundPatch::area_um2)});
}

void write_lambda_scan(const Path& file, const LambdaScan& scan, double length_um_per_lambda) {
  std::vector<LambdaRow> rows;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const ScanPoint& p = scan.points[i];
    rows.push_back(
        {p, p.lambda * length_um_per_lambda, scan.gcv[i], scan.curvature[i], scan.evidence[i], scan.risk[i]});
  }
  write(file, lambda_table(), rows);
}

std::vector<files::NamedArray> columns_of(const std::vector<Sensitivity>& sensitivities) {
  if (sensitivities.empty()) return {};
  return {files::array_of("shift_along_nN", sensitivities, &Sensitivity::shift_along_nN),
          files::array_of("shift_across_nN", sensitivities, &Sensitivity::shift_across_nN),
          files::array_of("size_nN", sensitivities, &Sensitivity::size_nN),
          files::array_of("angle_nN", sensitivities, &Sensitivity::angle_nN)};
}

Figures summary_of(const Reconstruction& r, const TractionSums& sums) {
  Figures figures = {{"total_force_nN", sums.total_force_nN},
                     {"net_force_x_nN", sums.net_force_nN.x},
                     {"net_force_y_nN", sums.net_force_nN.y},
                     {"strain_energy_fJ", sums.strain_energy_fJ},
                     {"contractile_moment_nN_um", sums.contractile_moment_nN_um()},
                     {"inward_share", sums.inward_share},
                     {"moment_xx_nN_um", sums.moment_nN_um[0][0]},
                     {"moment_xy_nN_um", sums.moment_nN_um[0][1]},
                     {"moment_yx_nN_um", sums.moment_nN_um[1][0]},
                     {"moment_yy_nN_um", sums.moment_nN_um[1][1]},
                     {"summed_over", sums.where},
                     {"relative_l2", r.relative_l2}};
  if (sums.total_force_sigma_nN) figures.emplace_back("total_force_sigma_nN", *sums.total_force_sigma_nN);
  if (r.lambda) figures.emplace_back("lambda_" + std::string(name_of(r.lambda_unit)), *r.lambda);
  if (r.length_um) figures.emplace_back("lambda_length_um", *r.length_um);
  if (r.scan && r.lambda && r.length_um) {
    const double scale = *r.length_um / *r.lambda;
    figures.emplace_back("length_by_risk_um", r.scan->by_risk * scale);
    figures.emplace_back("length_by_gcv_um", r.scan->by_gcv * scale);
    if (r.scan->by_l_curve) figures.emplace_back("length_by_l_curve_um", *r.scan->by_l_curve * scale);
    figures.emplace_back("length_by_evidence_um", r.scan->by_evidence * scale);
    figures.emplace_back("noise_from", r.scan->variance_source);
  }
  for (const auto& figure : r.figures) figures.push_back(figure);
  return figures;
}

}  // namespace mbtfm::tractions
