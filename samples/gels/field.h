/// The exact field of point forces above the surface of a gel on a rigid base: whatever the surface below them, the
/// gel under it is at rest if the surface carries the tractions of this field.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>
#include <vector>

namespace mbtfm::gels {

/// Lengths in um, forces in nN, z into the gel. Kelvin's solution and its image behind the clamped plane (Blake's, for
/// any Poisson ratio), so that u = 0 at z = base. Exact below the sources for a gel without sides.
class FieldUnderASurface {
 public:
  struct Source {
    Eigen::Vector3d position_um, force_nN;
  };
  FieldUnderASurface(std::vector<Source> sources, double youngs_modulus_kPa, double poisson_ratio, double base_um)
      : sources_(std::move(sources)), modulus_(youngs_modulus_kPa), nu_(poisson_ratio), base_(base_um) {}

  Eigen::Vector3d displacement_um(const Eigen::Vector3d& p) const { return at<double>(p); }
  /// By steps along the imaginary axis: exact to rounding.
  Eigen::Matrix3d gradient(const Eigen::Vector3d& p) const {
    using Complex = std::complex<double>;
    constexpr double kStep = 1e-30;
    Eigen::Matrix3d gradient;
    for (int j = 0; j < 3; ++j) {
      Eigen::Matrix<Complex, 3, 1> moved = p.cast<Complex>();
      moved[j] += Complex(0, kStep);
      gradient.col(j) = at<Complex>(moved).imag() / kStep;
    }
    return gradient;
  }
  Eigen::Matrix3d stress_kPa(const Eigen::Vector3d& p) const {
    const Eigen::Matrix3d g = gradient(p);
    const double mu = modulus_ / (2 * (1 + nu_)), lambda = 2 * mu * nu_ / (1 - 2 * nu_);
    return mu * (g + g.transpose()) + lambda * g.trace() * Eigen::Matrix3d::Identity();
  }

 private:
  // Kelvin's solution, its pressure, and the image behind the clamped plane: zeta = base - z upwards
  template <class Real>
  Eigen::Matrix<Real, 3, 1> at(const Eigen::Matrix<Real, 3, 1>& p) const {
    using Vector = Eigen::Matrix<Real, 3, 1>;
    const double mu = modulus_ / (2 * (1 + nu_)), k = 1 / (8 * std::numbers::pi * mu * (1 - nu_)), n = 3 - 4 * nu_;
    Vector sum = Vector::Zero();
    for (const Source& source : sources_) {
      const Eigen::Vector3d f(source.force_nN.x(), source.force_nN.y(), -source.force_nN.z());
      const Real zeta = base_ - p.z();
      const double zeta_s = base_ - source.position_um.z();
      const Vector x(p.x() - source.position_um.x(), p.y() - source.position_um.y(), zeta - zeta_s);
      const Vector m(x.x(), x.y(), -zeta - zeta_s);
      const auto dot_f = [&](const Vector& a) -> Real { return f.x() * a.x() + f.y() * a.y() + f.z() * a.z(); };
      const auto length = [](const Vector& a) -> Real {
        using std::sqrt;
        return sqrt(a.x() * a.x() + a.y() * a.y() + a.z() * a.z());
      };
      const auto kelvin = [&](const Vector& a) -> Vector {
        const Real r = length(a), g = dot_f(a) / (r * r * r);
        Vector u;
        for (int i = 0; i < 3; ++i) u[i] = 0.5 * k * (n * f[i] / r + a[i] * g);
        return u;
      };
      const Real r = length(m), r3 = r * r * r, r5 = r3 * r * r, fm = dot_f(m);
      const Real pressure = -k * fm / r3;
      Vector slope_u, slope_p;  // of the mirrored fields
      for (int i = 0; i < 3; ++i) {
        slope_u[i] = 0.5 * k * (-n * f.z() * m[i] / r3 + m.z() * f[i] / r3 - 3.0 * m.z() * fm * m[i] / r5);
        if (i == 2) slope_u[i] += 0.5 * k * fm / r3;
        slope_p[i] = -k * (f[i] / r3 - 3.0 * fm * m[i] / r5);
      }
      slope_u.z() = -slope_u.z();
      slope_p.z() = -slope_p.z();
      Vector u = kelvin(x) - kelvin(m);
      for (int i = 0; i < 3; ++i) u[i] += 2.0 / n * zeta * (slope_u[i] - 0.5 * zeta * slope_p[i]);
      u.z() += (1 - 1 / n) * zeta * pressure;
      u.z() = -u.z();
      sum += u;
    }
    return sum;
  }

  std::vector<Source> sources_;
  double modulus_, nu_, base_;
};

}  // namespace mbtfm::gels
