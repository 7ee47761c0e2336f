/// Standard traction reconstructions from bead displacements, and what is summed up of them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mbtfm/inverse/regularisation.h"
#include "mbtfm/tractions/parameters.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/figures.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/report.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/named_array.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::tractions {

/// Whether fttc draws standard errors of its map, which takes as long as the map.
enum class PointErrors { skipped, stated };

struct TractionInputs {
  DisplacementField beads;  ///< without the flagged ones
  Gel gel;
  std::vector<Adhesion> adhesions;  ///< may be empty
  Polygon outline_um;               ///< may be empty
  PointErrors point_errors = PointErrors::skipped;
};

std::vector<Vec2> positions_of(const std::vector<GroundPatch>& patches);

/// How far a force moves (length of the change of its vector) where its ellipse is wrong by what a segmentation errs.
struct Sensitivity {
  double shift_along_nN = 0, shift_across_nN = 0;  ///< the ellipse shifted along and across its major axis
  double size_nN = 0;                              ///< both axes longer
  double angle_nN = 0;                             ///< turned
};

/// Of a penalty on tractions, and of one on forces.
enum class LambdaUnit { um_per_kPa, um_per_nN };
constexpr auto words(LambdaUnit) { return std::array{"um_per_kPa", "um_per_nN"}; }

/// How large forces are that are known with errors: noise makes every one longer.
struct Magnitudes {
  VectorXd expected_nN;     ///< by force
  MatrixXd covariance_nN2;  ///< of the true magnitudes around these
};

/// Expected |F_a| for found forces F̂ = F + error, error ~ N(0, C), docs/theory/reconstructions.md (18). Before the
/// measurement each F_a is normal with a deviation s that is one of a list, from nothing to more than the largest
/// force; the shares of these are the most likely ones for all F̂ (Stephens, Biostatistics 18 (2017) 275). With them the
/// sum of the expected magnitudes is right in the mean, however many forces are no larger than their errors.
/// @param covariance_nN2  C, rows 2a and 2a + 1 of force a, positive definite
Magnitudes expected_magnitudes(const std::vector<Vec2>& forces_nN, const MatrixXd& covariance_nN2);

struct Reconstruction {
  std::vector<GroundPatch> patches;
  std::vector<AdhesionForce> forces;       ///< by adhesion, where there are any
  std::vector<Sensitivity> sensitivities;  ///< by adhesion, adhesion-forces only
  std::vector<Vec2> sigmas_kPa;            ///< by patch, standard errors along x and y; empty: not known
  std::optional<Magnitudes> magnitudes;    ///< of the patches' forces, adhesion-forces only
  std::optional<LambdaScan> scan;
  std::optional<double> lambda;  ///< in the method's own unit
  LambdaUnit lambda_unit = LambdaUnit::um_per_kPa;
  std::optional<double> length_um;  ///< lambda times E, per area: the same for every method
  double relative_l2 = 0;           ///< |u − model| / |u| at the beads, weighted
  Report report{.converged = true, .iterations = 0, .last_change = 0, .reason = {}};
  std::string remark;  ///< to be said in the last line; empty: nothing
  Figures figures;
};

/// @throws UsageError, InvalidData, NotSolved
Reconstruction reconstruct(const TractionInputs& inputs, const TractionParameters& parameters, int threads);

/// Each adhesion's force: the sum over the patches on its grown ellipse; without errors.
std::vector<AdhesionForce> forces_by_adhesion(const std::vector<GroundPatch>& patches,
                                              const std::vector<Adhesion>& adhesions, double grow_um);

/// Forces of the adhesions (2a, 2a + 1) with their standard errors along themselves.
/// @param covariance_nN2  of the components
std::vector<AdhesionForce> forces_with_errors(const std::vector<Adhesion>& adhesions, const VectorXd& forces_nN,
                                              const MatrixXd& covariance_nN2);

/// Displacements of the beads by a force of one spread evenly over each adhesion: 2·beads × 2·adhesions.
MatrixXd even_forces_um_per_nN(const TractionInputs& inputs, GelModel gel_model, int threads);

/// Sums over the patches near the cell.
struct TractionSums {
  double total_force_nN = 0;  ///< sum of magnitudes, or of expected ones where these are known
  std::optional<double> total_force_sigma_nN;
  Vec2 net_force_nN;
  double strain_energy_fJ = 0;     ///< half the sum of t · u A
  double moment_nN_um[2][2] = {};  ///< sum of (x − centre)_i F_j
  double contractile_moment_nN_um() const { return -(moment_nN_um[0][0] + moment_nN_um[1][1]); }  ///< > 0: inward
  /// Mean cosine between force and direction to the centre, weighted by distance and the square of the force, as noise
  /// is everywhere: near 1 for a contracting cell, 0 where forces know no centre, -1 where they push outward.
  double inward_share = 0;
  std::string where;
};
/// Near the cell: inside its outline or within `grow_um` of it, else of its adhesions; with neither, everywhere.
TractionSums sums_of(const Reconstruction& reconstruction, const TractionInputs& inputs, double grow_um);

/// For each patch the index of the adhesion whose ellipse, grown, holds it (the nearest where several do), or -1.
std::vector<int> adhesion_of_patches(const std::vector<Vec2>& positions_um, const std::vector<Adhesion>& adhesions,
                                     double grow_um);

// files beside traction.csv
/// Their part of docs/columns.md.
std::string pages_of_tables();
/// @param sigmas_kPa  by patch, or empty: without their columns
void write_tractions(const Path& file, const std::vector<GroundPatch>& patches,
                     const std::vector<Vec2>& sigmas_kPa = {});
void write_tractions_vtp(const Path& file, const std::vector<GroundPatch>& patches);
void write_lambda_scan(const Path& file, const LambdaScan& scan, double length_um_per_lambda);
/// The criteria over lambda in both its units, an SVG. @param chosen_by  for people; the reconstruction has a scan
void write_lambda_picture(const Path& file, const Reconstruction& reconstruction, const std::string& chosen_by);
std::vector<files::NamedArray> columns_of(const std::vector<Sensitivity>& sensitivities);
Figures summary_of(const Reconstruction& reconstruction, const TractionSums& sums);

}  // namespace mbtfm::tractions
