/// What must hold of every cell that is drawn.
#include <regex>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/polyline.h"
#include "pipeline/files/text.h"
#include "pipeline/stage/parameters.h"
#include "samples/colonies/parameters.h"
#include "samples/drawing/draw.h"
#include "samples/drawing/geometry.h"
#include "samples/drawing/random.h"
#include "samples/gels/scene.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::drawing;

constexpr double kField_um = 102.4;
constexpr int kSeeds = 8;

/// Cells of seeds 1 … kSeeds, drawn once for all tests.
const drawing::DrawnCell& cell_of_seed(int seed) {
  static std::vector<drawing::DrawnCell> cells;
  for (int next = static_cast<int>(cells.size()) + 1; next <= seed; ++next)
    cells.push_back(drawing::draw_cell({}, {}, kField_um, next));
  return cells[seed - 1];
}

double mean_area(const Cell& cell) {
  double sum = 0;
  for (const Adhesion& a : cell.adhesions) sum += a.area_um2;
  return sum / static_cast<double>(cell.adhesions.size());
}

TEST(DrawnCell, has_the_number_and_mean_area_of_adhesions_asked_for) {
  const drawing::CellParameters p;
  double sum = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Cell& cell = cell_of_seed(seed).cell;
    EXPECT_EQ(static_cast<int>(cell.adhesions.size()), p.n_adhesions);
    for (const Adhesion& a : cell.adhesions) {
      EXPECT_GE(a.area_um2, p.smallest_area_um2);
      EXPECT_LE(a.area_um2, p.largest_area_um2);
      EXPECT_NEAR(std::numbers::pi / 4 * a.major_axis_um * a.minor_axis_um, a.area_um2, 1e-12);
      EXPECT_GE(a.major_axis_um / a.minor_axis_um, p.smallest_aspect - 1e-12);
      EXPECT_LE(a.major_axis_um / a.minor_axis_um, p.largest_aspect + 1e-12);
    }
    sum += mean_area(cell);
  }
  // areas of mean 0.46 with log sd 0.6 have an sd of about 0.46 sqrt(exp(0.36) − 1) = 0.30; four standard errors
  const double standard_error = 0.30 / std::sqrt(p.n_adhesions * kSeeds);
  EXPECT_NEAR(sum / kSeeds, p.adhesion_area_um2, 4 * standard_error);
}

TEST(DrawnCell, keeps_adhesions_inside_the_outline_and_apart) {
  const drawing::CellParameters p;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Cell& cell = cell_of_seed(seed).cell;
    EXPECT_GT(signed_area_um2(cell.outline_um), 0) << "the outline turns the wrong way";
    for (std::size_t i = 0; i < cell.adhesions.size(); ++i) {
      for (const Vec2 point : ellipse_corners(cell.adhesions[i], 24))
        EXPECT_TRUE(contains(cell.outline_um, point)) << "adhesion " << cell.adhesions[i].adhesion_id;
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_FALSE(drawing::too_near(cell.adhesions[i], cell.adhesions[j], p.adhesion_clearance_um))
            << "adhesions " << i + 1 << " and " << j + 1;
    }
    for (const Fibre& f : cell.fibres)
      for (const Vec2 point : f.points_um) EXPECT_TRUE(contains(cell.outline_um, point)) << "fibre " << f.fibre_id;
  }
}

TEST(DrawnCell, types_fibres_by_the_adhesions_at_their_ends) {
  const drawing::CellParameters p;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Cell& cell = cell_of_seed(seed).cell;
    int n_of_type[3] = {};
    for (const Fibre& f : cell.fibres) {
      const int n_held = f.start_adhesion_id.has_value() + f.end_adhesion_id.has_value();
      EXPECT_EQ(f.type, n_held == 2 ? FibreType::ventral : n_held == 1 ? FibreType::dorsal : FibreType::arc);
      ++n_of_type[static_cast<int>(f.type)];
      for (const bool is_start : {true, false}) {
        const auto id = is_start ? f.start_adhesion_id : f.end_adhesion_id;
        const Vec2 end = is_start ? f.points_um.front() : f.points_um.back();
        for (const Adhesion& a : cell.adhesions)
          if (id == a.adhesion_id)
            EXPECT_LT(norm(a.position_um - end), 1e-9) << "fibre " << f.fibre_id;
          else if (!id)
            EXPECT_FALSE(covers(a, end, p.free_end_clearance_um - 1e-9)) << "fibre " << f.fibre_id;
      }
    }
    EXPECT_EQ(n_of_type[static_cast<int>(FibreType::ventral)], p.n_ventral);
    EXPECT_EQ(n_of_type[static_cast<int>(FibreType::dorsal)], p.n_dorsal);
    EXPECT_EQ(n_of_type[static_cast<int>(FibreType::arc)], p.n_arc);
  }
}

