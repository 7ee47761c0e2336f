/// The interval of a force's magnitude holds the true one as often as it says.
#include "pipeline/numerics/distributions.h"
#include "tests/support/test.h"

namespace mbtfm::numerics {
namespace {

/// Share of the draws whose interval holds the truth; all lengths in units of the error.
double coverage_of(double truth, unsigned seed) {
  constexpr int kDraws = 2500;
  test::Normal error(seed);
  int n_holding = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const double x = truth + error(), y = error();
    const MagnitudeInterval interval = magnitude_interval_95(std::hypot(x, y), 1);
    EXPECT_GE(interval.low, 0);
    EXPECT_LT(interval.low, interval.high);
    n_holding += interval.low <= truth && truth <= interval.high;
  }
  return static_cast<double>(n_holding) / kDraws;
}

TEST(MagnitudeInterval, holds_the_truth_in_nineteen_cases_of_twenty_and_near_zero_in_a_few_more) {
  // At 0 only the lower end can miss: 97.5 %. At 1 and 2 σ the upper end hardly does.
  const std::vector<std::array<double, 3>> expected = {
      {0, 0.975, 0.975}, {1, 0.95, 0.975}, {2, 0.95, 0.975}, {5, 0.95, 0.95}};
  constexpr double kChance = 4 * 0.0044;  // four standard errors of a share of 0.95 in 2 500 draws
  for (const auto& [truth, least, most] : expected) {
    const double coverage = coverage_of(truth, 7);
    EXPECT_GT(coverage, least - kChance) << truth;
    EXPECT_LT(coverage, most + kChance) << truth;
  }
}

TEST(MagnitudeInterval, is_that_of_a_number_where_the_force_is_large) {
  const MagnitudeInterval interval = magnitude_interval_95(30, 1), beyond = magnitude_interval_95(300, 1);
  const double mean = std::sqrt(30.0 * 30.0 - 1);
  EXPECT_NEAR(interval.low, mean - 1.96, 2e-3);  // the next order: 1/(2·30²)
  EXPECT_NEAR(interval.high, mean + 1.96, 2e-3);
  EXPECT_NEAR(beyond.high - beyond.low, 2 * 1.96, 1e-4);
}

TEST(MagnitudeInterval, grows_with_the_force_and_does_not_jump) {
  MagnitudeInterval before = magnitude_interval_95(0, 1);
  EXPECT_EQ(before.low, 0);
  EXPECT_NEAR(before.high, std::sqrt(2 * std::log(40)), 1e-9);
  constexpr double kStep = 0.05;
  for (double found = kStep; found < 60; found += kStep) {
    const MagnitudeInterval now = magnitude_interval_95(found, 1);
    EXPECT_GE(now.low, before.low) << found;
    EXPECT_GE(now.high, before.high) << found;
    EXPECT_LT(now.high - before.high, 5 * kStep) << found;
    before = now;
  }
}

TEST(MagnitudeInterval, of_what_is_known_exactly_or_not_at_all_is_a_point_or_everything) {
  EXPECT_EQ(magnitude_interval_95(3, 0).low, 3);
  EXPECT_EQ(magnitude_interval_95(3, 0).high, 3);
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(magnitude_interval_95(3, infinity).low, 0);
  EXPECT_EQ(magnitude_interval_95(3, infinity).high, infinity);
}

}  // namespace
}  // namespace mbtfm::numerics
