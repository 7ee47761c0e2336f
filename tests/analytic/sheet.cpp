/// Sheets on springs against closed forms and an independent spectral program (tests/data/reference/chapter4).
#include "continuum/sheet/from_traction.h"
#include "continuum/sheet/mesh_size.h"
#include "continuum/sheet/tables.h"
#include "pipeline/contract/errors.h"
#include "tests/support/sheets.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::sheet;
using test::Deviation;
using test::SolvedSheet;

/// Round the pixels of a disc: their corners, one by one.
Polygon pixel_steps(double radius_um, double pixel_um) {
  const int n = static_cast<int>(radius_um / pixel_um);
  const auto height = [&](int column) {  // of the quarter at x, y > 0
    const double x = (column + 0.5) / n;
    return static_cast<int>(n * std::sqrt(1 - x * x) + 0.5);
  };
  Polygon quarter;  // from the x axis up to the y axis
  for (int column = n - 1; column >= 0; --column)
    for (int row = column + 1 < n ? height(column + 1) : 0; row <= height(column); ++row)
      quarter.push_back(pixel_um * Vec2{column + 1.0, static_cast<double>(row)});
  Polygon ring;
  for (int turn = 0; turn < 4; ++turn)
    for (const Vec2 p : quarter) {
      Vec2 q = p;
      for (int k = 0; k < turn; ++k) q = {-q.y, q.x};
      if (ring.empty() || norm(ring.back() - q) > 1e-9) ring.push_back(q);
    }
  return ring;
}

TEST(Curve, steps_of_pixels_are_no_corners_and_corners_are_kept) {
  const Curve disc(pixel_steps(20, 0.2));
  EXPECT_TRUE(disc.corners_um().empty());
  for (double s = 0; s < disc.length_um(); s += 1) EXPECT_NEAR(norm(disc.at(s)), 20, 0.3);  // a pixel and a half
  const Curve strip(test::rectangle(60, 10));
  EXPECT_EQ(strip.corners_um().size(), 4u);
  EXPECT_NEAR(strip.length_um(), 140, 1e-12);
}

TEST(Curve, a_loop_is_found_and_a_neighbour_is_none) {
  EXPECT_TRUE(crossing_of({test::circle(10), test::circle(5)}).empty());
  EXPECT_EQ(crossing_of({Polygon{{0, 0}, {4, 4}, {4, 0}, {0, 4}}}), "piece 1 of ring 0 and piece 3 of ring 0");
  EXPECT_FALSE(crossing_of({test::circle(10), test::rectangle(30, 5)}).empty()) << "a hole that reaches out";
}

TEST(Sheet, triangles_beyond_all_memory_are_counted_and_refused_before_any_is_made) {
  const sheet::Region disc{.rims = {sheet::Curve(test::circle(25))}};
  const sheet::TriangleSize size{.at_curves_um = 1e-9, .largest_um = 5, .growth = 0.13};
  // a side of 1e-9 um: 1.6e11 of them around the rim
  EXPECT_GT(sheet::expected_triangles(disc, size), 1e11);
  EXPECT_THROW(sheet::triangulated(disc, size, 200000), InvalidData);
  // springs of 1e9 nN/um3 under a soft sheet: an edge that cannot be resolved is as fine as the program will make it
  const sheet::TriangleSize coarser = sheet::size_on_springs(disc, 2e-5);
  EXPECT_LE(sheet::expected_triangles(disc, coarser), 1e5);
}

