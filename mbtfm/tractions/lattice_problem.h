/// Bead displacements as the elastic answer to tractions on a lattice, in Fourier space.
/// docs/theory/reconstructions.md (9), (10).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "mbtfm/tractions/surface_spectrum.h"
#include "pipeline/contract/beads.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::tractions {

/// Weights of the four nodes around a share s of the way from the second to the third: cubic convolution with a = −1/2,
/// third order, exact on nodes. Source: Keys, IEEE Trans. ASSP 29 (1981) 1153, eq. 15.
std::array<double, 4> keys_weights(double s);

struct LatticeOptions {
  GelModel model = GelModel::layer;
  std::optional<double> spacing_um;  ///< unset: that of beads on a lattice, half the mean distance of scattered ones
  double padding = 1.5;              ///< periods over the field's size; 1: the field is periodic itself
  int threads = 1;
};

/// |P G t − u|² with u the displacements times the roots of their weights, P the interpolation from the lattice to the
/// beads, cubic (Keys 1981), times the same. Weights have a mean of one over the lattice's nodes, so that lambda is
/// that of an evenly sampled field whatever the beads' density and errors.
class LatticeProblem {
 public:
  /// @throws InvalidData where the beads are too few, two are in the same place or all are on one line
  LatticeProblem(const DisplacementField& beads, const Gel& gel, const LatticeOptions& options);

  const Lattice& field() const { return field_; }  ///< that covers the beads
  const Lattice& box() const { return box_; }      ///< one period; the field is its first rows and columns
  const SurfaceSpectrum& spectrum() const { return *spectrum_; }
  const WaveTransform& transform() const { return *transform_; }
  double n_data() const { return static_cast<double>(2 * n_beads_); }
  /// The across compliance of the wave that just fits into the field.
  double longest_wave_um_per_kPa() const { return longest_wave_um_per_kPa_; }
  bool is_complete() const { return is_complete_; }  ///< one bead on each node, all of one weight
  std::optional<double> stated_variance() const { return stated_variance_; }  ///< of one component of u
  int threads() const { return threads_; }

  /// Pᵀ u: the displacements on the lattice.
  const NodeField& spread_data() const { return spread_; }
  /// Pᵀ z of random signs: estimates the trace of the influence matrix (Hutchinson 1990).
  NodeField spread_signs() const;
  /// u: 2·beads, components in turn, and the roots of their weights
  const VectorXd& data() const { return data_; }
  const VectorXd& roots() const { return roots_; }
  /// Pᵀ of weighted components. @param memory  for it: fresh memory costs more
  NodeField spread(const VectorXd& components, NodeField memory = {}) const;
  /// P of displacements on the lattice, component by component
  VectorXd at_beads(const NodeField& displacements) const;
  /// u − P of displacements on the lattice, component by component
  VectorXd residuals(const NodeField& displacements) const { return data_ - at_beads(displacements); }
  /// Pᵀ P of nodes, to `result`
  void normal(const NodeField& nodes, NodeField& result) const;
  /// G of waves, in space
  NodeField displaced(WaveField tractions) const;
  /// G Pᵀ of something spread, in waves
  WaveField pulled_back(const NodeField& spread) const;

 private:
  Lattice field_, box_;
  std::unique_ptr<SurfaceSpectrum> spectrum_;
  std::unique_ptr<WaveTransform> transform_;
  std::size_t n_beads_ = 0;
  int threads_;
  bool is_complete_ = false;
  std::optional<double> stated_variance_;
  double longest_wave_um_per_kPa_ = 0;
  struct Tap {
    int node = 0;
    double weight = 0;
  };
  std::vector<Tap> taps_;               ///< of all beads in turn
  std::vector<std::size_t> first_tap_;  ///< by bead, and one more
  NodeField spread_;
  VectorXd data_, roots_;
};

/// (G PᵀP G + lambda²) t = b by conjugate gradients, preconditioned with the inverse for a field without gaps or
/// borders, which is diagonal in Fourier space, in the frame of the wave vectors. For several lambdas in turn: each
/// starts where the one before ended. A pass over the waves costs as much as a transform: so there are three a
/// step, and each does all that it can.
class TikhonovSolver {
 public:
  /// b = G Pᵀ u
  explicit TikhonovSolver(const LatticeProblem& problem);
  /// @param right_hand_side  as the solution, in waves of x and y
  TikhonovSolver(const LatticeProblem& problem, WaveField right_hand_side, int threads);
  /// @param tolerance  of the error, relative, in the energy of the equation
  /// @returns the iterations taken. @throws NotSolved
  int solve(double lambda, double tolerance);
  /// Another right hand side; the solution stays as the place to start.
  void set_right_hand_side(WaveField b);
  WaveField solution() const;
  double solution_squared() const;
  double right_hand_side_times_solution() const;  ///< b · t
  double displaced_squared() const;               ///< |P G t|²

 private:
  struct Start {
    double residual_energy = 0, solution_energy = 0;
  };
  struct StepSize {
    double squared = 0, displaced_squared = 0;
  };
  Start restart(double lambda);
  StepSize turn_step(double ratio);
  double go(double length);
  template <class Body>
  Eigen::Array2d sum_over_waves(const Body& body) const;
  double energy_of_residual(Eigen::Index k) const;
  const LatticeProblem& problem_;
  int threads_;
  double lambda2_ = 0;
  Eigen::ArrayXd by_along_, by_across_;  ///< the preconditioner
  WaveField b_, t_, residual_;           ///< residual: b − (G PᵀP G + lambda²) t
  WaveField step_, work_;
  NodeField nodes_, normal_;
};

}  // namespace mbtfm::tractions
