#include "mbtfm/explain.h"

#include <cmath>

#include "pipeline/contract/csv.h"

namespace mbtfm::inverse {

Change change_between(const std::string& effect, const EnsembleFit& without, const EnsembleFit& with) {
  const Eigen::VectorXd before = values_of(without);
  return {effect, values_of(with).head(before.size()) - before};
}

LinearData without_turn(LinearData data) {
  Vec2 centre;
  for (const Vec2 p : data.position_um) centre += (1 / static_cast<double>(data.position_um.size())) * p;
  Eigen::VectorXd turn(data.displacement_um.size()), weighted(turn.size());
  for (Eigen::Index b = 0; b < data.bead_weight.size(); ++b) {
    const Vec2 d = data.position_um[static_cast<std::size_t>(b)] - centre;
    const double weight = data.bead_weight[b] * std::pow(data.weight_per_um[2 * b], 2);
    turn.segment<2>(2 * b) << -d.y, d.x;
    weighted.segment<2>(2 * b) = weight * turn.segment<2>(2 * b);
  }
  const double norm = weighted.dot(turn);
  if (norm <= 0) return data;
  weighted /= norm;
  // the angle that fits best for any forces is linear in them: (turnᵀ W² (u − G R)) / (turnᵀ W² turn)
  data.response = substrate::less_a_mode(data.response, turn, data.response->pull_back(weighted));
  data.displacement_um -= weighted.dot(data.displacement_um) * turn;
  reweight(data, Eigen::VectorXd(data.bead_weight));
  return data;
}

double relative(const Change& change, const EnsembleFit& fit) {
  if (change.at_most) return *change.at_most;
  const Eigen::VectorXd tensions = values_of(fit);
  const Eigen::Index n = tensions.size() > 1 ? tensions.size() - 1 : 1;
  const double size = tensions.tail(n).norm();
  return size > 0 ? change.by_tension_nN.tail(n).norm() / size : 0;
}

std::string sentence(const Change& change, const EnsembleFit& fit) {
  const std::string percent = brief(100 * relative(change, fit)) + " %";
  if (change.at_most) return "would change the tensions by at most " + percent;
  Eigen::Index most = 0;
  const double largest = change.by_tension_nN.cwiseAbs().maxCoeff(&most);
  const int id = fit.fibre_ids[static_cast<std::size_t>(most)];
  return "would change the tensions by " + percent + ", that of " +
         (id == 0 ? "the network" : "fibre " + std::to_string(id)) + " by " + brief(largest) + " nN";
}

void write_changes(const std::filesystem::path& file, const std::vector<Change>& changes, const EnsembleFit& fit) {
  CsvText csv({"effect", "fibre_id", "change_nN"});
  for (const Change& change : changes) {
    for (Eigen::Index i = 0; i < change.by_tension_nN.size(); ++i) {
      csv.add(change.effect).add(fit.fibre_ids[static_cast<std::size_t>(i)]).add(change.by_tension_nN[i]);
      csv.end_row();
    }
  }
  write_text(file, csv.str());
}

}  // namespace mbtfm::inverse
