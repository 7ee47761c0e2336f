#include "mbtfm/tensions/fit_results.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>

#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/findings.h"
#include "mbtfm/tensions/search.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/distributions.h"
#include "pipeline/numerics/near.h"
#include "pipeline/numerics/order_statistics.h"
#include "substrate/compliance.h"
#include "substrate/greens/models.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::tensions {

namespace {

void check_along(const char* axis, double Vec2::*of, const Extent& beads, const Extent& cell) {
  if (beads.low_um.*of <= cell.high_um.*of && cell.low_um.*of <= beads.high_um.*of) return;
  const auto in_words = [of](const Extent& e) { return brief(e.low_um.*of) + " to " + brief(e.high_um.*of) + " um"; };
  throw InvalidData("the displacement", std::string("beads about the cell, whose ") + axis + " is " + in_words(cell),
                    std::string("beads whose ") + axis + " is " + in_words(beads) +
                        ": has this coordinate another sign, unit or origin?");
}

}  // namespace

void check_place(const DisplacementField& beads, const Cell& cell) {
  if (beads.empty() || cell.adhesions.empty()) return;
  const Extent of_beads = extent_of(beads, &Bead::position_um),
               of_cell = extent_of(cell.adhesions, &Adhesion::position_um);
  check_along("x", &Vec2::x, of_beads, of_cell);
  check_along("y", &Vec2::y, of_beads, of_cell);
}

std::vector<int> adhesion_ids_of(const Cell& cell) {
  std::vector<int> ids;
  for (const Adhesion& a : cell.adhesions) ids.push_back(a.adhesion_id);
  return ids;
}

namespace {

std::optional<double> if_finite(double number) { return std::isfinite(number) ? std::optional(number) : std::nullopt; }

}  // namespace

std::vector<Tension> tensions_of(const EnsembleFit& fit) {
  double largest_nN = 0;
  for (std::size_t i = 1; i < fit.tensions.nN.size(); ++i) largest_nN = std::max(largest_nN, fit.tensions.nN[i].value);
  std::vector<Tension> tensions;
  for (std::size_t i = 0; i < fit.tensions.fibre_ids.size(); ++i) {
    const Estimate& e = fit.tensions.nN[i];
    const Interval interval = interval_95(e);
    // A tension that could be anything that occurs in this cell was not measured.
    const double scale = i == 0 ? e.value : largest_nN;
    tensions.push_back({.fibre_id = fit.tensions.fibre_ids[i],
                        .tension_nN = e.value,
                        .low_nN = interval.low,
                        .high_nN = if_finite(interval.high),
                        .sigma_nN = if_finite(e.standard_error),
                        .identifiable = e.standard_error < scale});
  }
  return tensions;
}

std::vector<AdhesionForce> forces_of(const EnsembleFit& fit, const Cell& cell) {
  std::set<int> connected;
  for (const Fibre& f : cell.fibres) {
    if (f.start_adhesion_id) connected.insert(*f.start_adhesion_id);
    if (f.end_adhesion_id) connected.insert(*f.end_adhesion_id);
  }
  const VectorXd exerted_nN = adhesion_forces_nN(fit);  // forces of their own act at the centres
  std::vector<AdhesionForce> forces;
  for (std::size_t a = 0; a < cell.adhesions.size(); ++a) {
    const Index each = fit.data.dimension, at = each * static_cast<Index>(a);
    const Vec2 network_nN{fit.forces.nN[at], fit.forces.nN[at + 1]};
    const double about_origin_nN_um = fit.forces.torques_nN_um[static_cast<Index>(a)];
    const Vec2 force_nN{exerted_nN[at], exerted_nN[at + 1]};
    const Estimate& magnitude_nN = fit.forces.magnitudes[a];
    const double student = quantile_975(magnitude_nN) / kNormal95;  // as in interval_95
    const numerics::MagnitudeInterval interval =
        numerics::magnitude_interval_95(exerted_nN.segment(at, each).norm(), student * magnitude_nN.standard_error);
    forces.push_back({.adhesion_id = cell.adhesions[a].adhesion_id,
                      .force_nN = force_nN,
                      .sigma_nN = if_finite(magnitude_nN.standard_error),
                      .connected = connected.contains(cell.adhesions[a].adhesion_id),
                      .moment_nN_um = about_origin_nN_um - cross(cell.adhesions[a].position_um, network_nN),
                      .low_nN = interval.low,
                      .high_nN = if_finite(interval.high)});
  }
  return forces;
}

