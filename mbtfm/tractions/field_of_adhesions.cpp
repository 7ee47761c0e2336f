#include "mbtfm/tractions/field_of_adhesions.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/order_statistics.h"
#include "substrate/ellipse.h"
#include "substrate/greens/models.h"

namespace mbtfm::tractions {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Shift, and what changes linearly over the field: six columns of order 1.
MatrixXd affine_motions(const std::vector<Vec2>& places_um) {
  Vec2 low = places_um.front(), high = low;
  for (const Vec2 p : places_um) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  const double side = std::max({high.x - low.x, high.y - low.y, 1.0});
  MatrixXd columns = MatrixXd::Zero(2 * std::ssize(places_um), 6);
  for (Index i = 0; i < std::ssize(places_um); ++i) {
    const Vec2 at = 2 / side * (places_um[static_cast<std::size_t>(i)] - 0.5 * (low + high));
    columns.row(2 * i) << 1, at.x, at.y, 0, 0, 0;
    columns.row(2 * i + 1) << 0, 0, 0, 1, at.x, at.y;
  }
  return columns;
}

/// Tukey's, of residuals whose middle tells their scale (Maronna, Martin & Yohai, Robust Statistics, 2006, 6.4).
VectorXd weights_of(const VectorXd& residual) {
  constexpr double kTukey = 5.123, kMiddle = 1.1774;  // of a vector in the plane: Rayleigh's median
  std::vector<double> sizes;
  for (Index row = 0; row < residual.size(); row += 2) sizes.push_back(residual.segment<2>(row).norm());
  const double scale = std::max(numerics::median(sizes) / kMiddle, 1e-12);
  VectorXd weights(residual.size());
  for (Index i = 0; i < std::ssize(sizes); ++i) {
    const double r = std::min(1.0, sizes[static_cast<std::size_t>(i)] / (kTukey * scale));
    weights.segment<2>(2 * i).setConstant((1 - r * r) * (1 - r * r));
  }
  return weights;
}

}  // namespace

FieldOfAdhesions::FieldOfAdhesions(const std::vector<Adhesion>& adhesions, int threads) : threads_(threads) {
  for (const Adhesion& a : adhesions) ellipses_.push_back(substrate::ellipse_of(a));
}

std::vector<Vec2> FieldOfAdhesions::um(const DisplacementField& beads) {
  std::vector<Vec2> places_um;
  std::vector<Index> rows;  // of beads without a flag
  VectorXd displacement_um(2 * std::ssize(beads));
  for (Index i = 0; i < std::ssize(beads); ++i) {
    const Bead& bead = beads[static_cast<std::size_t>(i)];
    places_um.push_back(bead.position_um);
    displacement_um.segment<2>(2 * i) << bead.displacement_um.x, bead.displacement_um.y;
    if (bead.flag.empty()) rows.insert(rows.end(), {2 * i, 2 * i + 1});
  }
  const Index n_forces = 2 * std::ssize(ellipses_), n_unknowns = n_forces + 6;
  if (ellipses_.empty() || std::ssize(rows) < 10 * n_unknowns) return {};
  if (places_um != places_um_) {
    const Gel gel{.youngs_modulus_kPa = 1, .poisson_ratio = 0.5};  // whatever its modulus: forces are not asked for
    shapes_.resize(displacement_um.size(), n_unknowns);
    shapes_ << greens::make_greens(gel, {.model = substrate::ModelKind::layer}, threads_)
                   ->compliance_um_per_nN(places_um, ellipses_),
        affine_motions(places_um);
    places_um_ = std::move(places_um);
  }
  const MatrixXd used = shapes_(rows, Eigen::all);
  const VectorXd target = displacement_um(rows);
  VectorXd weights = VectorXd::Ones(target.size()), found;
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    MatrixXd normal = MatrixXd::Zero(n_unknowns, n_unknowns);
    numerics::add_upper_gram(weights.cwiseSqrt().asDiagonal() * used, normal, threads_);
    constexpr double kRidge = 1e-4;  // of forces that no bead feels, or that two adhesions share
    normal.diagonal().head(n_forces).array() += kRidge * normal.diagonal().head(n_forces).mean();
    if (!numerics::upper_cholesky(normal, threads_)) return {};
    MatrixXd x = used.transpose() * weights.cwiseProduct(target);
    numerics::solve_upper_transposed(normal, x);
    numerics::solve_upper(normal, x);
    found = x;
    weights = weights_of(target - used * found);
  }
  const VectorXd field = shapes_ * found;
  std::vector<Vec2> all;
  for (Index row = 0; row < field.size(); row += 2) all.push_back({field[row], field[row + 1]});
  return all;
}

}  // namespace mbtfm::tractions
