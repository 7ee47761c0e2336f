/// Contracting solids against closed forms and independent programs (tests/data/reference/chapter4).
#include "continuum/solids/indent.h"
#include "pipeline/contract/words.h"
#include "pipeline/files/csv.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace mbtfm::solids {
namespace {

const std::string kReference = test::source_folder().string() + "/tests/data/reference/chapter4/";

/// A half disc or shell above z = 0, cut into patches that are not turned over.
Patch shell(double inner_um, double outer_um, int n, int part) {
  return {[=](Vec2 at) {
            const double r = inner_um + (outer_um - inner_um) * at.x, angle = 0.5 * std::numbers::pi * at.y;
            return Vec2{r * std::cos(angle), r * std::sin(angle)};
          },
          even_lines(n), even_lines(4), part};
}

std::vector<Patch> ball(double radius_um, int part) {
  const double half = radius_um / 2;
  const auto arc = [=](double from, double to) {
    return Side([=](double s) {
      const double angle = 0.5 * std::numbers::pi * ((1 - s) * from + s * to);
      return Vec2{radius_um * std::cos(angle), radius_um * std::sin(angle)};
    });
  };
  const Vec2 corner = {half, half};
  const Vec2 low = {half, 0}, high = {0, half};
  return {
      {between(straight({0, 0}, low), straight(high, corner), straight({0, 0}, high), straight(low, corner)),
       even_lines(2), even_lines(2), part},
      {between(straight(low, {radius_um, 0}), straight(corner, arc(0, 1)(0.5)), straight(low, corner), arc(0, 0.5)),
       even_lines(2), even_lines(2), part},
      {between(straight(high, corner), arc(1, 0.5), straight(high, {0, radius_um}), straight(corner, arc(0, 1)(0.5))),
       even_lines(2), even_lines(2), part}};
}

Body body_of(const std::vector<Patch>& patches, int order, const std::function<Held(Vec2)>& held,
             std::vector<Solid> solids) {
  const auto mesh = std::make_shared<const Mesh>(make_mesh(patches, order));
  return {mesh, std::make_shared<const Unknowns>(*mesh, held), std::move(solids)};
}

TEST(Solids, a_contracting_ball_in_an_elastic_shell_moves_as_the_closed_form) {
  const files::CsvTable table(kReference + "solid_spheres.csv");
  for (int row = 0; row < table.n_rows(); row += 6) {
    const auto number = [&](const char* column) { return table.number(row, column); };
    const double cell_um = number("cell_radius_um"), outer_um = number("outer_radius_um");
    std::vector<Patch> patches = ball(cell_um, 1);
    patches.push_back(shell(cell_um, outer_um, 10, 0));
    const Solid gel{number("gel_E_kPa"), number("gel_nu")};
    const Solid cell{number("cell_E_kPa"), number("cell_nu"), number("contraction_kPa")};
    const auto held = [&](Vec2 at) {
      const bool on_shell = norm(at) > outer_um * (1 - 1e-9);
      return Held{on_shell, on_shell || std::abs(at.y) < 1e-9};
    };
    const Deformed deformed = solve(body_of(patches, 5, held, {gel, cell}), Strain::small);
    const double largest = std::abs(table.number(row + 2, "ur_um"));  // at the cell's surface
    for (int k = row; k < row + 6; ++k) {
      const double r = table.number(k, "r_um");
      // along the axis z = 0, in the patch that holds it
      const auto place = r <= cell_um / 2 ? deformed.body.mesh->place_in(0, {2 * r / cell_um, 0})
                         : r <= cell_um   ? deformed.body.mesh->place_in(1, {2 * r / cell_um - 1, 0})
                                          : deformed.body.mesh->place_in(3, {(r - cell_um) / (outer_um - cell_um), 0});
      EXPECT_NEAR(deformed.displacement_um_at(place).x, table.number(k, "ur_um"), 1e-5 * largest) << "row " << k;
    }
  }
}

/// 1 / R of the middle of a disc, film above base, the film contracting.
double curvature_of_disc(const files::CsvTable& table, int row) {
  const auto number = [&](const char* column) { return table.number(row, column); };
  const double film = number("film_h_um"), base = number("base_h_um"), radius = 10 * (film + base);
  const auto layer = [&](double low, double high, int part) {
    return Patch{[=](Vec2 at) {
                   return Vec2{radius * at.x, low + (high - low) * at.y};
                 },
                 even_lines(30), even_lines(1), part};
  };
  const Body body = body_of({layer(0, base, 0), layer(base, base + film, 1)}, 5,
                            [](Vec2 at) { return Held{.along_z = norm(at) < 1e-9}; },
                            {Solid{number("base_E_kPa"), number("base_nu")},
                             Solid{number("film_E_kPa"), number("film_nu"), number("contraction_kPa")}});
  const Deformed deformed = solve(body, Strain::small);
  const double r = radius / 10;  // far from the rim the lower face is a paraboloid
  return 2 * std::abs(deformed.displacement_um_at(deformed.body.mesh->place_in(0, {0.1, 0})).y) / (r * r);
}

TEST(Solids, a_film_that_contracts_bends_its_base_as_the_bilayer_and_stoney_have_it) {
  const files::CsvTable table(kReference + "solid_bilayer.csv");
  for (int row = 0; row < table.n_rows(); ++row) {
    const double curvature = curvature_of_disc(table, row), exact = table.number(row, "curvature_per_um");
    EXPECT_NEAR(curvature, exact, 1e-3 * exact) << "row " << row;
    if (table.number(row, "film_h_um") > 0.02 * table.number(row, "base_h_um")) continue;
    EXPECT_NEAR(curvature, table.number(row, "stoney_per_um"), 0.04 * exact);  // a film of a hundredth: 4 h_f / h_b
  }
}

Setting setting_of(const files::CsvTable& table, int row) {
  const auto number = [&](const char* column) { return table.number(row, column); };
  return {.volume_um3 = number("volume_um3"),
          .cell = {number("cell_E_kPa"), number("cell_nu"), number("contraction_kPa")},
          .slab = {number("gel_thickness_um"), number("gel_radius_um")},
          .gel_poisson_ratio = number("gel_nu"),
          .depths_um = {0, 2, 5, 15},
          .strain = Strain::small};
}

TEST(Solids, a_section_of_a_sphere_presses_into_its_gel_as_an_independent_program_has_it) {
  const files::CsvTable table(kReference + "solid_section.csv");
  ASSERT_GT(table.n_rows(), 20);
  for (int row = 0; row < table.n_rows(); ++row) {
    const Setting setting = setting_of(table, row);
    const Case of{table.number(row, "h_um"), table.number(row, "gel_E_kPa") / table.number(row, "cell_E_kPa")};
    const SectionMesh mesh = section_mesh({setting.volume_um3, of.height_um}, setting.slab, setting.fineness);
    EXPECT_NEAR(mesh.contact_radius_um, table.number(row, "contact_radius_um"), 1e-7);
    const Deformed deformed = deformed_section(setting, of);
    const double a = mesh.contact_radius_um;
    const auto at = [&](double r, double depth) { return deformed.displacement_um_at(mesh.in_gel(r, depth)); };
    const std::vector<std::pair<const char*, double>> found = {
        {"down_axis_0_um", at(0, 0).y},
        {"down_axis_2_um", at(0, 2).y},
        {"down_axis_5_um", at(0, 5).y},
        {"down_axis_15_um", at(0, 15).y},
        {"ur_at_1p5a_um", at(1.5 * a, 0).x},
        {"down_at_1p5a_um", at(1.5 * a, 0).y},
        {"ur_at_2p5a_um", at(2.5 * a, 0).x},
        {"down_top_of_cell_um", deformed.displacement_um_at(mesh.top_of_cell()).y},
        {"largest_u_cell_um", indentation(setting, of).reading.largest_u_um}};
    // both are finite elements with errors of their own
    for (const auto& [column, value] : found)
      EXPECT_NEAR(value, table.number(row, column), 5e-4 * table.number(row, "largest_u_cell_um"))
          << "row " << row << " " << column;
  }
}

Setting thesis_setting(double poisson_ratio) {
  return {.volume_um3 = 5000, .cell = {10, poisson_ratio, 30}, .gel_poisson_ratio = poisson_ratio};
}

TEST(Solids, the_depth_is_nearly_proportional_to_one_less_twice_poissons_ratio_and_nothing_locks) {
  for (const auto& [nu, published] : {std::pair{0.45, 13.68}, std::pair{0.49, 13.24}, std::pair{0.495, 13.18},
                                      std::pair{0.499, 13.13}, std::pair{0.4999, 13.12}}) {
    const Setting setting = thesis_setting(nu);
    const SectionMesh mesh = section_mesh({5000, 7.5}, setting.slab, setting.fineness);
    const double depth = deformed_section(setting, {7.5, 1}).displacement_um_at(mesh.in_gel(0, 5)).y;
    EXPECT_NEAR(depth / (1 - 2 * nu), published, 0.005 * published) << nu;
  }
}

TEST(Solids, forces_balance_and_the_energy_is_half_the_work) {
  for (const Strain strain : {Strain::small, Strain::large}) {
    Setting setting = thesis_setting(0.49);
    setting.strain = strain;
    setting.fineness = {4, 3};
    EXPECT_LT(indentation(setting, {7.5, 0.5}).imbalance, 1e-9) << name_of(strain);
  }
  const Deformed deformed = deformed_section(thesis_setting(0.49), {7.5, 1});
  Deformed passive = deformed;
  passive.body.solids[kCell].contraction_kPa = 0;
  const std::vector<Vec2> forces = passive.forces_nN();
  double work = 0;
  for (std::size_t k = 0; k < forces.size(); ++k) work += dot(forces[k], deformed.displacement_um[k]);
  EXPECT_NEAR(deformed.energy_fJ, -0.5 * work, 1e-9 * work);
}

/// A ball that nothing holds.
Deformed free_ball(double contraction_kPa, Strain strain) {
  return solve(body_of(ball(10, 0), 4, [](Vec2 at) { return Held{.along_z = std::abs(at.y) < 1e-9}; },
                       {Solid{10, 0.45, contraction_kPa}}),
               strain);
}

TEST(Solids, a_free_cell_shortens_by_its_free_contraction_without_stress) {
  for (const double contraction : {1.0, 20.0, 39.0}) {
    const double x = contraction * 0.1 / 10;
    for (const auto& [strain, stretch] :
         {std::pair{Strain::small, 1 - x}, std::pair{Strain::large, std::sqrt(1 - 2 * x)}}) {
      const Deformed ball = free_ball(contraction, strain);
      const auto surface = ball.body.mesh->place_in(1, {1, 0});
      EXPECT_NEAR(ball.displacement_um_at(surface).x, 10 * (stretch - 1), 1e-8) << contraction << name_of(strain);
      EXPECT_LT(ball.stress_kPa_at(surface).norm(), 1e-7 * contraction);
    }
  }
}

TEST(Solids, small_contractions_are_the_same_for_small_and_large_strains) {
  Setting setting = thesis_setting(0.49);
  setting.fineness = {4, 3};
  const auto depth = [&](double contraction, Strain strain) {
    setting.cell.contraction_kPa = contraction;
    setting.strain = strain;
    return indentation(setting, {7.5, 1}).reading.depth_um[1] / contraction;
  };
  const double small = depth(1, Strain::small);
  const double at_one = depth(1, Strain::large) / small - 1, at_two = depth(2, Strain::large) / small - 1;
  EXPECT_LT(std::abs(at_one), 0.01);      // the free contraction is 0.002
  EXPECT_NEAR(at_two / at_one, 2, 0.05);  // the first correction is linear in it
}

TEST(Solids, the_map_has_its_optima_where_an_independent_program_has_them) {
  const files::CsvTable map(kReference + "indentation_map.csv");
  Setting setting = thesis_setting(0.49);
  setting.fineness = {4, 4};
  std::vector<Case> cases;
  for (const double ratio : {0.1, 0.2, 0.5, 1.0, 1.5, 2.0})
    for (const double height : {5.3, 6.5, 8.0, 9.5, 13.36}) cases.push_back({height, ratio});
  const std::vector<Indentation> solved = indentations(setting, cases, 2, {});
  for (const Indentation& one : solved)
    for (int row = 0; row < map.n_rows(); ++row) {
      if (map.number(row, "nu") != 0.49 || map.number(row, "E_ratio") != one.of.modulus_ratio ||
          map.number(row, "h_um") != one.of.height_um)
        continue;
      const auto expect = [&](double value, const char* column) {
        EXPECT_NEAR(value, map.number(row, column), 0.005 * map.number(row, column))
            << column << " " << one.of.height_um << " " << one.of.modulus_ratio;
      };
      expect(one.reading.depth_um[0], "surface_um");
      expect(one.reading.depth_um[1], "depth5_um");
      expect(one.reading.lift_um, "lift_um");
      expect(one.reading.largest_u_um, "umax_cell_um");
    }
  const std::vector<Optimum> best = optima(setting, solved, 2);
  ASSERT_EQ(best.size(), 12u);
  const std::vector<double> at_surface = {6.48, 7.18, 8.11, 8.71, 8.99, 9.15},
                            below = {6.18, 6.89, 7.81, 8.40, 8.68, 8.84};
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_NEAR(best[2 * k].height_um, at_surface[k], 0.1);
    EXPECT_NEAR(best[2 * k + 1].height_um, below[k], 0.1);
    EXPECT_LT(best[2 * k + 1].height_error_um, 0.1);
  }
}

}  // namespace
}  // namespace mbtfm::solids
