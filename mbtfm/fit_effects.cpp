#include "mbtfm/fit_effects.h"

#include <algorithm>
#include <optional>

#include "pipeline/contract/csv.h"

namespace mbtfm::inverse {
namespace {

constexpr const char* kTurnLeft = "turn of the displacement";

std::optional<Change> change_by_gel(const std::string& name, const FittedCell& c,
                                    const substrate::SubstrateParameters& parameters, int threads) {
  const auto gel = substrate::make_substrate(c.parameters.gel, parameters, threads);
  LinearData with = c.data;
  with.compliance_um_per_nN = gel->compliance_um_per_nN(points_of(c.inputs.beads), ellipses_of(c.inputs.cell));
  reweight(with, c.data.bead_weight);
  return change_by_data(name, c.fit, c.data, with);
}

std::optional<Change> with_base(const Effect& e, const FittedCell& c, int threads) {
  substrate::SubstrateParameters parameters = c.parameters.substrate;
  parameters.model = "auto";
  parameters.effects.finite_thickness = "on";
  return change_by_gel(e.name, c, parameters, threads);
}

std::optional<Change> with_sides(const Effect& e, const FittedCell& c, int threads) {
  substrate::SubstrateParameters parameters = c.parameters.substrate;
  if (!parameters.side_distance_um) return {};
  parameters.model = "auto";
  parameters.effects.finite_sides = "on";
  if (parameters.effects.finite_thickness == "off") parameters.effects.finite_thickness = "auto";
  return change_by_gel(e.name, c, parameters, threads);
}

/// Where the effect's number bounds the change of the field, and so of the forces that displace the gel as far.
std::optional<Change> bounded_by_number(const Effect& e, const FittedCell& c) {
  if (!e.number) return {};
  Change change{e.name, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(c.fit.tensions_nN.size()))};
  for (std::size_t i = 0; i < c.fit.tensions_nN.size(); ++i) {
    change.by_tension_nN[static_cast<Eigen::Index>(i)] = *e.number * c.fit.tensions_nN[i].value;
  }
  return change;
}

std::optional<Change> with_elasticity(const Effect& e, const FittedCell& c, int threads) {
  std::vector<network::CableNetwork> networks;
  for (const network::CableNetwork& n : c.networks) networks.emplace_back(n.network(), c.parameters.cables);
  return change_by_networks(e.name, c.fit, c.data, networks, adhesion_ids_of(c.inputs.cell), threads);
}

std::optional<Change> with_loss(const Effect& e, const FittedCell& c) {
  return change_by_loss(e.name, c.fit, c.data, c.parameters.fit.robust_kind);
}

std::optional<Change> with_turn(const Effect& e, const FittedCell& c) {
  return change_by_turn(e.name, c.fit, c.data, points_of(c.inputs.beads));
}

/// A fit on one network that has them.
std::optional<Change> with_fibres(const Effect& e, const FittedCell& c, int threads) {
  if (c.cell.fibres.empty()) return {};
  std::vector<network::CableNetwork> networks;
  networks.emplace_back(network::generate_network(c.cell, c.parameters.network).network, c.parameters.cables);
  LinearData data = c.data;
  const EnsembleFit fit = fit_ensemble(networks, data, adhesion_ids_of(c.cell), c.parameters.fit, threads, {});
  const double without = c.fit.meshes.front().fit.trial.tensions_nN[0];
  return Change{e.name, Eigen::VectorXd::Constant(1, fit.tensions_nN[0].value - without)};
}

std::optional<Change> change_with(const Effect& e, const FittedCell& c, int threads) {
  if (e.name == "stress fibres") return with_fibres(e, c, threads);
  if (e.name == "finite thickness") return with_base(e, c, threads);
  if (e.name == "finite sides") return with_sides(e, c, threads);
  if (e.name == "depth-graded gel" || e.name == "uneven surface") return bounded_by_number(e, c);
  if (e.name == "elasticity of cables") return with_elasticity(e, c, threads);
  if (e.name == "robust loss") return with_loss(e, c);
  if (e.name == kTurnLeft) return with_turn(e, c);
  return {};
}

/// Of those that change no tension, or of which nothing is known.
std::string in_words(const std::string& name) {
  if (name == "vertical displacement") return "would change no tension: nothing along the surface depends on it";
  if (name == "time coupling") return "would change no tension but by the fit's tolerance: only where the fit begins";
  return "would change nothing that can be told: there is no datum of it";
}

}  // namespace

std::vector<Change> explain(std::vector<Effect>& effects, const FittedCell& cell, int threads) {
  effects.push_back(
      decided(kTurnLeft, "auto", false,
              "mbtfm-track takes turns off the displacement; this is what it left, or was told to leave"));
  std::vector<Change> changes;
  for (Effect& effect : effects) {
    if (effect.is_on) continue;
    const std::optional<Change> change = change_with(effect, cell, threads);
    effect.would_change = change ? sentence(*change, cell.fit) : in_words(effect.name);
    if (!change) continue;
    effect.change = relative(*change, cell.fit);
    changes.push_back(*change);
  }
  return changes;
}

void declare(ParameterList& list, FitStageParameters& p) {
  declare(list, p.gel);
  declare(list, p.network);
  declare(list, p.cables);
  declare(list, p.substrate);
  declare(list, p.fit);
  declare(list, p.segmentation);
  list.add("explain", p.explain, "estimate how far each effect that is off would change the tensions");
  declare(list, p.effects,
          {"stress_fibres", "finite_thickness", "finite_sides", "depth_graded_gel", "vertical_displacement",
           "cable_elasticity", "robust_loss", "time_coupling", "effect_tolerance"});
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

std::vector<Vec2> points_of(const DisplacementField& beads) {
  std::vector<Vec2> points;
  for (const Bead& b : beads) points.push_back(b.position_um);
  return points;
}

}  // namespace mbtfm::inverse
