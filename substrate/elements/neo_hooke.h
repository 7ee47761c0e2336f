/// Large strains: a nearly incompressible Neo-Hookean gel,
///
///   W = mu/2 (J^(-2/3) tr C - 3) + kappa/4 (J² - 1 - 2 ln J),   kappa = 2 mu (1 + nu) / (3 (1 - 2 nu)),
///
/// total Lagrangian, as mu/2 (J^(-2/3) tr C - 3) + U(theta) + p (J - theta) with a pressure p and a dilatation theta
/// that are linear in each element and unknowns of Newton's method: with displacements alone it fails near nu = 1/2.
/// Source: Simo, Taylor, Pister, CMAME 51 (1985) 177.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "pipeline/contract/gel.h"
#include "substrate/elements/volume.h"

namespace mbtfm::elements {

struct NeoHooke {
  explicit NeoHooke(const Gel& gel);
  double mu_kPa, kappa_kPa;

  /// First Piola–Kirchhoff stress of mu/2 (J^(-2/3) tr C - 3) + p J; p the mean Cauchy stress.
  Eigen::Matrix3d stress_kPa(const Eigen::Matrix3d& F, double p_kPa) const;
  /// Its derivative by F, at a given p, along dF.
  Eigen::Matrix3d stress_change_kPa(const Eigen::Matrix3d& F, double p_kPa, const Eigen::Matrix3d& dF) const;
  double pressure_kPa(double theta) const { return 0.5 * kappa_kPa * (theta - 1 / theta); }
  double pressure_slope_kPa(double theta) const { return 0.5 * kappa_kPa * (1 + 1 / (theta * theta)); }
};

/// Displacement of all nodes; pressure and dilatation of each cell, as coefficients of its pressures.
struct LargeState {
  Vectors at_nodes_um;
  std::vector<Eigen::Vector4d> pressure_kPa, dilatation;
};

/// While nothing acts.
LargeState state_at_rest(const Space& space);

/// What acts, per area and volume of the gel at rest, and keeps its direction.
struct LargeLoading {
  OfSurface traction_kPa = {};
  OfPlace held_um = {};           ///< displacement of the nodes that are held
  OfPlace force_kPa_per_um = {};  ///< by volume
  Vectors at_nodes_nN = {};       ///< by free node; empty: none
};

struct LargeSolution {
  LargeState state = {};
  double share = 0;  ///< of the load that was reached: 1 where all of it
  int load_steps = 0;
  int most_iterations = 0;                             ///< of Newton's method in a load step
  std::vector<double> residuals = {};                  ///< of the last load step, relative to the forces
  std::optional<Eigen::Vector3d> turned_over_um = {};  ///< of the gel at rest: where a larger load would do that
};

/// @throws NotSolved where no step of the load, however small, can be solved: with the share reached and the place
/// where an
///         element would be turned inside out
LargeSolution solve_neo_hooke(const Gel& gel, const Space& space, const LargeLoading& loading, int load_steps,
                              const numerics::FactorOptions& options);

/// As solve_neo_hooke, but gives the last good state and its share instead of an error.
LargeSolution solve_neo_hooke_as_far(const Gel& gel, const Space& space, const LargeLoading& loading, int load_steps,
                                     const numerics::FactorOptions& options);

/// By cell of the space's mesh: the tangent about a state. Both must outlive it.
std::function<MatrixXd(int cell)> large_stiffness_of(const Gel& gel, const Space& space, const LargeState& state);

/// Cauchy's, of a state.
StressLaw large_stress(const Gel& gel, const LargeState& state);

}  // namespace mbtfm::elements
