/// One question for all that a fit may lack: a block of displacements X that is not in it, of sizes b,
///
///   what the fit leaves = X b + noise,   q = Xᵀ V⁻¹ P r,   K = Xᵀ V⁻¹ P X,
///
/// P takes off what is free to follow, V is the noise's covariance and that of the model's error. Without the block q
/// has the covariance K (score test: Rao, Math Proc Camb Phil Soc 44:50, 1948); with sizes of variance κ the data speak
/// for it by log_bayes_factor(). The best block is a cause: the others are asked again with it.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mbtfm/tensions/linear_data.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/gel.h"
#include "substrate/compliance.h"

namespace mbtfm::tensions {

struct EnsembleFit;

/// How these places answer to forces on the ellipses, by a model of the gel, which must outlive it.
substrate::LazyResponse response_to(const std::vector<substrate::Ellipse>& ellipses, const std::vector<Vec3>& places_um,
                                    Index dimension, const substrate::Substrate& gel);

/// Of each place the displacement by forces of 1 nN/um times the root of its area: components × components·places.
MatrixXd by_root_of_area(MatrixXd compliance_um_per_nN, const std::vector<substrate::Ellipse>& places);

struct Scores {
  MatrixXd information;  ///< K, of noise of variance 1
  VectorXd scores;       ///< q; over s where the noise has the variance s²
};
/// Of these columns alone.
Scores at(const Scores& scores, const std::vector<Index>& columns);
/// Less what these columns explain, which are of variance κ s².
/// @param scores  over s
Scores beside(const Scores& scores, const std::vector<Index>& columns, double kappa);

/// Of data with noise of variance s² and random effects of variance κ s²: those along which they do not mix.
struct Spectrum {
  VectorXd information;  ///< d: signal over noise, in squares, at κ = 1
  VectorXd found;        ///< c² / s²: its mean is d (1 + κ d)
};
/// @param scores  over s
Spectrum spectrum_of(const Scores& scores);

/// log of the likelihood of sizes of variance κ s² over that of none: ½ Σ κ c²/(1 + κ d) − log(1 + κ d).
double log_bayes_factor(const Spectrum& spectrum, double kappa);
/// Of greatest likelihood, to a quarter: what is allowed for hangs on it weakly (restricted maximum likelihood;
/// Patterson & Thompson, Biometrika 58 (1971) 545).
double likeliest_kappa(const Spectrum& spectrum);

/// Blocks that are more likely than not, the most likely one first, each in addition to those before: its
/// log_bayes_factor() is above the log of the prior odds against it.
/// @param columns, log_odds_against  by block  @param kappa  of the sizes of a block; none: the likeliest
std::vector<std::size_t> causes_among(Scores scores, const std::vector<std::vector<Index>>& columns,
                                      const std::vector<double>& log_odds_against, std::optional<double> kappa = {});

/// Columns of displacements as the data see them.
struct Pattern {
  MatrixXd forces_nN;  ///< of the adhesions that look most like them, (CᵀC)⁻¹ Gᵀ W² P X: 2·adhesions × columns
  Scores beyond;       ///< of what no such forces do; scores not over s
};
/// @param columns_um  2·beads × columns
Pattern pattern_of(const LinearData& data, const MatrixXd& columns_um);
/// s²: of what neither forces nor these columns explain, not below the stated errors'.
double variance_beside(const LinearData& data, const Scores& beyond);

/// What a fit leaves of its data, the tensions free to follow, the error of the model's forces counted.
class Left {
 public:
  /// With the variances that the fit's error bars have.
  explicit Left(const EnsembleFit& fit);
  /// @param force_variance_nN2  of the model's error, by component; empty: none
  /// @param variance  s²
  Left(const EnsembleFit& fit, const VectorXd& force_variance_nN2, double variance, int threads);
  /// Of these columns, over s.
  Scores scores_of(const Pattern& pattern) const;
  /// Of forces of the adhesions themselves, over s, by components of these.
  Scores scores_of(const std::vector<Index>& components) const;
  double variance() const { return variance_; }  ///< s²
  /// Of each component of the forces, not over s.
  const VectorXd& force_scores() const { return scores_; }
  /// Calls body(first, block) with the columns first, first + 1, … of the information of all components of the forces,
  /// down to the last diagonal entry of the block: a whole is large where adhesions are many.
  void for_each_block(const std::function<void(Index first, const MatrixXd& information)>& body) const;

 private:
  Scores over_s(const MatrixXd& compliance, const MatrixXd& followed, const VectorXd& scores) const;
  ReducedData data_;   ///< whitened
  MatrixXd followed_;  ///< L⁻¹ Jᵀ C with L Lᵀ = Jᵀ J: what the tensions explain is its square
  VectorXd scores_;    ///< by component of the forces
  double variance_;
  int threads_;
};

// Cells beyond the border of the picture, which pull at the same gel.

/// Pieces of the surface along the border of the beads' field, of half the breadth of a spread cell and its depth,
/// beyond which forces act, whatever the forces of this cell are: each by the likelihood of random forces there,
/// the likeliest first, the others with it. With the pieces next to them, as no cell ends where a piece does. None
/// is named by chance in 10 000 cells.
/// @param data  with the motions that are allowed for so far
std::vector<Polygon> neighbours_beyond_border(const LinearData& data, const Cell& cell, const Gel& gel);

/// "upper left", "left": where these lie, seen from the field of the beads.
std::vector<std::string> borders_of(const std::vector<Polygon>& pieces_um, const std::vector<Vec2>& beads_um);

}  // namespace mbtfm::tensions
