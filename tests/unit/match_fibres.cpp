#include "pipeline/report/compare.h"

#include <gtest/gtest.h>

namespace mbtfm::report {
namespace {

Fibre fibre(int id, Polyline points) {
  Fibre f;
  f.fibre_id = id;
  f.points_um = std::move(points);
  return f;
}

TEST(MatchFibres, parallel_lines_are_as_far_apart_as_they_lie) {
  EXPECT_NEAR(line_distance_um({{0, 0}, {10, 0}}, {{10, 2}, {0, 2}}, 0.25), 2, 1e-12);  // rounding
}

TEST(MatchFibres, a_line_that_ends_early_is_away_by_what_it_lacks) {
  // 4 of 10 um missing: mean over the long line of the distance to the short one's end, 0.4 · 2 um. The midpoint rule
  // is exact where the distance is linear; the piece that holds the corner errs by less than step²/8 over the length.
  EXPECT_NEAR(line_distance_um({{0, 0}, {10, 0}}, {{0, 0}, {6, 0}}, 0.25), 0.8, 0.25 * 0.25 / 8);
}

TEST(MatchFibres, pairs_are_one_to_one_and_the_closest_wins) {
  const std::vector<Fibre> found = {fibre(1, {{0, 0.5}, {10, 0.5}}), fibre(2, {{0, 0.1}, {10, 0.1}})};
  const std::vector<Fibre> truth = {fibre(7, {{0, 0}, {10, 0}})};
  const auto matches = match_fibres(found, truth);
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].found_index, 1);
}

TEST(MatchFibres, direction_and_order_do_not_matter) {
  const std::vector<Fibre> a = {fibre(1, {{0, 0}, {10, 0}}), fibre(2, {{0, 5}, {5, 8}, {10, 8}})};
  const std::vector<Fibre> b = {fibre(1, {{10, 8.2}, {5, 8.2}, {0, 5.2}}), fibre(2, {{10, 0.3}, {0, 0.3}})};
  const auto matches = match_fibres(a, b);
  ASSERT_EQ(matches.size(), 2u);
  for (const FibreMatch& match : matches) EXPECT_EQ(match.found_index, 1 - match.true_index);
}

TEST(MatchFibres, distant_lines_have_no_partner) {
  EXPECT_TRUE(match_fibres({fibre(1, {{0, 0}, {10, 0}})}, {fibre(1, {{0, 3}, {10, 3}})}).empty());
}

TEST(MatchFibres, crossing_lines_have_no_partner) {
  EXPECT_TRUE(match_fibres({fibre(1, {{0, 0}, {10, 0}})}, {fibre(1, {{5, -5}, {5, 5}})}).empty());
}

}  // namespace
}  // namespace mbtfm::report
