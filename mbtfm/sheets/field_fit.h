/// A contraction that varies smoothly over the sheet, as smoothly as the beads call for.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "mbtfm/sheets/sheet_fit.h"

namespace mbtfm::sheets {

/// s(x) = Σ c_k φ_k(x), bilinear between the points of a square lattice.
class ContractionLattice {
 public:
  /// Over all that the sheet covers, with about so many points.
  ContractionLattice(const sheet::Elements& elements, int n_points);

  std::vector<Vec2> places_um() const;  ///< of the points
  int n_points() const { return static_cast<int>(points_.size()); }
  /// φ_k, which add up to 1 on the sheet.
  double share(int point, Vec2 place_um) const;
  /// By point, at the points of the elements: for SheetShape::contractions.
  std::vector<std::vector<double>> shares_on(const sheet::Elements& elements) const;
  /// All φ_k at a place.
  VectorXd shares_at(Vec2 place_um) const;
  /// L: ∫ |∇s|² dA = cᵀ L c, over all squares of the lattice that the sheet touches.
  MatrixXd roughness() const;

 private:
  struct Square {
    std::array<int, 4> points;  ///< counter-clockwise from the low corner
  };
  Vec2 low_um_;
  double spacing_um_ = 1;
  std::vector<std::array<int, 2>> points_;  ///< column, row
  std::vector<Square> squares_;
};

/// A sheet whose contraction varies.
struct FieldFit {
  SheetFit sheet;                    ///< its contractions are means over the sheet
  VectorXd contractions;             ///< c, nN/um: the mean of what the beads leave possible
  MatrixXd covariance;               ///< of c
  double smoothing = 0;              ///< λ (um²/nN²)
  bool is_smoothing_at_end = false;  ///< as smooth as was tried: the beads call for no variation
  double degrees = 0;                ///< how many numbers of the contraction the beads determine
};

/// Bayes' rule, with a prior that knows how smooth a contraction is and nothing of its mean: exp(−λ/2 ∫ |∇s|² dA). For
/// each stiffness and λ the contraction is linear in the data; means, errors and 95 % intervals are over the posterior
/// of all three, log M and log λ equally probable before (MacKay, Neural Comput. 4 (1992) 415). Whatever λ is, the
/// contraction may vary by the patterns of variation.h: the beads hardly distinguish these from another stiffness.
///
///   log p(y | M, λ) = ½ log |P| − ½ log |N/v + P| − Q/(2v),   Q = min |A c − y|² + v cᵀPc,   N = AᵀA
///
/// P⁻¹ = (λL)⁻¹ + GGᵀ with the patterns G, |P| over all but an even contraction, v the variance of a datum: of the
/// noise, or of what the sheet leaves if that is more. Line tension and bundles are known by nothing before.
/// @param table  with the shares of the lattice as its contractions; known adhesions
/// @param mean  of each φ over the sheet's area
FieldFit fit_field(tensions::LinearData data, const StiffnessTable& table, tensions::Loss loss,
                   std::optional<double> stiffness_nN_per_um, const ContractionLattice& lattice, const VectorXd& mean);

/// As of a SheetFit, also of the contraction at each place.
void add_error(FieldFit& fit, std::optional<double> SheetErrorParts::*part, const MatrixXd& changes_um);

/// The contraction at a place.
struct ContractionAt {
  Vec2 position_um;
  double nN_per_um = 0, sigma_nN_per_um = 0, low_nN_per_um = 0, high_nN_per_um = 0;  ///< 95 %
};
/// At the nodes.
std::vector<ContractionAt> contractions_at(const sheet::Elements& elements, const ContractionLattice& lattice,
                                           const FieldFit& fit);

/// Of each φ over the area of the sheet.
VectorXd means_over(const sheet::Elements& elements, const ContractionLattice& lattice);

}  // namespace mbtfm::sheets
