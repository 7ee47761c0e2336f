/// The statistics beside R's own functions on the same tables: tests/data/statistics/expected.R makes both.
#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"
#include "pipeline/statistics/descriptive.h"
#include "pipeline/statistics/mixed_model.h"
#include "pipeline/statistics/rank_tests.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace mbtfm::statistics {
namespace {

const std::filesystem::path kData = test::source_folder() / "tests/data/statistics";

struct Fibre {
  int cell = 0, type = 0;
  double tension_nN = 0, sigma_nN = 0;
};
const std::vector<std::string> kTypes = {"dorsal", "arc", "ventral"};

struct FromR {
  std::vector<Fibre> fibres;
  std::map<std::string, double> expected;
  FromR() {
    const files::CsvTable table(kData / "fibres.csv"), numbers(kData / "expected.csv");
    for (int row = 0; row < table.n_rows(); ++row) {
      const auto type = std::find(kTypes.begin(), kTypes.end(), table.text(row, "type"));
      fibres.push_back({table.integer(row, "cell", 1), static_cast<int>(type - kTypes.begin()),
                        table.number(row, "tension_nN"), table.number(row, "sigma_nN")});
    }
    for (int row = 0; row < numbers.n_rows(); ++row) expected[numbers.text(row, "name")] = numbers.number(row, "value");
  }
  /// Expect what R says under this name, to a share of it.
  void expect(const std::string& name, double value, double share) const {
    EXPECT_NEAR(value, expected.at(name), share * std::abs(expected.at(name))) << name;
  }
  std::vector<std::vector<double>> by_type() const {
    std::vector<std::vector<double>> groups(3);
    for (const Fibre& f : fibres) groups[static_cast<std::size_t>(f.type)].push_back(f.tension_nN);
    return groups;
  }
};

double share_above(const std::vector<double>& values, double threshold) {
  const auto n = std::ranges::count_if(values, [&](double v) { return v > threshold; });
  return static_cast<double>(n) / static_cast<double>(values.size());
}

constexpr double kExact = 1e-9;  // R's numbers are committed with ten digits
// Both maximise the same likelihood, to tolerances of about 1e-9 in it: the maximum is flat, so that variances agree to
// the root of that over the curvature. R prints nlme's with seven digits.
constexpr double kOptimiser = 2e-4;

TEST(StatisticsBesideR, rank_tests_and_holm) {
  const FromR r;
  const auto groups = r.by_type();
  r.expect("kruskal.h", kruskal_wallis(groups).statistic, kExact);
  r.expect("kruskal.p", kruskal_wallis(groups).p_value, kExact);
  std::vector<double> p_values;
  for (const auto& [a, b] : {std::pair<std::size_t, std::size_t>{0, 1}, {0, 2}, {1, 2}}) {
    const std::string name = "wilcoxon." + kTypes[a] + "." + kTypes[b];
    const TestResult u = mann_whitney(groups[a], groups[b]);
    r.expect(name + ".u", u.statistic, kExact);
    r.expect(name + ".p", u.p_value, kExact);
    p_values.push_back(u.p_value);
  }
  const std::vector<double> corrected = holm(p_values);
  for (std::size_t i = 0; i < 3; ++i) r.expect("holm." + std::to_string(i + 1), corrected[i], kExact);
}

TEST(StatisticsBesideR, wilson_interval_and_line_through_the_origin) {
  const FromR r;
  const auto ventral = r.by_type()[2];
  const Interval wilson = wilson_interval(share_above(ventral, 5), static_cast<double>(ventral.size()));
  r.expect("wilson.low", wilson.low, kExact);
  r.expect("wilson.high", wilson.high, kExact);
  const files::CsvTable table(kData / "cells.csv");
  std::vector<double> x, y;
  for (int row = 0; row < table.n_rows(); ++row) {
    x.push_back(table.number(row, "n_adhesions"));
    y.push_back(table.number(row, "total_force_nN"));
  }
  const LineThroughOrigin line = line_through_origin(x, y);
  r.expect("line.slope", line.slope, kExact);
  r.expect("line.error", *line.slope_error, kExact);
  r.expect("line.r", *line.correlation, kExact);
}

/// Without kinds: a random intercept by cell and one scatter.
TEST(StatisticsBesideR, mixed_model_of_lme4_with_the_degrees_of_lmerTest) {
  const FromR r;
  std::vector<Observation> data;
  for (const Fibre& f : r.fibres)
    data.push_back({.value = f.tension_nN, .error_variance = 0, .cell = f.cell, .kind = 0, .group = f.type});
  const MixedFit fit = fit_mixed_model(data);
  EXPECT_TRUE(fit.converged);
  r.expect("lmer.log_likelihood", fit.log_likelihood, kExact);
  r.expect("lmer.cell_variance", *fit.cell_variance, kOptimiser);
  r.expect("lmer.residual_variance", *fit.residual_variance[0], kOptimiser);
  // lmerTest takes the observed information of the variances, we the average of observed and expected: some per cent
  constexpr double kInformation = 0.05;
  for (int g = 0; g < 3; ++g) {
    const Contrast mean = contrast_of(fit, Eigen::VectorXd::Unit(3, g));
    const std::string& type = kTypes[g];
    r.expect("lmer.mean." + type, mean.estimate, kOptimiser);
    r.expect("lmer.error." + type, mean.standard_error, kOptimiser);
    r.expect("lmer.degrees." + type, mean.degrees, kInformation);
  }
  const Contrast difference = contrast_of(fit, Eigen::Vector3d(-1, 0, 1));
  r.expect("lmer.ventral_dorsal.estimate", difference.estimate, kOptimiser);
  r.expect("lmer.ventral_dorsal.error", difference.standard_error, kOptimiser);
  r.expect("lmer.ventral_dorsal.degrees", difference.degrees, kInformation);
  Eigen::MatrixXd all(2, 3);
  all << -1, 1, 0, -1, 0, 1;
  const FTest test = test_all_zero(fit, all);
  r.expect("lmer.all.f", test.f, kOptimiser);
  r.expect("lmer.all.degrees", test.denominator_degrees, kInformation);
}

void expect_nested(const FromR& r, const std::string& name, bool has_errors) {
  std::vector<Observation> data;
  for (const Fibre& f : r.fibres)
    data.push_back({.value = f.tension_nN,
                    .error_variance = has_errors ? f.sigma_nN * f.sigma_nN : 0,
                    .cell = f.cell,
                    .kind = f.type,
                    .group = f.type});
  const MixedFit fit = fit_mixed_model(data);
  EXPECT_TRUE(fit.converged);
  r.expect(name + ".log_likelihood", fit.log_likelihood, 1e-6);
  // four variances of 150 fibres: flatter still
  constexpr double kFlat = 3e-3;
  r.expect(name + ".cell_variance", *fit.cell_variance, kFlat);
  r.expect(name + ".cell_kind_variance", *fit.cell_kind_variance, kFlat);
  for (int g = 0; g < 3; ++g) {
    const std::string& type = kTypes[g];
    const Contrast mean = contrast_of(fit, Eigen::VectorXd::Unit(3, g));
    r.expect(name + ".mean." + type, mean.estimate, kOptimiser);
    r.expect(name + ".error." + type, mean.standard_error, kFlat);
    r.expect(name + ".residual_variance." + type, *fit.residual_variance[g], kFlat);
  }
}

TEST(StatisticsBesideR, nested_mixed_model_of_nlme_with_a_scatter_by_type) { expect_nested(FromR(), "lme", false); }
TEST(StatisticsBesideR, mixed_model_of_metafor_with_known_errors) { expect_nested(FromR(), "rma", true); }

TEST(StatisticsBesideR, clustered_rank_sum_by_its_definition) {
  const FromR r;
  std::vector<ClusteredValue> values;
  for (const Fibre& f : r.fibres)
    if (f.type != 1) values.push_back({.value = f.tension_nN, .group = f.type / 2, .cell = f.cell});
  r.expect("clustered.f", clustered_rank_test(values).statistic, kExact);
}

TEST(MixedModel, balanced_cells_give_the_classical_degrees_of_freedom) {
  // one group, the same number in each cell: the mean's variance is that between cells over their number
  std::vector<Observation> data;
  for (int cell = 0; cell < 7; ++cell)
    for (int i = 0; i < 4; ++i)
      data.push_back({.value = std::sin(2.0 * cell) + 0.3 * std::cos(11.0 * (4 * cell + i)), .cell = cell});
  const MixedFit fit = fit_mixed_model(data);
  const Contrast mean = contrast_of(fit, Eigen::VectorXd::Ones(1));
  std::vector<double> cell_means(7, 0);
  for (const Observation& o : data) cell_means[o.cell] += o.value / 4;
  const Description d = describe(cell_means);
  EXPECT_NEAR(mean.estimate, d.mean, 1e-12);
  EXPECT_NEAR(mean.standard_error, *d.standard_deviation / std::sqrt(7.0), 1e-6);
  EXPECT_NEAR(mean.degrees, 6, 1e-3);
}

TEST(MixedModel, one_observation_a_cell_and_kind_is_welchs_test) {
  const std::vector<double> a = {1.2, 2.0, 3.1, 2.2, 1.9}, b = {4.0, 7.5, 2.0, 9.1, 5.5, 6.1};
  std::vector<Observation> data;
  for (const double v : a) data.push_back({.value = v, .cell = static_cast<int>(data.size())});
  for (const double v : b) data.push_back({.value = v, .cell = static_cast<int>(data.size()), .kind = 1, .group = 1});
  const Contrast c = contrast_of(fit_mixed_model(data), Eigen::Vector2d(-1, 1));
  const Description da = describe(a), db = describe(b);
  const double va = *da.standard_deviation * *da.standard_deviation / 5,
               vb = *db.standard_deviation * *db.standard_deviation / 6;
  EXPECT_NEAR(c.standard_error, std::sqrt(va + vb), 1e-6);
  EXPECT_NEAR(c.degrees, (va + vb) * (va + vb) / (va * va / 4 + vb * vb / 5), 1e-3);
}

/// Then all variances are held at zero: the mean is weighted by the errors, which tell how well it is known.
TEST(MixedModel, scatter_that_the_errors_explain_leaves_a_mean_weighted_by_them) {
  const std::vector<double> values = {3.1, 2.9, 3.4, 3.0, 2.8}, errors = {1, 2, 4, 1, 3};
  std::vector<Observation> data;
  double weight = 0, sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    data.push_back({.value = values[i], .error_variance = errors[i] * errors[i], .cell = static_cast<int>(i / 3)});
    weight += 1 / data.back().error_variance;
    sum += values[i] / data.back().error_variance;
  }
  const MixedFit fit = fit_mixed_model(data);
  EXPECT_TRUE(fit.converged);
  EXPECT_EQ(fit.cell_variance, 0);
  EXPECT_EQ(fit.residual_variance[0], 0);
  // what is left of the least scatter, a part in 1e8 of the variance, is far below the errors' squares
  const Contrast mean = contrast_of(fit, Eigen::VectorXd::Ones(1));
  EXPECT_NEAR(mean.estimate, sum / weight, 1e-8);
  EXPECT_NEAR(mean.standard_error, 1 / std::sqrt(weight), 1e-8);
  EXPECT_EQ(mean.degrees, 4);
}