namespace {

/// Root of the sum of squares over the fibres.
template <class Part>
double over_fibres(const EnsembleFit& fit, const Part& part) {
  double sum = 0;
  for (std::size_t i = 1; i < fit.tensions.nN.size(); ++i) sum += std::pow(part(fit.tensions.nN[i]), 2);
  return std::sqrt(sum);
}

Figures figures_of(const CutForce& cut, const EnsembleFit& fit, const std::vector<Adhesion>& adhesions) {
  const Interval interval = interval_95(cut.magnitude_nN);
  double torque_nN_um = cut.reaction.torque_nN_um;  // and of the adhesions' own forces, at their centres
  const VectorXd own_nN = adhesion_forces_nN(fit) - fit.forces.nN;
  for (std::size_t a = 0; a < adhesions.size(); ++a) {
    const auto at = 2 * static_cast<Index>(a);
    torque_nN_um -= cross(adhesions[a].position_um, {own_nN[at], own_nN[at + 1]});
  }
  return {{"cut_force_x_nN", cut.x_nN.value},       {"cut_force_x_sigma_nN", cut.x_nN.standard_error},
          {"cut_force_y_nN", cut.y_nN.value},       {"cut_force_y_sigma_nN", cut.y_nN.standard_error},
          {"cut_force_nN", cut.magnitude_nN.value}, {"cut_force_sigma_nN", cut.magnitude_nN.standard_error},
          {"cut_force_low_nN", interval.low},       {"cut_force_high_nN", interval.high},
          {"cut_torque_nN_um", torque_nN_um}};
}

/// sigma √n / |u less the motion| of the beads in use: the relative L2 that noise alone would leave.
double expected_relative_l2(const EnsembleFit& fit, double noise_um) {
  const LinearData& data = fit.data;
  const VectorXd is_used = data.weight_per_um.unaryExpr([](double w) { return w > 0 ? 1.0 : 0.0; });
  const VectorXd measured_um = residual_um(data, fit.forces.nN) + moved_by(data, fit.forces.nN);
  const double measured = is_used.cwiseProduct(measured_um).norm();
  return measured > 0 ? noise_um * is_used.norm() / measured : 0;
}

}  // namespace

FitSummary summary_of(const EnsembleFit& fit, const CellOnBeads& scene, double surface_tension_nN_per_um,
                      const FitParameters& parameters) {
  const Polygon& outline_um = scene.cell.outline_um;
  const NoiseLevel noise = noise_level(fit.data, adhesion_forces_nN(fit), outline_um, parameters.far_distance_um);
  const Imbalance balance = imbalance_of(fit);
  const VectorXd exerted_nN = adhesion_forces_nN(fit), beside_nN = exerted_nN - fit.forces.nN;
  FitSummary s;
  s.relative_l2 = relative_l2(fit.data, fit.forces.nN);
  s.noise_um = noise.sigma_um;
  s.expected_relative_l2 = expected_relative_l2(fit, noise.sigma_um);
  s.total_force_nN = fit.total_force_nN.value;
  s.network_force_nN = fit.network_force_nN.value;
  s.fibre_force_nN = s.total_force_nN - s.network_force_nN;
  s.network_surface_tension_nN_per_um = surface_tension_nN_per_um;
  s.n_meshes = static_cast<int>(fit.meshes.size());
  s.iterations = fit.report.iterations;
  s.converged = fit.report.converged;
  s.more = {
      {"noise_source", noise.source},
      {"chi_squared_per_degree", fit.misfit.chi_squared_per_degree},
      {"total_force_sigma_nN", fit.total_force_nN.standard_error},
      {"network_force_sigma_nN", fit.network_force_nN.standard_error},
      {"force_beside_network_nN",
       std::sqrt(beside_nN.squaredNorm() / std::max<double>(1, static_cast<double>(scene.cell.adhesions.size())))},
      {"network_explains", 1 - beside_nN.squaredNorm() / std::max(exerted_nN.squaredNorm(), 1e-300)},
      {"edge_force_nN", fit.forces.edge.sum_nN},
      {"edge_force_probability", fit.forces.edge.probability},
      {"net_force_over_total", balance.force},
      {"net_torque_over_total", balance.torque},
      {"tension_error_from_noise_nN", over_fibres(fit, [](const Estimate& t) { return t.noise; })},
      {"tension_error_from_mesh_nN", over_fibres(fit, [](const Estimate& t) { return t.from_model(); })},
      {"n_beads", std::int64_t(scene.beads.size())},
      {"n_flagged_beads", std::int64_t(scene.n_flagged)},
      {"method", name_of(parameters.method)},
      {"loss", name_of(fit.misfit.loss)},
      {"reason", fit.report.reason}};
  if (!fit.cut) return s;
  const Figures of_cut = figures_of(*fit.cut, fit, scene.cell.adhesions);
  s.more.insert(s.more.end(), of_cut.begin(), of_cut.end());
  return s;
}

