/// The objective of the tension fit: Phi(t) = ½ |C R(t) − y|², R(t) the adhesion forces of a contractile cell.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "mbtfm/tensions/linear_data.h"
#include "network/contractile.h"

namespace mbtfm::tensions {

/// One trial of the tensions. Knows its equilibrium, so that the next trial can start there.
struct Trial {
  VectorXd tensions_nN;  ///< by label: the network, then the fibres
  std::shared_ptr<const network::AtRest> rest;
  VectorXd forces_nN;  ///< 2·adhesions of the data: fx, fy
  VectorXd residual;   ///< C R − y: as long
  double objective = 0;
};

/// |W (u(R) − u)|² with the displacement u(R) solved afresh for these adhesion forces, as the thesis does (3.2.5).
using SolvedMisfit = std::function<double(const VectorXd& forces_nN)>;

using network::CutReaction;

class TensionProblem {
 public:
  /// @param adhesion_ids  the adhesion of each pair of forces of the data; every adhesion that holds the network must
  ///                      be among them
  /// @param solved_misfit  where given, the objective of every trial comes from it, and not from the data's compliance:
  ///                       the same to rounding, at the thesis' cost
  /// @param threads  that derivatives take
  TensionProblem(const network::Contractile& cell, const ReducedData& data, const std::vector<int>& adhesion_ids,
                 SolvedMisfit solved_misfit = {}, int threads = 1);

  int n_tensions() const { return static_cast<int>(cell_.fibre_ids().size()); }
  const network::Contractile& cell() const { return cell_; }
  const ReducedData& data() const { return data_; }
  const std::vector<int>& adhesion_ids() const { return adhesion_ids_; }

  /// @param nearby  a trial whose equilibrium is a good place to start, or none
  /// @param force_tolerance  of the equilibrium, where rougher than usual will do: see network::Contractile
  Trial evaluate(const VectorXd& tensions_nN, const Trial* nearby = nullptr,
                 std::optional<double> force_tolerance = {}) const;
  /// Torque of the cell on the substrate about the origin, by adhesion of the data: those of its vertices together.
  VectorXd torques_nN_um(const Trial& trial) const;
  /// The part of the forces that the actin network brings: 2·adhesions of the data.
  VectorXd network_part_nN(const Trial& trial) const;
  /// dR/dt by adhesion of the data: 2·adhesions × tensions, from the implicit function theorem.
  MatrixXd force_derivatives(const Trial& trial) const;
  /// d(C R)/dt: 2·adhesions × tensions
  MatrixXd jacobian(const Trial& trial) const { return displace(data_, force_derivatives(trial), threads_); }
  /// dPhi/dt by tension, exact.
  VectorXd gradient(const Trial& trial) const;
  /// dPhi/dt by central differences over threads, as the thesis does (3.2.5); for comparison.
  VectorXd finite_difference_gradient(const Trial& trial, int threads) const;

 private:
  MatrixXd to_data_rows(const MatrixXd& by_adhesion_of_cell) const;
  const network::Contractile& cell_;
  const ReducedData& data_;
  std::vector<int> adhesion_ids_;
  SolvedMisfit solved_misfit_;
  int threads_;
  std::vector<Index> pair_of_;  ///< of the i-th adhesion that holds the cell, in the data
};

/// The multiple of these tensions that fits best. Forces grow in proportion to the tensions (but for cables beyond
/// their rest length), so one trial and one division tell it; a start of the wrong size then costs no steps. And the
/// vertices hardly move, so the second equilibrium starts where the first one is.
/// @param nearby  a trial of tensions like these, to start the first one from
Trial scaled_to_data(const TensionProblem& problem, const VectorXd& tensions_nN, const Trial* nearby = nullptr);

/// Tensions all equal, of the size that fits best: where the fit starts.
/// @throws InvalidData where the beads move outward as a whole, which no contracting network explains
Trial uniform_start(const TensionProblem& problem);

}  // namespace mbtfm::tensions