/// Means of skewed samples, whose own-scale intervals hold the truth in 82 to 89 % of cases for four to six cells.
TEST(MixedModel, a_positive_interval_holds_skewed_means_more_often_and_normal_ones_as_often) {
  std::mt19937_64 random(1);
  std::exponential_distribution<double> skewed;
  std::normal_distribution<double> normal(1, 0.2);
  constexpr int kSamples = 4000;
  for (const int n : {2, 4, 6}) {
    int skewed_own = 0, skewed_positive = 0, normal_own = 0, normal_positive = 0;
    const auto count = [&](auto& distribution, int& own, int& positive) {
      std::vector<double> values;
      for (int i = 0; i < n; ++i) values.push_back(distribution(random));
      const Description d = describe(values);
      const Contrast plain = by_students_t(d.mean, *d.standard_deviation / std::sqrt(n), n - 1),
                     changed = with_positive_interval(plain);
      EXPECT_GT(changed.low, 0);
      EXPECT_NEAR(changed.low * changed.high, d.mean * d.mean, 1e-9 * d.mean * d.mean);
      own += plain.low <= 1 && 1 <= plain.high ? 1 : 0;
      positive += changed.low <= 1 && 1 <= changed.high ? 1 : 0;
    };
    for (int k = 0; k < kSamples; ++k) {
      count(skewed, skewed_own, skewed_positive);
      count(normal, normal_own, normal_positive);
    }
    constexpr double kChance = 3 * 0.0035;  // three standard errors of a share of 95 %
    EXPECT_LT(skewed_own, (0.95 - 2 * kChance) * kSamples) << n << " cells: then it is not worth the while";
    EXPECT_GT(skewed_positive, (0.93 - kChance) * kSamples) << n;
    EXPECT_NEAR(normal_positive, 0.95 * kSamples, kChance * kSamples) << n;
    EXPECT_NEAR(normal_positive, normal_own, kChance * kSamples) << n;
  }
}

