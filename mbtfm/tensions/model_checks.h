/// Does the scene call for this model? Compared with simpler and freer ones, with each fibre left out, and with one
/// more.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/error_budget.h"
#include "mbtfm/tensions/linear_data.h"
#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/contract/cell.h"

namespace mbtfm::tensions {

/// Fibres whose tensions trade against each other without the beads noticing, while their sum is well determined.
struct FibreGroup {
  std::vector<int> indices;  ///< into EnsembleFit::fibre_ids
  Estimate sum_nN;
};
/// Fibres joined by correlations beyond −0.95: the partner then takes nine tenths of the beads' information on each.
std::vector<FibreGroup> fibres_not_distinguished(const EnsembleFit& fit);
/// Of the tensions, from the beads' noise.
MatrixXd correlation_of(const EnsembleFit& fit);

/// no-fibres: a network of one tension; full: ours; adhesion-forces: every force for itself (thesis' null model).
std::vector<ModelScore> compare_models(const EnsembleFit& fit, const LinearData& data,
                                       const network::Contractile& first_network, const std::vector<int>& adhesion_ids);

/// How the beads determine each tension. Influence: by how many of its standard errors a tension changes (on the first
/// mesh) where a bead's displacement component changes by one of its own, as the fit weighs beads and meshes.
struct Influence {
  VectorXd variance;               ///< by tension: sum of the squared influence over all components
  VectorXd n_informing_beads;      ///< by tension, over which it is spread: (sum q)² / sum q², q by bead
  std::vector<int> most_informed;  ///< by bead: the fibre whose tension it moves most; 0: the network
};
Influence influence_of(const EnsembleFit& fit, const LinearData& data);

/// What becomes of the fit where a fibre is taken for plain network, the other tensions following.
struct FibreLeftOut {
  int fibre_id = 0;
  double chi_squared_rise = 0;   ///< from the local misfit, mean over the meshes, in units of the noise
  double aic_rise = 0;           ///< less 2 for the parameter saved: positive where the beads call for the fibre
  double n_informing_beads = 0;  ///< see Influence
  double existence = 1;          ///< the probability that it is a fibre: existence_of()
};
std::vector<FibreLeftOut> leave_each_fibre_out(const EnsembleFit& fit, const Influence& influence);

/// Beads that call for more fibres than these show something else: wrong images, a wrong segmentation or, where they
/// are all but exact, the errors of the model. The time to find fibres together grows steeply with their number.
constexpr std::size_t kMostMissingFibres = 24;

/// The best ones, no adhesion twice, at most `kMostMissingFibres`, found together: tensions and gains are of each
/// given the others. A gain is kept where chance would reach it in one cell of a hundred, all pairs tried
/// (Bonferroni), errors of the model and of the segmentation counted.
std::vector<MissingFibre> missing_fibres(const EnsembleFit& fit, const std::vector<Adhesion>& adhesions,
                                         const SegmentationErrors& segmentation = {}, int threads = 1);

/// The data of a cell that has these fibres, too: each a pair of forces of its two adhesions, of any size. What they
/// pull is no longer taken for the tensions of others.
/// @param n_last  motions that stay the last ones
LinearData with_missing_fibres(LinearData data, const std::vector<Adhesion>& adhesions,
                               const std::vector<MissingFibre>& fibres, Index n_last);

/// Variance of each component of the adhesions' forces, as the beads show them, by errors of the adhesions' ellipses:
///
///   σ = |F| √( (δ/b)² + (ε/2)² + φ² ),
///
/// δ the error of the centre, b the semi-minor axis (over which the displacement falls off), ε the relative error of
/// the area (the displacement on an adhesion goes as one over the root of its area), φ that of the angle.
VectorXd segmentation_variance_nN2(const VectorXd& forces_nN, const std::vector<Adhesion>& adhesions,
                                   const SegmentationErrors& errors);

// Do the fibres' types matter? Tensions drawn from what the types usually have, and the same with dorsal and ventral
// exchanged: where the second explain the beads worse, the types carry information (thesis fig. 3.15).

/// Tensions that fibres of a type were found to have; draws take one of them.
using TypeTensions = std::map<FibreType, std::vector<double>>;

struct CrossValidation {
  std::vector<double> own, exchanged;  ///< relative L2 of each draw
};

/// Every draw is an equilibrium of its own, started from that of the given trial: tensions drawn at random are too far
/// from it for derivatives.
/// @param types  of the network's groups from 1 on; the network keeps the trial's tension
CrossValidation cross_validate(const TensionProblem& problem, const LinearData& data, const Trial& around,
                               const std::vector<FibreType>& types, const TypeTensions& tensions, int n_draws,
                               std::uint64_t seed, int threads);

}  // namespace mbtfm::tensions