DisplacementField field_of(const VectorXd& forces_nN, const DisplacementField& beads, const LinearData& data) {
  VectorXd model = moved_by(data, forces_nN);
  if (data.motions.shapes.cols() > 0) {
    model += numerics::small_product(data.motions.shapes,
                                     motion_in(data, data.displacement_um - data.response->displace(forces_nN)))
                 .col(0);
  }
  DisplacementField field = beads;
  for (std::size_t i = 0; i < field.size(); ++i) {
    const Index row = data.dimension * static_cast<Index>(i);
    field[i].displacement_um = {model[row], model[row + 1]};
    field[i].sigma_um = 0;
  }
  return field;
}

void write_displacement_vtp(const Path& file, const DisplacementField& measured, const DisplacementField& fitted,
                            const std::vector<files::NamedArray>& more) {
  std::vector<Vec2> residual_um;
  for (std::size_t i = 0; i < measured.size(); ++i)
    residual_um.push_back(measured[i].displacement_um - fitted[i].displacement_um);
  std::vector<files::NamedArray> arrays = {files::array_of("measured_um", measured, &Bead::displacement_um),
                                           files::array_of("fitted_um", fitted, &Bead::displacement_um),
                                           files::array_of("residual_um", residual_um)};
  arrays.insert(arrays.end(), more.begin(), more.end());
  files::write_points_vtp(file, points_of(measured), arrays);
}

void write_tractions_vtp(const Path& file, const Cell& cell, const std::vector<AdhesionForce>& forces) {
  std::vector<Vec2> traction_kPa;
  for (std::size_t a = 0; a < forces.size(); ++a)
    traction_kPa.push_back(1 / area_stood_for_um2(cell.adhesions[a]) * forces[a].force_nN);
  files::write_ellipses_vtp(
      file, cell.adhesions,
      {files::array_of("force_nN", forces, &AdhesionForce::force_nN), files::array_of("traction_kPa", traction_kPa)});
}

namespace {

/// By adhesion and component: the mean displacement under it.
VectorXd mean_displacement_um(const std::vector<substrate::Ellipse>& ellipses, const VectorXd& forces_nN,
                              const Gel& gel, int threads) {
  std::vector<std::vector<substrate::DiscPoint>> rules;
  const Index each = forces_nN.size() / std::max<Index>(1, std::ssize(ellipses));
  std::vector<Vec3> points_um;
  for (const substrate::Ellipse& e : ellipses) {
    rules.push_back(substrate::ellipse_rule(e, 5));
    for (const substrate::DiscPoint& p : rules.back())
      points_um.push_back({e.centre_um.x + p.position.x, e.centre_um.y + p.position.y, 0});
  }
  const auto layer = greens::make_greens(gel, {.model = substrate::ModelKind::layer}, threads);
  const VectorXd at_points = response_to(ellipses, points_um, each, *layer)->displace(forces_nN);
  VectorXd mean = VectorXd::Zero(forces_nN.size());
  Index point = 0;
  for (Index a = 0; a < std::ssize(ellipses); ++a) {
    for (const substrate::DiscPoint& p : rules[a])
      mean.segment(each * a, each) += p.weight * at_points.segment(each * point++, each);
  }
  return mean;
}

/// Mean of what the forces make of the beads on an adhesion, or of the four nearest.
VectorXd shown_by_beads_um(const numerics::Near& beads, const VectorXd& moved_um, const Adhesion& adhesion) {
  constexpr std::size_t kNearest = 4;
  const Vec3 place{adhesion.position_um.x, adhesion.position_um.y, 0};
  std::vector<int> shown = beads.within(place, adhesion.major_axis_um / 2, static_cast<int>(beads.points().size()));
  if (shown.size() < kNearest) shown = beads.nearest(place, kNearest);
  const Index n = std::ssize(beads.points());
  return moved_um.reshaped(moved_um.size() / n, n)(Eigen::all, shown).rowwise().mean();
}

VectorXd displacement_under_um(const EnsembleFit& fit, const Cell& cell, const VectorXd& forces_nN, const Gel& gel,
                               int threads) {
  VectorXd under = mean_displacement_um(substrate::ellipses_of(cell.adhesions), forces_nN, gel, threads);
  const auto assumed = [](const Adhesion& a) { return is_assumed(a.origin); };
  if (std::ranges::none_of(cell.adhesions, assumed) || fit.data.position_um.empty()) return under;
  constexpr double kCell_um = 1;
  const numerics::Near beads(places_of_beads(fit.data), kCell_um);
  const VectorXd moved_um = moved_by(fit.data, forces_nN);
  const Index each = fit.data.dimension;
  for (Index a = 0; a < std::ssize(cell.adhesions); ++a)
    if (assumed(cell.adhesions[a]))
      under.segment(each * a, each) = shown_by_beads_um(beads, moved_um, cell.adhesions[a]);
  return under;
}

/// Of a number that changes by `gradient` with the forces.
double standard_error(const EnsembleFit& fit, const VectorXd& gradient) {
  const MatrixXd network = by_network_force(fit, gradient);
  const double variance = covariance_of_estimates(fit, MatrixXd::Zero(1, 1), network.transpose())(0, 0);
  return std::sqrt(variance + own_variances(fit, gradient)[0]);
}

Figures moments_of(const EnsembleFit& fit, const std::vector<substrate::Ellipse>& ellipses, const VectorXd& forces_nN) {
  const Vec2 centre = centre_of(ellipses, &substrate::Ellipse::centre_um);
  Eigen::Matrix2d moment = Eigen::Matrix2d::Zero();
  VectorXd of_trace = VectorXd::Zero(forces_nN.size());
  for (Index a = 0; a < std::ssize(ellipses); ++a) {
    const Vec2 arm = ellipses[a].centre_um - centre;
    const Eigen::Vector2d x(arm.x, arm.y);
    moment -= x * forces_nN.segment<2>(fit.data.dimension * a).transpose();
    of_trace.segment<2>(fit.data.dimension * a) = -x;
  }
  const auto [sizes, axes] = numerics::symmetric_eigen(0.5 * (moment + moment.transpose()));
  const Eigen::Vector2d major = axes.col(1);
  const double angle_deg = std::atan2(major.y(), major.x()) * 180 / std::numbers::pi;
  return {{"contractile_moment_nN_um", moment.trace()},
          {"contractile_moment_sigma_nN_um", standard_error(fit, of_trace)},
          {"contractile_moment_major_nN_um", sizes[1]},
          {"contractile_moment_minor_nN_um", sizes[0]},
          {"contractile_moment_axis_deg", angle_deg < 0 ? angle_deg + 180 : angle_deg}};
}

}  // namespace

