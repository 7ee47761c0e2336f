#include "substrate/greens/half_space.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "pipeline/numerics/parallel.h"
#include "substrate/material.h"

namespace mbtfm::greens {

using std::numbers::pi;

namespace {

// In coordinates scaled by the axes the ellipse is the unit disc. A line through p' = R (cos f0, sin f0) in direction
// f = f0 + psi has a chord of 2 sqrt(1 - R² sin² psi) there, m(f) = sqrt(a² cos² f + b² sin² f) times that in truth;
// e = (a cos f, b sin f) / m and dt = a b / m² df. So
//
//   M = 2 a b  integral  sqrt(1 - R² sin² psi) / m³ (a cos f, b sin f)(a cos f, b sin f)^T dpsi
//
// over psi in [-pi/2, pi/2] from inside; from outside over R |sin psi| < 1, where sin chi = R sin psi gives
//   sqrt(1 - R² sin² psi) dpsi = cos² chi / sqrt(R² - sin² chi) dchi,  chi in [-pi/2, pi/2].
// Both integrands have period pi in psi or chi (chi: after chi -> pi - chi), so the midpoint rule with n points errs by
// exp(-2 n d), d the height above the real axis of the nearest singularity: the rim (R = 1) or the tip of a slender
// ellipse (m = 0). Where n would be too large the interval is cut below those and each part drawn out by tanh.

constexpr double kDigits = 29.9;    // -log(1e-13)
constexpr double kRound = 1e6;      // exp(d) of a circle's tip: none
constexpr int kMostMidpoints = 96;  // beyond it the tanh rule is cheaper
constexpr double kTanhStep = 0.17;  // singularities at height pi/4: exp(-2 pi (pi/4) / 0.17) = 2e-13
constexpr int kTanhPoints = 88;     // on either side: exp(-2 · 0.17 · 88) = 1e-13

struct Scene {
  double a, b;          // semi-axes
  double r;             // R
  double cos_0, sin_0;  // of f0, in the first quadrant
};

void add(Sym2& sum, const Scene& s, double sin_psi, double cos_psi, double weight) {
  const double x = s.a * (s.cos_0 * cos_psi - s.sin_0 * sin_psi);
  const double y = s.b * (s.sin_0 * cos_psi + s.cos_0 * sin_psi);
  const double m2 = x * x + y * y;
  const double scale = weight / (m2 * std::sqrt(m2));
  sum += {scale * x * x, scale * x * y, scale * y * y};
}

void add_inside(Sym2& sum, const Scene& s, double sin_psi, double cos_psi, double weight) {
  // 1 - R² sin² = (1 - R²) + R² cos²: no cancellation at the rim
  const double half_chord = std::sqrt(std::max(0.0, (1 - s.r) * (1 + s.r) + s.r * s.r * cos_psi * cos_psi));
  add(sum, s, sin_psi, cos_psi, weight * half_chord);
}

void add_outside(Sym2& sum, const Scene& s, double sin_chi, double cos_chi, double weight) {
  const double r_cos_psi = std::sqrt((s.r - 1) * (s.r + 1) + cos_chi * cos_chi);
  if (r_cos_psi == 0) return;  // on the rim, along the tangent: no chord
  add(sum, s, sin_chi / s.r, r_cos_psi / s.r, weight * cos_chi * cos_chi / r_cos_psi);
}

/// Midpoint rules of n points on [-pi/2, pi/2] and the tanh rule on [-1, 1], made once.
struct Rules {
  struct Angle {
    double sin, cos;
  };
  std::array<std::vector<Angle>, kMostMidpoints + 1> midpoints;
  struct Node {
    double distance;  // from the nearer end of [-1, 1], exactly where it is tiny
    double weight;
    bool is_left;
  };
  std::vector<Node> tanh_nodes;