/// The rows of one case, from `row` on, along a line off the axes, where the mesh has no symmetry.
void expect_radial(const SolvedSheet& solved, const files::CsvTable& csv, int& row) {
  const int of_case = csv.integer(row, "case", 0);
  const double c = std::cos(0.7), s = std::sin(0.7);
  Deviation u, rr, tt;
  for (; row < csv.n_rows() && csv.integer(row, "case", 0) == of_case; ++row) {
    const auto [at, S] = solved.at(csv.number(row, "r_um") * Vec2{c, s}).value();
    u.add(at.x * c + at.y * s, csv.number(row, "ur_um"));
    rr.add(c * c * S.xx + s * s * S.yy + 2 * c * s * S.xy, csv.number(row, "Srr_nN_per_um"));
    tt.add(s * s * S.xx + c * c * S.yy - 2 * c * s * S.xy, csv.number(row, "Stt_nN_per_um"));
  }
  for (const Deviation& deviation : {u, rr, tt}) EXPECT_LE(deviation.relative(), 1e-4) << "case " << of_case;
}

TEST(Sheet, discs_on_springs_are_the_closed_form) {
  const auto csv = test::chapter4("sheet_disc");
  int row = 0;
  while (row < csv.n_rows()) {
    const int of_case = csv.integer(row, "case", 0);
    const auto value = [&](const char* column) { return csv.number(row, column); };
    const double R = value("radius_um");
    if (R > 30 * value("penetration_um")) {  // meshes of 100 000 nodes and more: notes/sheets.md
      while (row < csv.n_rows() && csv.integer(row, "case", 0) == of_case) ++row;
      continue;
    }
    const Region region{{Curve(test::circle(R))}, {}};
    SolvedSheet disc(region, size_on_springs(region, value("penetration_um")));
    disc.sheet.material = {value("E_kPa"), value("nu"), value("h_um")};
    disc.sheet.contraction_nN_per_um = even(disc.elements, value("s_nN_per_um"));
    disc.sheet.spring_nN_per_um3 = even(disc.elements, value("kappa_nN_per_um3"));
    disc.sheet.line_tension_nN = value("line_nN");
    disc.solve();
    expect_radial(disc, csv, row);
  }
}

std::vector<double> numbers_in(const std::string& text) {
  std::istringstream stream(text);
  std::vector<double> numbers;
  for (double value = 0; stream >> value;) numbers.push_back(value);
  return numbers;
}

TEST(Sheet, rings_of_adhesion_and_annuli_are_the_closed_form) {
  const auto csv = test::chapter4("sheet_rings");
  int row = 0;
  while (row < csv.n_rows()) {
    const auto value = [&](const char* column) { return csv.number(row, column); };
    const std::vector<double> radii = numbers_in(csv.text(row, "radii_um")),
                              kappas = numbers_in(csv.text(row, "kappas_nN_per_um3"));
    Region region{{Curve(test::circle(radii.back()))}, {}};
    if (radii.front() > 0) region.rims.emplace_back(test::circle(radii.front()));
    for (std::size_t k = 1; k + 1 < radii.size(); ++k) region.lines.emplace_back(test::circle(radii[k]));
    const Material material{value("E_kPa"), value("nu"), value("h_um")};
    const double stiffest = *std::max_element(kappas.begin(), kappas.end());
    SolvedSheet rings(region, size_on_springs(region, std::sqrt(material.stiffness_nN_per_um() / stiffest)));
    rings.sheet.material = material;
    rings.sheet.contraction_nN_per_um = even(rings.elements, value("s_nN_per_um"));
    for (int t = 0; t < rings.elements.n_triangles(); ++t)
      for (int p = 0; p < Elements::kPoints; ++p) {
        std::size_t k = 0;
        while (k + 2 < radii.size() && norm(rings.elements.at(t, p).place_um) > radii[k + 1]) ++k;
        rings.sheet.spring_nN_per_um3.push_back(kappas[k]);
      }
    if (value("inner_edge_free") == 0) {
      rings.sheet.held.assign(static_cast<std::size_t>(rings.elements.n_nodes()), {false, false});
      for (const auto& side : rings.elements.triangles().sides)
        if (side.curve == 1)
          for (const int node : side.nodes) rings.sheet.held[node] = {true, true};
    }
    rings.solve();
    expect_radial(rings, csv, row);
  }
}

