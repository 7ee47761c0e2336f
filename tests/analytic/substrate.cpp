/// The half-space and the layer against closed forms, brute-force quadrature and independently computed values.
#include "pipeline/numerics/quadrature.h"
#include "substrate/greens/layer.h"
#include "substrate/greens/layer_vertical.h"
#include "substrate/material.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace mbtfm::substrate {
namespace {

using std::numbers::pi;

/// Rows of numbers below a header line.
std::vector<std::vector<double>> rows_of(const std::string& name) {
  std::ifstream file(test::source_folder().string() + "/tests/data/reference/substrate/" + name);
  std::vector<std::vector<double>> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    std::string field;
    rows.emplace_back();
    while (std::getline(fields, field, ',')) rows.back().push_back(std::stod(field));
  }
  return rows;
}

/// The gel of the first columns; a thickness of inf stands for the half-space.
Gel gel_of(const std::vector<double>& row) {
  return {.youngs_modulus_kPa = row[0], .poisson_ratio = row[1], .thickness_um = row[2]};
}

/// One table for each gel of the rows.
const greens::Layer& layer_of(const Gel& gel) {
  static std::map<std::pair<double, double>, greens::Layer> layers;
  return layers.try_emplace({gel.poisson_ratio, gel.thickness_um}, gel).first->second;
}

double relative_difference(const greens::Sym2& value, const greens::Sym2& reference) {
  const auto size = [](double xx, double xy, double yy) { return std::sqrt(xx * xx + 2 * xy * xy + yy * yy); };
  return size(value.xx - reference.xx, value.xy - reference.xy, value.yy - reference.yy) /
         size(reference.xx, reference.xy, reference.yy);
}

greens::Sym2 cerruti_surface(const Gel& gel, Vec2 offset) {
  const double r = norm(offset);
  const Vec2 e = (1 / r) * offset;
  const double nu = gel.poisson_ratio;
  return 1 / (2 * pi * shear_modulus_kPa(gel) * r) *
         greens::Sym2{1 - nu + nu * e.x * e.x, nu * e.x * e.y, 1 - nu + nu * e.y * e.y};
}

TEST(Layer, equals_independent_values_of_a_point_force_in_every_row) {
  const auto rows = rows_of("layer_point.csv");
  ASSERT_EQ(rows.size(), 96u);
  for (const auto& row : rows) {
    const Gel gel = gel_of(row);
    const Vec2 offset = {row[3], row[4]};
    const greens::Sym2 reference = {row[5], row[6], row[7]};
    const greens::Sym2 value =
        std::isinf(gel.thickness_um) ? cerruti_surface(gel, offset) : layer_of(gel).point_compliance_um_per_nN(offset);
    // the rows are good to 1e-9, the table to 1e-12 of the half-space's field
    EXPECT_LT(relative_difference(value, reference), 1e-8)
        << "nu " << row[1] << " h " << row[2] << " r " << norm(offset);
  }
}

TEST(DiscRule, averages_powers_up_to_its_degree) {
  // <x^2i y^2k> over the unit disc: (2i-1)!! (2k-1)!! / (2^n (n+1)!), n = i + k
  const auto odd_factorial = [](int n) {
    return n == 0 ? 1.0 : std::tgamma(2 * n) / std::tgamma(n) / std::pow(2, n - 1);
  };
  for (const int degree : {3, 5, 7, 11})
    for (int i = 0; 2 * i <= degree; ++i)
      for (int k = 0; 2 * (i + k) <= degree; ++k) {
        double sum = 0;
        for (const DiscPoint& p : disc_rule(degree))
          sum += p.weight * std::pow(p.position.x, 2 * i) * std::pow(p.position.y, 2 * k);
        const int n = i + k;
        const double exact = odd_factorial(i) * odd_factorial(k) / (std::pow(2, n) * std::tgamma(n + 2));
        EXPECT_NEAR(sum, exact, 1e-13) << "degree " << degree << ", x^" << 2 * i << " y^" << 2 * k;
      }
}