TEST(DrawnCell, adhesions_carry_their_fibres_with_at_most_the_stress_asked_for) {
  const drawing::CellParameters p;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const drawing::DrawnCell& drawn = cell_of_seed(seed);
    for (std::size_t i = 0; i < drawn.cell.fibres.size(); ++i)
      for (const auto& id : {drawn.cell.fibres[i].start_adhesion_id, drawn.cell.fibres[i].end_adhesion_id}) {
        if (!id) continue;
        const double area = drawn.cell.adhesions[*id - 1].area_um2;
        EXPECT_GE(area * (1 + 1e-12), std::min(drawn.tensions_nN[i] / p.adhesion_stress_kPa, p.largest_area_um2));
      }
  }
}

TEST(DrawnCell, is_the_same_for_the_same_seed_and_another_for_another) {
  const drawing::DrawnCell &a = cell_of_seed(5), &c = cell_of_seed(6);
  const drawing::DrawnCell b = drawing::draw_cell({}, {}, kField_um, 5);
  ASSERT_EQ(a.cell.outline_um.size(), b.cell.outline_um.size());
  EXPECT_TRUE(std::ranges::equal(a.cell.outline_um, b.cell.outline_um));
  EXPECT_EQ(a.tensions_nN, b.tensions_nN);
  for (std::size_t i = 0; i < a.cell.adhesions.size(); ++i)
    EXPECT_TRUE(a.cell.adhesions[i].position_um == b.cell.adhesions[i].position_um);
  EXPECT_NE(a.tensions_nN, c.tensions_nN);
}

TEST(DrawnCell, without_room_says_what_to_change) {
  drawing::CellParameters crowded;
  crowded.n_adhesions = 5000;
  crowded.adhesion_area_um2 = 1;
  EXPECT_THROW(drawing::draw_cell(crowded, {}, kField_um, 1), UsageError);
  EXPECT_THROW(drawing::draw_cell({}, {}, 40, 1), UsageError) << "a cell of 66 um in a field of 40 um";
}

/// The scenario `dense`, of one seed after another.
drawing::DrawnCell dense_cell(std::uint64_t seed) {
  drawing::ScenarioParameters p;
  stage::ParameterList list;
  declare(list, p);
  stage::read_toml(list, drawing::scenario_file("dense"));
  return drawing::draw_cell(p.cell, p.tension, drawing::field_um(p.microscope), seed);
}

/// Median over a fibre of the distance to the nearest other one that runs alongside; none where there is none.
std::optional<double> spacing_um(const Fibre& fibre, const std::vector<Fibre>& fibres) {
  constexpr double kAlongside = 0.2;  // sine of 12 degrees
  const Polyline points = drawing::resampled(fibre.points_um, 0.5);
  std::vector<double> distances;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double nearest = 1e300;
    for (const Fibre& other : fibres) {
      if (other.fibre_id == fibre.fibre_id) continue;
      const Polyline others = drawing::resampled(other.points_um, 0.25);
      for (std::size_t k = 0; k < others.size(); ++k)
        if (std::abs(cross(drawing::tangent(points, i), drawing::tangent(others, k))) < kAlongside)
          nearest = std::min(nearest, norm(points[i] - others[k]));
    }
    if (nearest < 4) distances.push_back(nearest);
  }
  if (distances.size() < points.size() / 2) return std::nullopt;
  std::ranges::nth_element(distances, distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2));
  return distances[distances.size() / 2];
}

