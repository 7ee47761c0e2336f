#include <cmath>

#include "mbtfm/spatial/reconstruction.h"

namespace mbtfm::spatial {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

Vec3 vec(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Vector3d vector(const Vec3& v) { return {v.x, v.y, v.z}; }

/// Of three sums over the tractions.
Vec3 errors_of(const MatrixXd& sums, const MatrixXd& covariance) {
  if (covariance.size() == 0) return {};
  const Vector3d variances = (sums * covariance).cwiseProduct(sums).rowwise().sum();
  return vec(variances.cwiseMax(0).cwiseSqrt());
}

}  // namespace

VectorXd resolved_shares(const MatrixXd& covariance, const MatrixXd& precision_before) {
  const Index n = precision_before.rows();
  VectorXd shares = VectorXd::Ones(n);
  for (Index v = 0; v < n; ++v) {
    for (Index w = 0; w < n; ++w) {
      if (precision_before(v, w) == 0) continue;
      double trace = 0;
      for (Index c = 0; c < 3; ++c) trace += covariance(3 * v + c, 3 * w + c);
      shares[v] -= trace * precision_before(v, w) / 3;
    }
  }
  return shares.cwiseMax(0).cwiseMin(1);
}

std::vector<PartForce> forces_on(const Problem& problem, const SpatialReconstruction& r, const MatrixXd& areas_um2) {
  const std::vector<Vec3> vertices = problem.vertices_um();
  std::vector<PartForce> forces;
  for (Index a = 0; a < areas_um2.rows(); ++a) {
    PartForce& force = forces.emplace_back();
    MatrixXd sums = MatrixXd::Zero(3, r.traction_kPa.size());
    Vec3 centre;
    for (Index v = 0; v < areas_um2.cols(); ++v) {
      const double area = areas_um2(a, v);
      for (Index c = 0; c < 3; ++c) sums(c, 3 * v + c) = area;
      force.area_um2 += area;
      centre += area * vertices[static_cast<std::size_t>(v)];
    }
    if (force.area_um2 > 0) force.position_um = 1 / force.area_um2 * centre;
    const Vector3d f = sums * (r.unshortened_kPa.size() > 0 ? r.unshortened_kPa : r.traction_kPa);
    force.force_nN = vec(f);
    if (r.covariance_kPa2.size() == 0) continue;
    const Matrix3d covariance = sums * r.covariance_kPa2 * sums.transpose();
    force.sigma_nN = vec(covariance.diagonal().cwiseMax(0).cwiseSqrt());
    const Vector3d along = f.norm() > 0 ? Vector3d(f.normalized()) : Vector3d::UnitX();
    force.magnitude_sigma_nN = std::sqrt(std::max(0.0, along.dot(covariance * along)));
  }
  return forces;
}

Balance balance_of(const Problem& problem, const SpatialReconstruction& r) {
  const TractionMesh& mesh = problem.mesh;
  const std::vector<Vec3> vertices = problem.vertices_um();
  const Index n = mesh.n_vertices();
  Balance balance;
  const auto traction = [&](Index v) { return Vector3d(r.traction_kPa.segment<3>(3 * v)); };
  over_faces(mesh, problem.ground, 3, Places::gauss,
             [&](Vec2 at, const std::array<int, 4>& corners, const std::array<double, 4>& shares, double area_um2) {
               Vector3d t = Vector3d::Zero();
               for (std::size_t i = 0; i < 4; ++i) t += shares[i] * traction(corners[i]);
               const double size = t.norm() * area_um2;
               balance.total_force_nN += size;
               balance.normal_force_nN += std::abs(t.dot(vector(problem.ground.normal(at)))) * area_um2;
               balance.centre_um += size * Vec3{at.x, at.y, problem.ground.height_um(at)};
             });
  if (balance.total_force_nN > 0) balance.centre_um = 1 / balance.total_force_nN * balance.centre_um;
  MatrixXd forces = MatrixXd::Zero(3, 3 * n), moments = forces;
  for (Index v = 0; v < n; ++v) {
    const double area = mesh.areas_um2[static_cast<std::size_t>(v)];
    const Vec3 arm = vertices[static_cast<std::size_t>(v)] - balance.centre_um;
    Matrix3d cross_arm;
    cross_arm << 0, -arm.z, arm.y, arm.z, 0, -arm.x, -arm.y, arm.x, 0;
    forces.middleCols<3>(3 * v) = area * Matrix3d::Identity();
    moments.middleCols<3>(3 * v) = area * cross_arm;
  }
  balance.force_nN = vec(forces * r.traction_kPa);
  balance.moment_nN_um = vec(moments * r.traction_kPa);
  balance.force_sigma_nN = errors_of(forces, r.covariance_kPa2);
  balance.moment_sigma_nN_um = errors_of(moments, r.covariance_kPa2);
  const VectorXd u = problem.surface_displacement_um(r.traction_kPa);
  for (Index j = 0; j < n; ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(mesh.mass_um2, j); it; ++it)
      balance.strain_energy_fJ += 0.5 * it.value() * traction(it.row()).dot(u.segment<3>(3 * j));
  }
  return balance;
}

std::vector<double> resolution_um(const Problem& problem, const SpatialReconstruction& r) {
  std::vector<double> lengths;
  constexpr double kLeast = 1e-6;  // of a share: nothing is seen there
  for (Index v = 0; v < r.resolved.size(); ++v) {
    const double area = problem.mesh.areas_um2[static_cast<std::size_t>(v)];
    lengths.push_back(std::sqrt(area / std::max(r.resolved[v], kLeast)));
  }
  return lengths;
}

}  // namespace mbtfm::spatial