TEST(Layer, beyond_its_reach_nothing_is_left_of_the_half_spaces_field) {
  const Gel gel{.youngs_modulus_kPa = 5, .poisson_ratio = 0.3, .thickness_um = 2};
  const greens::Layer layer(gel);
  const greens::LayerVertical vertical(gel);
  const Ellipse disc{.semi_major_um = 0.5, .semi_minor_um = 0.5, .angle_rad = 0};
  for (const double thicknesses : {39.0, 41.0, 200.0}) {
    const double r = thicknesses * gel.thickness_um;
    const Vec2 offset = r * Vec2{std::cos(0.7), std::sin(0.7)};
    greens::Sym2 sum = layer.point_correction_um_per_nN(offset);
    const greens::Sym2 half_space = cerruti_surface(gel, offset);
    sum += half_space;
    EXPECT_LT(std::abs(sum.xx) + std::abs(sum.xy) + std::abs(sum.yy), 1e-10 * half_space.xx) << r;
    const double whole = vertical.vertical_um({offset}, {disc}, {{1, 0}}, 1).front();
    const double of_half_space = greens::half_space_vertical_um(gel, {offset}, {disc}, {{1, 0}}, 1).front();
    EXPECT_LT(std::abs(whole), 1e-4 * std::abs(of_half_space)) << r;  // the table's 1e-6 of the field near the force
  }
}

TEST(Layer, equals_independent_values_of_an_ellipse_in_every_row) {
  const auto rows = rows_of("layer_ellipse.csv");
  ASSERT_EQ(rows.size(), 96u);
  for (const auto& row : rows) {
    const Gel gel = gel_of(row);
    const Ellipse ellipse = {
        .centre_um = {3, -7}, .semi_major_um = row[3], .semi_minor_um = row[4], .angle_rad = row[5]};
    const Vec2 point = ellipse.centre_um + Vec2{row[6], row[7]};
    const greens::Sym2 reference = {row[8], row[9], row[10]};
    double difference = 0;
    if (std::isinf(gel.thickness_um)) {
      difference = relative_difference(greens::HalfSpaceEllipse(gel, ellipse).compliance_um_per_nN(point), reference);
    } else {
      difference =
          relative_difference(greens::LayerEllipse(layer_of(gel), ellipse).compliance_um_per_nN(point), reference);
    }
    // the rules leave out less than 1e-8 of the nearby field
    EXPECT_LT(difference, 1e-8) << "nu " << row[1] << " h " << row[2] << " r " << norm(Vec2{row[6], row[7]});
  }
}

/// The kernel averaged over the ellipse by a fine rule: right outside it.
greens::Sym2 averaged_cerruti(const Gel& gel, const Ellipse& ellipse, Vec2 point) {
  greens::Sym2 sum;
  for (const DiscPoint& p : ellipse_rule(ellipse, 159))
    sum += p.weight * cerruti_surface(gel, point - ellipse.centre_um - p.position);
  return sum;
}

const Gel kGel = {.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.45, .thickness_um = 30};

TEST(HalfSpace, field_of_an_ellipse_is_the_average_of_the_point_force_outside_it) {
  for (const double aspect : {1.0, 2.0, 10.0}) {
    const Ellipse ellipse = {.centre_um = {1, 2}, .semi_major_um = aspect, .semi_minor_um = 1, .angle_rad = 0.7};
    for (int k = 0; k < 24; ++k) {
      // a quarter of the major axis beyond the rim: a rule of degree 159 leaves at most
      // (5/4 + sqrt(25/16 - 1))^-160 = 2^-160 of the kernel
      const double direction = 2 * pi * k / 24;
      const Vec2 local = {(aspect + 0.25 * aspect) * std::cos(direction), (1 + 0.25 * aspect) * std::sin(direction)};
      const double c = std::cos(ellipse.angle_rad), s = std::sin(ellipse.angle_rad);
      const Vec2 point = ellipse.centre_um + Vec2{c * local.x - s * local.y, s * local.x + c * local.y};
      EXPECT_LT(relative_difference(greens::HalfSpaceEllipse(kGel, ellipse).compliance_um_per_nN(point),
                                    averaged_cerruti(kGel, ellipse, point)),
                1e-11)
          << "aspect " << aspect << ", direction " << direction;
    }
  }
}

