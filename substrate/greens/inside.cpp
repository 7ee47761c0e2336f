#include "substrate/greens/inside.h"

#include <math.h>  // j0, j1: POSIX

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/numerics/quadrature.h"
#include "substrate/greens/half_space.h"
#include "substrate/greens/transforms.h"
#include "substrate/material.h"

namespace mbtfm::greens {
namespace {

using std::numbers::pi;

// The base's part is singular at its image sources, 2 - z away and one at least: over half a thickness of r (half
// length 1/4) Chebyshev interpolation gains a factor of 8 by node, over all depths (half length 1/2) one of 3.7 at the
// base.
constexpr int kPiecesOfR = 2, kNodesOfR = 12, kNodesOfZ = 24;
constexpr int kPiecesInReach = kPiecesOfR * static_cast<int>(BaseTable::kReach);

/// Displacements of a wave of wave number 1: U along it as its cosine, W into the gel as its sine.
struct Wave {
  double u = 0, w = 0;
};

/// grad phi (i = 0, 1) and kappa psi e_z - z grad psi (i = 2, 3), which decay from the surface (even i) or from the
/// base at z = x (odd i).
Wave solution(int i, double kappa, double x, double z) {
  const double s = i % 2 == 0 ? -1 : 1, e = std::exp(s < 0 ? -z : z - x);
  return i < 2 ? Wave{e, s * e} : Wave{-z * e, (kappa - z * s) * e};
}

/// The half-space's, by a unit traction along the wave or into the gel.
struct HalfSpaceWave {
  double phi, psi;
  Wave at(double kappa, double z) const {
    const Wave a = solution(0, kappa, 0, z), b = solution(2, kappa, 0, z);
    return {phi * a.u + psi * b.u, phi * a.w + psi * b.w};
  }
};

/// What the base at z = x adds to both: the solutions' coefficients.
std::array<Eigen::Vector4d, 2> base_part(double nu, double x) {
  const double kappa = 3 - 4 * nu;
  Eigen::Matrix4d rows;  // U and W at the base, sigma_xz and sigma_zz over mu at the surface
  for (int i = 0; i < 4; ++i) {
    const Wave base = solution(i, kappa, x, x);
    const double s = i % 2 == 0 ? -1 : 1, top = s < 0 ? 1 : std::exp(-x);
    rows.col(i) << base.u, base.w, (i < 2 ? 2 * s : kappa - 1) * top, (i < 2 ? 2 : 4 * (1 - nu) * s) * top;
  }
  const Eigen::PartialPivLU<Eigen::Matrix4d> solver(rows);
  std::array<Eigen::Vector4d, 2> coefficients;
  const std::array<HalfSpaceWave, 2> loads{{{1 - nu, 0.5}, {0.5 * (1 - 2 * nu), 0.5}}};
  for (int load = 0; load < 2; ++load) {
    const Wave there = loads[load].at(kappa, x);
    coefficients[load] = solver.solve(Eigen::Vector4d(-there.u, -there.w, 0, 0));
  }
  return coefficients;
}

Wave sum_of(const Eigen::Vector4d& coefficients, double kappa, double x, double z) {
  Wave sum;
  for (int i = 0; i < 4; ++i) {
    const Wave part = solution(i, kappa, x, z);
    sum = {sum.u + coefficients[i] * part.u, sum.w + coefficients[i] * part.w};
  }
  return sum;
}

double across(double x, double z) {  // sinh(x (1 - z)) / cosh x - exp(-x z)
  return -std::exp(-x * (2 - z)) * (1 + std::exp(-2 * x * z)) / (1 + std::exp(-2 * x));
}

}  // namespace

Eigen::Matrix3d half_space_inside_um_per_nN(const Gel& gel, Vec2 offset, double z) {
  const double r2 = dot(offset, offset), distance = std::sqrt(r2 + z * z);
  const double a = 1 / distance, b = 1 / (distance + z), q = 1 - 2 * gel.poisson_ratio;
  const double even = a + q * b, cross = a * a * a - q * a * b * b;
  const double down = z * a * a * a + q * a * b, out = z * a * a * a - q * a * b;
  const double x = offset.x, y = offset.y;
  Eigen::Matrix3d g;
  g << even + x * x * cross, x * y * cross, x * out,  //
      x * y * cross, even + y * y * cross, y * out,   //
      x * down, y * down, z * z * a * a * a + (1 + q) * a;
  return 1 / (4 * pi * substrate::shear_modulus_kPa(gel)) * g;
}

double base_down_by_along(double nu, double x) { return sum_of(base_part(nu, x)[0], 3 - 4 * nu, x, 0).w; }

BaseTable::BaseTable(double nu) {
  constexpr int kPanels = 100;  // of 1/2 with 20 Gauss points: the factors fall as x² exp(-x), or faster
  const numerics::GaussRule gauss = numerics::gauss_legendre(20);
  const double kappa = 3 - 4 * nu;
  const auto n_gauss = static_cast<Eigen::Index>(gauss.nodes.size()), n_x = kPanels * n_gauss;
  Eigen::VectorXd x(n_x);
  // By function, integrands without their Bessel function: rows are x, columns depths.
  std::array<Eigen::MatrixXd, kFunctions> factor;
  factor.fill(Eigen::MatrixXd(n_x, kNodesOfZ));
  for (Eigen::Index i = 0; i < n_x; ++i) {
    const auto g = static_cast<std::size_t>(i % n_gauss);
    x[i] = 0.5 * (static_cast<double>(i / n_gauss) + 0.5 * (1 + gauss.nodes[g]));
    const double weight = 0.25 * gauss.weights[g];
    const auto coefficients = base_part(nu, x[i]);
    for (int k = 0; k < kNodesOfZ; ++k) {
      const double z = 0.5 * (1 + chebyshev_node(kNodesOfZ, k));
      const Wave along = sum_of(coefficients[0], kappa, x[i], x[i] * z);
      const Wave down = sum_of(coefficients[1], kappa, x[i], x[i] * z);
      const double t = across(x[i], z);
      factor[0](i, k) = 0.5 * weight * (along.u + t);
      factor[1](i, k) = -0.5 * weight * (along.u - t);
      factor[2](i, k) = weight * along.w;
      factor[3](i, k) = -weight * down.u;
      factor[4](i, k) = weight * down.w;
    }
  }
  Eigen::MatrixXd j0(kPiecesInReach * kNodesOfR, n_x), j1(j0.rows(), n_x), j2(j0.rows(), n_x);
  for (Eigen::Index row = 0; row < j0.rows(); ++row) {
    const double r = (static_cast<double>(row / kNodesOfR) +
                      0.5 * (1 + chebyshev_node(kNodesOfR, static_cast<int>(row % kNodesOfR)))) /
                     kPiecesOfR;
    for (Eigen::Index i = 0; i < n_x; ++i) {
      j0(row, i) = ::j0(x[i] * r);
      j1(row, i) = ::j1(x[i] * r);
      j2(row, i) = bessel_2(x[i] * r, j0(row, i), j1(row, i));
    }
  }
  const std::array<const Eigen::MatrixXd*, kFunctions> bessel{&j0, &j2, &j1, &j1, &j0};
  values_.resize(static_cast<std::size_t>(j0.rows() * kNodesOfZ));
  for (int f = 0; f < kFunctions; ++f) {
    const Eigen::MatrixXd of_r_and_z = *bessel[f] * factor[f];
    for (Eigen::Index row = 0; row < j0.rows(); ++row) {
      for (int k = 0; k < kNodesOfZ; ++k) values_[row * kNodesOfZ + k][f] = of_r_and_z(row, k);
    }
  }
}

BaseTable::Value BaseTable::at(double r, double z) const {
  const int piece = std::min(static_cast<int>(r * kPiecesOfR), kPiecesInReach - 1);
  const auto of_r = interpolation_weights<kNodesOfR>(2 * (r * kPiecesOfR - piece) - 1);
  const auto of_z = interpolation_weights<kNodesOfZ>(2 * z - 1);
  std::array<double, kFunctions> sum{};
  for (int i = 0; i < kNodesOfR; ++i) {
    const auto* row = &values_[(piece * kNodesOfR + i) * kNodesOfZ];
    for (int k = 0; k < kNodesOfZ; ++k) {
      for (int f = 0; f < kFunctions; ++f) sum[f] += of_r[i] * of_z[k] * row[k][f];
    }
  }
  return {sum[0], sum[1], sum[2], sum[3], sum[4]};
}

LayerInside::LayerInside(const Gel& gel) : gel_((mbtfm::check(gel), gel)), table_(gel.poisson_ratio) {}

Eigen::Matrix3d LayerInside::compliance_um_per_nN(Vec2 offset, double z) const {
  return half_space_inside_um_per_nN(gel_, offset, z) + base_part_um_per_nN(offset, z);
}

Eigen::Matrix3d LayerInside::base_part_um_per_nN(Vec2 offset, double z) const {
  const double h = gel_.thickness_um, r = norm(offset);
  if (r >= BaseTable::kReach * h) return -half_space_inside_um_per_nN(gel_, offset, z);
  const BaseTable::Value v = table_.at(r / h, z / h);
  const Vec2 e = r > 0 ? (1 / r) * offset : Vec2{};
  const double difference = v.d * (e.x * e.x - e.y * e.y), xy = 2 * v.d * e.x * e.y;
  Eigen::Matrix3d base;
  base << v.s + difference, xy, e.x * v.out_by_down,  //
      xy, v.s - difference, e.y * v.out_by_down,      //
      e.x * v.down_by_along, e.y * v.down_by_along, v.down_by_down;
  return 1 / (2 * pi * substrate::shear_modulus_kPa(gel_) * h) * base;
}

EllipseInside::EllipseInside(const Gel& gel, const LayerInside* layer, const substrate::Ellipse& ellipse)
    : gel_(gel),
      layer_(layer),
      ellipse_(ellipse),
      cos_(std::cos(ellipse.angle_rad)),
      sin_(std::sin(ellipse.angle_rad)) {
  if (!layer) return;
  const double z = gel.thickness_um / ellipse.semi_major_um, q = 1 / (z + std::sqrt(z * z + 1));  // see LayerEllipse
  base_rule_ = substrate::ellipse_rule(ellipse, std::max(3, static_cast<int>(std::ceil(std::log(1e-9) / std::log(q)))));
}

Eigen::Matrix3d EllipseInside::compliance_um_per_nN(Vec2 point, double z) const {
  Eigen::Matrix3d sum = z > 0 ? half_space(point, z) : half_space_at_surface(point);
  for (const substrate::DiscPoint& p : base_rule_)
    sum += p.weight * layer_->base_part_um_per_nN(point - ellipse_.centre_um - p.position, z);
  return sum;
}

Eigen::Matrix3d EllipseInside::half_space(Vec2 point, double z) const {
  constexpr int kFewest = 32, kMost = 1 << 15;  // points of the rim
  constexpr double kTolerance = 1e-10;
  const double a = ellipse_.semi_major_um, b = ellipse_.semi_minor_um, q = 1 - 2 * gel_.poisson_ratio;
  const Vec2 away = point - ellipse_.centre_um;
  const Vec2 seen{cos_ * away.x + sin_ * away.y, cos_ * away.y - sin_ * away.x};  // in the ellipse's frame
  const auto part = [&](double angle) {
    const Vec2 d{a * std::cos(angle) - seen.x, b * std::sin(angle) - seen.y};  // from the projection to the rim
    const Vec2 step{-a * std::sin(angle), b * std::cos(angle)};
    const double s2 = std::max(dot(d, d), 1e-24 * a * a), s = std::sqrt(s2), R = std::sqrt(s2 + z * z);
    const double swept = cross(d, step) / s2;  // the angle, by the parameter
    const Vec2 e = 1 / s * d;
    const double beyond = s2 / (R + z), log = std::log1p(beyond / (2 * z));  // R - z, ln((R + z) / 2z)
    const double hyperbolic = z * std::asinh(s / z);
    const double even = (1 + q) * beyond - q * z * log;
    const double squared = beyond - z * beyond / R - q * (beyond - 2 * z * log);
    const double first = hyperbolic - z * s / R, second = s - hyperbolic;
    const double down = first + q * second, out = first - q * second;
    Eigen::Matrix3d m;
    // the point lies at -d from where the force acts
    m << even + e.x * e.x * squared, e.x * e.y * squared, -e.x * out,  //
        e.x * e.y * squared, even + e.y * e.y * squared, -e.y * out,   //
        -e.x * down, -e.y * down, z * beyond / R + (1 + q) * beyond;
    return Eigen::Matrix3d(swept * m);
  };
  const auto mean_of = [&](int n, double first) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (int k = 0; k < n; ++k) sum += part(2 * pi * (k + first) / n);
    return Eigen::Matrix3d(1.0 / n * sum);
  };
  Eigen::Matrix3d mean = mean_of(kFewest, 0);  // over the rim's parameter
  double change = 1;
  for (int n = kFewest; n < kMost && change > kTolerance; n *= 2) {
    const Eigen::Matrix3d finer = 0.5 * (mean + mean_of(n, 0.5));
    change = (finer - mean).cwiseAbs().maxCoeff() / finer.cwiseAbs().maxCoeff();
    mean = finer;
  }
  Eigen::Matrix3d turn;
  turn << cos_, -sin_, 0, sin_, cos_, 0, 0, 0, 1;
  const double scale = 1 / (4 * pi * substrate::shear_modulus_kPa(gel_) * pi * a * b);
  return 2 * pi * scale * (turn * mean * turn.transpose());
}

Eigen::Matrix3d EllipseInside::half_space_at_surface(Vec2 point) const {
  const double mu = substrate::shear_modulus_kPa(gel_), area = pi * ellipse_.semi_major_um * ellipse_.semi_minor_um;
  const Vec2 away = point - ellipse_.centre_um;
  const Vec2 seen{cos_ * away.x + sin_ * away.y, cos_ * away.y - sin_ * away.x};
  const Sym2 moments = chord_moments_um(seen, ellipse_.semi_major_um, ellipse_.semi_minor_um);
  const Sym2 along = HalfSpaceEllipse(gel_, ellipse_).compliance_um_per_nN(point);
  const auto down = [&](Vec2 force_nN) {
    return half_space_vertical_um(gel_, {point}, {ellipse_}, {force_nN}, 1).front();
  };
  Eigen::Matrix3d g;
  g << along.xx, along.xy, 0, along.xy, along.yy, 0, down({1, 0}), down({0, 1}),
      (1 - gel_.poisson_ratio) / (2 * pi * mu * area) * (moments.xx + moments.yy);
  g.col(2).head<2>() = -g.row(2).head<2>().transpose();  // reciprocity, across the surface
  return g;
}

}  // namespace mbtfm::greens