/// One cell a condition: the conditions' means hold all that the cells differ by.
TEST(MixedModel, what_the_groups_means_take_up_is_no_variance_between_cells) {
  const MixedFit fit = fit_mixed_model(
      {{.value = 1}, {.value = 2}, {.value = 7, .cell = 1, .group = 1}, {.value = 9, .cell = 1, .group = 1}});
  EXPECT_FALSE(fit.cell_variance);
  EXPECT_TRUE(fit.residual_variance[0]);
}

TEST(MixedModel, kinds_without_two_values_in_a_group_have_no_scatter) {
  const MixedFit fit = fit_mixed_model({{.value = 1},
                                        {.value = 2, .cell = 1},
                                        {.value = 1.5, .cell = 2},
                                        {.value = 7, .cell = 2, .kind = 2, .group = 1}});
  ASSERT_EQ(fit.residual_variance.size(), 3u);
  EXPECT_TRUE(fit.residual_variance[0]);
  EXPECT_FALSE(fit.residual_variance[1]);
  EXPECT_FALSE(fit.residual_variance[2]);
}

TEST(MixedModel, what_cannot_be_estimated_is_refused) {
  EXPECT_THROW(fit_mixed_model({{.value = 1}, {.value = 1, .cell = 1}, {.value = 2, .cell = 1, .group = 1}}),
               InvalidData);
  EXPECT_THROW(fit_mixed_model({{.value = 1}, {.value = 2}}), InvalidData);
  EXPECT_THROW(fit_mixed_model({{.value = 1}, {.value = 1, .cell = 1}}), InvalidData);
  EXPECT_THROW(fit_mixed_model({{.value = 1, .group = 1}, {.value = 2, .cell = 1, .group = 1}}), InvalidData);
}

