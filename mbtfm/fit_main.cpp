/// mbtfm-fit: tensions, adhesion forces and their error bars from bead displacements.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "mbtfm/ensemble.h"
#include "mbtfm/noise.h"
#include "network/mesh.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/files.h"
#include "pipeline/contract/parallel.h"
#include "pipeline/contract/stage.h"
#include "substrate/compliance.h"
#include "substrate/surface_vtu.h"

namespace mbtfm::inverse {
namespace {

// Chi squared per degree of freedom. Cells that follow the model, fitted on other networks, were found at 0.99 to 1.16.
constexpr double kPoorFit = 1.3;

struct FitStageParameters {
  Gel gel;
  network::NetworkParameters network;
  network::CableParameters cables;
  substrate::SubstrateParameters substrate;
  FitParameters fit;
};

void declare(ParameterList& list, FitStageParameters& p) {
  declare(list, p.gel);
  declare(list, p.network);
  declare(list, p.cables);
  declare(list, p.substrate);
  declare(list, p.fit);
}

struct Inputs {
  Cell cell;
  Network network;
  DisplacementField beads;  ///< without the flagged ones
  int n_flagged = 0;
};

Inputs read_inputs(StageContext& context) {
  Inputs inputs{.cell = read_cell(context.input("cell", kCellFiles)),
                .network = read_network(context.input("network")),
                .beads = {}};
  const Path field = context.input("displacement");
  for (Bead& bead : read_displacement(field)) {
    if (bead.flag.empty())
      inputs.beads.push_back(std::move(bead));
    else
      ++inputs.n_flagged;
  }
  std::set<int> groups = {0};
  for (const Link& link : inputs.network.links) groups.insert(link.fibre_id);
  if (2 * inputs.beads.size() < groups.size()) {
    throw InputError(field.string(),
                     "at least " + std::to_string((groups.size() + 1) / 2) + " good beads for " +
                         std::to_string(groups.size()) + " tensions",
                     std::to_string(inputs.beads.size()));
  }
  return inputs;
}

std::vector<int> adhesion_ids_of(const Cell& cell) {
  std::vector<int> ids;
  for (const Adhesion& a : cell.adhesions) ids.push_back(a.adhesion_id);
  return ids;
}

std::vector<substrate::Ellipse> ellipses_of(const Cell& cell) {
  std::vector<substrate::Ellipse> ellipses;
  for (const Adhesion& a : cell.adhesions) ellipses.push_back(substrate::ellipse_of(a));
  return ellipses;
}

Eigen::MatrixXd compliance_of(const substrate::Substrate& substrate, const Inputs& inputs) {
  std::vector<Vec2> points;
  for (const Bead& b : inputs.beads) points.push_back(b.position_um);
  return substrate.compliance_um_per_nN(points, ellipses_of(inputs.cell));
}

/// The given network first, then further ones over the same cell from other seeds.
std::vector<network::CableNetwork> span_ensemble(const Inputs& inputs, const FitStageParameters& p, int threads) {
  std::vector<Network> networks(p.fit.n_meshes);
  networks[0] = inputs.network;
  parallel_for(p.fit.n_meshes - 1, threads, [&](int m) {
    network::NetworkParameters parameters = p.network;
    parameters.seed += static_cast<std::uint64_t>(m) + 1;
    networks[m + 1] = network::generate_network(inputs.cell, parameters).network;
  });
  std::vector<network::CableNetwork> cables;
  for (Network& network : networks) cables.emplace_back(std::move(network), p.cables);
  return cables;
}

std::vector<Tension> tensions_of(const EnsembleFit& fit) {
  const int n_meshes = static_cast<int>(fit.fits.size());
  double largest_nN = 0;
  for (std::size_t i = 1; i < fit.tensions_nN.size(); ++i) largest_nN = std::max(largest_nN, fit.tensions_nN[i].value);
  std::vector<Tension> tensions;
  for (std::size_t i = 0; i < fit.fibre_ids.size(); ++i) {
    const Estimate& e = fit.tensions_nN[i];
    const double half_width = half_width_95(e, n_meshes);
    // A tension that could be anything that occurs in this cell was not measured.
    const double scale = i == 0 ? e.value : largest_nN;
    tensions.push_back({.fibre_id = fit.fibre_ids[i],
                        .tension_nN = e.value,
                        .low_nN = std::max(0.0, e.value - half_width),
                        .high_nN = e.value + half_width,
                        .identifiable = e.noise < scale});
  }
  return tensions;
}

std::vector<AdhesionForce> forces_of(const EnsembleFit& fit, const Cell& cell) {
  std::set<int> connected;
  for (const Fibre& f : cell.fibres) {
    if (f.start_adhesion_id) connected.insert(*f.start_adhesion_id);
    if (f.end_adhesion_id) connected.insert(*f.end_adhesion_id);
  }
  std::vector<AdhesionForce> forces;
  for (std::size_t a = 0; a < cell.adhesions.size(); ++a) {
    const auto at = 2 * static_cast<Eigen::Index>(a);
    forces.push_back({.adhesion_id = cell.adhesions[a].adhesion_id,
                      .force_nN = {fit.forces_nN[at], fit.forces_nN[at + 1]},
                      .sigma_nN = fit.force_magnitudes_nN[a].standard_error(),
                      .connected = connected.contains(cell.adhesions[a].adhesion_id)});
  }
  return forces;
}

double sum_of_magnitudes(const Eigen::VectorXd& forces_nN) {
  double sum = 0;
  for (Eigen::Index i = 0; i < forces_nN.size(); i += 2) sum += forces_nN.segment<2>(i).norm();
  return sum;
}

/// |sum of forces| over the sum of their magnitudes: rounding only.
double imbalance(const Eigen::VectorXd& forces_nN) {
  Eigen::Vector2d net = Eigen::Vector2d::Zero();
  for (Eigen::Index i = 0; i < forces_nN.size(); i += 2) net += forces_nN.segment<2>(i);
  return net.norm() / std::max(sum_of_magnitudes(forces_nN), 1e-300);
}

/// Of a sheet of links that carry share · t: half the trace of its stress, sigma = t / (2 A) sum share_k l_k. On a
/// regular triangulation of edge h this is sqrt(3) t / h (docs/theory.md, 4).
double surface_tension_nN_per_um(const Network& network, const Polygon& outline_um, double tension_nN) {
  double sum_um = 0;
  for (const Link& link : network.links) {
    if (link.fibre_id == 0) sum_um += link.share * link.rest_length_um;
  }
  return tension_nN * sum_um / (2 * std::abs(signed_area_um2(outline_um)));
}

FitSummary summary_of(const EnsembleFit& fit, const LinearData& data, const Inputs& inputs,
                      const std::vector<network::CableNetwork>& networks, const FitParameters& parameters) {
  const NoiseLevel noise =
      noise_level(inputs.beads, data, fit.forces_nN, inputs.cell.outline_um, parameters.far_distance_um);
  const double measured_um = data.displacement_um.norm();
  FitSummary s;
  s.relative_l2 = relative_l2(data, fit.forces_nN);
  s.noise_um = noise.sigma_um;
  s.expected_relative_l2 =
      measured_um > 0 ? noise.sigma_um * std::sqrt(static_cast<double>(data.displacement_um.size())) / measured_um : 0;
  s.total_force_nN = sum_of_magnitudes(fit.forces_nN);
  s.network_force_nN = sum_of_magnitudes(fit.network_forces_nN);
  s.fibre_force_nN = s.total_force_nN - s.network_force_nN;
  s.network_surface_tension_nN_per_um =
      surface_tension_nN_per_um(networks.front().network(), inputs.cell.outline_um, fit.tensions_nN[0].value);
  s.n_meshes = static_cast<int>(fit.fits.size());
  s.iterations = fit.report.iterations;
  s.converged = fit.report.converged;
  double mesh_part = 0, noise_part = 0;
  for (std::size_t i = 1; i < fit.tensions_nN.size(); ++i) {
    mesh_part += std::pow(fit.tensions_nN[i].spread, 2);
    noise_part += std::pow(fit.tensions_nN[i].noise, 2);
  }
  s.more = {{"noise_source", noise.source},
            {"chi_squared_per_degree", fit.chi_squared_per_degree},
            {"net_force_over_total", imbalance(fit.forces_nN)},
            {"tension_error_from_noise_nN", std::sqrt(noise_part)},
            {"tension_error_from_mesh_nN", std::sqrt(mesh_part)},
            {"n_beads", std::int64_t(inputs.beads.size())},
            {"n_flagged_beads", std::int64_t(inputs.n_flagged)},
            {"method", parameters.method},
            {"reason", fit.report.reason}};
  return s;
}

DisplacementField fitted_field(const Inputs& inputs, const LinearData& data, const EnsembleFit& fit) {
  const Eigen::VectorXd model = data.compliance_um_per_nN * fit.forces_nN;
  DisplacementField field = inputs.beads;
  for (std::size_t i = 0; i < field.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    field[i].displacement_um = {model[row], model[row + 1]};
    field[i].sigma_um = 0;
  }
  return field;
}

void write_displacement_vtp(const Path& file, const DisplacementField& measured, const DisplacementField& fitted) {
  std::vector<Vec2> points;
  PointArray u{.name = "measured_um", .scalars = {}, .vectors = {}};
  PointArray model{.name = "fitted_um", .scalars = {}, .vectors = {}};
  PointArray residual{.name = "residual_um", .scalars = {}, .vectors = {}};
  for (std::size_t i = 0; i < measured.size(); ++i) {
    points.push_back(measured[i].position_um);
    u.vectors.push_back(measured[i].displacement_um);
    model.vectors.push_back(fitted[i].displacement_um);
    residual.vectors.push_back(measured[i].displacement_um - fitted[i].displacement_um);
  }
  write_points_vtp(file, points, {u, model, residual});
}

void write_tractions_vtp(const Path& file, const Cell& cell, const std::vector<AdhesionForce>& forces) {
  PointArray force{.name = "force_nN", .scalars = {}, .vectors = {}};
  PointArray traction{.name = "traction_kPa", .scalars = {}, .vectors = {}};
  for (std::size_t a = 0; a < forces.size(); ++a) {
    force.vectors.push_back(forces[a].force_nN);
    traction.vectors.push_back(1 / cell.adhesions[a].area_um2 * forces[a].force_nN);
  }
  write_ellipses_vtp(file, cell.adhesions, {force, traction});
}

/// The first network, contracted by the mean tensions.
void write_contracted(const Path& file, const network::CableNetwork& network, const EnsembleFit& fit) {
  std::vector<double> tensions;
  for (const Estimate& e : fit.tensions_nN) tensions.push_back(e.value);
  const network::Equilibrium e = network.equilibrium(tensions, fit.fits.front().trial.equilibrium.positions_um);
  write_contracted_network(file, network.network(), e.positions_um, e.link_force_nN);
}

void write_surface(const Path& file, const substrate::Substrate& substrate, const Cell& cell,
                   const std::vector<AdhesionForce>& forces) {
  std::vector<Vec2> forces_nN;
  for (const AdhesionForce& f : forces) forces_nN.push_back(f.force_nN);
  substrate::write_substrate_vtu(file, substrate, ellipses_of(cell), forces_nN);
}

std::vector<Effect> effects_of(const substrate::Substrate& substrate, const Inputs& inputs, const FitParameters& p) {
  std::vector<Effect> effects = substrate.effects();
  const std::string n_fibres = std::to_string(inputs.cell.fibres.size());
  effects.push_back({.name = "stress fibres in the network",
                     .is_on = !inputs.cell.fibres.empty(),
                     .why = n_fibres + " fibres were segmented"});
  effects.push_back({.name = "mesh ensemble",
                     .is_on = p.n_meshes > 1,
                     .why = p.n_meshes > 1
                                ? std::to_string(p.n_meshes) + " meshes: their spread is part of the error bars"
                                : "one mesh: the error bars hold the bead noise only"});
  return effects;
}

StageReport fit(const FitStageParameters& p, StageContext& context) {
  context.progress(0, "reading");
  const Inputs inputs = read_inputs(context);
  const auto substrate = substrate::make_substrate(p.gel, p.substrate, context.threads);
  context.progress(0.05, "compliance of the substrate");
  const LinearData data = reduce(inputs.beads, compliance_of(*substrate, inputs));
  context.progress(0.3, "spanning networks");
  const std::vector<network::CableNetwork> networks = span_ensemble(inputs, p, context.threads);
  const EnsembleFit fit = fit_ensemble(networks, data, adhesion_ids_of(inputs.cell), p.fit, context.threads,
                                       [&](double f, std::string_view what) { context.progress(0.4 + 0.5 * f, what); });

  const std::vector<Tension> tensions = tensions_of(fit);
  const std::vector<AdhesionForce> forces = forces_of(fit, inputs.cell);
  const DisplacementField fitted = fitted_field(inputs, data, fit);
  const FitSummary summary = summary_of(fit, data, inputs, networks, p.fit);
  write_tensions(context.output("out", "tensions.csv"), tensions, inputs.cell.fibres);
  write_adhesion_forces(context.output("out", "adhesion_forces.csv"), forces, inputs.cell.adhesions);
  write_fit_summary(context.output("out", "fit.json"), summary);
  write_contracted(context.output("out", "contracted.vtu"), networks.front(), fit);
  write_tractions_vtp(context.output("out", "tractions.vtp"), inputs.cell, forces);
  write_displacement(context.output("out", "fitted_displacement.csv"), fitted);
  write_displacement_vtp(context.output("out", "displacement.vtp"), inputs.beads, fitted);
  context.progress(0.95, "surface of the gel");
  write_surface(context.output("out", "substrate.vtu"), *substrate, inputs.cell, forces);
  context.progress(1, "done");

  const auto n_unidentifiable =
      std::count_if(tensions.begin(), tensions.end(), [](const Tension& t) { return !t.identifiable; });
  StageReport report{.converged = fit.report.converged,
                     .summary = std::to_string(tensions.size() - 1) + " fibre tensions, total force " +
                                std::to_string(summary.total_force_nN) + " nN, relative L2 " +
                                std::to_string(summary.relative_l2),
                     .figures = summary.more,
                     .effects = effects_of(*substrate, inputs, p.fit)};
  if (n_unidentifiable > 0) report.summary += "; " + std::to_string(n_unidentifiable) + " tensions not identifiable";
  if (inputs.n_flagged > 0) report.summary += "; " + std::to_string(inputs.n_flagged) + " flagged beads left out";
  if (!fit.report.converged) report.summary = fit.report.reason;
  if (data.has_errors && fit.chi_squared_per_degree > kPoorFit) {
    report.summary += "; the model explains the beads poorly (chi squared " +
                      std::to_string(fit.chi_squared_per_degree) +
                      " per degree of freedom): do displacement, segmentation and gel belong together?";
  }
  for (const auto& figure : substrate->figures()) report.figures.push_back(figure);
  return report;
}

}  // namespace
}  // namespace mbtfm::inverse

int main(int argc, char** argv) {
  using mbtfm::FileArgument;
  using namespace mbtfm::inverse;
  return mbtfm::run_stage<FitStageParameters>(
      {.name = "fit",
       .purpose = "find the tension of every stress fibre and the force of every adhesion from bead displacements",
       .files = {{"cell", FileArgument::Kind::input,
                  "folder with adhesions.csv, fibres.csv, fibre_points.csv, outline.csv"},
                 {"network", FileArgument::Kind::input, "network.vtu"},
                 {"displacement", FileArgument::Kind::input, "displacement.csv of the beads"},
                 {"out", FileArgument::Kind::output_folder, "tensions.csv, adhesion_forces.csv, fit.json, VTK files"}}},
      argc, argv, fit);
}