TEST(DenseCell, has_room_for_its_fibres_whose_types_agree_with_their_ends) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    drawing::DrawnCell drawn;
    ASSERT_NO_THROW(drawn = dense_cell(seed));
    const Cell& cell = drawn.cell;
    EXPECT_GE(cell.fibres.size(), 30u);
    EXPECT_LE(cell.fibres.size(), 50u);
    ASSERT_EQ(drawn.tensions_nN.size(), cell.fibres.size());
    for (const Fibre& f : cell.fibres) {
      const int n_held = f.start_adhesion_id.has_value() + f.end_adhesion_id.has_value();
      const bool spans = f.type == FibreType::ventral || f.type == FibreType::edge;
      EXPECT_EQ(n_held, spans ? 2 : f.type == FibreType::dorsal ? 1 : 0) << "fibre " << f.fibre_id;
      EXPECT_FALSE(n_held == 2 && f.start_adhesion_id == f.end_adhesion_id) << "fibre " << f.fibre_id;
      for (const bool is_start : {true, false}) {
        const auto id = is_start ? f.start_adhesion_id : f.end_adhesion_id;
        const Vec2 end = is_start ? f.points_um.front() : f.points_um.back();
        if (!id) continue;
        EXPECT_LT(norm(cell.adhesions[static_cast<std::size_t>(*id) - 1].position_um - end), 1e-9)
            << "fibre " << f.fibre_id;
      }
    }
  }
}

TEST(DenseCell, has_fibres_side_by_side_at_the_distances_asked_for) {
  drawing::ScenarioParameters p;
  std::vector<double> spacings;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const drawing::DrawnCell drawn = dense_cell(seed);
    for (const Fibre& f : drawn.cell.fibres) {
      if (f.type != FibreType::ventral) continue;
      const auto spacing = spacing_um(f, drawn.cell.fibres);
      if (!spacing) continue;
      // 0.9 of the least distance between the points of the drawing; the finished points lie 2 um apart
      EXPECT_GE(*spacing, 0.85 * p.cell.carpet_smallest_um) << "seed " << seed << ", fibre " << f.fibre_id;
      spacings.push_back(*spacing);
    }
  }
  ASSERT_GE(spacings.size(), 60u) << "most of 5 x 24 ventral fibres have a neighbour";
  std::ranges::sort(spacings);
  EXPECT_LE(spacings[spacings.size() / 2], p.cell.carpet_largest_um);
}

TEST(DenseCell, has_edge_bundles_inside_of_concave_arcs) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Cell cell = dense_cell(seed).cell;
    for (const Fibre& f : cell.fibres) {
      if (f.type != FibreType::edge) continue;
      for (const Vec2 p : f.points_um) EXPECT_LT(distance_to_boundary_um(cell.outline_um, p), 1.5);
      const Vec2 middle = f.points_um[f.points_um.size() / 2];
      const Vec2 chord = 0.5 * (f.points_um.front() + f.points_um.back());
      const Vec2 outward = nearest_on_boundary_um(cell.outline_um, middle) - middle;
      EXPECT_LT(dot(middle - chord, outward), 0) << "the edge bulges out at fibre " << f.fibre_id;
    }
  }
}

TEST(DrawnTensions, follow_the_histograms_of_their_types) {
  // 2000 draws: a fraction p is known to sqrt(p (1−p) / 2000) <= 0.011; four times that
  const drawing::TensionParameters p;
  const auto fraction_above = [&](double median, double log_sd, double level) {
    drawing::Random random(1, drawing::Stream::tensions);
    int n = 0;
    for (int i = 0; i < 2000; ++i)
      n += drawing::draw(random, {median, log_sd, p.smallest_tension_nN, p.largest_tension_nN}) > level;
    return n / 2000.0;
  };
  EXPECT_GT(fraction_above(p.ventral_median_nN, p.ventral_log_sd, 5), 0.30);
  EXPECT_NEAR(fraction_above(p.dorsal_median_nN, p.dorsal_log_sd, 5), 0.10, 0.044);
  EXPECT_LT(fraction_above(p.dorsal_median_nN, p.dorsal_log_sd, 1), 0.5);
  const double arcs = fraction_above(p.arc_median_nN, p.arc_log_sd, 5);
  EXPECT_GT(arcs, fraction_above(p.dorsal_median_nN, p.dorsal_log_sd, 5));
  EXPECT_LT(arcs, fraction_above(p.ventral_median_nN, p.ventral_log_sd, 5));
}

