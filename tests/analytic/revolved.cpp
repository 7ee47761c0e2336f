/// Cells whose contact is no circle: the full solution in space against the round cell's, symmetries and balances.
#include "continuum/solids/indent.h"
#include "pipeline/contract/errors.h"
#include "tests/support/test.h"

namespace mbtfm::solids {
namespace {

constexpr double kRadius_um = 20, kHeight_um = 7.5;
constexpr double kPi = std::numbers::pi;

Polygon outline_of(const std::function<Vec2(double angle)>& place) {
  constexpr int kPoints = 3600;  // of a circle the polygon is within 4e-7 of the radius
  Polygon outline;
  for (int k = 0; k < kPoints; ++k) outline.push_back(place(2 * kPi * k / kPoints));
  return outline;
}

/// Axes R exp(e) and R exp(-e), so that -e is e turned by a right angle.
Polygon ellipse(double e, double turn, Vec2 centre = {0, 0}) {
  return outline_of([=](double angle) {
    const double x = kRadius_um * std::exp(e) * std::cos(angle), y = kRadius_um * std::exp(-e) * std::sin(angle);
    return centre + Vec2{x * std::cos(turn) - y * std::sin(turn), x * std::sin(turn) + y * std::cos(turn)};
  });
}

Setting setting_of(const Contact& contact, const Fineness& fineness, double poisson_ratio = 0.49) {
  return {.volume_um3 = section_on(contact, kHeight_um).volume_um3,
          .cell = {10, poisson_ratio, 30},
          .gel_poisson_ratio = poisson_ratio,
          .fineness = fineness};
}

RevolvedBody solved_on(const Polygon& outline, const Fineness& fineness) {
  const Contact contact(outline);
  return solved(revolved_mesh(contact, sectors_of(contact, fineness.order), kHeight_um, Slab{}, fineness),
                {{10, 0.49}, {10, 0.49, 30}}, 2);
}

/// @param r_um  of the round cell's half plane
Vec3 displacement_um(const RevolvedBody& body, double r_um, double angle, double depth_um) {
  const std::vector<double>& angles = body.mesh.sectors.angles;
  int sector = 0;
  while (angles[sector + 1] < angle) ++sector;
  return body.displacement_um_at(body.mesh.half_plane.in_gel(r_um, depth_um), sector,
                                 (angle - angles[sector]) / (angles[sector + 1] - angles[sector]));
}

/// By which the polynomials of a sector of 30 degrees miss the sine: |slope| / n! times the largest product of the
/// distances from the nodes of Gauss and Lobatto, 0.2 h⁴ of order 3 and 0.385 h³ of order 2, h = 15 degrees.
double angular_error(int order) {
  const double h = kPi / 12;
  return order == 3 ? 0.2 * std::pow(h, 4) / 24 : 0.385 * std::pow(h, 3) / 6;
}

void expect_same(const Reading& in_space, const Reading& round, double within_um) {
  for (std::size_t k = 0; k < round.depth_um.size(); ++k)
    EXPECT_NEAR(in_space.depth_um[k], round.depth_um[k], within_um) << k;
  EXPECT_NEAR(in_space.lift_um, round.lift_um, within_um);
  EXPECT_NEAR(in_space.largest_u_um, round.largest_u_um, within_um);
  EXPECT_NEAR(in_space.largest_u_gel_um, round.largest_u_gel_um, within_um);
  EXPECT_NEAR(in_space.top_down_um, round.top_down_um, within_um);
}

/// Its half planes have the round cell's elements: what is left is the error around the axis, 4e-5 and 1e-3.
TEST(Revolved, a_circle_gives_what_the_round_cell_gives_and_nothing_locks) {
  const Contact contact(ellipse(0, 0, {50, 60}));
  for (const auto& [fineness, nu] : {std::pair{Fineness{3, 2}, 0.49}, std::pair{Fineness{2, 2}, 0.4999}}) {
    const Setting setting = setting_of(contact, fineness, nu);
    const Indentation in_space = indentation(setting, {kHeight_um, 1}, contact, 2).of;
    const Indentation round = indentation(setting, {kHeight_um, 1});
    expect_same(in_space.reading, round.reading, angular_error(fineness.order) * round.reading.largest_u_um);
    EXPECT_NEAR(in_space.energy_fJ, round.energy_fJ, angular_error(fineness.order) * std::abs(round.energy_fJ));
    EXPECT_NEAR(in_space.contact_area_um2, kPi * kRadius_um * kRadius_um, 1e-5 * in_space.contact_area_um2);
    EXPECT_LT(in_space.imbalance, 1e-9);
    if (fineness.order == 2) continue;
    // Each element is at least its own size away from the rim or touches it, so that an order more divides the error of
    // what is smooth there by 4 and more; the round cell's default mesh is the limit.
    const double exact = indentation(setting_of(contact, Fineness{}), {kHeight_um, 1}).reading.depth_um[1];
    const double off = std::abs(in_space.reading.depth_um[1] / exact - 1);
    const double coarse_off = std::abs(in_space.coarse.depth_um[1] / exact - 1);
    EXPECT_LT(off, coarse_off / 4);
    EXPECT_LT(coarse_off, 0.01);
  }
}

TEST(Revolved, a_turned_outline_turns_the_answer_and_forces_and_moments_cancel) {
  const Vec2 centre = {50, 60};
  const RevolvedBody straight = solved_on(ellipse(0.2, 0, centre), {3, 1});
  const double turn = 0.3;
  const RevolvedBody turned = solved_on(ellipse(0.2, turn, centre), {3, 1});
  double largest = 0;
  for (const Vec3 u : straight.displacement_um) largest = std::max(largest, norm(u));
  // both outlines are followed up to off_um
  const double within = (straight.mesh.sectors.off_um + turned.mesh.sectors.off_um) / kRadius_um * largest;
  EXPECT_LT(within, 2e-3 * largest);
  for (const double depth : {0.0, 5.0})
    for (const double angle : {0.1, 1.2, 2.8, 4.4})
      for (const double r : {0.0, 12.0, 30.0}) {
        const Vec3 a = displacement_um(straight, r, angle, depth), b = displacement_um(turned, r, angle + turn, depth);
        const Vec3 back = {b.x * std::cos(turn) + b.y * std::sin(turn), b.y * std::cos(turn) - b.x * std::sin(turn),
                           b.z};
        EXPECT_LT(norm(back + -1 * a), within) << r << " " << angle << " " << depth;
      }
  Vec3 force, moment;
  double sum = 0;
  const std::vector<Vec3> forces = turned.forces_nN(kCell);
  for (std::size_t k = 0; k < forces.size(); ++k) {
    const Vec3 at = turned.mesh.position_um[k];
    if (std::abs(at.z) > 1e-9) continue;  // the cell's other nodes are free: they carry none
    force += forces[k];
    moment += cross(Vec3{at.x - centre.x, at.y - centre.y, 0}, forces[k]);
    sum += norm(forces[k]);
  }
  EXPECT_LT(norm(force), 1e-9 * sum);
  EXPECT_LT(norm(moment), 1e-9 * sum * kRadius_um);
}

TEST(Revolved, a_slight_ellipse_changes_the_depth_by_the_square_of_its_excess) {
  const auto depth = [](double e) { return displacement_um(solved_on(ellipse(e, 0), {2, 2}), 0, 0, 5).z; };
  const double round = depth(0), at_one = depth(0.06), at_two = depth(0.12);
  EXPECT_LT(at_one, round);  // a longer rim, and less below the middle
  // the next term is e⁴: a share of some e² = 0.014
  EXPECT_NEAR((at_two - round) / (at_one - round), 4, 4 * 0.02);
  EXPECT_NEAR(depth(-0.06), at_one, 1e-9 * round);  // a right angle is three sectors
}

/// Of the round cell: rr + tt + zz and zz do not depend on the angle.
TEST(Revolved, the_stress_of_a_circle_is_the_round_cells) {
  const Contact contact(ellipse(0, 0));
  const Setting setting = setting_of(contact, {3, 1});
  const Deformed round = deformed_section(setting, {kHeight_um, 1});
  const RevolvedBody body = solved_on(ellipse(0, 0), setting.fineness);
  const auto stress = body.stress_kPa();
  const Square& square = round.body.mesh->square;
  const double within_kPa = angular_error(3) * setting.cell.contraction_kPa;
  for (int e = 0; e < round.body.mesh->n_elements(); ++e) {
    const auto middle = [&](int i) { return 0.5 * (square.nodes()[i] + square.nodes()[i + 1]); };
    const Eigen::Vector4d expected = round.stress_kPa_at({e, {middle(1), middle(1)}});
    for (int s = 0; s < body.mesh.sectors.n(); ++s) {
      const std::size_t element = static_cast<std::size_t>(e) * body.mesh.sectors.n() + s;
      const auto& found = stress[27 * element + 13];  // the middle one of 3³
      EXPECT_NEAR(found[0] + found[1] + found[2], expected[0] + expected[1] + expected[2], within_kPa) << e;
      EXPECT_NEAR(found[2], expected[2], within_kPa) << e;
    }
  }
}

TEST(Revolved, the_volume_is_the_round_sections_of_the_same_area_and_height) {
  const Contact contact(ellipse(0.3, 0.4, {-5, 80}));
  const Section section = section_on(contact, kHeight_um);
  EXPECT_NEAR(section.contact_area_um2(), contact.area_um2(), 1e-9 * contact.area_um2());
  EXPECT_NEAR(contact.centroid_um().x, -5, 1e-9);
  EXPECT_NEAR(contact.centroid_um().y, 80, 1e-9);
  EXPECT_NEAR(contact.radius_um_at(0.4), kRadius_um * std::exp(0.3), 1e-4);
  EXPECT_NEAR(contact.radius_um_at(0.4 + kPi / 2), kRadius_um * std::exp(-0.3), 1e-4);
}

void expect_refused(const std::function<void()>& work, const std::string& words) {
  const InvalidData error = test::thrown<InvalidData>(work);
  EXPECT_TRUE(has_words(error.what(), words));
}

TEST(Revolved, outlines_that_it_cannot_follow_are_refused_with_the_place) {
  expect_refused(
      [] {
        Contact({{0, 0}, {40, 0}, {40, 40}, {36, 40}, {36, 4}, {0, 4}});
      },
      "from point 3 at (36, 40)");  // an angle: its centroid is outside
  expect_refused([] { Contact({{0, 0}, {40, 40}, {40, 0}, {0, 30}}); }, "star-shaped");
  const Contact wide(outline_of([](double t) { return Vec2{51 * std::cos(t), 40 * std::sin(t)}; }));
  expect_refused([&] { expect_on_slab(wide, Slab{}); }, "at 51 um");
  const Contact saw(outline_of([](double t) {
    const double r = 20 + 3 * std::cos(40 * t);
    return Vec2{r * std::cos(t), r * std::sin(t)};
  }));
  expect_refused([&] { sectors_of(saw, 3); }, "32 sectors");
}

}  // namespace
}  // namespace mbtfm::solids