Figures energy_and_moments(const EnsembleFit& fit, const Cell& cell, const Gel& gel, bool is_even_gel, int threads) {
  const std::vector<substrate::Ellipse> ellipses = substrate::ellipses_of(cell.adhesions);
  const VectorXd forces_nN = adhesion_forces_nN(fit);
  Figures figures;
  if (is_even_gel) {
    const VectorXd displacement_um = displacement_under_um(fit, cell, forces_nN, gel, threads);
    figures = {{"strain_energy_fJ", 0.5 * forces_nN.dot(displacement_um)},
               {"strain_energy_sigma_fJ", standard_error(fit, displacement_um)}};
  }
  if (!fit.cut) {
    const Figures moments = moments_of(fit, ellipses, forces_nN);
    figures.insert(figures.end(), moments.begin(), moments.end());
  }
  return figures;
}

namespace {

bool is_far(Vec2 bead_um, const Polygon& outline_um, double far_distance_um) {
  return !contains(outline_um, bead_um) && distance_to_boundary_um(outline_um, bead_um) >= far_distance_um;
}

}  // namespace

bool has_far_beads(const LinearData& data, const Polygon& outline_um, double far_distance_um) {
  constexpr int kFewest = 30;
  int n = 0;
  for (Index b = 0; b < std::ssize(data.position_um); ++b)
    n += is_used(data, b) && is_far(data.position_um[b], outline_um, far_distance_um);
  return n >= kFewest;
}

NoiseLevel noise_level(const LinearData& data, const VectorXd& forces_nN, const Polygon& outline_um,
                       double far_distance_um) {
  const VectorXd residual = evened_residual_um(data, forces_nN);
  const Index each = data.dimension;
  const bool has_far = has_far_beads(data, outline_um, far_distance_um);
  std::vector<double> used;
  for (Index row = 0; row < residual.size(); ++row) {
    if (!is_used(data, row / each)) continue;  // beside another cell it is no witness of rest
    if (has_far && !is_far(data.position_um[row / each], outline_um, far_distance_um)) continue;
    used.push_back(std::abs(residual[row]));
  }
  if (used.empty()) return {};
  const std::string source = std::to_string(std::ssize(used) / each) +
                             (has_far ? " beads far from the cell" : " beads, too few of them far from the cell");
  return {.sigma_um = 1.4826 * numerics::median_in(used), .source = source};
}

}  // namespace mbtfm::tensions
