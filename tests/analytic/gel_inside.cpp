#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"
#include "substrate/greens/inside.h"
#include "substrate/greens/layer.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace mbtfm::greens {
namespace {

Gel gel_of(double youngs_modulus_kPa, double poisson_ratio, double thickness_um) {
  return {.youngs_modulus_kPa = youngs_modulus_kPa, .poisson_ratio = poisson_ratio, .thickness_um = thickness_um};
}

double largest(const Eigen::Matrix3d& matrix) { return matrix.cwiseAbs().maxCoeff(); }

// tests/data/reference/substrate/layer_volume.csv: Hankel integrals by another program, to 1e-10 of the largest.
TEST(InsideOfTheGel, all_nine_components_are_those_of_an_independent_program) {
  const files::CsvTable table(test::source_folder() / "tests/data/reference/substrate/layer_volume.csv");
  const std::string axes = "xyz";
  int n_half_spaces = 0;
  std::map<double, LayerInside> layers;
  for (int row = 0; row < table.n_rows(); ++row) {
    const auto value = [&](const std::string& column) { return std::stod(table.text(row, column)); };
    Eigen::Matrix3d reference;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) reference(i, j) = value(std::string("g_") + axes[i] + axes[j] + "_um_per_nN");
    const Vec2 offset{value("dx_um"), value("dy_um")};
    const bool is_half_space = table.text(row, "thickness_um") == "inf";
    const Gel gel =
        gel_of(value("youngs_modulus_kPa"), value("poisson_ratio"), is_half_space ? 1 : value("thickness_um"));
    if (!is_half_space && !layers.contains(gel.thickness_um)) layers.emplace(gel.thickness_um, gel);
    const Eigen::Matrix3d found = is_half_space
                                      ? half_space_inside_um_per_nN(gel, offset, value("z_um"))
                                      : layers.at(gel.thickness_um).compliance_um_per_nN(offset, value("z_um"));
    EXPECT_LT(largest(found - reference), 1e-8 * largest(reference)) << "row " << row << "\n"
                                                                     << found << "\n\n"
                                                                     << reference;
    n_half_spaces += is_half_space;
  }
  EXPECT_EQ(n_half_spaces, 10);
  EXPECT_EQ(table.n_rows(), 40);
}

TEST(InsideOfTheGel, the_base_is_at_rest_and_the_surface_is_the_surfaces_own_greens_function) {
  for (const double nu : {0.0, 0.3, 0.5}) {
    const Gel gel = gel_of(8, nu, 25);
    const LayerInside inside(gel);
    const Layer surface(gel);
    for (const double r : {0.5, 3.0, 24.0, 60.0, 240.0}) {
      const Vec2 offset{0.6 * r, -0.8 * r};
      const double scale = largest(half_space_inside_um_per_nN(gel, offset, 0));
      EXPECT_LT(largest(inside.compliance_um_per_nN(offset, 25)), 1e-9 * scale) << nu << ", " << r;
      const Sym2 along = surface.point_compliance_um_per_nN(offset);
      Eigen::Matrix2d expected;
      expected << along.xx, along.xy, along.xy, along.yy;
      const Eigen::Matrix2d found = inside.compliance_um_per_nN(offset, 0).topLeftCorner<2, 2>();
      EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-9 * scale) << nu << ", " << r;
    }
  }
}

// mu div grad u + mu/(1 - 2 nu) grad div u = 0, by central differences of a step at which rounding and the fourth
// derivatives are alike small beside the second ones that cancel.
TEST(InsideOfTheGel, is_in_balance_without_forces_inside) {
  const double nu = 0.4, step = 0.05;
  const LayerInside inside(gel_of(10, nu, 20));
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(4, 3, 6), Eigen::Vector3d(-9, 2, 15), Eigen::Vector3d(1, -12, 3)}) {
    const auto u = [&](const Eigen::Vector3d& d) {
      const Eigen::Vector3d p = at + step * d;
      return inside.compliance_um_per_nN({p.x(), p.y()}, p.z());
    };
    // second derivatives of all nine components, by pair of directions
    std::array<std::array<Eigen::Matrix3d, 3>, 3> second;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        const Eigen::Vector3d i = Eigen::Vector3d::Unit(a), j = Eigen::Vector3d::Unit(b);
        second[a][b] = (u(i + j) - u(i - j) - u(j - i) + u(-i - j)) / (4 * step * step);
      }
    for (int force = 0; force < 3; ++force)
      for (int i = 0; i < 3; ++i) {
        double laplacian = 0, of_divergence = 0, size = 0;
        for (int j = 0; j < 3; ++j) {
          laplacian += second[j][j](i, force);
          of_divergence += second[i][j](j, force);
          size += std::abs(second[j][j](i, force));
        }
        EXPECT_LT(std::abs(laplacian + of_divergence / (1 - 2 * nu)), 2e-3 * size)
            << at.transpose() << ", " << force << i;
      }
  }
}

