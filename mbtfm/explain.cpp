#include "mbtfm/explain.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "mbtfm/robust.h"
#include "pipeline/contract/csv.h"
#include "pipeline/contract/parallel.h"

namespace mbtfm::inverse {
namespace {

/// Forces of a mesh and their derivatives, where the step begins.
struct Expansion {
  Eigen::VectorXd tensions_nN, forces_nN;
  Eigen::MatrixXd derivatives;
};

std::vector<Expansion> expansions_of(const EnsembleFit& fit) {
  std::vector<Expansion> result;
  for (const MeshFit& m : fit.meshes) {
    result.push_back({m.fit.trial.tensions_nN, m.fit.trial.forces_nN, m.force_derivatives});
  }
  return result;
}

/// Reduced data in which the errors of beads and model together are as even as in the fit's: y = C (R + e) + n.
/// Columns beyond those of the forces have no model error.
ReducedData weighed_as(const EnsembleFit& fit, const ReducedData& data) {
  if (!fit.model_error) return data;
  const Eigen::VectorXd& variance = fit.model_error->force_variance_nN2;
  const Eigen::MatrixXd C = data.compliance.leftCols(variance.size()) * variance.cwiseSqrt().asDiagonal();
  Eigen::MatrixXd errors = C * C.transpose() / fit.model_error->noise_variance;
  errors.diagonal().array() += 1;
  const Eigen::LLT<Eigen::MatrixXd> root(errors);
  ReducedData result = data;
  result.compliance = root.matrixL().solve(data.compliance);
  result.target = root.matrixL().solve(data.target);
  return result;
}

/// The tensions that fit best about the expansion, less its own; >= 0 in sum.
Eigen::VectorXd step_nN(const Expansion& at, const ReducedData& data) {
  const Eigen::MatrixXd J = data.compliance * at.derivatives;
  Eigen::MatrixXd H = J.transpose() * J;
  H.diagonal().array() += 1e-12 * H.diagonal().maxCoeff();  // a tension that no bead feels
  const Eigen::VectorXd gradient = J.transpose() * (data.compliance * at.forces_nN - data.target);
  return bounded_quadratic_minimum(H, gradient, -at.tensions_nN);
}

Eigen::VectorXd mean_step_nN(const std::vector<Expansion>& meshes, const ReducedData& data) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(meshes.front().tensions_nN.size());
  for (const Expansion& mesh : meshes) sum += step_nN(mesh, data);
  return sum / static_cast<double>(meshes.size());
}

}  // namespace

Change change_by_data(const std::string& effect, const EnsembleFit& fit, const LinearData& without,
                      const LinearData& with) {
  const std::vector<Expansion> meshes = expansions_of(fit);
  // The fit ends a little short of its own best step: that is no part of the change.
  return {effect,
          mean_step_nN(meshes, weighed_as(fit, with.reduced)) - mean_step_nN(meshes, weighed_as(fit, without.reduced))};
}

Change change_by_networks(const std::string& effect, const EnsembleFit& fit, const LinearData& data,
                          const std::vector<network::CableNetwork>& with, const std::vector<int>& adhesion_ids,
                          int threads) {
  constexpr int kSteps = 2;  // the first makes most of it, the second what the forces' bend leaves
  const auto n = static_cast<int>(with.size());
  const auto trial_at = [&](int m, const Eigen::VectorXd& tensions_nN, const Trial& nearby) {
    return TensionProblem(with[static_cast<std::size_t>(m)], data.reduced, adhesion_ids).evaluate(tensions_nN, &nearby);
  };
  const auto derivatives = [&](int m, const Trial& trial) {
    return TensionProblem(with[static_cast<std::size_t>(m)], data.reduced, adhesion_ids).force_derivatives(trial);
  };
  std::vector<Trial> trials(with.size());
  std::vector<MeshForces> common(with.size());
  const Trial& first = fit.meshes.front().fit.trial;
  parallel_for(n, threads, [&](int m) {
    const auto i = static_cast<std::size_t>(m);
    const Trial& start = fit.meshes[i].fit.trial;
    trials[i] = trial_at(m, start.tensions_nN, start);
    if (!fit.model_error) return;
    const Trial here = trial_at(m, first.tensions_nN, trials[i]);
    common[i] = {here.forces_nN, derivatives(m, here)};
  });
  const ReducedData weighed =
      fit.model_error ? model_error(common, data.reduced, fit.model_error->noise_variance).data : data.reduced;
  parallel_for(n, threads, [&](int m) {
    Trial& trial = trials[static_cast<std::size_t>(m)];
    for (int step = 0; step < kSteps; ++step) {
      const Expansion at{trial.tensions_nN, trial.forces_nN, derivatives(m, trial)};
      trial = trial_at(m, (trial.tensions_nN + step_nN(at, weighed)).cwiseMax(0.0), trial);
    }
  });
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(first.tensions_nN.size());
  for (std::size_t i = 0; i < with.size(); ++i) {
    sum += (trials[i].tensions_nN - fit.meshes[i].fit.trial.tensions_nN) / static_cast<double>(n);
  }
  return {effect, sum};
}

