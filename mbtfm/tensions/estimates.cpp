#include "mbtfm/tensions/estimates.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/distributions.h"

namespace mbtfm::tensions {

namespace {

/// Quantities that are linear in the tensions about a mesh's solution.
struct Quantities {
  VectorXd values;
  MatrixXd gradients;  ///< tensions × quantities
};

/// Their means over the meshes, and errors.
/// @param of_mesh  quantities of a mesh
/// @param along  each by force (forces × quantities): its own error is the model's, in addition to the tensions'; empty
///               for tensions
/// @param is_single  each quantity is of one adhesion
/// @param more_noise  further variances by the beads' noise; empty: none
template <class OfMesh>
std::vector<Estimate> estimates_of(const EnsembleFit& all, const OfMesh& of_mesh, const MatrixXd& along = {},
                                   bool is_single = false, const VectorXd& more_noise = {}) {
  const auto n_meshes = static_cast<double>(all.meshes.size());
  VectorXd value, noise;
  MatrixXd model;  // variances by force
  for (const MeshFit& mesh : all.meshes) {
    const Quantities q = of_mesh(mesh);
    const VectorXd own_noise =
        q.gradients.cwiseProduct(numerics::product(mesh.noise_covariance_nN2, q.gradients)).colwise().sum();
    if (value.size() == 0) {
      value = noise = VectorXd::Zero(q.values.size());
      model = MatrixXd::Zero(all.model_error ? all.forces.nN.size() : 0, q.values.size());
    }
    value += q.values / n_meshes;
    noise += own_noise / n_meshes;
    if (model.size() == 0) continue;
    MatrixXd by_force = numerics::transposed_product(mesh.by_force, q.gradients);
    if (along.size() > 0) by_force -= (is_single ? std::sqrt(all.model_error->of_single) : 1.0) * along;
    model += all.model_error->stated_variance_nN2.asDiagonal() * by_force.cwiseAbs2() / n_meshes;
  }
  if (more_noise.size() > 0) noise += more_noise;
  std::vector<Estimate> estimates;
  for (Index i = 0; i < value.size(); ++i) {
    const double from_noise = std::max(0.0, noise[i]);
    const double variance = from_noise + (model.size() > 0 ? model.col(i).sum() : 0);
    Estimate estimate{.value = value[i], .noise = std::sqrt(from_noise), .standard_error = std::sqrt(variance)};
    double squares = 0;  // Welch–Satterthwaite, over the adhesions
    for (Index row = 0; row < model.rows(); row += all.data.dimension)
      squares += std::pow(model.col(i).segment(row, all.data.dimension).sum(), 2);
    if (squares > 0) estimate.degrees = std::min(1e6, variance * variance / squares * kDegreesByAdhesion);
    estimates.push_back(estimate);
  }
  return estimates;
}

/// The same for one quantity.
template <class ValueOf, class GradientOf>
Estimate estimate_of(const EnsembleFit& all, const ValueOf& value_of, const GradientOf& gradient_of,
                     const VectorXd& along = {}) {
  const auto of_mesh = [&](const MeshFit& mesh) {
    return Quantities{VectorXd::Constant(1, value_of(mesh)), gradient_of(mesh)};
  };
  return estimates_of(all, of_mesh, MatrixXd(along)).front();
}

/// Sums of the forces that adhesions exert, those of their own included. @param sums  weights by force × sums
template <class ValueOf>
std::vector<Estimate> with_own_forces(const EnsembleFit& all, const MatrixXd& sums, const ValueOf& value_of,
                                      bool is_single = false) {
  const MatrixXd along = by_network_force(all, sums);
  const auto of_mesh = [&](const MeshFit& mesh) {
    return Quantities{value_of(mesh), numerics::small_transposed_product(mesh.force_derivatives, along)};
  };
  return estimates_of(all, of_mesh, along, is_single, own_variances(all, sums));
}

/// R + E a, of one mesh.
VectorXd exerted_nN(const EnsembleFit& all, const VectorXd& network_nN) {
  return all.forces.own ? VectorXd(numerics::matvec(all.forces.own->left, network_nN) + all.forces.own->found_nN)
                        : network_nN;
}

/// Of the adhesions' forces, along the mean over meshes.
std::vector<Estimate> force_magnitudes_of(const EnsembleFit& all) {
  constexpr Index kAtOnce = 256;  // adhesions: some MB of numbers
  const Index each = all.data.dimension, n = all.forces.nN.size() / each;
  const VectorXd forces_nN = adhesion_forces_nN(all);
  std::vector<Estimate> magnitudes;
  for (Index first = 0; first < n; first += kAtOnce) {
    const Index count = std::min(kAtOnce, n - first);
    MatrixXd along = MatrixXd::Zero(all.forces.nN.size(), count);
    for (Index k = 0; k < count; ++k) {
      const VectorXd force = forces_nN.segment(each * (first + k), each);
      along.col(k).segment(each * (first + k), each) =
          force.norm() > 0 ? VectorXd(force.normalized()) : VectorXd::Unit(each, 0);
    }
    if (all.forces.own) {
      const auto value_of = [&](const MeshFit& mesh) -> VectorXd {
        return numerics::transposed_matvec(along, exerted_nN(all, mesh.fit.trial.forces_nN));
      };
      for (const Estimate& magnitude : with_own_forces(all, along, value_of, true)) magnitudes.push_back(magnitude);
      continue;
    }
    const MatrixXd own = along.middleRows(each * first, each * count);  // the others are zero
    const auto of_mesh = [&](const MeshFit& mesh) {
      return Quantities{
          numerics::transposed_matvec(own, mesh.fit.trial.forces_nN.segment(each * first, each * count)),
          numerics::transposed_product(mesh.force_derivatives.middleRows(each * first, each * count), own)};
    };
    for (const Estimate& magnitude : estimates_of(all, of_mesh, along, true)) magnitudes.push_back(magnitude);
  }
  return magnitudes;
}

/// Its errors are those of the adhesions' forces, which it balances.
CutForce cut_force_of(const EnsembleFit& all) {
  CutForce cut;
  for (const MeshFit& mesh : all.meshes) {
    cut.reaction.force_nN += mesh.cut.force_nN / static_cast<double>(all.meshes.size());
    cut.reaction.torque_nN_um += mesh.cut.torque_nN_um / static_cast<double>(all.meshes.size());
  }
  const auto along_of = [&](const Eigen::Vector2d& direction) -> Estimate {
    const VectorXd along = along_cut(direction, all.forces.nN.size());
    const auto value_of = [&](const MeshFit& mesh) -> VectorXd {
      const VectorXd& network_nN = mesh.fit.trial.forces_nN;
      return VectorXd::Constant(1,
                                direction.dot(mesh.cut.force_nN) + along.dot(exerted_nN(all, network_nN) - network_nN));
    };
    return with_own_forces(all, along, value_of).front();
  };
  cut.x_nN = along_of({1, 0});
  cut.y_nN = along_of({0, 1});
  cut.magnitude_nN = along_of(cut.direction());
  return cut;
}

/// A tension's interval: the mean of the meshes'.
Sides mean_sides(const std::vector<MeshFit>& meshes, std::size_t i) {
  Sides mean;
  for (const MeshFit& mesh : meshes) {
    mean.below += mesh.intervals_95[i].below / static_cast<double>(meshes.size());
    mean.above += mesh.intervals_95[i].above / static_cast<double>(meshes.size());
  }
  return mean;
}

/// Errors by way of the forces' directions in the mean over meshes.
Estimate total_force_of(const EnsembleFit& all) {
  const Index dimension = all.data.dimension;
  const VectorXd forces_nN = adhesion_forces_nN(all), along = directions_of(forces_nN, dimension);
  const auto value_of = [&](const MeshFit& mesh) -> VectorXd {
    const MatrixXd derivatives =
        all.forces.own ? numerics::small_product(all.forces.own->left, mesh.force_derivatives) : mesh.force_derivatives;
    return VectorXd::Constant(
        1, along.dot(exerted_nN(all, mesh.fit.trial.forces_nN) + numerics::matvec(derivatives, mesh.past_bounds_nN)) -
               magnitude_bias_nN(forces_nN, derivatives, mesh.covariance_nN2, dimension));
  };
  Estimate total = with_own_forces(all, along, value_of).front();
  if (all.forces.own)
    total.value -=
        lengthened_nN(forces_nN, all.misfit.variance * across_nN2(forces_nN, all.forces.own->covariance, dimension));
  if (!all.model_error) return total;
  const RoughnessOfTotal roughness = roughness_of_total(all);
  total.value += roughness.lacking_nN - roughness.surplus_nN;
  total.standard_error = std::hypot(total.standard_error, roughness.sigma_nN);
  return total;
}

/// Proportional to the network's tension.
Estimate network_force_of(const EnsembleFit& all) {
  const VectorXd along = directions_of(all.forces.of_network_nN, all.data.dimension);
  const auto per_tension = [&](const MeshFit& mesh) {
    const double tension = mesh.local.tensions_nN[0];
    return tension > 0 ? along.dot(mesh.network_forces_nN) / tension : 0;
  };
  return estimate_of(
      all,
      [&](const MeshFit& mesh) {
        return per_tension(mesh) *
               std::max(0.0, (1 - all.tensions.network_bias) * mesh.local.tensions_nN[0] + mesh.past_bounds_nN[0]);
      },
      [&](const MeshFit& mesh) -> VectorXd { return per_tension(mesh) * VectorXd::Unit(mesh.local.g.size(), 0); });
}

}  // namespace

void add_force_estimates(EnsembleFit& all, bool is_cut) {
  all.forces.magnitudes = force_magnitudes_of(all);
  all.total_force_nN = total_force_of(all);
  if (is_cut) all.cut = cut_force_of(all);
}

void add_estimates(EnsembleFit& all, bool is_cut) {
  const auto n_tensions = static_cast<Index>(all.tensions.fibre_ids.size());
  all.tensions.covariance_nN2 = MatrixXd::Zero(n_tensions, n_tensions);
  for (const MeshFit& mesh : all.meshes)
    all.tensions.covariance_nN2 += mesh.covariance_nN2 / static_cast<double>(all.meshes.size());
  for (Index i = 0; i < n_tensions; ++i) {
    all.tensions.nN.push_back(sum_of(all, {static_cast<int>(i)}));
    all.tensions.nN.back().sides_95 = mean_sides(all.meshes, static_cast<std::size_t>(i));
  }
  all.network_force_nN = network_force_of(all);
  add_force_estimates(all, is_cut);
}

VectorXd directions_of(const VectorXd& forces_nN, Index dimension) {
  VectorXd along(forces_nN.size());
  for (Index row = 0; row < forces_nN.size(); row += dimension)
    along.segment(row, dimension) = forces_nN.segment(row, dimension).normalized();  // none has no direction
  return along;
}

MatrixXd covariance_of_estimates(const EnsembleFit& fit, const MatrixXd& of_noise, const MatrixXd& by_force) {
  const MeshFit& mesh = fit.meshes.front();
  const MatrixXd by_tension = numerics::small_product(by_force, mesh.force_derivatives);
  MatrixXd covariance = fit.misfit.variance * of_noise + numerics::congruence(by_tension, mesh.noise_covariance_nN2);
  if (!fit.model_error) return covariance;
  const MatrixXd left =
      numerics::minus_product(by_force, by_tension, mesh.by_force);  // of errors of the forces, tensions following
  return covariance + numerics::weighted_outer(left, fit.model_error->force_variance_nN2);
}

VectorXd adhesion_forces_nN(const EnsembleFit& fit) { return exerted_nN(fit, fit.forces.nN); }

RoughnessOfTotal roughness_of_total(const EnsembleFit& fit) {
  return roughness_of_total(adhesion_forces_nN(fit), *fit.model_error,
                            fit.forces.own ? fit.forces.own->left : MatrixXd());
}

MatrixXd by_network_force(const EnsembleFit& fit, const MatrixXd& sums) {
  return fit.forces.own ? numerics::small_transposed_product(fit.forces.own->left, sums) : sums;
}

VectorXd own_variances(const EnsembleFit& fit, const MatrixXd& sums) {
  if (!fit.forces.own) return VectorXd::Zero(sums.cols());
  return fit.misfit.variance * numerics::quadratic_forms(fit.forces.own->covariance, sums);
}

Eigen::Vector2d CutForce::direction() const {
  const Eigen::Vector2d force(x_nN.value, y_nN.value);
  return force.norm() > 0 ? Eigen::Vector2d(force.normalized()) : Eigen::Vector2d(1, 0);
}

VectorXd along_cut(const Eigen::Vector2d& direction, Index n_forces) { return -direction.replicate(n_forces / 2, 1); }

Estimate sum_of(const EnsembleFit& fit, const std::vector<int>& indices) {
  VectorXd ones = VectorXd::Zero(static_cast<Index>(fit.tensions.fibre_ids.size()));
  for (const int i : indices) ones[i] = 1;
  return estimate_of(
      fit, [&](const MeshFit& mesh) { return ones.dot(mesh.fit.trial.tensions_nN); },
      [&](const MeshFit&) { return ones; });
}

double quantile_975(const Estimate& estimate) { return numerics::student_quantile(estimate.degrees, 0.975); }

Interval interval_95(const Estimate& estimate) {
  const double student = quantile_975(estimate);
  const double half = kNormal95 * estimate.standard_error;
  const Sides sides = estimate.sides_95.value_or(Sides{half, half});
  return {.low = std::max(0.0, estimate.value - student / kNormal95 * sides.below),
          .high = estimate.value + student / kNormal95 * sides.above};
}

}  // namespace mbtfm::tensions