TEST(Sheet, strips_are_the_closed_form) {
  const auto csv = test::chapter4("sheet_strip");
  for (int row = 0; row < csv.n_rows();) {
    const std::string sides = csv.text(row, "sides");
    const int first = row;
    const auto value = [&](const char* column) { return csv.number(row, column); };
    const bool is_narrow = sides.starts_with("narrow");
    const double length = value("length_um");
    // A narrow one must be so narrow that its springs do not hold it across: by (width / l)² / 8.
    const double width = is_narrow ? 0.1 : 10;
    const Region region{{Curve(test::rectangle(length, width))}, {}};
    const Material material{value("E_kPa"), value("nu"), value("h_um")};
    const double l = std::sqrt(material.stiffness_nN_per_um() / value("kappa_nN_per_um3"));
    TriangleSize size = size_on_springs(region, l);
    if (is_narrow) size = {.at_curves_um = width, .largest_um = width};
    SolvedSheet strip(region, size);
    strip.sheet.material = material;
    strip.sheet.contraction_nN_per_um = even(strip.elements, value("s_nN_per_um"));
    strip.sheet.spring_nN_per_um3 = even(strip.elements, value("kappa_nN_per_um3"));
    if (!is_narrow) strip.sheet.held.assign(static_cast<std::size_t>(strip.elements.n_nodes()), {false, true});
    strip.solve();
    Deviation u, xx;
    for (; row < csv.n_rows() && csv.text(row, "sides") == sides && value("length_um") == length; ++row) {
      const auto at = strip.at({value("x_um"), 0.01});
      ASSERT_TRUE(at);
      u.add(at->u.x, value("ux_um"));
      xx.add(at->S.xx, value("Sxx_nN_per_um"));
    }
    EXPECT_LE(u.relative(), 1e-4) << "row " << first;
    EXPECT_LE(xx.relative(), 1e-4) << "row " << first;
  }
}

Polygon outline(const std::string& shape) {
  const auto csv = test::chapter4("outlines");
  Polygon points;
  for (int row = 0; row < csv.n_rows(); ++row)
    if (csv.text(row, "shape") == shape) points.push_back({csv.number(row, "x_um"), csv.number(row, "y_um")});
  return points;
}

/// A sheet of the row's outline and numbers.
SolvedSheet sheet_of(const files::CsvTable& csv, int row, double finer = 1) {
  const auto value = [&](const char* column) { return csv.number(row, column); };
  const Region region{{Curve(outline(csv.text(row, "shape")))}, {}};
  const Material material{value("E_kPa"), value("nu"), value("h_um")};
  TriangleSize size = size_on_springs(region, std::sqrt(material.stiffness_nN_per_um() / value("kappa_nN_per_um3")));
  size.at_curves_um /= finer;
  size.largest_um /= finer;
  size.most_turn_rad /= finer;
  size.most_notch_rad /= finer;
  SolvedSheet made(region, size);
  made.sheet.material = material;
  made.sheet.contraction_nN_per_um = even(made.elements, value("s_nN_per_um"));
  made.sheet.spring_nN_per_um3 = even(made.elements, value("kappa_nN_per_um3"));
  return made;
}

