/// A gel of even layers on a rigid base, wave by wave: shares nothing with finite elements.
///
/// Plane part: u = (U cos kx, W sin kx); in each layer (U, W) is a sum of (1, -1) e^(-kz), (z, -z - kappa/k) e^(-kz)
/// and their mirror images (1, 1) e^(kz), (z, z - kappa/k) e^(kz), kappa = 3 - 4 nu; displacements and tractions are
/// continuous. Antiplane part: V = a cosh kz + b sinh kz. Source: Navier's equations, solved here.
#pragma once

#include <Eigen/LU>

#include "pipeline/numerics/quadrature.h"
#include "substrate/greens/half_space.h"
#include "tests/support/test.h"

namespace mbtfm::test {

struct EvenLayer {
  double thickness_um, youngs_modulus_kPa;
};

class LayeredGel {
 public:
  LayeredGel(std::vector<EvenLayer> layers, double poisson_ratio) : layers_(std::move(layers)), nu_(poisson_ratio) {
    // what the half-space of the first layer leaves falls as exp(-2 k d): below 1e-12 at k = 14/d
    const double most = 14 / layers_[0].thickness_um;
    const numerics::GaussRule gauss = numerics::gauss_legendre(12);
    constexpr int kPanels = 40;
    for (int panel = 0; panel < kPanels; ++panel)
      for (std::size_t g = 0; g < gauss.nodes.size(); ++g) {
        const double k = most / kPanels * (panel + 0.5 * (1 + gauss.nodes[g]));
        const double weight = 0.5 * most / kPanels * gauss.weights[g] * k / (2 * std::numbers::pi);
        const double mu = shear_modulus(0);
        const double along = plane(k) - (1 - nu_) / (mu * k), across = antiplane(k) - 1 / (mu * k);
        k_.push_back(k);
        s_.push_back(0.5 * weight * (along + across));
        d_.push_back(-0.5 * weight * (along - across));
      }
  }

  /// Displacement by a unit force on an ellipse: the half-space of the first layer, plus the rest averaged.
  greens::Sym2 compliance_um_per_nN(const substrate::Ellipse& ellipse, Vec2 point) const {
    const Gel top = {.youngs_modulus_kPa = layers_[0].youngs_modulus_kPa, .poisson_ratio = nu_, .thickness_um = 1};
    greens::Sym2 sum = greens::HalfSpaceEllipse(top, ellipse).compliance_um_per_nN(point);
    for (const substrate::DiscPoint& p : substrate::ellipse_rule(ellipse, 5))
      sum += p.weight * rest(point - ellipse.centre_um - p.position);
    return sum;
  }

 private:
  double shear_modulus(std::size_t layer) const { return layers_[layer].youngs_modulus_kPa / (2 * (1 + nu_)); }

  greens::Sym2 rest(Vec2 offset) const {
    const double r = norm(offset);
    double s = 0, d = 0;
    for (std::size_t i = 0; i < k_.size(); ++i) {
      s += s_[i] * std::cyl_bessel_j(0, k_[i] * r);
      d += d_[i] * std::cyl_bessel_j(2, k_[i] * r);
    }
    if (r == 0) return {s, 0, s};
    const Vec2 e = (1 / r) * offset;
    return {s + d * (2 * e.x * e.x - 1), 2 * d * e.x * e.y, s + d * (2 * e.y * e.y - 1)};
  }

  /// V(0) for a unit traction across the wave: stiffness handed up from the base, layer by layer.
  double antiplane(double k) const {
    double compliance = 0;  // of what lies below, V over traction
    for (std::size_t n = layers_.size(); n-- > 0;) {
      const double scale = 1 / (shear_modulus(n) * k), t = std::tanh(k * layers_[n].thickness_um);
      compliance = (compliance + scale * t) / (1 + compliance * t / scale);
    }
    return compliance;
  }

  /// Rows U, W, sigma_xz, sigma_zz of the four solutions at depth z of a layer from 0 to h; the rising two are scaled
  /// to 1 at h.
  Eigen::Matrix4d rows(std::size_t layer, double k, double z) const {
    const double mu = shear_modulus(layer), lambda = 2 * mu * nu_ / (1 - 2 * nu_), kappa = 3 - 4 * nu_;
    Eigen::Matrix4d m;
    for (int rising = 0; rising < 2; ++rising) {
      const double sign = rising == 1 ? 1 : -1;
      const double y = rising == 1 ? z - layers_[layer].thickness_um : z;
      const double e = std::exp(sign * k * y);
      for (int linear = 0; linear < 2; ++linear) {
        const double u = linear == 1 ? y : 1, w = linear == 1 ? sign * y - kappa / k : sign;
        const double du = sign * k * u + (linear == 1 ? 1 : 0), dw = sign * k * w + (linear == 1 ? sign : 0);
        m.col(2 * rising + linear) << u, w, mu * (du + k * w), lambda * (-k * u + dw) + 2 * mu * dw;
        m.col(2 * rising + linear) *= e;
      }
    }
    return m;
  }

  /// U(0) for a unit traction along the wave.
  double plane(double k) const {
    const auto n = static_cast<Eigen::Index>(layers_.size());
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(4 * n, 4 * n);
    Eigen::VectorXd b = Eigen::VectorXd::Zero(4 * n);
    m.block<2, 4>(0, 0) = rows(0, k, 0).bottomRows<2>();
    b[0] = -1;  // the surface's normal points to -z
    for (Eigen::Index i = 0; i + 1 < n; ++i) {
      m.block<4, 4>(2 + 4 * i, 4 * i) = rows(i, k, layers_[i].thickness_um);
      m.block<4, 4>(2 + 4 * i, 4 * i + 4) = -rows(i + 1, k, 0);
    }
    m.block<2, 4>(4 * n - 2, 4 * n - 4) = rows(n - 1, k, layers_.back().thickness_um).topRows<2>();
    const Eigen::VectorXd x = m.partialPivLu().solve(b);
    return rows(0, k, 0).row(0).dot(x.head<4>());
  }

  std::vector<EvenLayer> layers_;
  double nu_;
  std::vector<double> k_, s_, d_;
};

}  // namespace mbtfm::test