/// Chord moments by brute force: directions in equal steps, the chord of each from its quadratic equation.
greens::Sym2 brute_chord_moments(Vec2 p, double a, double b, int n) {
  greens::Sym2 sum;
  for (int k = 0; k < n; ++k) {
    const double t = pi * (k + 0.5) / n;
    const Vec2 e = {std::cos(t), std::sin(t)};
    const double qa = e.x * e.x / (a * a) + e.y * e.y / (b * b);
    const double qb = p.x * e.x / (a * a) + p.y * e.y / (b * b);
    const double qc = p.x * p.x / (a * a) + p.y * p.y / (b * b) - 1;
    const double under = qb * qb - qa * qc;
    const double chord = under > 0 ? 2 * std::sqrt(under) / qa : 0;
    sum += pi / n * chord * greens::Sym2{e.x * e.x, e.x * e.y, e.y * e.y};
  }
  return sum;
}

TEST(HalfSpace, chord_moments_equal_brute_force_inside_outside_and_on_the_rim) {
  constexpr int kDirections = 2000000;
  for (const double aspect : {1.0, 3.0, 10.0})
    for (const double r : {0.0, 0.5, 0.99, 1.0, 1.01, 1.5})
      for (const double angle : {0.0, 0.4, 0.5 * pi, 2.2}) {
        const Vec2 point = {aspect * r * std::cos(angle), r * std::sin(angle)};
        // outside, brute force errs where a chord begins, as a square root: step^(3/2) of the ellipse's own angle;
        // on the rim, where the chord has a kink: step². Both below 1e-8.
        EXPECT_LT(relative_difference(greens::chord_moments_um(point, aspect, 1),
                                      brute_chord_moments(point, aspect, 1, kDirections)),
                  1e-8)
            << "aspect " << aspect << ", r " << r << ", angle " << angle;
      }
}

TEST(HalfSpace, centre_of_a_uniform_disc_moves_by_the_textbook_value) {
  const double radius = 1.7;
  const Ellipse disc = {.centre_um = {4, 5}, .semi_major_um = radius, .semi_minor_um = radius, .angle_rad = 0.3};
  const double q = 1 / (pi * radius * radius);
  const double nu = kGel.poisson_ratio;
  const double expected = (1 + nu) * (2 - nu) * q * radius / kGel.youngs_modulus_kPa;
  const greens::Sym2 g = greens::HalfSpaceEllipse(kGel, disc).compliance_um_per_nN(disc.centre_um);
  EXPECT_NEAR(g.xx, expected, 1e-12 * expected);
  EXPECT_NEAR(g.yy, expected, 1e-12 * expected);
  EXPECT_NEAR(g.xy, 0, 1e-12 * expected);
}

TEST(HalfSpace, a_hertz_like_patch_moves_the_surface_by_the_known_values) {
  // q0 sqrt(1 - r²/a²) is a stack of uniform discs: with r = a sqrt(1 - s²), q = q0 s, the disc of radius a sqrt(1 -
  // s²) carries q0 ds over its area; force pi a² (1 - s²) q0 ds, in all 2/3 pi a² q0 = 10 nN
  const Gel gel = {.youngs_modulus_kPa = 10, .poisson_ratio = 0.45, .thickness_um = 1000};
  const double a = 2, force = 10;
  const double known[8][4] = {{0, 0, 0.421406, 0},          {1, 0, 0.376377, 0},        {0, 1, 0.361084, 0},
                              {1.5, 1, 0.259768, 0.022939}, {4, 0, 0.115783, 0},        {0, 4, 0.067946, 0},
                              {3, 3, 0.086334, 0.022774},   {10, 5, 0.037616, 0.007359}};
  const numerics::GaussRule gauss = numerics::gauss_legendre(200);
  for (const auto& [x, y, ux, uy] : known) {
    greens::Sym2 sum;
    for (std::size_t k = 0; k < gauss.nodes.size(); ++k) {
      const double s = 0.5 * (1 + gauss.nodes[k]);
      const double radius = a * std::sqrt(1 - s * s);
      const double share = 0.5 * gauss.weights[k] * 1.5 * (1 - s * s);
      const Ellipse disc = {.semi_major_um = radius, .semi_minor_um = radius, .angle_rad = 0};
      sum += share * force * greens::HalfSpaceEllipse(gel, disc).compliance_um_per_nN({x, y});
    }
    // the values have six decimals; the stack's kink where a disc's rim passes the point errs by about 1/200² of 0.4
    EXPECT_NEAR(sum.xx, ux, 1e-5) << x << ", " << y;
    EXPECT_NEAR(sum.xy, uy, 1e-5) << x << ", " << y;
  }
}