TEST(Sheet, any_outline_is_the_spectral_solution) {
  const auto csv = test::chapter4("sheet_outline");
  for (int row = 0; row < csv.n_rows();) {
    const std::string shape = csv.text(row, "shape");
    SolvedSheet made = sheet_of(csv, row);
    made.solve();
    Deviation u, S;
    double stated = 0;
    int n = 0, n_met = 0;  // points on the rim may lie beyond its curve by rounding
    for (; row < csv.n_rows() && csv.text(row, "shape") == shape; ++row) {
      const auto value = [&](const char* column) { return csv.number(row, column); };
      const auto at = made.at({value("x_um"), value("y_um")});
      ++n;
      if (!at) continue;
      ++n_met;
      u.add(at->u.x, value("ux_um"));
      u.add(at->u.y, value("uy_um"));
      S.add(at->S.xx, value("Sxx_nN_per_um"));
      S.add(at->S.yy, value("Syy_nN_per_um"));
      S.add(at->S.xy, value("Sxy_nN_per_um"));
      stated = std::max(stated, value("u_error_um"));
    }
    EXPECT_GE(n_met, 0.9 * n) << shape;
    const auto energies = test::chapter4("sheet_energy");
    for (int k = 0; k < energies.n_rows(); ++k) {
      if (energies.text(k, "shape") != shape) continue;
      const double exact = energies.number(k, "energy_fJ");
      EXPECT_NEAR(0.5 * made.u.dot(forces_of_contraction_nN(made.elements, made.sheet)), exact, 1e-4 * exact) << shape;
      // the polygon of the file is smaller than the curve that it stands for
      EXPECT_NEAR(made.elements.area_um2(), energies.number(k, "area_um2"), 1e-4 * made.elements.area_um2()) << shape;
    }
    EXPECT_LE(u.difference, std::max(1e-4 * u.largest, stated)) << shape;
  }
}

/// Thesis, section 4.2: where l is large against a spike its tip pulls more than a disc's edge, where it is small less.
TEST(Sheet, tips_of_spikes_pull_more_than_a_disc_where_the_penetration_length_is_long) {
  const auto csv = test::chapter4("spike_ratio");
  for (int row = 0; row < csv.n_rows(); ++row) {
    const auto value = [&](const char* column) { return csv.number(row, column); };
    const double l = value("penetration_um"), R = value("radius_um"), a = value("spike_height_um"), w = value("w");
    if (a != 50 || (l != 6 && l != 12 && l != 200)) continue;  // the others: notes/sheets.md
    const auto pull_at_tip = [&](double spike_um) {
      const auto radius = [=](double t) { return R + spike_um * std::exp((std::cos(4 * t) - 1) / w); };
      Scene scene;
      scene.region.rims.emplace_back(test::ring(radius, 2880));
      scene.material = {10, value("nu"), 2};
      scene.contraction.nN_per_um = 1;
      scene.adhesion_nN_per_um3 = scene.material.stiffness_nN_per_um() / (l * l);
      scene.size = size_on_springs(scene.region, l);
      const Solution solution = solve_on_springs(scene, 1);
      const auto rows = at_points_of(solution, {{R + spike_um, 0}});
      return *scene.adhesion_nN_per_um3 * std::hypot(rows.front().ux_um.value(), rows.front().uy_um.value());
    };
    const double ratio = pull_at_tip(a) / pull_at_tip(0), exact = value("tip_over_disc_edge");
    EXPECT_NEAR(ratio, exact, std::max(0.01, value("relative_error")) * exact) << a << " " << l;
  }
}

