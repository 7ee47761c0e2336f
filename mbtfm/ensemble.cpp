#include "mbtfm/ensemble.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <mutex>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/parallel.h"

namespace mbtfm::inverse {

namespace {

/// What one mesh says.
struct MeshFit {
  TensionFit fit;
  Eigen::MatrixXd tension_covariance;         ///< from the beads' noise
  Eigen::MatrixXd force_covariance_diagonal;  ///< adhesions × (xx, xy, yy)
  Eigen::VectorXd network_forces_nN, torques_nN_um;
};

/// (JᵀJ)⁻¹; a direction in which no bead tells anything gets an infinite variance.
Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& jacobian) {
  const Eigen::VectorXd scale = jacobian.colwise().norm().cwiseMax(1e-300);
  const Eigen::MatrixXd scaled = jacobian * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled.transpose() * scaled);
  const double smallest = 1e-12 * eigen.eigenvalues().maxCoeff();  // rounding of JᵀJ
  const Eigen::VectorXd inverse = eigen.eigenvalues().unaryExpr([&](double v) { return 1 / std::max(v, smallest); });
  const Eigen::MatrixXd half =
      scale.cwiseInverse().asDiagonal() * eigen.eigenvectors() * inverse.cwiseSqrt().asDiagonal();
  return half * half.transpose();
}

/// Forces with every fibre at the network's tension.
Eigen::VectorXd network_forces_nN(const TensionProblem& problem, const Trial& trial) {
  const double tension = trial.tensions_nN[0];
  if (tension <= kNoTension * trial.tensions_nN.maxCoeff()) return Eigen::VectorXd::Zero(trial.forces_nN.size());
  return problem.evaluate(Eigen::VectorXd::Constant(trial.tensions_nN.size(), tension), &trial).forces_nN;
}

MeshFit fit_mesh(const network::CableNetwork& network, const LinearData& data, const std::vector<int>& adhesion_ids,
                 const FitParameters& parameters, int threads) {
  const TensionProblem problem(network, data, adhesion_ids);
  MeshFit mesh;
  mesh.fit = fit_tensions(problem, parameters, threads, uniform_start_nN(problem));
  const Trial& trial = mesh.fit.trial;
  const Eigen::MatrixXd derivatives = problem.force_derivatives(trial);
  mesh.tension_covariance = covariance_of(data.reduced * derivatives);
  const Eigen::Index n_adhesions = derivatives.rows() / 2;
  mesh.force_covariance_diagonal.resize(n_adhesions, 3);
  for (Eigen::Index a = 0; a < n_adhesions; ++a) {
    const auto rows = derivatives.middleRows<2>(2 * a);
    const Eigen::Matrix2d c = rows * mesh.tension_covariance * rows.transpose();
    mesh.force_covariance_diagonal.row(a) << c(0, 0), c(0, 1), c(1, 1);
  }
  mesh.network_forces_nN = network_forces_nN(problem, trial);
  mesh.torques_nN_um = problem.torques_nN_um(trial);
  return mesh;
}

/// Spread of one further mesh about the mean of these: s² (1 + 1/n).
double spread_of(const std::vector<double>& values) {
  const double n = static_cast<double>(values.size());
  if (n < 2) return 0;
  double mean = 0, sum = 0;
  for (const double v : values) mean += v / n;
  for (const double v : values) sum += (v - mean) * (v - mean);
  return std::sqrt(sum / (n - 1) * (1 + 1 / n));
}

double chi_squared_per_degree(const LinearData& data, const Eigen::VectorXd& forces_nN, Eigen::Index n_tensions) {
  const double misfit = (data.reduced * forces_nN - data.target).squaredNorm() + data.floor_squared;
  const Eigen::Index degrees = data.displacement_um.size() - n_tensions;
  return misfit / static_cast<double>(std::max<Eigen::Index>(1, degrees));
}

}  // namespace

