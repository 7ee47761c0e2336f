#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "mbtfm/spatial/problem.h"
#include "mbtfm/spatial/reconstruction.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::spatial {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

Vec3 vec(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Vector3d vector(const Vec3& v) { return {v.x, v.y, v.z}; }

Vec3 errors_of(const Matrix3d& covariance) { return vec(covariance.diagonal().cwiseMax(0).cwiseSqrt()); }

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

namespace {

/// Where they act, and on how much of the surface.
std::vector<PartForce> parts_of(const Problem& problem, const MatrixXd& areas_um2) {
  const std::vector<Vec3> vertices = problem.vertices_um();
  std::vector<PartForce> parts;
  for (Index a = 0; a < areas_um2.rows(); ++a) {
    PartForce& part = parts.emplace_back();
    Vec3 centre;
    for (Index v = 0; v < areas_um2.cols(); ++v) {
      part.area_um2 += areas_um2(a, v);
      centre += areas_um2(a, v) * vertices[v];
    }
    if (part.area_um2 > 0) part.position_um = 1 / part.area_um2 * centre;
  }
  return parts;
}

void set_force(PartForce& part, const Vector3d& force_nN, const Matrix3d& covariance_nN2) {
  part.force_nN = vec(force_nN);
  part.sigma_nN = errors_of(covariance_nN2);
  part.magnitude_sigma_nN = inverse::error_along(force_nN, covariance_nN2);
  constexpr double kOfAny_deg = 180 / std::numbers::sqrt3, kDegrees = 180 / std::numbers::pi;
  const Vector3d across(-force_nN.y(), force_nN.x(), 0);
  const double lateral_nN = across.norm();
  part.angle_deg = kDegrees * std::atan2(force_nN.y(), force_nN.x());
  part.angle_sigma_deg =
      lateral_nN > 0 ? std::min(kOfAny_deg, kDegrees * inverse::error_along(across, covariance_nN2) / lateral_nN)
                     : kOfAny_deg;
}

}  // namespace

std::optional<double> chi_squared_of_flipped_z(const Problem& problem, const SpatialReconstruction& r) {
  const Index n = problem.observed.n_components();
  if (n < 3 || r.covariance_kPa2.size() == 0 || !(r.variance > 0)) return std::nullopt;
  const inverse::Rows rows = rows_of(problem, r.weighing.by_row);
  const auto chi_squared = [&](const VectorXd& displacement_um) {
    const VectorXd u = rows.of(displacement_um);
    const VectorXd pulled = numerics::transposed_matvec(problem.response_um_per_kPa, rows.transposed(u));
    return (u.squaredNorm() - numerics::quadratic_form(r.covariance_kPa2, pulled) / r.variance) / r.variance;
  };
  const VectorXd measured = problem.displacement_um();
  VectorXd flipped = measured;
  for (Index z = 2; z < flipped.size(); z += n) flipped[z] = -flipped[z];
  return chi_squared(flipped) - chi_squared(measured);
}

const VectorXd& summed_tractions_kPa(const SpatialReconstruction& r) {
  return r.summands ? r.summands->traction_kPa : r.traction_kPa;
}

const MatrixXd& covariance_of_summed_kPa2(const SpatialReconstruction& r) {
  return r.summands ? r.summands->covariance_kPa2 : r.covariance_kPa2;
}

std::vector<PartForce> forces_beside_background(const Problem& problem, const MatrixXd& background,
                                                const SpatialReconstruction& r, int threads) {
  const inverse::Rows rows = rows_of(problem, r.weighing.by_row);
  const MatrixXd A = rows.of(background), P = rows.of(problem.patch_response_um_per_nN);
  const VectorXd u = rows.of(problem.displacement_um());
  MatrixXd inner = MatrixXd::Zero(A.cols(), A.cols());
  numerics::add_upper_gram(A, inner, threads);
  inner.diagonal().array() += *r.lambda * *r.lambda;
  const Eigen::LLT<MatrixXd, Eigen::Upper> factor(inner);
  const MatrixXd AP = numerics::small_transposed_product(A, P);
  const MatrixXd hidden = factor.solve(AP);
  const numerics::SmallCholesky information(
      numerics::minus_product(numerics::small_transposed_product(P, P), AP.transpose(), hidden));
  const VectorXd forces_nN = information.solve(numerics::transposed_matvec(P, u) -
                                               numerics::transposed_matvec(hidden, numerics::transposed_matvec(A, u)));
  const MatrixXd covariance_nN2 = r.variance * information.inverse();
  std::vector<PartForce> parts = parts_of(problem, problem.adhesion_areas_um2);
  for (std::size_t a = 0; a < parts.size(); ++a) {
    const auto at = 3 * static_cast<Index>(a);
    set_force(parts[a], forces_nN.segment<3>(at), covariance_nN2.block<3, 3>(at, at));
  }
  return parts;
}

std::vector<PartForce> forces_on(const Problem& problem, const SpatialReconstruction& r, const MatrixXd& areas_um2) {
  std::vector<PartForce> forces = parts_of(problem, areas_um2);
  for (std::size_t a = 0; a < forces.size(); ++a) {
    MatrixXd sums = MatrixXd::Zero(3, r.traction_kPa.size());
    for (Index v = 0; v < areas_um2.cols(); ++v) {
      for (Index c = 0; c < 3; ++c) sums(c, 3 * v + c) = areas_um2(static_cast<Index>(a), v);
    }
    const Vector3d f = numerics::matvec(sums, summed_tractions_kPa(r));
    const MatrixXd& covariance = covariance_of_summed_kPa2(r);
    forces[a].force_nN = vec(f);
    if (covariance.size() > 0) set_force(forces[a], f, numerics::congruence(sums, covariance));
  }
  return forces;
}

Balance balance_of(const Problem& problem, const SpatialReconstruction& r) {
  const TractionMesh& mesh = problem.mesh;
  const std::vector<Vec3> vertices = problem.vertices_um();
  const Index n = mesh.n_vertices();
  Balance balance;
  const VectorXd& summed = summed_tractions_kPa(r);
  // The total is that of the map; of group-l1, whose map the penalty shortens, that of the mean.
  const bool is_mean_counted = r.method == tractions::TractionMethod::group_l1;
  const auto traction = [&](Index v) {
    return Vector3d((is_mean_counted ? summed : r.traction_kPa).segment<3>(3 * v));
  };
  double of_map_nN = 0, of_summed_nN = 0;  // totals
  over_faces(mesh, problem.ground, 3, Places::gauss,
             [&](Vec2 at, std::span<const VertexShare> shares, double area_um2) {
               Vector3d of_map = Vector3d::Zero(), of_sums = Vector3d::Zero();
               for (const auto& [vertex, share] : shares) {
                 of_map += share * r.traction_kPa.segment<3>(3 * vertex);
                 of_sums += share * summed.segment<3>(3 * vertex);
               }
               const Vector3d& t = is_mean_counted ? of_sums : of_map;
               const double size = t.norm() * area_um2;
               balance.total_force_nN += size;
               of_map_nN += of_map.norm() * area_um2;
               of_summed_nN += of_sums.norm() * area_um2;
               balance.normal_force_nN += std::abs(t.dot(vector(problem.ground.normal(at)))) * area_um2;
               balance.centre_um += size * Vec3{at.x, at.y, problem.ground.height_um(at)};
             });
  if (balance.total_force_nN > 0) balance.centre_um = 1 / balance.total_force_nN * balance.centre_um;
  MatrixXd sums = MatrixXd::Zero(6, 3 * n);  // forces, moments
  VectorXd inwards(3 * n);                   // contractile moment
  for (Index v = 0; v < n; ++v) {
    const double area = mesh.areas_um2[v];
    const Vec3 arm = vertices[v] - balance.centre_um;
    Matrix3d cross_arm;
    cross_arm << 0, -arm.z, arm.y, arm.z, 0, -arm.x, -arm.y, arm.x, 0;
    sums.block<3, 3>(0, 3 * v) = area * Matrix3d::Identity();
    sums.block<3, 3>(3, 3 * v) = area * cross_arm;
    inwards.segment<3>(3 * v) = -area * vector(arm);
  }
  if (r.covariance_kPa2.size() > 0) {
    VectorXd along(3 * n);
    for (Index v = 0; v < n; ++v) along.segment<3>(3 * v) = mesh.areas_um2[v] * traction(v).stableNormalized();
    balance.total_force_sigma_nN =
        std::hypot(std::sqrt(std::max(0.0, numerics::quadratic_form(r.covariance_kPa2, along))),
                   (of_summed_nN - of_map_nN) / std::sqrt(12.0));
  }
  const VectorXd net = numerics::matvec(sums, summed);
  balance.force_nN = vec(net.head<3>());
  balance.moment_nN_um = vec(net.tail<3>());
  balance.contractile_moment_nN_um = inwards.dot(summed);
  if (const MatrixXd& covariance = covariance_of_summed_kPa2(r); covariance.size() > 0) {
    MatrixXd of_net = numerics::congruence(sums, covariance);
    const double of_gel = problem.model_error * problem.model_error * balance.total_force_nN;
    for (Index v = 0; v < n; ++v) {
      const auto of_vertex = sums.middleCols<3>(3 * v);  // of a traction there
      const double area = mesh.areas_um2[v];
      of_net += of_gel * traction(v).norm() / area * of_vertex * of_vertex.transpose();
    }
    const Matrix3d of_force = of_net.topLeftCorner<3, 3>(), of_moment = of_net.bottomRightCorner<3, 3>();
    balance.force_sigma_nN = errors_of(of_force);
    balance.moment_sigma_nN_um = errors_of(of_moment);
    balance.net_force_sigma_nN = inverse::error_along(net.head<3>(), of_force);
    balance.net_moment_sigma_nN_um = inverse::error_along(net.tail<3>(), of_moment);
    balance.imbalance = net.dot(VectorXd(numerics::solve_symmetric(of_net, net)));
    balance.contractile_moment_sigma_nN_um = std::sqrt(std::max(0.0, inwards.dot(covariance * inwards)));
  }
  const VectorXd u = problem.surface_displacement_um(summed);
  for (Index j = 0; j < n; ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(mesh.mass_um2, j); it; ++it)
      balance.strain_energy_fJ += 0.5 * it.value() * summed.segment<3>(3 * it.row()).dot(u.segment<3>(3 * j));
  }
  return balance;
}

std::optional<Finding> noticed_imbalance(const Balance& balance) {
  if (!balance.imbalance) return std::nullopt;
  return noticed(Symptom::tractions_out_of_balance, *balance.imbalance,
                 {.value = with_error(norm(balance.force_nN), balance.net_force_sigma_nN),
                  .at = brief(balance.total_force_nN) + " nN in all"});
}

std::vector<double> resolution_um(const Problem& problem, const SpatialReconstruction& r) {
  std::vector<double> lengths;
  constexpr double kLeast = 1e-6;  // of a share: nothing is seen there
  for (Index v = 0; v < r.resolved.size(); ++v) {
    const double area = problem.mesh.areas_um2[v];
    lengths.push_back(std::sqrt(area / std::max(r.resolved[v], kLeast)));
  }
  return lengths;
}

}  // namespace mbtfm::spatial
