/// Tensions from bead displacements (thesis 3.2.5): minimise Phi(t) over t >= 0, by several methods.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mbtfm/inverse/loss.h"
#include "mbtfm/tensions/linear_data.h"
#include "network/contractile.h"
#include "pipeline/contract/report.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::tensions {

// The objective of the tension fit: Phi(t) = ½ |C R(t) − y|², R(t) the adhesion forces of a contractile cell.

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
/// their rest length), so one trial and one division give it; a start of the wrong size then costs no steps. And the
/// vertices hardly move, so the second equilibrium starts where the first one is.
/// @param nearby  a trial of tensions like these, to start the first one from
Trial scaled_to_data(const TensionProblem& problem, const VectorXd& tensions_nN, const Trial* nearby = nullptr);

/// Tensions all equal, of the size that fits best: where the fit starts.
/// @throws InvalidData where the beads move outward as a whole, which no contracting network explains
Trial uniform_start(const TensionProblem& problem);

// The fit.

/// Gauss–Newton converges in about ten steps; the others are kept for comparison.
enum class FitMethod { gauss_newton, blockwise_cg, plain_cg };
constexpr auto words(FitMethod) { return std::array{"gauss-newton", "blockwise-cg", "plain-cg"}; }

enum class Gradients {
  exact,
  finite_difference  ///< as in the thesis, one equilibrium a tension and side
};
constexpr auto words(Gradients) { return std::array{"exact", "finite-difference"}; }

using inverse::Loss;

/// How a trial's displacements come about.
enum class TrialDisplacement {
  compliance,     ///< by one matrix a cell
  per_evaluation  ///< solved for each trial: as in the thesis, for comparison
};
constexpr auto words(TrialDisplacement) { return std::array{"compliance", "per-evaluation"}; }

struct FitParameters {
  FitMethod method = FitMethod::gauss_newton;
  Gradients gradients = Gradients::exact;
  std::optional<Loss> loss = {};   ///< as the switch robust_loss says; unset: what the residuals call for
  Loss robust_kind = Loss::huber;  ///< one minimum, and 95 % efficient where the noise is Gaussian after all
  TrialDisplacement substrate = TrialDisplacement::compliance;
  std::optional<double> region_um = {};  ///< unset: all beads, as the field far away still shows the forces
  int n_meshes = 2;  ///< the fewest that give the model's error; more take 7 % off that of the tensions (validation.md)
  double tolerance = 1e-8;      ///< relative change of the tensions at which the fit stops; with noise it stops before
  int max_steps = 100;          ///< of Gauss–Newton: every loop ends
  int max_evaluations = 5000;   ///< of the conjugate gradients
  double far_distance_um = 10;  ///< beads this far outside the outline determine the noise level
  std::optional<double> frame_interval_s = {};  ///< of a time series; unset: tracks go by frame
  int bootstrap = 0;         ///< draws; 0: intervals from the misfit's profile, which are as good and cost nothing
  int surface_lines = 80;    ///< a micrometre for a cell of 80; the time goes with their square
  int cross_validation = 0;  ///< draws; 0: not asked for, as it takes an equilibrium each
};
void declare(stage::ParameterList& list, FitParameters& parameters);

/// Of the largest tension: a network's tension below this is as good as none.
inline constexpr double kNoTension = 1e-6;

/// The misfit that a method had reached after so many equilibria.
struct Milestone {
  int n_evaluations = 0;
  double objective = 0;
};

struct TensionFit {
  Trial trial;  ///< the best one
  Report report;
  int n_evaluations = 0;  ///< equilibria solved from the start on, those of finite differences included
  std::vector<Milestone> history;
};

/// A fibre that comes out slack may be a minimum of its own, in addition to that of the taut one.
enum class Search {
  nearest,  ///< the minimum that the start leads to, as near as counts where data or weights change after it: to a
            ///< tenth of a standard error along one direction of twenty
  best      ///< to a thirtieth, and the other side of slack fibres is tried, too
};

/// @param start  a trial of this problem: see scaled_to_data(), uniform_start()
TensionFit fit_tensions(const TensionProblem& problem, const FitParameters& parameters, int threads, const Trial& start,
                        Search search = Search::best);

/// Levenberg–Marquardt with the exact Jacobian, and what else the Hessian has learnt from the steps before; each step
/// solves the bounded quadratic problem.
TensionFit fit_gauss_newton(const TensionProblem& problem, const FitParameters& parameters, const Trial& start,
                            Search search = Search::best);

/// Non-linear conjugate gradients (Polak–Ribière), projected on t >= 0. `blocks` are taken in turn: so many steps on
/// those tensions, the others held.
struct Block {
  std::vector<int> tensions;
  int n_steps = 1;
};
TensionFit fit_conjugate_gradients(const TensionProblem& problem, const FitParameters& parameters, int threads,
                                   const Trial& start, const std::vector<Block>& blocks);

/// The minimiser of ½ xᵀ H x + gᵀ x over x >= low, for symmetric positive definite H, by an active set.
VectorXd bounded_quadratic_minimum(const MatrixXd& H, const VectorXd& g, const VectorXd& low);

}  // namespace mbtfm::tensions
