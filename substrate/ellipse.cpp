#include "substrate/ellipse.h"

#include <cmath>
#include <numbers>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/quadrature.h"

namespace mbtfm::substrate {

using std::numbers::pi;

void check(const std::vector<Ellipse>& ellipses) {
  for (std::size_t j = 0; j < ellipses.size(); ++j) {
    const Ellipse& e = ellipses[j];
    const std::string element = "ellipse " + std::to_string(j);
    if (!is_finite(e.centre_um) || !std::isfinite(e.angle_rad)) {
      throw InvalidData(element, "a finite centre and angle", "another");
    }
    const bool is_finite = std::isfinite(e.semi_minor_um) && std::isfinite(e.semi_major_um);
    if (!is_finite || e.semi_minor_um <= 0 || e.semi_minor_um > e.semi_major_um * (1 + 1e-9)) {
      throw InvalidData("axes of " + element, "0 < semi_minor_um <= semi_major_um",
                        "'" + std::to_string(e.semi_minor_um) + "' and '" + std::to_string(e.semi_major_um) + "'");
    }
  }
}

namespace {

[[noreturn]] void refuse_point(std::size_t i, const std::string& coordinates) {
  throw InvalidData("point " + std::to_string(i), "finite coordinates", "'" + coordinates + "'");
}

}  // namespace

void check_points(const std::vector<Vec2>& points_um) {
  for (std::size_t i = 0; i < points_um.size(); ++i) {
    const Vec2 p = points_um[i];
    if (!is_finite(p)) refuse_point(i, std::to_string(p.x) + ", " + std::to_string(p.y));
  }
}

void check_points(const std::vector<Vec3>& points_um) {
  for (std::size_t i = 0; i < points_um.size(); ++i) {
    const Vec3& p = points_um[i];
    if (!is_finite(p)) refuse_point(i, std::to_string(p.x) + ", " + std::to_string(p.y) + ", " + std::to_string(p.z));
  }
}

Vec2 half_extent_um(const Ellipse& ellipse) {
  const double c = std::cos(ellipse.angle_rad);
  const double s = std::sin(ellipse.angle_rad);
  const double a2 = ellipse.semi_major_um * ellipse.semi_major_um;
  const double b2 = ellipse.semi_minor_um * ellipse.semi_minor_um;
  return {std::sqrt(a2 * c * c + b2 * s * s), std::sqrt(a2 * s * s + b2 * c * c)};
}

namespace {

void add_ring(std::vector<DiscPoint>& rule, double radius, int n, double weight) {
  for (int k = 0; k < n; ++k) {
    const double angle = 2 * pi * k / n;
    rule.push_back({{radius * std::cos(angle), radius * std::sin(angle)}, weight / n});
  }
}

}  // namespace

std::vector<DiscPoint> disc_rule(int degree) {
  std::vector<DiscPoint> rule;
  if (degree <= 3) {
    add_ring(rule, std::sqrt(0.5), 4, 1);
  } else if (degree <= 5) {
    rule.push_back({{0, 0}, 0.25});
    add_ring(rule, std::sqrt(2.0 / 3.0), 6, 0.75);
  } else {
    // r dr = d(r²)/2: n Gauss points in r² take r^(4n-2); 4n angles take harmonics below 4n. Together degree 4n - 1,
    // as odd degrees vanish by symmetry.
    const int n_rings = (degree + 4) / 4;
    const numerics::GaussRule gauss = numerics::gauss_legendre(n_rings);
    for (int k = 0; k < n_rings; ++k) {
      add_ring(rule, std::sqrt(0.5 * (1 + gauss.nodes[k])), 4 * n_rings, 0.5 * gauss.weights[k]);
    }
  }
  return rule;
}

std::vector<DiscPoint> ellipse_rule(const Ellipse& ellipse, int degree) {
  const Vec2 major = ellipse.semi_major_um * Vec2{std::cos(ellipse.angle_rad), std::sin(ellipse.angle_rad)};
  const Vec2 minor = ellipse.semi_minor_um * Vec2{-std::sin(ellipse.angle_rad), std::cos(ellipse.angle_rad)};
  std::vector<DiscPoint> rule = disc_rule(degree);
  for (DiscPoint& point : rule) point.position = point.position.x * major + point.position.y * minor;
  return rule;
}

}  // namespace mbtfm::substrate