/// The tractions of a sheet on springs are tractions as any: the tensions must be those of the forward solution where
/// Poisson's ratio is right, and those of the independent solution where it is not.
TEST(Sheet, tensions_follow_from_tractions) {
  const auto csv = test::chapter4("stress_from_traction");
  for (int row = 0; row < csv.n_rows();) {
    const std::string shape = csv.text(row, "shape");
    const auto value = [&](const char* column) { return csv.number(row, column); };
    Scene scene;
    scene.region.rims.emplace_back(outline(shape));
    scene.material = {value("E_kPa"), value("nu"), value("h_um")};
    scene.contraction.nN_per_um = value("s_nN_per_um");
    scene.adhesion_nN_per_um3 = value("kappa_nN_per_um3");
    scene.size =
        size_on_springs(scene.region, std::sqrt(scene.material.stiffness_nN_per_um() / value("kappa_nN_per_um3")));
    scene.size = with_edge(scene.size, 1.5 * scene.size.at_curves_um);  // bars of 1 % and not of 1e-4
    const Solution forward = solve_on_springs(scene, 1);
    while (row < csv.n_rows() && csv.text(row, "shape") == shape) {
      const double nu = value("nu_assumed"), s = value("s_nN_per_um"), mean = value("mean_tension_nN_per_um");
      const FromTraction found = tensions_from(forward.patches, scene.region, {1, nu, 1}, scene.size, 1);
      EXPECT_NEAR(found.balance.mean_tension_nN_per_um, mean, 2e-3 * s) << shape;
      EXPECT_NEAR(found.balance.virial_tension_nN_per_um, found.balance.mean_tension_nN_per_um, 1e-9 * s) << shape;
      const Locator locator(*found.solution.elements);
      Deviation S;
      S.largest = s;
      for (; row < csv.n_rows() && csv.text(row, "shape") == shape && value("nu_assumed") == nu; ++row) {
        const auto place = locator.find({value("x_um"), value("y_um")}, 0.05);
        if (!place) continue;
        const Tensor at = value_of(found.solution.at_nodes, found.solution.elements->nodes(place->triangle),
                                   found.solution.elements->shape(place->triangle, place->r, place->s));
        for (const auto& [ours, column] :
             {std::pair{at.xx, "Sxx_nN_per_um"}, {at.yy, "Syy_nN_per_um"}, {at.xy, "Sxy_nN_per_um"}})
          S.difference = std::max(S.difference, std::abs(ours - value(column)));
      }
      EXPECT_LE(S.difference, 0.01 * s) << shape << " " << nu;
    }
  }
}

/// An ellipse on springs, its tractions on a lattice, and the part of it right of x = cut_um.
struct CutEllipse {
  static constexpr double kHalfLength_um = 30, kHalfWidth_um = 18, kSpacing_um = 0.5;
  Region whole, right;
  std::vector<GroundPatch> all, seen;
  Solution forward;

  explicit CutEllipse(double cut_um) {
    whole.rims.emplace_back(test::ring(
        [](double t) { return 1 / std::hypot(std::cos(t) / kHalfLength_um, std::sin(t) / kHalfWidth_um); }, 240));
    const double end = std::acos(cut_um / kHalfLength_um);
    Polygon part;
    for (int i = 0; i <= 120; ++i) {
      const double t = end * (i / 60.0 - 1);
      part.push_back({kHalfLength_um * std::cos(t), kHalfWidth_um * std::sin(t)});
    }
    part.front().x = part.back().x = cut_um;
    right.cuts = {{part.back(), part.front()}};
    right.rims.emplace_back(part);
    Scene scene;
    scene.region = whole;
    scene.material = {1, 0.4, 4};
    scene.contraction.nN_per_um = 1;
    scene.adhesion_nN_per_um3 = 0.02;  // l = 15 um
    scene.size = {.at_curves_um = 1, .largest_um = 2, .growth = 0.3};
    forward = solve_on_springs(scene, 1);
    const Locator locator(*forward.elements);
    for (double x = cut_um - 59.75; x < 31; x += kSpacing_um)
      for (double y = -19.75; y < 20; y += kSpacing_um) {
        const auto place = locator.find({x, y}, 0);
        if (!place) continue;
        const Vec2 u = value_of(forward.u, forward.elements->nodes(place->triangle),
                                forward.elements->shape(place->triangle, place->r, place->s));
        all.push_back({{x, y}, kSpacing_um * kSpacing_um, 0.02 * u, {}});
        if (x > cut_um) seen.push_back(all.back());
      }
  }
  FromTraction of_part(CutEdge edge) const {
    return tensions_from(seen, right, {1, 0.4, 4}, {.at_curves_um = 1, .largest_um = 2, .growth = 0.3}, 1, 1, {}, edge);
  }
  /// Of the part that is seen, in truth.
  double mean_nN_per_um() const { return figures_inside(forward, right.rims.front().points_um()).mean_nN_per_um; }
};