TEST(HalfSpace, series_of_an_ellipse_errs_as_the_sixth_power_of_its_size_over_the_distance) {
  for (const double aspect : {1.0, 1.5, 10.0}) {
    const Ellipse ellipse = {.centre_um = {1, 2}, .semi_major_um = aspect, .semi_minor_um = 1, .angle_rad = 0.7};
    const greens::HalfSpaceEllipse field(kGel, ellipse);
    for (const double r : {5.0, 10.0, 20.0})
      for (int k = 0; k < 12; ++k) {
        const double direction = 2 * pi * k / 12;
        const Vec2 point = ellipse.centre_um + r * aspect * Vec2{std::cos(direction), std::sin(direction)};
        EXPECT_LT(relative_difference(field.far_compliance_um_per_nN(point), field.compliance_um_per_nN(point)),
                  0.2 * std::pow(r, -6))
            << "aspect " << aspect << ", r " << r << ", direction " << direction;
      }
  }
}

TEST(HalfSpace, far_from_an_ellipse_its_field_is_a_point_force) {
  const Ellipse ellipse = {.semi_major_um = 1, .semi_minor_um = 0.4, .angle_rad = 1};
  // the next term is the second moment, (a/r)²/4 times a second derivative's factor of at most 2
  for (const double r : {10.0, 100.0, 1000.0}) {
    const Vec2 point = {0.6 * r, -0.8 * r};
    EXPECT_LT(relative_difference(greens::HalfSpaceEllipse(kGel, ellipse).compliance_um_per_nN(point),
                                  cerruti_surface(kGel, point)),
              0.5 / (r * r));
  }
}

TEST(HalfSpace, inner_field_is_in_equilibrium_and_meets_the_surface_field) {
  const double x[3] = {0.7, -1.1, 0.9};
  const greens::PointForceField on_top = greens::cerruti_field(kGel, x[0], x[1], 0);
  const greens::Sym2 surface = cerruti_surface(kGel, {x[0], x[1]});
  EXPECT_NEAR(on_top.u_um_per_nN[0][0], surface.xx, 1e-15);
  EXPECT_NEAR(on_top.u_um_per_nN[0][1], surface.xy, 1e-15);
  EXPECT_NEAR(on_top.u_um_per_nN[1][1], surface.yy, 1e-15);
  // central differences: step² of the fourth derivatives and rounding over the step, 1e-10 and 1e-12 of the field
  const double step = 1e-5;
  const double nu = kGel.poisson_ratio;
  for (int f = 0; f < 2; ++f) {
    const greens::PointForceField here = greens::cerruti_field(kGel, x[0], x[1], x[2]);
    double divergence_gradient[3], laplacian[3] = {};
    for (int j = 0; j < 3; ++j) {
      double high[3] = {x[0], x[1], x[2]}, low[3] = {x[0], x[1], x[2]};
      high[j] += step;
      low[j] -= step;
      const greens::PointForceField after = greens::cerruti_field(kGel, high[0], high[1], high[2]);
      const greens::PointForceField before = greens::cerruti_field(kGel, low[0], low[1], low[2]);
      double trace = 0;
      for (int i = 0; i < 3; ++i) {
        const double slope = (after.u_um_per_nN[f][i] - before.u_um_per_nN[f][i]) / (2 * step);
        EXPECT_NEAR(here.gradient_per_nN[f][i][j], slope, 1e-10) << f << i << j;
        laplacian[i] += (after.gradient_per_nN[f][i][j] - before.gradient_per_nN[f][i][j]) / (2 * step);
        trace += (after.gradient_per_nN[f][i][i] - before.gradient_per_nN[f][i][i]) / (2 * step);
      }
      divergence_gradient[j] = trace;
    }
    // Navier: grad div u / (1 - 2 nu) + laplacian u = 0
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(divergence_gradient[i] / (1 - 2 * nu) + laplacian[i], 0, 1e-9);
  }
}

}  // namespace
}  // namespace mbtfm::substrate
