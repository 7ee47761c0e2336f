#include "mbtfm/tractions/field_of_adhesions.h"

#include <algorithm>
#include <cmath>

#include "mbtfm/inverse/loss.h"
#include "mbtfm/inverse/rows.h"
#include "pipeline/numerics/dense.h"
#include "substrate/ellipse.h"
#include "substrate/greens/models.h"

namespace mbtfm::tractions {
namespace {

/// Tukey's, of residuals whose median gives their scale (Maronna, Martin & Yohai, Robust Statistics, 2006, 6.4); beads
/// with a flag have none. By component.
VectorXd weights_of(const VectorXd& residual, const VectorXd& as_flagged) {
  const std::vector<double> lengths = inverse::residual_lengths(residual, 2);
  std::vector<double> good;
  for (std::size_t i = 0; i < lengths.size(); ++i)
    if (as_flagged[2 * static_cast<Index>(i)] > 0) good.push_back(lengths[i]);
  const double scale = std::max(inverse::scale_of(std::move(good), 2), 1e-12);
  const VectorXd by_bead = inverse::weights_of(inverse::Loss::tukey, residual, scale, 2);
  return by_bead.transpose().replicate(2, 1).reshaped().cwiseProduct(as_flagged);
}

/// The sums of shapes that explain the displacements best with these weights; empty if they do not determine them.
/// @param n_forces  of the shapes, the first ones
VectorXd weighted_fit(const MatrixXd& shapes, const VectorXd& displacement_um, const VectorXd& weights, Index n_forces,
                      int threads) {
  MatrixXd normal = MatrixXd::Zero(shapes.cols(), shapes.cols()), block;
  constexpr Index kRows = 1024;  // at a time: no second copy of all
  for (Index first = 0; first < shapes.rows(); first += kRows) {
    const Index count = std::min(kRows, shapes.rows() - first);
    block = weights.segment(first, count).cwiseSqrt().asDiagonal() * shapes.middleRows(first, count);
    numerics::add_upper_gram(block, normal, threads);
  }
  constexpr double kRidge = 1e-4;  // of forces that no bead feels, or that two adhesions share
  normal.diagonal().head(n_forces).array() += kRidge * normal.diagonal().head(n_forces).mean();
  if (!numerics::upper_cholesky(normal, threads)) return {};
  MatrixXd sizes = numerics::transposed_matvec(shapes, weights.cwiseProduct(displacement_um));
  numerics::solve_upper_transposed(normal, sizes);
  numerics::solve_upper(normal, sizes);
  return sizes;
}

}  // namespace

FieldOfAdhesions::FieldOfAdhesions(const std::vector<Adhesion>& adhesions, int threads)
    : ellipses_(substrate::ellipses_of(adhesions)), threads_(threads) {}

std::vector<Vec2> FieldOfAdhesions::um(const DisplacementField& beads) {
  std::vector<Vec2> places_um = points_of(beads);
  VectorXd displacement_um = inverse::components_of(beads), as_flagged = VectorXd::Zero(displacement_um.size());
  for (Index i = 0; i < std::ssize(beads); ++i)
    if (beads[i].flag.empty()) as_flagged.segment<2>(2 * i).setOnes();
  const Index n_forces = 2 * std::ssize(ellipses_), n_unknowns = n_forces + 6;
  if (ellipses_.empty() || as_flagged.sum() < 10.0 * static_cast<double>(n_unknowns)) return {};
  if (places_um != places_um_) {
    const Gel gel{.youngs_modulus_kPa = 1, .poisson_ratio = 0.5};  // whatever its modulus: forces are not asked for
    shapes_.resize(displacement_um.size(), n_unknowns);
    shapes_ << greens::make_greens(gel, {.model = substrate::ModelKind::layer}, threads_)
                   ->compliance_um_per_nN(places_um, ellipses_),
        inverse::affine_motions(beads);
    places_um_ = std::move(places_um);
    field_um_.resize(0);
  }
  // of the same frame again, some beads of which were mended, the last field shows which are outliers
  const bool is_again = field_um_.size() == displacement_um.size() &&
                        (displacement_um.array() == displacement_um_.array()).count() > displacement_um.size() / 2;
  VectorXd weights = is_again ? weights_of(displacement_um - field_um_, as_flagged) : as_flagged;
  const int n_rounds = is_again ? 1 : 4;
  for (int round = 1; round <= n_rounds; ++round) {
    const VectorXd sizes = weighted_fit(shapes_, displacement_um, weights, n_forces, threads_);
    if (sizes.size() == 0) return {};
    field_um_ = shapes_ * sizes;
    if (round < n_rounds) weights = weights_of(displacement_um - field_um_, as_flagged);
  }
  displacement_um_ = std::move(displacement_um);
  std::vector<Vec2> all;
  for (Index row = 0; row < field_um_.size(); row += 2) all.push_back({field_um_[row], field_um_[row + 1]});
  return all;
}

}  // namespace mbtfm::tractions