TEST(Ring, turns_into_itself) {
  drawing::CellParameters p;
  p.layout = drawing::Layout::ring;
  p.n_adhesions = 12;
  p.n_dorsal = 6;
  p.diameter_um = 40;
  const Cell cell = drawing::draw_cell(p, {}, kField_um, 1).cell;
  ASSERT_EQ(cell.adhesions.size(), 12u);
  ASSERT_EQ(cell.fibres.size(), 6u);
  const Vec2 centre{0.5 * kField_um, 0.5 * kField_um};
  Vec2 sum;
  for (const Adhesion& a : cell.adhesions) {
    EXPECT_NEAR(norm(a.position_um - centre), 20, 1e-12);
    sum += a.position_um - centre;
  }
  EXPECT_LT(norm(sum), 1e-12);
  p.n_adhesions = 500;
  EXPECT_THROW(drawing::draw_cell(p, {}, kField_um, 1), UsageError);
}

TEST(LogNormal, with_mean_has_that_mean) {
  const drawing::LogNormal d = drawing::with_mean({.median = 1, .log_sd = 0.6, .low = 0.1, .high = 3}, 0.46);
  EXPECT_NEAR(drawing::mean_of(d), 0.46, 1e-12);
  drawing::Random random(3, drawing::Stream::adhesions);
  double sum = 0;
  constexpr int n = 100000;
  for (int i = 0; i < n; ++i) sum += drawing::draw(random, d);
  EXPECT_NEAR(sum / n, 0.46, 4 * 0.30 / std::sqrt(n));  // four standard errors
  EXPECT_THROW(drawing::with_mean(d, 5), UsageError);
}

TEST(Poisson, has_mean_and_variance_alike) {
  for (const double mean : {0.3, 4.0, 9.9, 10.1, 50.0, 3000.0}) {
    SCOPED_TRACE(mean);
    drawing::Random random(7, drawing::Stream::camera);
    constexpr int n = 100000;
    double sum = 0, squares = 0;
    for (int i = 0; i < n; ++i) {
      const double k = random.poisson(mean);
      sum += k;
      squares += (k - mean) * (k - mean);
    }
    // standard errors: sqrt(mean / n) of the mean; of the variance sqrt((2 mean² + mean) / n)
    EXPECT_NEAR(sum / n, mean, 4 * std::sqrt(mean / n));
    EXPECT_NEAR(squares / n, mean, 4 * std::sqrt((2 * mean * mean + mean) / n));
  }
}

/// Keys without a row of help are explained there.
TEST(ScenarioFiles, explain_every_key_that_help_leaves_out_and_u2os_is_the_defaults) {
  ScenarioParameters cell;
  gels::SpaceParameters space;
  colonies::ColonyParameters colony;
  stage::ParameterList list;
  declare(list, cell);
  declare(list, space);
  declare(list, colony);
  std::string lines;
  for (const auto& file : fs::directory_iterator(test::source_folder() / "samples/scenarios"))
    lines += files::read_text(file.path());
  stage::read_toml(list, test::source_folder() / "samples/scenarios/u2os.toml");
  int n_keys = 0;
  for (const stage::Parameter& p : list.all()) {
    if (!p.meaning.empty()) continue;
    ++n_keys;
    const std::regex explained("\n" + p.name + " = [^\n]*# ...|\n# [^\n]*\n" + p.name + " = ");
    EXPECT_TRUE(std::regex_search(lines, explained)) << p.name;
    EXPECT_EQ(p.is_set, p.table == "scenario") << p.name;
    EXPECT_EQ(stage::to_text(p), p.default_value) << p.name;
  }
  EXPECT_EQ(n_keys, 109);
}

}  // namespace