EnsembleFit fit_ensemble(const std::vector<network::CableNetwork>& networks, const LinearData& data,
                         const std::vector<int>& adhesion_ids, const FitParameters& parameters, int threads,
                         const Progress& progress) {
  const int n_meshes = static_cast<int>(networks.size());
  MBTFM_ASSERT(n_meshes >= 1);
  std::vector<MeshFit> meshes(n_meshes);
  std::mutex mutex;
  int n_done = 0;
  parallel_for(n_meshes, threads, [&](int m) {
    meshes[m] = fit_mesh(networks[m], data, adhesion_ids, parameters, n_meshes == 1 ? threads : 1);
    const std::lock_guard lock(mutex);
    if (progress) progress(double(++n_done) / n_meshes, "fitting tensions on " + std::to_string(n_meshes) + " meshes");
  });

  EnsembleFit all;
  all.fibre_ids = networks.front().fibre_ids();
  for (const auto& network : networks) MBTFM_ASSERT(network.fibre_ids() == all.fibre_ids);
  const Eigen::Index n_forces = data.compliance_um_per_nN.cols();
  all.forces_nN = all.network_forces_nN = Eigen::VectorXd::Zero(n_forces);
  all.torques_nN_um = Eigen::VectorXd::Zero(n_forces / 2);
  all.report.converged = true;
  for (const MeshFit& mesh : meshes) {
    all.forces_nN += mesh.fit.trial.forces_nN / n_meshes;
    all.network_forces_nN += mesh.network_forces_nN / n_meshes;
    all.torques_nN_um += mesh.torques_nN_um / n_meshes;
    all.report.iterations = std::max(all.report.iterations, mesh.fit.report.iterations);
    all.report.last_change = std::max(all.report.last_change, mesh.fit.report.last_change);
    if (!mesh.fit.report.converged || all.report.reason.empty()) all.report.reason = mesh.fit.report.reason;
    all.report.converged = all.report.converged && mesh.fit.report.converged;
  }
  const auto n_tensions = static_cast<Eigen::Index>(all.fibre_ids.size());
  all.chi_squared_per_degree = chi_squared_per_degree(data, all.forces_nN, n_tensions);
  // A misfit beyond the stated noise is the model's; it widens the error bars as if it were noise.
  const double widening = data.has_errors ? std::max(1.0, all.chi_squared_per_degree) : all.chi_squared_per_degree;

  for (Eigen::Index i = 0; i < n_tensions; ++i) {
    std::vector<double> values;
    Estimate estimate;
    for (const MeshFit& mesh : meshes) {
      values.push_back(mesh.fit.trial.tensions_nN[i]);
      estimate.value += values.back() / n_meshes;
      estimate.noise += mesh.tension_covariance(i, i) * widening / n_meshes;
    }
    estimate.noise = std::sqrt(estimate.noise);
    estimate.spread = spread_of(values);
    all.tensions_nN.push_back(estimate);
  }
  for (Eigen::Index a = 0; a < n_forces / 2; ++a) {
    const Eigen::Vector2d force = all.forces_nN.segment<2>(2 * a);
    const Eigen::Vector2d along = force.norm() > 0 ? Eigen::Vector2d(force.normalized()) : Eigen::Vector2d(1, 0);
    std::vector<double> values;
    Estimate estimate{.value = force.norm()};
    for (const MeshFit& mesh : meshes) {
      values.push_back(along.dot(mesh.fit.trial.forces_nN.segment<2>(2 * a)));
      const auto c = mesh.force_covariance_diagonal.row(a);
      const double variance = along[0] * along[0] * c[0] + 2 * along[0] * along[1] * c[1] + along[1] * along[1] * c[2];
      estimate.noise += variance * widening / n_meshes;
    }
    estimate.noise = std::sqrt(std::max(0.0, estimate.noise));
    estimate.spread = spread_of(values);
    all.force_magnitudes_nN.push_back(estimate);
  }
  for (MeshFit& mesh : meshes) all.fits.push_back(std::move(mesh.fit));
  return all;
}

double half_width_95(const Estimate& estimate, int n_meshes) {
  const double error = estimate.standard_error();
  if (n_meshes < 2 || estimate.spread <= 0) return boost::math::quantile(boost::math::normal(), 0.975) * error;
  const double part = std::pow(estimate.spread / error, 4);
  const double degrees = (n_meshes - 1) / part;
  return boost::math::quantile(boost::math::students_t(std::min(degrees, 1e6)), 0.975) * error;
}

}  // namespace mbtfm::inverse
