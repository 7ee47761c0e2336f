#include "mbtfm/spatial/rows.h"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <numbers>

#include "mbtfm/spatial/reconstruction.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::spatial {

MatrixXd common_motions(const Observed& observed) {
  const auto& beads = std::get<std::vector<Vec3>>(observed.at.points_um);
  const Index n = observed.n_components();
  Vec3 centre;
  for (const Vec3& bead : beads) centre += 1 / static_cast<double>(beads.size()) * bead;
  MatrixXd motions = MatrixXd::Zero(n * observed.n_beads, n + 1);
  for (Index b = 0; b < observed.n_beads; ++b) {
    motions.block(n * b, 0, n, n).setIdentity();
    const Vec3 d = beads[b] - centre;
    motions(n * b, n) = -d.y;
    motions(n * b + 1, n) = d.x;
  }
  return motions;
}

Rows::Rows(const Problem& problem, const VectorXd& weights_by_row)
    : roots_(weights_by_row.cwiseSqrt().cwiseQuotient(problem.observed.sigma_um)) {
  if (problem.common_um.cols() == 0) return;
  weighed_common_ = roots_.asDiagonal() * problem.common_um;
  common_ = numerics::orthonormal_basis(weighed_common_);
}

MatrixXd Rows::of(const MatrixXd& by_row) const {
  MatrixXd weighed = roots_.asDiagonal() * by_row;
  if (common_.cols() > 0)
    weighed -= numerics::small_product(common_, numerics::small_transposed_product(common_, weighed));
  return weighed;
}

MatrixXd Rows::transposed(const MatrixXd& weighed) const {
  if (common_.cols() == 0) return roots_.asDiagonal() * weighed;
  return roots_.asDiagonal() *
         (weighed - numerics::small_product(common_, numerics::small_transposed_product(common_, weighed)));
}

MatrixXd Rows::common_in(const MatrixXd& by_row) const {
  return numerics::shortest_solution(weighed_common_, roots_.asDiagonal() * by_row);
}

std::optional<CommonMotionInSpace> common_motion_beside(const Problem& problem, const SpatialReconstruction& found) {
  if (problem.common_um.cols() == 0 || found.covariance_kPa2.size() == 0) return std::nullopt;
  const Rows rows(problem, found.weighing.by_row);
  const VectorXd roots = found.weighing.by_row.cwiseSqrt().cwiseQuotient(problem.observed.sigma_um);
  const MatrixXd C = roots.asDiagonal() * problem.common_um;
  const MatrixXd by_traction = rows.common_in(problem.response_um_per_kPa);
  const MatrixXd covariance =
      numerics::plus_product(found.variance * numerics::inverse_symmetric(numerics::small_transposed_product(C, C)),
                             numerics::small_product(by_traction, found.covariance_kPa2), by_traction.transpose());
  const VectorXd left_um =
      numerics::minus_matvec(problem.displacement_um(), problem.response_um_per_kPa, found.traction_kPa);
  return CommonMotionInSpace{rows.common_in(left_um), covariance.diagonal().cwiseMax(0).cwiseSqrt()};
}

Effect common_motion_effect(Switch setting, const Problem& problem, const std::optional<CommonMotionInSpace>& found) {
  if (setting == Switch::off)
    return stage::decided(EffectKind::common_motion, setting, true,
                          "switched off in [effects]: the beads at rest are taken to lie still");
  if (problem.common_um.cols() == 0)
    return stage::decided(EffectKind::common_motion, setting, false, "the displacement is imposed as it was measured");
  if (!found) return stage::decided(EffectKind::common_motion, setting, true, "found with the tractions");
  std::string why = "found with the tractions: shift";
  const Index n = found->values.size() - 1;
  constexpr std::array kAxes = {" x ", " y ", " z "};
  const auto in_unit = [&](Index k, double unit) {
    return with_error(unit * found->values[k], unit * found->sigma[k]);
  };
  for (Index k = 0; k < n; ++k) why += kAxes.at(static_cast<std::size_t>(k)) + in_unit(k, 1) + " um,";
  why += " turn " + in_unit(n, 180 / std::numbers::pi) + " degrees";
  return stage::decided(EffectKind::common_motion, setting, true, why);
}

Figures figures_of(const CommonMotionInSpace& found) {
  Figures figures;
  constexpr std::array kAxes = {"x", "y", "z"};
  const Index n = found.values.size() - 1;
  for (Index k = 0; k < n; ++k) {
    const std::string name = std::string("common_shift_") + kAxes.at(static_cast<std::size_t>(k));
    figures.emplace_back(name + "_um", found.values[k]);
    figures.emplace_back(name + "_sigma_um", found.sigma[k]);
  }
  constexpr double kDegree = 180 / std::numbers::pi;
  figures.emplace_back("common_turn_deg", kDegree * found.values[n]);
  figures.emplace_back("common_turn_sigma_deg", kDegree * found.sigma[n]);
  return figures;
}

}  // namespace mbtfm::spatial