  Rules() {
    for (int n = 1; n <= kMostMidpoints; ++n) {
      for (int k = 0; k < n; ++k) {
        const double angle = -0.5 * pi + (k + 0.5) * pi / n;
        midpoints[n].push_back({std::sin(angle), std::cos(angle)});
      }
    }
    for (int k = -kTanhPoints; k <= kTanhPoints; ++k) {
      const double w = std::abs(k) * kTanhStep;
      const double cosh = std::cosh(w);
      tanh_nodes.push_back({std::exp(-w) / cosh, kTanhStep / (cosh * cosh), k < 0});
    }
  }
};

const Rules& rules() {
  static const Rules instance;
  return instance;
}

/// exp(d), d the height of the nearest singularity.
double exp_of_height(const Scene& s) {
  if (s.r < 1) {
    // rim: cosh d = 1/R; tip: tanh d = b/a, so exp(2d) = (a + b) / (a - b)
    const double tip = s.a > s.b ? std::sqrt((s.a + s.b) / (s.a - s.b)) : kRound;
    return s.r > 0 ? std::min(tip, (1 + std::sqrt((1 - s.r) * (1 + s.r))) / s.r) : tip;
  }
  // the tip psi = pi/2 - f0 + i d is carried over to chi by sin chi = R sin psi = z; cosh |Im asin z| is the
  // semi-axis of the ellipse with foci -1, 1 through z. The rim lies at cosh d = R.
  double semi_axis = s.r;
  if (s.a > s.b) {
    const double scale = s.r / std::sqrt((s.a + s.b) * (s.a - s.b));  // cosh d = a, sinh d = b over sqrt(a² - b²)
    const double re = scale * s.a * s.cos_0;
    const double im2 = scale * scale * s.b * s.b * s.sin_0 * s.sin_0;
    const double sum = std::sqrt((re - 1) * (re - 1) + im2) + std::sqrt((re + 1) * (re + 1) + im2);
    semi_axis = std::max(1.0, std::min(semi_axis, 0.5 * sum));
  }
  return semi_axis + std::sqrt((semi_axis - 1) * (semi_axis + 1));
}

/// Integrate over [low, high], graded towards both ends.
template <class Add>
void add_graded(double low, double high, const Add& add_angle) {
  const double half = 0.5 * (high - low);
  if (half <= 0) return;
  for (const Rules::Node& node : rules().tanh_nodes) {
    add_angle(node.is_left ? low + half * node.distance : high - half * node.distance, half * node.weight);
  }
}

Sym2 graded_moments(const Scene& s) {
  Sym2 sum;
  if (s.r <= 1) {
    const double tip = std::atan2(s.cos_0, s.sin_0);  // pi/2 - f0
    const auto angle = [&](double psi, double weight) { add_inside(sum, s, std::sin(psi), std::cos(psi), weight); };
    add_graded(-0.5 * pi, tip, angle);
    add_graded(tip, 0.5 * pi, angle);
  } else {
    const double tip = std::asin(std::min(1.0, s.r * s.cos_0));
    const auto angle = [&](double chi, double weight) { add_outside(sum, s, std::sin(chi), std::cos(chi), weight); };
    add_graded(-0.5 * pi, tip, angle);
    add_graded(tip, 0.5 * pi, angle);
  }
  return sum;
}

Sym2 midpoint_moments(const Scene& s, int n) {
  Sym2 sum;
  for (const auto& [sin, cos] : rules().midpoints[n]) {
    if (s.r < 1) {
      add_inside(sum, s, sin, cos, pi / n);
    } else {
      add_outside(sum, s, sin, cos, pi / n);
    }
  }
  return sum;
}

}  // namespace

Sym2 chord_moments_um(Vec2 point_um, double semi_major_um, double semi_minor_um) {
  Scene s{.a = semi_major_um, .b = semi_minor_um, .r = 0, .cos_0 = 1, .sin_0 = 0};
  const Vec2 scaled = {std::abs(point_um.x) / s.a, std::abs(point_um.y) / s.b};
  s.r = std::sqrt(dot(scaled, scaled));
  if (s.r > 0) {
    s.cos_0 = scaled.x / s.r;
    s.sin_0 = scaled.y / s.r;
  }
  const double digits_a_point = 2 * std::log(exp_of_height(s));  // none at the rim
  Sym2 moments = kDigits <= (kMostMidpoints - 1) * digits_a_point
                     ? midpoint_moments(s, static_cast<int>(std::ceil(kDigits / digits_a_point)) + 1)
                     : graded_moments(s);
  if ((point_um.x < 0) != (point_um.y < 0)) moments.xy = -moments.xy;
  return 2 * s.a * s.b * moments;
}

HalfSpaceEllipse::HalfSpaceEllipse(const Gel& gel, const substrate::Ellipse& ellipse)
    : ellipse_(ellipse),
      poisson_ratio_(gel.poisson_ratio),
      cos_(std::cos(ellipse.angle_rad)),
      sin_(std::sin(ellipse.angle_rad)),
      scale_(1 / (2 * pi * pi * substrate::shear_modulus_kPa(gel) * ellipse.semi_major_um * ellipse.semi_minor_um)) {
  // w = s (p e^(it) + q e^(-it)), s² even on [0, 1]: the terms without e^(it), times <s²> = 1/2 or <s⁴> = 1/3
  const double p = 0.5 * (ellipse.semi_major_um + ellipse.semi_minor_um);
  const double q = 0.5 * (ellipse.semi_major_um - ellipse.semi_minor_um);
  m20_ = p * q;
  m11_ = 0.5 * (p * p + q * q);
  m40_ = 2 * m20_ * m20_;
  m31_ = 2 * m20_ * m11_;
  m22_ = (p * p * p * p + 4 * m20_ * m20_ + q * q * q * q) / 3;
}

Sym2 HalfSpaceEllipse::far_compliance_um_per_nN(Vec2 point_um) const {
  // With z = x + i y in the ellipse's frame a point force's field is (2-nu)/2 1/|z| I plus the reflection
  // nu/2 z²/|z|³; of both, at z - w, the series in w/z and conj(w/z): those of (1-t)^(-1/2), (1-t)^(1/2), (1-t)^(-3/2)
  const Vec2 offset = point_um - ellipse_.centre_um;
  const double x = cos_ * offset.x + sin_ * offset.y, y = cos_ * offset.y - sin_ * offset.x;
  const double u = 1 / (x * x + y * y);
  const double re = u * u * (x * x - y * y), im = -2 * u * u * x * y;  // of z^-2
  const double re2 = re * re - im * im, im2 = 2 * re * im;
  const double even =
      1 + u * (m11_ / 4 + m22_ * 9 / 64 * u) + re * (m20_ * 3 / 4 + m31_ * 5 / 16 * u) + re2 * m40_ * 35 / 64;
  const double turned_re =
      1 - u * (m11_ * 3 / 4 + m22_ * 15 / 64 * u) + re * (m20_ * 7 / 4 - m31_ * 19 / 16 * u) + re2 * m40_ * 155 / 64;
  const double turned_im = im * (m31_ * u - 2 * m20_) - im2 * m40_ * 5 / 2;
  const double turn_re = re / u, turn_im = -im / u;  // z²/|z|²
  const double plane_re = turn_re * turned_re - turn_im * turned_im;
  const double plane_im = turn_re * turned_im + turn_im * turned_re;
  const double c = cos_ * cos_ - sin_ * sin_, s = 2 * cos_ * sin_;
  const double area_scale = 0.5 * pi * ellipse_.semi_major_um * ellipse_.semi_minor_um * scale_ * std::sqrt(u);
  const double mean = area_scale * (2 - poisson_ratio_) * even, part = area_scale * poisson_ratio_;
  const double xx = part * (c * plane_re - s * plane_im), xy = part * (s * plane_re + c * plane_im);
  return {mean + xx, xy, mean - xx};
}

Sym2 HalfSpaceEllipse::compliance_um_per_nN(Vec2 point_um) const {
  const double c = cos_;
  const double s = sin_;
  const Vec2 offset = point_um - ellipse_.centre_um;
  const Sym2 m = chord_moments_um({c * offset.x + s * offset.y, c * offset.y - s * offset.x}, ellipse_.semi_major_um,
                                  ellipse_.semi_minor_um);
  const double nu = poisson_ratio_;
  const double even = (1 - nu) * (m.xx + m.yy);
  return scale_ * Sym2{even + nu * (c * c * m.xx - 2 * c * s * m.xy + s * s * m.yy),
                       nu * (c * s * (m.xx - m.yy) + (c * c - s * s) * m.xy),
                       even + nu * (s * s * m.xx + 2 * c * s * m.xy + c * c * m.yy)};
}

PointForceField cerruti_field(const Gel& gel, double x_um, double y_um, double z_um) {
  // u_i = C [ d_if (A + q B) + x_i x_f (A³ - q A B²) ] for i = x, y;  u_z = C x_f [ z A³ + q A B ],
  // A = 1/R, B = 1/(R + z), q = 1 - 2 nu;  dA/dx_j = -x_j A³,  dB/dx_j = -B² (x_j A + d_jz)
  const double x[3] = {x_um, y_um, z_um};
  const double q = 1 - 2 * gel.poisson_ratio;
  const double scale = 1 / (4 * pi * substrate::shear_modulus_kPa(gel));
  const double r = std::sqrt(x_um * x_um + y_um * y_um + z_um * z_um);
  const double a = 1 / r;
  const double b = 1 / (r + z_um);
  const double a3 = a * a * a;
  const double even = a + q * b;
  const double cross = a3 - q * a * b * b;
  const double down = z_um * a3 + q * a * b;
  PointForceField field;
  for (int f = 0; f < 2; ++f) {
    for (int i = 0; i < 2; ++i) field.u_um_per_nN[f][i] = scale * ((i == f ? even : 0) + x[i] * x[f] * cross);
    field.u_um_per_nN[f][2] = scale * x[f] * down;
    for (int j = 0; j < 3; ++j) {
      const double da = -x[j] * a3;
      const double db = -b * b * (x[j] * a + (j == 2 ? 1 : 0));
      const double da3 = 3 * a * a * da;
      const double deven = da + q * db;
      const double dcross = da3 - q * (da * b * b + 2 * a * b * db);
      const double ddown = (j == 2 ? a3 : 0) + z_um * da3 + q * (da * b + a * db);
      for (int i = 0; i < 2; ++i) {
        const double dproduct = (i == j ? x[f] : 0) + (f == j ? x[i] : 0);
        field.gradient_per_nN[f][i][j] = scale * ((i == f ? deven : 0) + dproduct * cross + x[i] * x[f] * dcross);
      }
      field.gradient_per_nN[f][2][j] = scale * ((f == j ? down : 0) + x[f] * ddown);
    }
  }
  return field;
}

std::vector<double> half_space_vertical_um(const Gel& gel, const std::vector<Vec2>& points_um,
                                           const std::vector<substrate::Ellipse>& ellipses,
                                           const std::vector<Vec2>& forces_nN, int threads) {
  std::vector<double> vertical(points_um.size());
  numerics::parallel_for(static_cast<int>(points_um.size()), threads, [&](int i) {
    for (std::size_t j = 0; j < ellipses.size(); ++j) {
      const double a = ellipses[j].semi_major_um, b = ellipses[j].semi_minor_um;
      const std::complex<double> turn = std::polar(1.0, -ellipses[j].angle_rad);
      const Vec2 offset = points_um[i] - ellipses[j].centre_um;
      const std::complex<double> z = turn * std::complex(offset.x, offset.y);
      const std::complex<double> force = turn * std::complex(forces_nN[j].x, forces_nN[j].y);
      const bool is_inside = std::hypot(z.real() / a, z.imag() / b) <= 1;
      // the root that grows as z: of two factors, each with its cut on the line between the foci
      const double focus = std::sqrt(std::max(0.0, a * a - b * b));
      const std::complex<double> root = std::sqrt(z - focus) * std::sqrt(z + focus);
      const std::complex<double> field =
          is_inside ? pi * (std::conj(z) - (a - b) / (a + b) * z) : 2 * pi * a * b / (z + root);
      vertical[i] += (1 - 2 * gel.poisson_ratio) / (4 * pi * substrate::shear_modulus_kPa(gel) * pi * a * b) *
                     (force * field).real();
    }
  });
  return vertical;
}

}  // namespace mbtfm::greens