Change change_by_loss(const std::string& effect, const EnsembleFit& fit, const LinearData& data,
                      const std::string& robust_kind) {
  constexpr int kMaxRounds = 20;  // the weights settle linearly, in some ten rounds
  const std::vector<Expansion> meshes = expansions_of(fit);
  LinearData weighed = data;
  Eigen::VectorXd forces = fit.forces_nN;
  Change change{effect, Eigen::VectorXd::Zero(meshes.front().tensions_nN.size())};
  for (int round = 0; round < kMaxRounds; ++round) {
    const Eigen::VectorXd residual = weighted_residual(data, forces);
    const double scale = robust_scale(data, residual);
    if (scale <= 0) break;
    Eigen::VectorXd weights(residual.size() / 2);
    for (Eigen::Index b = 0; b < weights.size(); ++b) {
      weights[b] = robust_weight(robust_kind, residual.segment<2>(2 * b).norm() / scale);
    }
    reweight(weighed, weights);
    const Change next = change_by_data(effect, fit, data, weighed);
    const double moved = (next.by_tension_nN - change.by_tension_nN).norm();
    change = next;
    forces = fit.forces_nN;
    for (const Expansion& mesh : meshes) {
      forces += mesh.derivatives * change.by_tension_nN / static_cast<double>(meshes.size());
    }
    if (moved <= 1e-2 * change.by_tension_nN.norm()) break;  // an estimate needs no more
  }
  return change;
}

Change change_by_turn(const std::string& effect, const EnsembleFit& fit, const LinearData& data,
                      const std::vector<Vec2>& points_um) {
  Vec2 centre;
  for (const Vec2 p : points_um) centre += (1 / static_cast<double>(points_um.size())) * p;
  LinearData turned = data;
  const Eigen::Index n_forces = data.compliance_um_per_nN.cols();
  turned.compliance_um_per_nN.conservativeResize(Eigen::NoChange, n_forces + 1);
  for (std::size_t b = 0; b < points_um.size(); ++b) {
    const Vec2 d = points_um[b] - centre;
    const auto row = 2 * static_cast<Eigen::Index>(b);
    turned.compliance_um_per_nN(row, n_forces) = -d.y;
    turned.compliance_um_per_nN(row + 1, n_forces) = d.x;
  }
  auto turn = turned.compliance_um_per_nN.col(n_forces);  // of the size of a force's column: any unit of angle serves
  turn *= data.compliance_um_per_nN.norm() / std::sqrt(static_cast<double>(n_forces)) / std::max(1e-300, turn.norm());
  reweight(turned, data.bead_weight);
  const ReducedData with = weighed_as(fit, turned.reduced);
  const ReducedData without = weighed_as(fit, data.reduced);
  const std::vector<Expansion> meshes = expansions_of(fit);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(meshes.front().tensions_nN.size());
  for (const Expansion& mesh : meshes) {
    // The angle is free either way: it is cleared from the data, and no bound concerns it.
    const Eigen::VectorXd column = with.compliance.col(n_forces).normalized();
    ReducedData cleared = with;
    cleared.compliance = with.compliance.leftCols(n_forces);
    cleared.compliance -= column * (column.transpose() * cleared.compliance).eval();
    cleared.target -= column.dot(with.target) * column;
    sum += step_nN(mesh, cleared) - step_nN(mesh, without);
  }
  return {effect, sum / static_cast<double>(meshes.size())};
}

double relative(const Change& change, const EnsembleFit& fit) {
  const std::size_t first = fit.tensions_nN.size() > 1 ? 1 : 0;
  double squares = 0, of_change = 0;
  for (std::size_t i = first; i < fit.tensions_nN.size(); ++i) {
    squares += fit.tensions_nN[i].value * fit.tensions_nN[i].value;
    of_change +=
        change.by_tension_nN[static_cast<Eigen::Index>(i)] * change.by_tension_nN[static_cast<Eigen::Index>(i)];
  }
  return squares > 0 ? std::sqrt(of_change / squares) : 0;
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

std::string sentence(const Change& change, const EnsembleFit& fit) {
  Eigen::Index most = 0;
  const double largest = change.by_tension_nN.cwiseAbs().maxCoeff(&most);
  const int id = fit.fibre_ids[static_cast<std::size_t>(most)];
  return "would change the tensions by " + brief(100 * relative(change, fit)) + " %, that of " +
         (id == 0 ? "the network" : "fibre " + std::to_string(id)) + " by " + brief(largest) + " nN";
}

}  // namespace mbtfm::inverse
