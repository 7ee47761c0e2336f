/// Finite elements bent onto a surface, against exact fields (tests/data/reference/curved, by another program).
#include "pipeline/contract/errors.h"
#include "substrate/choice/factory.h"
#include "substrate/elements/linear.h"
#include "substrate/elements/surface_loads.h"
#include "substrate/material.h"
#include "substrate/response.h"
#include "tests/support/cubed_sphere.h"
#include "tests/support/field_under_a_surface.h"

namespace mbtfm::elements {
namespace {

const numerics::FactorOptions kFactor{.threads = 2, .memory_limit_GB = 8};

/// Cells of 120 um / n over the square ±60 um, n / 3 layers of them.
elements::GridLines lines_of(const CurvedCase& scene, int n) {
  elements::GridLines lines;
  for (int k = 0; k <= n; ++k) lines.x_um.push_back(-60 + 120.0 * k / n);
  lines.y_um = lines.x_um;
  lines.z_um = layers_um(scene.base_um, n / 3);
  return lines;
}

/// Displacement on a mesh.
struct Field {
  std::shared_ptr<const Block> block;
  Space space;
  Vectors at_nodes_um;
};

/// By the exact traction on the surface and the exact displacement at the sides.
Field solved(const CurvedCase& scene, double poisson_ratio, int n, int threads = 2) {
  const FieldUnderASurface exact = scene.field(poisson_ratio);
  const auto held_um = [&](const Eigen::Vector3d& p) { return exact.displacement_um(p); };
  const auto block = std::make_shared<const Block>(
      Shape{scene.height_um, scene.base_um}, lines_of(scene, n), [](const elements::Box&) { return false; },
      Sides::held, 100000, threads);
  const Space space(block->mesh(), threads);
  const auto stiffness_of = linear_stiffness_of({scene.gel(poisson_ratio), {}}, block->mesh());
  Vectors forces = space.traction_forces_nN([&](const Eigen::Vector3d& p, const Eigen::Vector3d& normal) {
    return Eigen::Vector3d(exact.stress_kPa(p) * normal);
  });
  const Vectors held = space.spread(Vectors(forces.size(), Eigen::Vector3d::Zero()), held_um);
  const Vectors by_held = space.gather([&](int cell) {
    const NodeValues u = space.values_of(cell, held);
    return NodeValues((stiffness_of(cell) * Eigen::Map<const Eigen::VectorXd>(u.data(), kUnknowns)).eval().data());
  });
  for (std::size_t k = 0; k < forces.size(); ++k) forces[k] -= by_held[k];
  const auto factor = space.factorise(stiffness_of, {.threads = threads, .memory_limit_GB = 8});
  return {block, space, space.spread(solve(*factor, forces), held_um)};
}

/// Relative L2 error at the points of volume.csv.
double error_at_points(const Field& field, const std::vector<CurvedValue>& values) {
  double error = 0, size = 0;
  for (const CurvedValue& v : values) {
    const Location at = field.block->locate(v.position_um);
    const Eigen::Vector3d u = field.space.values_of(at.cell, field.at_nodes_um) * shapes_at(at.unit);
    error += (u - v.displacement_um).squaredNorm();
    size += v.displacement_um.squaredNorm();
  }
  return std::sqrt(error / size);
}

/// Relative L2 error over all of the block.
double error_in_volume(const Field& field, const FieldUnderASurface& exact) {
  double error = 0, size = 0;
  const Mesh& mesh = field.space.mesh();
  for (int cell = 0; cell < mesh.n_cells(); ++cell) {
    const Element element(mesh.positions_of(cell));
    const NodeValues u = field.space.values_of(cell, field.at_nodes_um);
    for (int q = 0; q < static_cast<int>(element.points.size()); ++q) {
      const QuadraturePoint& point = element.points[q];
      const Eigen::Vector3d truth = exact.displacement_um(point.position_um);
      error += point.volume_um3 * (u * shapes_of_point(q) - truth).squaredNorm();
      size += point.volume_um3 * truth.squaredNorm();
    }
  }
  return std::sqrt(error / size);
}

TEST(CurvedElement, rigid_motions_store_no_energy_and_strains_store_theirs) {
  const Eigen::Vector3d size(1, 2, 0.5);
  NodePositions nodes;
  for (int k = 0; k < kNodes; ++k) nodes.col(k) = unit_of_node(k).cwiseProduct(size);
  EXPECT_NEAR(least_scaled_jacobian(nodes), 1, 1e-14);
  const Gel gel{8.4, 0.4, 30};
  const double mu = substrate::shear_modulus_kPa(gel), lambda = 2 * mu * 0.4 / (1 - 2 * 0.4);
  const Eigen::MatrixXd k = linear_stiffness(Element(nodes), {gel, {}});
  const auto displaced = [&](const Eigen::Matrix3d& gradient) {
    const NodeValues u = gradient * nodes;
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(u.data(), kUnknowns));
  };
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero(), gradient;
  turn(0, 1) = 1;
  turn(1, 0) = -1;
  EXPECT_LT((k * displaced(turn)).norm(), 1e-12 * k.norm());
  EXPECT_LT((k * Eigen::VectorXd::Ones(k.rows())).norm(), 1e-12 * k.norm());
  gradient << 0.1, 0.3, -0.2, 0.05, -0.4, 0.1, 0.2, 0.6, 0.25;
  const Eigen::Matrix3d strain = 0.5 * (gradient + gradient.transpose());
  const double expected = size.prod() * (2 * mu * strain.squaredNorm() + lambda * strain.trace() * strain.trace());
  const Eigen::VectorXd u = displaced(gradient);
  EXPECT_NEAR(u.dot(k * u), expected, 1e-12 * expected * static_cast<double>(k.rows()));
}

/// Linear displacements have no body force: a bent cell in such a field is loaded at its outer nodes alone, and the
/// element's own middle node, which lies inside, by nothing.
TEST(CurvedElement, holds_a_linear_field_without_force_on_its_inner_node) {
  const CurvedCase scene = curved_case("sharp_wave");
  const Block block(
      {scene.height_um, scene.base_um}, lines_of(scene, 12), [](const elements::Box&) { return false; }, Sides::free,
      1000, 1);
  const Gel gel{9, 0.49, 30};
  Eigen::Matrix3d gradient;
  gradient << .1, .2, -.3, .05, -.2, .1, .3, -.1, .15;
  for (int cell = 0; cell < 12; ++cell) {
    const NodePositions nodes = block.mesh().positions_of(cell);
    const NodeValues u = gradient * nodes;
    const Eigen::VectorXd force =
        linear_stiffness(Element(nodes), {gel, {}}) * Eigen::Map<const Eigen::VectorXd>(u.data(), kUnknowns);
    EXPECT_LE(force.segment<3>(3 * 13).norm(), 1e-10 * force.norm());
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(Eigen::Map<const NodeValues>(force.data()).row(axis).sum(), 0, 1e-11 * force.norm());
  }
}

class UnderASurface : public testing::TestWithParam<std::string> {};

TEST_P(UnderASurface, the_exact_field_is_that_of_the_independent_program) {
  const CurvedCase scene = curved_case(GetParam());
  for (const double nu : {0.3, 0.49, 0.4999}) {
    const FieldUnderASurface exact = scene.field(nu);
    for (const CurvedValue& v : curved_values(GetParam(), nu)) {
      const Eigen::Vector3d u = exact.displacement_um({v.position_um.x, v.position_um.y, v.position_um.z});
      EXPECT_LE((u - v.displacement_um).norm(), 1e-9 * v.displacement_um.norm());
    }
    EXPECT_LE(exact.displacement_um({3, 4, scene.base_um}).norm(), 1e-15);
  }
}

// Bars of issue and brief: 12 700 unknowns; nu = .4999 within 1.4 times of .3.
TEST_P(UnderASurface, few_cells_are_right_to_a_percent_at_any_poisson_ratio) {
  const std::map<std::string, double> bars = {
      {"smooth_wave", .005}, {"eggbox", .005}, {"groove", .025}, {"sharp_wave", .033}};
  const CurvedCase scene = curved_case(GetParam());
  std::map<double, double> error;
  for (const double nu : {0.3, 0.49, 0.4999}) {
    error[nu] = error_at_points(solved(scene, nu, 12), curved_values(GetParam(), nu));
    EXPECT_LE(error[nu], bars.at(GetParam())) << nu;
  }
  EXPECT_LE(error[0.4999], 1.4 * error[0.3]);
}

INSTANTIATE_TEST_SUITE_P(All, UnderASurface, testing::Values("smooth_wave", "eggbox", "groove", "sharp_wave"),
                         [](const auto& of) { return of.param; });

TEST(UnderAnEggbox, the_error_falls_by_five_where_cells_are_halved) {
  const CurvedCase scene = curved_case("eggbox");
  for (const double nu : {0.3, 0.49, 0.4999}) {
    const FieldUnderASurface exact = scene.field(nu);
    std::vector<double> error;
    for (const int n : {12, 24}) error.push_back(error_in_volume(solved(scene, nu, n), exact));
    EXPECT_GE(error[0] / error[1], 5) << nu;
  }
}

TEST(UnderAnEggbox, threads_change_no_bit) {
  const CurvedCase scene = curved_case("eggbox");
  const Field one = solved(scene, 0.49, 6, 1);
  for (const int threads : {2, 4}) {
    const Field other = solved(scene, 0.49, 6, threads);
    ASSERT_EQ(other.at_nodes_um.size(), one.at_nodes_um.size());
    for (std::size_t k = 0; k < one.at_nodes_um.size(); ++k) EXPECT_EQ(other.at_nodes_um[k], one.at_nodes_um[k]);
  }
}

// Gel between a rigid ball and a loaded sphere: shell.csv, modes of shell_modes.csv.
TEST(Shell, vector_harmonics_displace_it_as_they_must) {
  const files::CsvTable modes(curved_folder("shell_modes.csv")), table(curved_folder("shell.csv"));
  for (const std::string name : {"1", "2", "3"}) {
    Eigen::Vector2d radii = Eigen::Vector2d::Zero();
    const auto traction = [&](const Eigen::Vector3d& p, const Eigen::Vector3d&) -> Eigen::Vector3d {
      const Eigen::Vector3d n = p.normalized();
      const double x = n.x(), y = n.y(), z = n.z();
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (int row = 0; row < modes.n_rows(); ++row) {
        if (modes.text(row, "case") != name) continue;
        const std::string harmonic = modes.text(row, "harmonic"), kind = modes.text(row, "kind");
        double value = 0;
        Eigen::Vector3d slope;
        if (harmonic == "zz") {
          value = 2 * z * z - x * x - y * y, slope << -2 * x, -2 * y, 4 * z;
        } else if (harmonic == "z") {
          value = z, slope << 0, 0, 1;
        } else if (harmonic == "xyz") {
          value = x * y * z, slope << y * z, x * z, x * y;
        } else if (harmonic == "xy") {
          value = x * y, slope << y, x, 0;
        } else {
          EXPECT_EQ(harmonic, "x4");
          value = std::pow(x, 4) - 6 * x * x * y * y + std::pow(y, 4);
          slope << 4 * x * x * x - 12 * x * y * y, 4 * y * y * y - 12 * x * x * y, 0;
        }
        const Eigen::Vector3d tangential = slope - modes.number(row, "degree") * value * n;
        const double a = modes.number(row, "amplitude_kPa");
        sum += a * (kind == "normal" ? value * n : kind == "tangential" ? tangential : n.cross(tangential));
      }
      return sum;
    };
    for (int row = 0; row < modes.n_rows(); ++row)
      if (modes.text(row, "case") == name) radii << modes.number(row, "inner_um"), modes.number(row, "outer_um");
    const test::CubedSphere sphere(radii[0], radii[1], 8, name == "3" ? 3 : 6);
    const Space space(sphere.mesh, 2);
    EXPECT_LE(space.n_unknowns(), 100000);
    for (const double nu : {0.3, 0.4999}) {
      const auto factor = space.factorise(linear_stiffness_of({{10, nu, 1}, {}}, sphere.mesh), kFactor);
      const Vectors u = space.spread(solve(*factor, space.traction_forces_nN(traction)));
      double error = 0, size = 0;
      for (int row = 0; row < table.n_rows(); ++row) {
        if (table.text(row, "case") != name || table.number(row, "poisson_ratio") != nu) continue;
        const auto vector = [&](const char* a, const char* b, const char* c) {
          return Eigen::Vector3d(table.number(row, a), table.number(row, b), table.number(row, c));
        };
        const Location at = sphere.locate(vector("x_um", "y_um", "z_um"));
        const Eigen::Vector3d truth = vector("ux_um", "uy_um", "uz_um");
        error += (space.values_of(at.cell, u) * shapes_at(at.unit) - truth).squaredNorm();
        size += truth.squaredNorm();
      }
      ASSERT_GT(size, 0);
      EXPECT_LE(std::sqrt(error / size), 0.01) << "case " << name << ", nu " << nu;
      RecordProperty("case" + name + "_" + std::to_string(nu), std::to_string(std::sqrt(error / size)));
    }
  }
}

std::unique_ptr<substrate::Substrate> gel_of(const Gel& gel, const char* model, double tolerance = 0) {
  substrate::SubstrateParameters parameters;
  parameters.model = named<substrate::ModelKind>(model).value();
  parameters.displacement_tolerance = tolerance;
  return choice::make_substrate(gel, parameters, 2);
}

// All nine components in the volume, from two cells on, against the layer's Green's function.
TEST(FlatSurface, is_displaced_as_a_layer) {
  const Gel gel{10, 0.45, 30};
  const std::vector<substrate::Ellipse> ellipses = {{{0, 0}, 2, 1, 0.4}, {{12, 5}, 1.5, 1.5, 0}};
  std::vector<Vec3> points;
  for (int k = 0; k < 40; ++k) {
    points.push_back(
        {-14 + 28 * std::fmod(0.618 * k, 1), -14 + 28 * std::fmod(0.414 * k, 1), 29 * std::fmod(0.732 * k, 1)});
    const double cell = 1.8;  // square root of an ellipse's area over 1.4
    const auto is_near = [&](const substrate::Ellipse& e) {
      return norm(points.back() - Vec3{e.centre_um.x, e.centre_um.y, 0}) < 2 * cell + 2;
    };
    if (is_near(ellipses[0]) || is_near(ellipses[1])) points.pop_back();
  }
  const auto model = gel_of(gel, "curved", 0.05);
  const auto matrix = [&](const substrate::Substrate& of) {
    return of.response({ellipses, 3}, {points, substrate::Components::all})->matrix();
  };
  const Eigen::MatrixXd exact = matrix(*gel_of(gel, "layer")), found = matrix(*model);
  for (Eigen::Index column = 0; column < exact.cols(); ++column)
    EXPECT_LE((found.col(column) - exact.col(column)).norm(), 0.015 * exact.col(column).norm()) << column;
  EXPECT_GT(model->stated_error(), 0);
  EXPECT_GE(model->stated_error(), 0.5 * (found - exact).norm() / exact.norm());
  EXPECT_LE(model->stated_error(), 2 * (found - exact).norm() / exact.norm());
  RecordProperty("stated", std::to_string(model->stated_error()));
  RecordProperty("error", std::to_string((found - exact).norm() / exact.norm()));
}

TEST(CurvedModel, takes_the_thickest_gel_and_refuses_a_point_too_far_for_any_mesh) {
  const std::vector<substrate::Ellipse> ellipses = {{{0, 0}, 0.5, 0.5, 0}};
  const Gel thick{8, 0.45, 1e5};
  const std::vector<Vec3> points = {{5, 5, 3}, {-3, 2, 0.5}};
  const auto matrix = [&](const char* model) {
    return gel_of(thick, model, 0.02)->response({ellipses, 3}, {points, substrate::Components::all})->matrix();
  };
  const Eigen::MatrixXd exact = matrix("half-space");
  EXPECT_LE((matrix("curved") - exact).norm(), 0.02 * exact.norm());
  const Gel thin{8, 0.45, 1};
  const std::vector<Vec3> far = {{1e5, 1e5, 0.5}};
  EXPECT_THROW(gel_of(thin, "curved")->response({ellipses, 3}, {far, substrate::Components::all})->matrix(),
               OutOfMemory);
}

/// Of a parabola, which the elements hold exactly, the area under an ellipse lies further out than the ellipse's
/// centre.
TEST(AnEllipse, pulls_at_the_centre_of_the_area_that_it_covers_of_the_slope) {
  constexpr double kBend = 0.05;
  const substrate::Ellipse ellipse{{6, 0.5}, 4, 3, 0.4};
  elements::GridLines lines;
  for (int k = 0; k <= 16; ++k) lines.x_um.push_back(-16 + 2 * k);
  lines.y_um = lines.x_um;
  lines.z_um = {0, 5, 15, 30};
  const Block block(
      Shape{[](Vec2 p) { return kBend * p.x * p.x; }, 30}, lines, [](const elements::Box&) { return false; },
      Sides::held, 100000, 1);
  const Space space(block.mesh(), 1);
  std::vector<Vec2> place(static_cast<std::size_t>(space.nodes().size()));
  for (std::size_t node = 0; node < block.mesh().position_um.size(); ++node) {
    const int free = space.nodes().index_of(static_cast<int>(node));
    const Eigen::Vector3d& at = block.mesh().position_um[node];
    if (free >= 0) place[free] = {at.x(), at.y()};
  }
  Vec2 pulled, centre;
  const auto loads = load_weights(block, space, {.shapes = std::vector<substrate::Ellipse>{ellipse}});
  for (const elements::NodeWeight& w : loads.front()) pulled += w.weight * place[w.node];
  double area = 0;
  constexpr int kRings = 400;
  for (int k = 0; k < kRings * kRings; ++k) {
    const double r = std::sqrt((k / kRings + 0.5) / kRings), turn = 2 * std::numbers::pi * (k % kRings) / kRings;
    const double u = r * ellipse.semi_major_um * std::cos(turn), v = r * ellipse.semi_minor_um * std::sin(turn);
    const double c = std::cos(ellipse.angle_rad), s = std::sin(ellipse.angle_rad);
    const Vec2 at = ellipse.centre_um + Vec2{c * u - s * v, s * u + c * v};
    const double stretch = std::hypot(1, 2 * kBend * at.x);
    area += stretch;
    centre += stretch * at;
  }
  centre = (1 / area) * centre;
  ASSERT_GT(centre.x - ellipse.centre_um.x, 0.1);
  EXPECT_LT(norm(pulled - centre), 0.01 * (centre.x - ellipse.centre_um.x));
}

TEST(TractionsOfASurfaceMesh, pull_back_exactly_as_they_displace_and_add_up_to_the_force_of_an_even_one) {
  substrate::SurfaceMesh mesh;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) mesh.points_um.push_back({4.0 * i - 6, 3.0 * j - 4.5});
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) mesh.faces.push_back({4 * j + i, 4 * j + i + 1, 4 * j + i + 5, 4 * j + i + 4});
  const std::vector<Vec3> points = {{1, 2, 3}, {-8, 4, 19}, {0, 0, 0.2}, {5, -5, 8}};
  const Gel gel{10, 0.49, 25};
  const auto model = gel_of(gel, "curved");
  const auto kept = model->response({mesh, 3}, {points, substrate::Components::all});
  std::srand(1);
  const Eigen::VectorXd t = Eigen::VectorXd::Random(kept->cols()), y = Eigen::VectorXd::Random(kept->rows());
  const Eigen::VectorXd displaced = kept->displace(t), pulled = kept->pull_back(y);
  EXPECT_NEAR(y.dot(displaced), t.dot(pulled), 1e-12 * y.norm() * displaced.norm());
  // the same traction at all vertices is an even one: that of a square over the faces
  Eigen::VectorXd even = Eigen::VectorXd::Zero(kept->cols());
  for (Eigen::Index k = 0; k < even.size(); k += 3) even[k] = 0.5;
  const std::vector<substrate::Square> squares = {{{-1.5, 0}, 9}, {{4.5, -3}, 3}, {{4.5, 0}, 3}, {{4.5, 3}, 3}};
  const Eigen::VectorXd by_squares = model->response({squares, 3}, {points, substrate::Components::all})
                                         ->displace(0.5 * Eigen::VectorXd::Unit(3, 0).replicate(4, 1));
  EXPECT_LE((by_squares - kept->displace(even)).norm(), 0.02 * by_squares.norm());
}

}  // namespace
}  // namespace mbtfm::elements