TEST(ClusteredRanks, a_cell_counted_twice_over_changes_nothing) {
  std::vector<ClusteredValue> values = {{1, 0, 0}, {4, 1, 0}, {2, 0, 1}, {3, 1, 2}, {6, 1, 3}, {5, 0, 3}, {7, 1, 4}};
  const TestResult once = clustered_rank_test(values);
  values.insert(values.end(), {{1, 0, 0}, {4, 1, 0}});
  EXPECT_NEAR(clustered_rank_test(values).p_value, once.p_value, 1e-12);
}

TEST(ClusteredRanks, hold_their_level_for_few_cells_that_are_alike) {
  // five cells of six values, no difference between groups: p is even in [0, 1], which F's degrees of freedom decide
  test::Normal normal(1);
  constexpr int kDraws = 8000;
  int n_below_5 = 0, n_below_20 = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<ClusteredValue> values;
    for (int i = 0; i < 30; ++i) values.push_back({normal(), i % 2, i / 6});
    const double p = clustered_rank_test(values).p_value;
    n_below_5 += p < 0.05;
    n_below_20 += p < 0.2;
  }
  // four standard deviations of a share of as many draws
  EXPECT_NEAR(n_below_5 / (1.0 * kDraws), 0.05, 4 * std::sqrt(0.05 * 0.95 / kDraws));
  EXPECT_NEAR(n_below_20 / (1.0 * kDraws), 0.2, 4 * std::sqrt(0.2 * 0.8 / kDraws));
}

TEST(Bootstrap, draws_keep_the_strata_and_the_seed) {
  const auto draws = draw_cells({0, 0, 0, 1, 1}, 50, 3);
  for (const CellWeights& w : draws) {
    EXPECT_EQ(w[0] + w[1] + w[2], 3);
    EXPECT_EQ(w[3] + w[4], 2);
  }
  EXPECT_EQ(draws, draw_cells({0, 0, 0, 1, 1}, 50, 3));
  EXPECT_NE(draws, draw_cells({0, 0, 0, 1, 1}, 50, 4));
}