TEST(InsideOfTheGel, a_thick_layer_is_a_half_space_and_the_matrix_turns_with_the_force) {
  const Gel thick = gel_of(10, 0.45, 1e5);
  const LayerInside inside(thick);
  const Eigen::Matrix3d g = inside.compliance_um_per_nN({3, 4}, 5);
  // what is left falls as 1/h: some units of 1/(2 pi mu h)
  EXPECT_LT(largest(g - half_space_inside_um_per_nN(thick, {3, 4}, 5)), 3e-4 * largest(g));

  const LayerInside layer(gel_of(10, 0.45, 20));
  const double angle = 1.1, c = std::cos(angle), s = std::sin(angle);
  Eigen::Matrix3d turn;
  turn << c, -s, 0, s, c, 0, 0, 0, 1;
  const Eigen::Matrix3d turned = layer.compliance_um_per_nN({3 * c - 4 * s, 3 * s + 4 * c}, 5);
  EXPECT_LT(largest(turned - turn * layer.compliance_um_per_nN({3, 4}, 5) * turn.transpose()), 1e-12 * largest(turned));
  // right under the force nothing but the force's own direction is left
  const Eigen::Matrix3d under = layer.compliance_um_per_nN({0, 0}, 5);
  EXPECT_LT(largest(under - Eigen::Matrix3d(under.diagonal().asDiagonal())), 1e-15);
  EXPECT_DOUBLE_EQ(under(0, 0), under(1, 1));
}

/// The base holds it there: what is left falls as exp(-pi r / 2h).
TEST(InsideOfTheGel, beyond_the_tables_reach_a_layer_is_at_rest) {
  const Gel gel = gel_of(10, 0.45, 20);
  const LayerInside layer(gel);
  for (const double r : {39.9 * 20, 40.1 * 20, 400.0 * 20}) {
    const double half_space = largest(half_space_inside_um_per_nN(gel, {r, 0}, 5));
    // the table is right to 1e-9 of what it holds near the force, of which the half-space has a fortieth here
    EXPECT_LT(largest(layer.compliance_um_per_nN({r, 0}, 5)), 1e-7 * half_space) << r;
  }
}

/// Mean of the point field over the ellipse, by rings: midpoints in the square of the radius and in the angle.
Eigen::Matrix3d mean_by_rings(const LayerInside* layer, const Gel& gel, const substrate::Ellipse& ellipse, Vec2 point,
                              double z_um, int n) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  const double c = std::cos(ellipse.angle_rad), s = std::sin(ellipse.angle_rad);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k) {
      const double r = std::sqrt((i + 0.5) / n), angle = 2 * std::numbers::pi * (k + 0.5) / n;
      const double x = ellipse.semi_major_um * r * std::cos(angle), y = ellipse.semi_minor_um * r * std::sin(angle);
      const Vec2 offset = point - ellipse.centre_um - Vec2{c * x - s * y, s * x + c * y};
      sum += layer ? layer->compliance_um_per_nN(offset, z_um) : half_space_inside_um_per_nN(gel, offset, z_um);
    }
  return 1.0 / (n * n) * sum;
}

TEST(InsideOfTheGel, an_ellipse_is_the_mean_of_its_point_forces) {
  const Gel gel = gel_of(10, 0.3, 6);
  const LayerInside layer(gel);
  const substrate::Ellipse ellipse{.centre_um = {1, -2}, .semi_major_um = 1.5, .semi_minor_um = 0.5, .angle_rad = 0.7};
  const auto difference = [&](const LayerInside* base, Vec2 point, double z_um, int n) {
    const Eigen::Matrix3d exact = EllipseInside(gel, base, ellipse).compliance_um_per_nN(point, z_um);
    return largest(mean_by_rings(base, gel, ellipse, point, z_um, n) - exact) / largest(exact);
  };
  for (const LayerInside* base : {static_cast<const LayerInside*>(nullptr), &layer})
    for (const double z : {0.4, 2.0, 5.0})
      for (const Vec2 point : {Vec2{1, -2}, Vec2{1.8, -1.2}, Vec2{5, 3}, Vec2{1, -2.6}}) {
        // midpoints err by the square of their distance
        const double coarse = difference(base, point, z, 24), fine = difference(base, point, z, 96);
        EXPECT_LT(fine, 3e-4) << z << " at " << point.x << ", " << point.y;
        EXPECT_LT(fine, coarse / 8 + 1e-8) << z << " at " << point.x << ", " << point.y;
      }
}

TEST(InsideOfTheGel, below_an_ellipse_the_field_tends_to_that_of_its_surface) {
  const Gel gel = gel_of(10, 0.45, 20);
  const substrate::Ellipse ellipse{.semi_major_um = 1.5, .semi_minor_um = 0.5, .angle_rad = 0.7};
  const EllipseInside field(gel, nullptr, ellipse);
  for (const Vec2 point : {Vec2{0, 0}, Vec2{0.9, 0.8}, Vec2{2, -3}}) {
    const Eigen::Matrix3d surface = field.compliance_um_per_nN(point, 0);
    const double near = largest(field.compliance_um_per_nN(point, 0.02) - surface);
    const double nearer = largest(field.compliance_um_per_nN(point, 0.005) - surface);
    // depth times the shear strain below the patch, its traction over the shear modulus
    const double traction_kPa = 1 / (std::numbers::pi * ellipse.semi_major_um * ellipse.semi_minor_um);
    EXPECT_LT(near, 1.2 * 0.02 * traction_kPa / (10 / (2 * 1.45)));
    EXPECT_NEAR(nearer, near / 4, 0.05 * near);  // linear in the depth
  }
}

}  // namespace
}  // namespace mbtfm::greens
