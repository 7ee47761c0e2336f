/// Tensions from bead displacements (thesis 3.2.5): minimise Phi(t) over t >= 0, by several methods.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mbtfm/tensions/tension_problem.h"
#include "pipeline/contract/report.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::tensions {

struct FitParameters {
  std::string method = "gauss-newton";   ///< converges in about ten steps; the others are kept for comparison
  std::string gradients = "exact";       ///< finite-difference: as in the thesis, one equilibrium a tension and side
  std::string loss = "auto";             ///< as the switch robust_loss says: auto, squares, or robust_kind
  std::string robust_kind = "huber";     ///< one minimum, and 95 % efficient where the noise is Gaussian after all
  std::string substrate = "compliance";  ///< one matrix a cell; per-evaluation: as in the thesis, for comparison
  std::optional<double> region_um = {};  ///< unset: all beads, as the field far away still tells of the forces
  int n_meshes = 2;  ///< the fewest that tell the model's error; more take 7 % off that of the tensions (validation.md)
  double tolerance = 1e-8;      ///< relative change of the tensions at which the fit stops; with noise it stops before
  int max_steps = 100;          ///< of Gauss–Newton: every loop ends
  int max_evaluations = 5000;   ///< of the conjugate gradients
  double far_distance_um = 10;  ///< beads this far outside the outline tell the noise level
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

/// A fibre that comes out slack may be a minimum of its own beside that of the taut one.
enum class Search {
  nearest,  ///< the minimum that the start leads to, as near as counts where data or weights change after it: to a
            ///< tenth of a standard error along one direction of twenty
  best      ///< to a thirtieth, and the other side of slack fibres is tried, too
};

/// @param start  a trial of this problem: see scaled_to_data(), uniform_start()
/// @throws UsageError for a method it does not know
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
Eigen::VectorXd bounded_quadratic_minimum(const Eigen::MatrixXd& H, const Eigen::VectorXd& g,
                                          const Eigen::VectorXd& low);

}  // namespace mbtfm::tensions
