/// Expected values: the examples in SciPy's documentation of scipy.stats.kruskal and mannwhitneyu, and by hand.
#include "pipeline/statistics/rank_tests.h"
#include "pipeline/contract/errors.h"
#include "pipeline/statistics/descriptive.h"
#include "tests/support/test.h"

namespace mbtfm::statistics {
namespace {

// SciPy prints 16 digits; the sums of a few ranks and the distributions are good to some 1e-15 relative.
constexpr double kRounding = 1e-13;

TEST(RankTests, kruskal_wallis_agrees_with_scipy_without_ties) {
  const TestResult result = kruskal_wallis({{1, 3, 5, 7, 9}, {2, 4, 6, 8, 10}});
  EXPECT_NEAR(result.statistic, 0.2727272727272734, kRounding);
  EXPECT_NEAR(result.p_value, 0.6015081344405895, kRounding);
}

TEST(RankTests, kruskal_wallis_agrees_with_scipy_with_ties) {
  const TestResult result = kruskal_wallis({{1, 1, 1}, {2, 2, 2}, {2, 2}});
  EXPECT_NEAR(result.statistic, 7.0, kRounding);
  // two degrees of freedom: the chi-squared tail is exp(-h/2)
  EXPECT_NEAR(result.p_value, std::exp(-3.5), kRounding);
}

TEST(RankTests, mann_whitney_agrees_with_scipy) {
  const TestResult result = mann_whitney({19, 22, 16, 29, 24}, {20, 11, 17, 12});
  EXPECT_EQ(result.statistic, 17);
  // by hand: mean 10, variance 5·4·10/12, z = 6.5/√(200/12) = 1.592168; two-sided tail erfc(z/√2)
  EXPECT_NEAR(result.p_value, std::erfc(6.5 / std::sqrt(200.0 / 12) / std::sqrt(2.0)), kRounding);
  EXPECT_NEAR(result.p_value, 0.11134688653314041, kRounding);
}

TEST(RankTests, mann_whitney_is_symmetric) {
  const std::vector<double> a = {1, 2, 2, 5, 9}, b = {2, 3, 4, 8, 8, 11};
  const TestResult ab = mann_whitney(a, b), ba = mann_whitney(b, a);
  EXPECT_EQ(ab.statistic + ba.statistic, 30);  // 5 · 6 pairs
  EXPECT_NEAR(ab.p_value, ba.p_value, kRounding);
}

TEST(RankTests, equal_values_cannot_be_ranked) {
  EXPECT_THROW(mann_whitney({1, 1}, {1}), InvalidData);
  EXPECT_THROW(kruskal_wallis({{1, 2}, {}}), InvalidData);
}

TEST(RankTests, holm_multiplies_the_smallest_most_and_stays_monotone) {
  const std::vector<double> corrected = holm({0.04, 0.01, 0.03});
  EXPECT_DOUBLE_EQ(corrected[1], 0.03);
  EXPECT_DOUBLE_EQ(corrected[2], 0.06);
  EXPECT_DOUBLE_EQ(corrected[0], 0.06);
}

TEST(RankTests, description_of_four_values) {
  const Description d = describe({4, 1, 3, 2});
  EXPECT_EQ(d.n, 4);
  EXPECT_DOUBLE_EQ(d.mean, 2.5);
  EXPECT_DOUBLE_EQ(d.median, 2.5);
  EXPECT_DOUBLE_EQ(*d.standard_deviation, std::sqrt(5.0 / 3));
}

}  // namespace
}  // namespace mbtfm::statistics
