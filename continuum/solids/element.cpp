#include "continuum/solids/element.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/numerics/quadrature.h"

namespace mbtfm::solids {
namespace {

/// Legendre's polynomials on [0, 1], 0 to n.
std::vector<double> legendre(double unit, int n) {
  const double x = 2 * unit - 1;
  std::vector<double> p = {1, x};
  for (int k = 1; k < n; ++k) p.push_back(((2 * k + 1) * x * p[k] - k * p[k - 1]) / (k + 1));
  return p;
}

/// Roots of (1 - x²) P_n'(x), on [0, 1]. Newton's method from those of Chebyshev.
std::vector<double> lobatto_nodes(int n) {
  std::vector<double> nodes;
  for (int k = 0; k <= n; ++k) {
    double x = -std::cos(std::numbers::pi * k / n);
    constexpr int kSteps = 50;  // it takes some five
    for (int step = 0; step < kSteps; ++step) {
      const auto p = legendre(0.5 * (x + 1), n);
      const double change = (x * p[n] - p[n - 1]) / ((n + 1) * p[n]);
      x -= change;
      if (std::abs(change) < 1e-16) break;
    }
    nodes.push_back(0.5 * (x + 1));
  }
  nodes.front() = 0;
  nodes.back() = 1;
  return nodes;
}

Eigen::VectorXd pressures_at(Vec2 unit, int order) {
  const auto u = legendre(unit.x, order), v = legendre(unit.y, order);
  Eigen::VectorXd values(order * (order + 1) / 2);
  int k = 0;
  for (int i = 0; i < order; ++i)
    for (int j = 0; i + j < order; ++j) values[k++] = u[i] * v[j];
  return values;
}

/// Where it lies and how it is deformed, at a point of the unit square.
struct AtPoint {
  double r = 0, determinant = 0;
  Eigen::MatrixX2d slopes;  ///< by node: along r, along z; 1/um
  Eigen::Matrix3d F;        ///< of r, z and the angle; without strain where strains are small
  Eigen::Vector4d strain;   ///< rr, tt, zz and sqrt 2 rz
};

AtPoint at_point(const Eigen::VectorXd& shapes, const Eigen::MatrixX2d& slopes, const Nodes& x, const Nodes& u,
                 Strain strain) {
  AtPoint at;
  const Eigen::Matrix2d jacobian = x * slopes;
  at.r = x.row(0).dot(shapes);
  at.determinant = jacobian.determinant();
  at.slopes = slopes * jacobian.inverse();
  Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();
  gradient.topLeftCorner<2, 2>() = u * at.slopes;
  gradient(2, 2) = u.row(0).dot(shapes) / at.r;
  Eigen::Matrix3d e = 0.5 * (gradient + gradient.transpose());
  at.F = Eigen::Matrix3d::Identity();
  if (strain == Strain::large) {
    e += 0.5 * gradient.transpose() * gradient;
    at.F += gradient;
  }
  at.strain << e(0, 0), e(2, 2), e(1, 1), std::numbers::sqrt2 * e(0, 1);
  return at;
}

/// How the strain changes with the displacement of the nodes.
Eigen::Matrix4Xd strain_slopes(const AtPoint& at, const Eigen::VectorXd& shapes) {
  Eigen::Matrix4Xd B(4, 2 * shapes.size());
  const double half = 0.5 * std::numbers::sqrt2;
  for (Eigen::Index k = 0; k < shapes.size(); ++k) {
    const double by_r = at.slopes(k, 0), by_z = at.slopes(k, 1);
    for (int i = 0; i < 2; ++i) {
      B.col(2 * k + i) << at.F(i, 0) * by_r, i == 0 ? at.F(2, 2) * shapes[k] / at.r : 0, at.F(i, 1) * by_z,
          half * (at.F(i, 0) * by_z + at.F(i, 1) * by_r);
    }
  }
  return B;
}

double trace(const Eigen::Vector4d& strain) { return strain[0] + strain[1] + strain[2]; }

/// 2 pi r dr dz at each point of the rule.
double volume_of(const Square::Point& point, const AtPoint& at) {
  return 2 * std::numbers::pi * at.r * at.determinant * point.weight;
}

/// P tr E, as coefficients of the pressures.
struct Dilatation {
  Eigen::MatrixXd mass;
  Eigen::VectorXd coefficients;
};
Dilatation dilatation_of(const Square& square, const Nodes& x, const Nodes& u, Strain strain) {
  const int n = square.n_pressures();
  Dilatation d{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
  for (const Square::Point& point : square.points()) {
    const AtPoint at = at_point(point.shapes, point.slopes, x, u, strain);
    const double volume = volume_of(point, at);
    d.mass += volume * point.pressures * point.pressures.transpose();
    d.coefficients += volume * trace(at.strain) * point.pressures;
  }
  d.coefficients = d.mass.llt().solve(d.coefficients);
  return d;
}

/// 2 mu E + lambda P tr E + contraction: rr, tt, zz and sqrt 2 rz.
Eigen::Vector4d stress_of(const AtPoint& at, double dilatation, const Solid& solid) {
  Eigen::Vector4d stress = 2 * solid.shear_modulus_kPa() * at.strain;
  stress.head<3>().array() += solid.lame_modulus_kPa() * dilatation + solid.contraction_kPa;
  return stress;
}

}  // namespace

Square::Square(int order) : order_(order), nodes_(lobatto_nodes(order)) {
  const numerics::GaussRule rule = numerics::gauss_legendre(order + kMoreThanOrder);
  for (std::size_t j = 0; j < rule.nodes.size(); ++j) {
    for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
      const Vec2 unit = {0.5 * (1 + rule.nodes[i]), 0.5 * (1 + rule.nodes[j])};
      points_.push_back(
          {0.25 * rule.weights[i] * rule.weights[j], shapes_at(unit), slopes_at(unit), pressures_at(unit, order)});
    }
  }
}

Square::OneSide Square::along_side(double unit) const {
  OneSide side;
  for (int k = 0; k <= order_; ++k) {
    double value = 1, slope = 0;
    for (int j = 0; j <= order_; ++j) {
      if (j == k) continue;
      const double over = 1 / (nodes_[k] - nodes_[j]);
      slope = (slope * (unit - nodes_[j]) + value) * over;
      value *= (unit - nodes_[j]) * over;
    }
    side.values.push_back(value);
    side.slopes.push_back(slope);
  }
  return side;
}

Eigen::VectorXd Square::shapes_at(Vec2 unit) const {
  const OneSide u = along_side(unit.x), v = along_side(unit.y);
  Eigen::VectorXd shapes(n_nodes());
  for (int j = 0; j <= order_; ++j)
    for (int i = 0; i <= order_; ++i) shapes[j * (order_ + 1) + i] = u.values[i] * v.values[j];
  return shapes;
}

Eigen::MatrixX2d Square::slopes_at(Vec2 unit) const {
  const OneSide u = along_side(unit.x), v = along_side(unit.y);
  Eigen::MatrixX2d slopes(n_nodes(), 2);
  for (int j = 0; j <= order_; ++j)
    for (int i = 0; i <= order_; ++i)
      slopes.row(j * (order_ + 1) + i) << u.slopes[i] * v.values[j], u.values[i] * v.slopes[j];
  return slopes;
}

Equations equations_of(const Square& square, const Nodes& x, const Nodes& u, const Solid& solid, Strain strain,
                       Wanted wanted) {
  Equations equations;
  const Eigen::Index n = 2 * square.n_nodes(), n_points = std::ssize(square.points());
  const double mu = solid.shear_modulus_kPa(), lambda = solid.lame_modulus_kPa();
  const Dilatation dilatation = dilatation_of(square, x, u, strain);
  equations.forces_nN = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd all(4 * n_points, n);                                         // strain slopes, weighed
  Eigen::MatrixXd divergence = Eigen::MatrixXd::Zero(square.n_pressures(), n);  // (tr of them, pressures)
  Eigen::MatrixXd stretched = Eigen::MatrixXd::Zero(square.n_nodes(), square.n_nodes());
  Eigen::MatrixXd hoop = stretched;
  for (Eigen::Index q = 0; q < n_points; ++q) {
    const Square::Point& point = square.points()[q];
    const AtPoint at = at_point(point.shapes, point.slopes, x, u, strain);
    if (strain == Strain::large && !(at.F.determinant() > 0)) {
      equations.is_sound = false;
      return equations;
    }
    const double volume = volume_of(point, at), P = dilatation.coefficients.dot(point.pressures);
    const Eigen::Matrix4Xd B = strain_slopes(at, point.shapes);
    const Eigen::Vector4d stress = stress_of(at, P, solid);
    equations.energy_fJ +=
        volume * (mu * at.strain.squaredNorm() + 0.5 * lambda * P * P + solid.contraction_kPa * trace(at.strain));
    equations.forces_nN += volume * B.transpose() * stress;
    if (wanted != Wanted::stiffness) continue;
    all.middleRows<4>(4 * q) = std::sqrt(2 * mu * volume) * B;
    divergence += volume * point.pressures * (B.row(0) + B.row(1) + B.row(2));
    if (strain == Strain::small) continue;
    Eigen::Matrix2d plane;
    plane << stress[0], stress[3] / std::numbers::sqrt2, stress[3] / std::numbers::sqrt2, stress[2];
    stretched += volume * at.slopes * plane * at.slopes.transpose();
    hoop += volume * stress[1] / (at.r * at.r) * point.shapes * point.shapes.transpose();
  }
  if (wanted != Wanted::stiffness) return equations;
  equations.stiffness = Eigen::MatrixXd::Zero(n, n);
  equations.stiffness.noalias() = all.transpose() * all;
  const Eigen::LLT<Eigen::MatrixXd> mass(dilatation.mass);
  const Eigen::MatrixXd projected = mass.matrixL().solve(divergence);
  equations.stiffness.noalias() += lambda * projected.transpose() * projected;
  if (strain == Strain::large) {
    const auto every_second = [&](int first) { return Eigen::seqN(first, square.n_nodes(), 2); };
    equations.stiffness(every_second(0), every_second(0)) += stretched + hoop;
    equations.stiffness(every_second(1), every_second(1)) += stretched;
  }
  return equations;
}

Eigen::Vector4d stress_kPa(const Square& square, const Nodes& x, const Nodes& u, const Solid& solid, Strain strain,
                           Vec2 unit) {
  const Dilatation dilatation = dilatation_of(square, x, u, strain);
  const AtPoint at = at_point(square.shapes_at(unit), square.slopes_at(unit), x, u, strain);
  Eigen::Vector4d stress = stress_of(at, dilatation.coefficients.dot(pressures_at(unit, square.order())), solid);
  stress[3] /= std::numbers::sqrt2;
  return stress;
}

double least_sine(const Square& square, const Nodes& x) {
  double least = 1;
  for (const Square::Point& point : square.points()) {
    const Eigen::Matrix2d jacobian = x * point.slopes;
    least = std::min(least, jacobian.determinant() / (jacobian.col(0).norm() * jacobian.col(1).norm()));
  }
  return least;
}

}  // namespace mbtfm::solids