TEST(Bootstrap, the_interval_of_a_mean_is_students) {
  // 40 cells of one value each: the expanded percentiles give mean ± t s/√n but for the bootstrap's own noise, which is
  // 1/√(2 B p) of a quantile's tail probability: 5 % of the half width at 4000 draws
  std::vector<double> values;
  for (int i = 0; i < 40; ++i) values.push_back(std::sin(7.0 * i));
  std::vector<std::optional<double>> means;
  for (const CellWeights& w : draw_cells(std::vector<int>(40, 0), 4000, 1)) {
    double sum = 0;
    for (std::size_t c = 0; c < 40; ++c) sum += w[c] * values[c] / 40;
    means.emplace_back(sum);
  }
  const Interval interval = *bootstrap_interval(means, 40);
  const Description d = describe(values);
  const double half = 2.0227 * *d.standard_deviation / std::sqrt(40.0);  // t of 39 degrees
  EXPECT_NEAR(interval.low, d.mean - half, 0.07 * half);
  EXPECT_NEAR(interval.high, d.mean + half, 0.07 * half);
}

TEST(Bootstrap, percentiles_make_up_for_few_cells) {
  std::vector<std::optional<double>> even;  // from 0 to 1: the value at a share is the share
  for (int i = 0; i <= 1000; ++i) even.emplace_back(i / 1000.0);
  const Interval interval = *bootstrap_interval(even, 6);
  // Phi(t √(6/5)), t = −2.5706 the 2.5 % point of 5 degrees of freedom, by SciPy: its t and Boost's agree to 1e-9
  EXPECT_NEAR(interval.low, 0.002431803166498854, kExact);
  EXPECT_NEAR(interval.high, 1 - 0.002431803166498854, kExact);
  EXPECT_FALSE(bootstrap_interval(even, 1));
  even.resize(1100);  // a tenth of the draws without the group
  EXPECT_FALSE(bootstrap_interval(even, 6));
}

TEST(Shares, fibres_that_agree_within_cells_count_as_cells) {
  // ten cells of ten fibres, all above or all below: as ten independent observations or fewer
  std::vector<CellCount> cells(10, {.n = 10, .n_with = 0});
  for (int c = 0; c < 4; ++c) cells[c].n_with = 10;
  const Share share = share_over_cells(cells);
  EXPECT_DOUBLE_EQ(share.value, 0.4);
  EXPECT_LE(share.n_effective, 10);
  EXPECT_GT(share.n_effective, 5);
}

TEST(Shares, of_one_fibre_a_cell_vary_as_a_mean_of_as_many_numbers_does) {
  // p (1 − p) / (n − 1), from the squares about the mean; and Student's t in the place of the normal's 1.96
  constexpr int kCells = 6;
  std::vector<CellCount> cells(kCells, {.n = 1, .n_with = 0});
  cells[0].n_with = cells[1].n_with = 1;
  const double t = 2.570582;  // 97.5 % of 5 degrees of freedom, from tables
  EXPECT_NEAR(share_over_cells(cells).n_effective, (kCells - 1) * std::pow(1.959964 / t, 2), 1e-4);
}

/// Were its points as near to each other as to the threshold, they would fill the memory.
TEST(Deconvolution, a_threshold_far_below_all_values_has_them_all_above) {
  EXPECT_NEAR(deconvolved_fraction_above({3, 5, 8}, {0.01, 0.01, 0.01}, 1e-9), 1, 1e-6);
  EXPECT_NEAR(deconvolved_fraction_above({3, 5, 8}, {0.01, 0.01, 0.01}, 1e9), 0, 1e-6);
}

TEST(Deconvolution, finds_the_share_of_two_sharp_values_behind_wide_errors) {
  // three quarters at 6, one at 10; errors of 1.5 put many of the former above 7.5
  std::vector<double> values, errors;
  test::Normal normal(1, 1.5);
  for (int i = 0; i < 2000; ++i) {
    values.push_back(std::max(0.0, (i % 4 != 0 ? 6 : 10) + normal()));
    errors.push_back(1.5 * 1.5);
  }
  EXPECT_GT(share_above(values, 7.5), 0.32);
  EXPECT_NEAR(deconvolved_fraction_above(values, errors, 7.5), 0.25, 0.03);
  const Deconvolved d = deconvolved_moments(values, errors);
  // the variance of 2000 values, 5.25, is known to 5.25 √(2/2000) = 0.17: the root of what is left to 0.05; three of it
  EXPECT_NEAR(d.standard_deviation, 4 * std::sqrt(0.25 * 0.75), 0.15);
}

}  // namespace
}  // namespace mbtfm::statistics
