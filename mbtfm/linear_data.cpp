#include "mbtfm/linear_data.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"

extern "C" void dsyrk_(const char* triangle, const char* transpose, const int* n, const int* k, const double* alpha,
                       const double* a, const int* lda, const double* beta, double* c, const int* ldc);

namespace mbtfm::inverse {

namespace {

/// The lower triangle of Aᵀ A. By BLAS, which is several times quicker here than Eigen without AVX: with ten thousand
/// beads this product is a quarter of a quick fit.
Eigen::MatrixXd lower_gram(const Eigen::MatrixXd& A) {
  const auto n = static_cast<int>(A.cols()), k = static_cast<int>(A.rows());
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(n, n);
  const double one = 1, zero = 0;
  if (n > 0 && k > 0) dsyrk_("L", "T", &n, &k, &one, A.data(), &k, &zero, gram.data(), &n);
  return gram;
}

}  // namespace

LinearData reduce(const DisplacementField& beads, Eigen::MatrixXd compliance_um_per_nN,
                  const std::vector<bool>& is_used) {
  const Eigen::Index n_rows = 2 * static_cast<Eigen::Index>(beads.size());
  MBTFM_ASSERT(compliance_um_per_nN.rows() == n_rows);
  LinearData data;
  data.has_errors = std::all_of(beads.begin(), beads.end(), [](const Bead& b) { return b.sigma_um > 0; });
  data.displacement_um.resize(n_rows);
  data.weight_per_um = Eigen::VectorXd::Zero(n_rows);
  for (std::size_t i = 0; i < beads.size(); ++i) {
    const Eigen::Index row = 2 * static_cast<Eigen::Index>(i);
    data.position_um.push_back(beads[i].position_um);
    data.displacement_um.segment<2>(row) << beads[i].displacement_um.x, beads[i].displacement_um.y;
    if (!is_used.empty() && !is_used[i]) continue;
    data.weight_per_um.segment<2>(row).setConstant(data.has_errors ? 1 / beads[i].sigma_um : 1);
    data.n_used += 2;
  }
  data.compliance_um_per_nN = std::move(compliance_um_per_nN);
  reweight(data, Eigen::VectorXd::Ones(n_rows / 2));
  return data;
}

void reweight(LinearData& data, const Eigen::VectorXd& bead_weight) {
  data.bead_weight = bead_weight;
  Eigen::VectorXd weight = data.weight_per_um;
  for (Eigen::Index i = 0; i < bead_weight.size(); ++i) weight.segment<2>(2 * i) *= std::sqrt(bead_weight[i]);
  // A = (W G)ᵀ W G = V Λ Vᵀ; then C = Λ^½ Vᵀ and y = Λ^−½ Vᵀ (W G)ᵀ W u. Directions that no bead feels drop out.
  const Eigen::MatrixXd weighted = weight.asDiagonal() * data.compliance_um_per_nN;
  const Eigen::VectorXd weighted_u = weight.cwiseProduct(data.displacement_um);
  const Eigen::MatrixXd normal = lower_gram(weighted);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(normal);
  const double smallest = 1e-13 * eigen.eigenvalues().maxCoeff();  // rounding of the normal matrix
  Eigen::Index n_felt = 0;
  while (n_felt < normal.cols() && eigen.eigenvalues()[normal.cols() - 1 - n_felt] > smallest) ++n_felt;
  const auto roots = eigen.eigenvalues().tail(n_felt).cwiseSqrt();
  const auto vectors = eigen.eigenvectors().rightCols(n_felt);
  data.reduced.compliance = roots.asDiagonal() * vectors.transpose();
  data.reduced.target = roots.cwiseInverse().asDiagonal() * (vectors.transpose() * (weighted.transpose() * weighted_u));
  data.reduced.n_components = data.n_used;
  data.reduced.floor_squared = std::max(0.0, weighted_u.squaredNorm() - data.reduced.target.squaredNorm());
}

Eigen::VectorXd weighted_residual(const LinearData& data, const Eigen::VectorXd& forces_nN) {
  return data.weight_per_um.cwiseProduct(data.displacement_um - data.compliance_um_per_nN * forces_nN);
}

double noise_variance(const LinearData& data) {
  const auto n_free = static_cast<double>(std::max<Eigen::Index>(1, data.n_used - data.reduced.compliance.rows()));
  return std::max(data.has_errors ? 1.0 : 1e-300, data.reduced.floor_squared / n_free);
}

double relative_l2(const LinearData& data, const Eigen::VectorXd& forces_nN) {
  const Eigen::VectorXd is_used = data.weight_per_um.unaryExpr([](double w) { return w > 0 ? 1.0 : 0.0; });
  const double scale = is_used.cwiseProduct(data.displacement_um).norm();
  const double misfit = is_used.cwiseProduct(data.displacement_um - data.compliance_um_per_nN * forces_nN).norm();
  return scale > 0 ? misfit / scale : misfit;
}

}  // namespace mbtfm::inverse