TEST(Sheet, one_that_is_cut_along_its_axis_of_symmetry_has_the_tensions_of_the_whole) {
  const CutEllipse ellipse(0);
  const FromTraction half = ellipse.of_part(CutEdge::held);
  // The lattice's squares end in steps at the rim: 1 % of the area, of which the mean is the sum.
  EXPECT_NEAR(half.balance.mean_tension_nN_per_um, ellipse.mean_nN_per_um(), 0.01 * ellipse.mean_nN_per_um());
  EXPECT_NEAR(half.balance.virial_tension_nN_per_um, half.balance.mean_tension_nN_per_um, 1e-9);
  const FromTraction whole =
      tensions_from(ellipse.all, ellipse.whole, {1, 0.4, 4}, {.at_curves_um = 1, .largest_um = 2, .growth = 0.3}, 1);
  const Locator in_half(*half.solution.elements), in_whole(*whole.solution.elements);
  for (const Vec2 p : {Vec2{1, 0}, {1, 15}, {10, 5}, {25, -3}}) {
    const auto at = [&](const Solution& solution, const Locator& locator) {
      const auto place = locator.find(p);
      return value_of(solution.at_nodes, solution.elements->nodes(place->triangle),
                      solution.elements->shape(place->triangle, place->r, place->s));
    };
    const Tensor a = at(half.solution, in_half), b = at(whole.solution, in_whole);
    EXPECT_NEAR(a.xx, b.xx, 0.01) << p.x << " " << p.y;  // of s = 1
    EXPECT_NEAR(a.yy, b.yy, 0.01) << p.x << " " << p.y;
    EXPECT_NEAR(a.xy, b.xy, 0.01) << p.x << " " << p.y;
  }
  // what lies beyond pulls with the tension across the cut: as much as the part pulls on its ground
  ASSERT_TRUE(half.cut);
  EXPECT_NEAR(half.cut->length_um, 2 * CutEllipse::kHalfWidth_um, 1e-6);
  Vec2 on_ground;
  for (const GroundPatch& patch : ellipse.seen) on_ground += patch.area_um2 * patch.traction_kPa;
  EXPECT_NEAR(half.cut->force_nN.x, on_ground.x, 1e-9 * std::abs(on_ground.x));
}

TEST(Sheet, at_a_cut_anywhere_the_edge_that_is_held_errs_less_than_a_free_one_and_less_than_the_spread) {
  for (const double cut : {-15.0, 8.0, 18.0}) {
    const CutEllipse ellipse(cut);
    const double truth = ellipse.mean_nN_per_um();
    const auto mean = [&](CutEdge edge) { return ellipse.of_part(edge).balance.mean_tension_nN_per_um; };
    const double held = mean(CutEdge::held), clamped = mean(CutEdge::clamped), free = mean(CutEdge::free);
    EXPECT_LT(std::abs(held - truth), 0.3 * std::abs(free - truth)) << cut;
    EXPECT_LE(std::abs(held - truth), std::max(std::abs(clamped - held), std::abs(free - held))) << cut;
  }
}

/// Errors drawn here as the errors are said to be: one for each component in each square of the correlation's side.
TEST(Sheet, errors_of_tensions_are_the_scatter_under_drawn_errors_of_tractions) {
  Region disc;
  disc.rims.emplace_back(test::circle(20, 60));
  const TriangleSize size{.at_curves_um = 4, .largest_um = 6, .growth = 0.3};
  const TractionNoise noise{.sigma_kPa = 0.1, .correlation_um = 4};
  const auto tractions = [&](double even_kPa, std::mt19937_64* random) {
    std::normal_distribution<double> normal(0, noise.sigma_kPa);
    std::vector<GroundPatch> patches;
    for (int j = -5; j <= 5; ++j)
      for (int i = -5; i <= 5; ++i) {
        const Vec2 at = noise.correlation_um * Vec2{static_cast<double>(i), static_cast<double>(j)};
        if (norm(at) > 19) continue;
        Vec2 traction = (-even_kPa / 20) * at;
        if (random) traction += {normal(*random), normal(*random)};
        patches.push_back({at, noise.correlation_um * noise.correlation_um, traction, {}});
      }
    return patches;
  };
  const auto solved = [&](std::mt19937_64* random) {
    return tensions_from(tractions(1, random), disc, {1, 0.5, 1}, size, 1, kMostUnbalanced, noise);
  };
  const auto by_triangle = [](const FromTraction& found) {
    std::vector<double> means;
    for (std::size_t p = 0; p < found.solution.at_points.size(); ++p) {
      if (p % Elements::kPoints == 0) means.push_back(0);
      means.back() += mean_of(found.solution.at_points[p]) / Elements::kPoints;
    }
    return means;
  };
  const FromTraction exact = solved(nullptr);
  const std::vector<double> truth = by_triangle(exact);
  std::mt19937_64 random(5);
  constexpr int kDraws = 48;
  double square = 0, claimed = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const std::vector<double> drawn = by_triangle(solved(&random));
    for (std::size_t t = 0; t < truth.size(); ++t) square += std::pow(drawn[t] - truth[t], 2) / kDraws;
  }
  for (const double sigma : exact.errors->by_triangle) claimed += sigma * sigma;
  // 48 draws each: a tenth, were all triangles one; three times the root of two of that
  EXPECT_NEAR(std::sqrt(square / claimed), 1, 0.3);
}

TEST(Sheet, quadratic_elements_are_of_third_order_on_the_ellipse) {
  const auto csv = test::chapter4("sheet_outline");
  std::vector<double> errors, sizes;
  for (const double finer : {0.5, 1.0, 2.0}) {
    SolvedSheet made = sheet_of(csv, 0, finer / 2.5);
    made.solve();
    double sum = 0;
    for (int row = 0; row < csv.n_rows() && csv.text(row, "shape") == "ellipse"; ++row) {
      const auto at = made.at({csv.number(row, "x_um"), csv.number(row, "y_um")});
      if (!at) continue;
      sum += std::pow(at->u.x - csv.number(row, "ux_um"), 2) + std::pow(at->u.y - csv.number(row, "uy_um"), 2);
    }
    errors.push_back(std::sqrt(sum));
    sizes.push_back(1 / std::sqrt(made.elements.n_nodes()));  // growth and bends keep the meshes from being alike
  }
  EXPECT_GE(std::log(errors.front() / errors.back()) / std::log(sizes.front() / sizes.back()), 2.7);
}

TEST(Sheet, large_strains_are_the_independent_solution) {
  const auto csv = test::chapter4("sheet_nonlinear");
  for (int row = 0; row < csv.n_rows();) {
    const std::string shape = csv.text(row, "shape"), measure = csv.text(row, "contraction");
    SolvedSheet made = sheet_of(csv, row);
    made.u = on_springs_large(
                 made.elements, made.sheet,
                 measure == "cauchy" ? ContractionMeasure::surface_tension : ContractionMeasure::second_piola, 1)
                 .u;
    made.S.assign(static_cast<std::size_t>(made.elements.n_nodes()), {});
    const double s = csv.number(row, "s_nN_per_um");
    Deviation u;
    for (; row < csv.n_rows() && csv.text(row, "shape") == shape && csv.text(row, "contraction") == measure &&
           csv.number(row, "s_nN_per_um") == s;
         ++row) {
      const auto at = made.at({csv.number(row, "x_um"), csv.number(row, "y_um")});
      if (!at) continue;
      u.add(at->u.x, csv.number(row, "ux_um"));
      u.add(at->u.y, csv.number(row, "uy_um"));
    }
    EXPECT_LE(u.relative(), 1e-3) << shape << " " << measure;
  }
}

}  // namespace
