/// Tests between kinds (fibre types; connected adhesions or not) and between conditions.
#include <algorithm>
#include <map>

#include "pipeline/contract/errors.h"
#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/rank_tests.h"

namespace mbtfm::statistics {

namespace {

struct Group {
  std::string name;
  int index = 0;  ///< of the sample's groups
  std::vector<Observation> values = {};
};

/// Groups that one question compares.
struct Family {
  Question question = Question::between_kinds;
  std::string within;
  std::vector<Group> groups = {};
};

std::vector<Observation> medians_by_cell(const std::vector<Observation>& observations) {
  std::map<int, std::vector<double>> by_cell;
  for (const Observation& o : observations) by_cell[o.cell].push_back(o.value);
  std::vector<Observation> medians;
  for (const auto& [cell, values] : by_cell) medians.push_back({.value = describe(values).median, .cell = cell});
  return medians;
}

Comparison blank(const Sample& sample, const Family& family, Test test, Unit unit, const Group& a, const Group* b) {
  return {.column = sample.column,
          .question = family.question,
          .within = family.within,
          .test = test,
          .unit = unit,
          .group_a = a.name,
          .group_b = b == nullptr ? "" : b->name,
          .n_a = static_cast<int>(a.values.size()),
          .n_b = b == nullptr ? 0 : static_cast<int>(b->values.size()),
          .cells_a = n_cells_of(a.values),
          .cells_b = b == nullptr ? 0 : n_cells_of(b->values),
          .p_holm = {}};
}

/// All observations of a family as one group, for the line of all groups together.
Group all_of(const std::vector<Group>& groups) {
  Group all{.name = "all"};
  for (const Group& g : groups) all.values.insert(all.values.end(), g.values.begin(), g.values.end());
  return all;
}

/// Run one kind of test, of all groups together if they are three or more and of each pair, and correct the pairs. What
/// cannot be tested (all values equal, too few cells) is left out.
/// @param of_all, of_pair  tests of all groups, of two by their places: statistic, p, effect of a comparison
template <class OfAll, class OfPair>
void add_tests(std::vector<Comparison>& list, const Sample& sample, const Family& family, std::pair<Test, Test> test,
               Unit unit, const OfAll& of_all, const OfPair& of_pair) {
  const std::vector<Group>& groups = family.groups;
  std::vector<Comparison> tests;
  std::vector<double> p_values;
  try {
    if (groups.size() > 2) {
      tests.push_back(blank(sample, family, test.first, unit, all_of(groups), nullptr));
      of_all(tests.back());
    }
    for (std::size_t i = 0; i < groups.size(); ++i) {
      for (std::size_t k = i + 1; k < groups.size(); ++k) {
        // of conditions the later one less the earlier: the reference is the first
        const auto [a, b] = family.question == Question::between_conditions ? std::pair(k, i) : std::pair(i, k);
        tests.push_back(blank(sample, family, test.second, unit, groups[a], &groups[b]));
        of_pair(tests.back(), a, b);
        p_values.push_back(tests.back().p_value);
      }
    }
  } catch (const InvalidData&) {
    return;
  }
  const std::vector<double> corrected = holm(p_values);
  std::size_t next = 0;
  for (Comparison& c : tests) {
    if (!c.group_b.empty()) c.p_holm = corrected[next++];
    list.push_back(std::move(c));
  }
}

void take(Comparison& c, const TestResult& result) {
  c.statistic = result.statistic;
  c.p_value = result.p_value;
}

/// @param u  Mann–Whitney's, of the pair
void take_rank_biserial(Comparison& pair, double u) {
  pair.effect = 2 * u / (static_cast<double>(pair.n_a) * pair.n_b) - 1;
  pair.effect_name = "rank-biserial correlation";
}

/// Kruskal–Wallis, Mann–Whitney.
void add_rank_tests(const Sample& sample, const Family& family, Unit unit, std::vector<Comparison>& list) {
  std::vector<std::vector<double>> values;
  for (const Group& g : family.groups) values.push_back(values_of(g.values));
  const auto of_all = [&](Comparison& all) {
    take(all, kruskal_wallis(values));
    all.degrees = static_cast<double>(values.size()) - 1;
    all.effect = all.statistic / (all.n_a - 1);
    all.effect_name = "epsilon squared";
  };
  const auto of_pair = [&](Comparison& pair, std::size_t i, std::size_t k) {
    take(pair, mann_whitney(values[i], values[k]));
    take_rank_biserial(pair, pair.statistic);
  };
  add_tests(list, sample, family, {Test::kruskal_wallis, Test::mann_whitney}, unit, of_all, of_pair);
}

TestResult clustered_test(const std::vector<Group>& groups) {
  std::vector<ClusteredValue> values;
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const Observation& o : groups[g].values)
      values.push_back({.value = o.value, .group = static_cast<int>(g), .cell = o.cell});
  return clustered_rank_test(values);
}

/// Datta & Satten's.
void add_clustered_tests(const Sample& sample, const Family& family, std::vector<Comparison>& list) {
  const std::vector<Group>& groups = family.groups;
  const auto of_all = [&](Comparison& all) {
    all.degrees = static_cast<double>(all.cells_a) - (static_cast<double>(groups.size()) - 1);
    take(all, clustered_test(groups));
  };
  const auto of_pair = [&](Comparison& pair, std::size_t i, std::size_t k) {
    const std::vector<Group> both = {groups[i], groups[k]};
    pair.degrees = n_cells_of(all_of(both).values) - 1;
    take_rank_biserial(pair, mann_whitney(values_of(both[0].values), values_of(both[1].values)).statistic);
    take(pair, clustered_test(both));
  };
  add_tests(list, sample, family, {Test::clustered_rank_sum, Test::clustered_rank_sum}, Unit::cell, of_all, of_pair);
}

/// F of all groups, t of each difference.
void add_model_tests(const Sample& sample, const Family& family, const SampleModel& model,
                     std::vector<Comparison>& list) {
  const auto difference = [&](std::size_t a, std::size_t b) {
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(model.fit.mean.size());
    weights[model.index[family.groups[a].index]] += 1;
    weights[model.index[family.groups[b].index]] -= 1;
    return weights;
  };
  const auto of_all = [&](Comparison& all) {
    const auto n = static_cast<Eigen::Index>(family.groups.size());
    Eigen::MatrixXd contrasts(n - 1, model.fit.mean.size());
    for (Eigen::Index g = 1; g < n; ++g) contrasts.row(g - 1) = difference(static_cast<std::size_t>(g), 0);
    const FTest f = test_all_zero(model.fit, contrasts);
    take(all, {.statistic = f.f, .p_value = f.p_value});
    all.degrees = f.denominator_degrees;
  };
  const auto of_pair = [&](Comparison& pair, std::size_t i, std::size_t k) {
    const Contrast c = contrast_of(model.fit, difference(i, k));
    take(pair, {.statistic = c.t, .p_value = c.p_value});
    pair.degrees = c.degrees;
    pair.effect = c.estimate;
    pair.effect_name = "difference of means" + (sample.unit.empty() ? "" : " (" + sample.unit + ")");
    pair.interval = Interval{c.low, c.high};
  };
  add_tests(list, sample, family, {Test::mixed_model, Test::mixed_model}, Unit::cell, of_all, of_pair);
}

Family with_medians(Family family) {
  for (Group& g : family.groups) g.values = medians_by_cell(g.values);
  std::erase_if(family.groups, [](const Group& g) { return g.values.size() < 2; });
  return family;
}

std::vector<Family> families_of(const Sample& sample) {
  std::vector<Family> families;
  for (int c = 0; c < sample.n_conditions() && sample.n_compared > 1; ++c) {
    Family family{.question = Question::between_kinds, .within = sample.conditions[c]};
    for (int k = 0; k < sample.n_compared; ++k)
      family.groups.push_back({sample.kinds[k], sample.group_of(c, k), sample.of_group(c, k)});
    families.push_back(std::move(family));
  }
  for (int k = 0; k < sample.n_kinds() && sample.n_conditions() > 1; ++k) {
    Family family{.question = Question::between_conditions, .within = sample.kinds[k]};
    for (int c = 0; c < sample.n_conditions(); ++c)
      family.groups.push_back({sample.conditions[c], sample.group_of(c, k), sample.of_group(c, k)});
    families.push_back(std::move(family));
  }
  for (Family& family : families) std::erase_if(family.groups, [](const Group& g) { return g.values.size() < 2; });
  std::erase_if(families, [](const Family& family) { return family.groups.size() < 2; });
  return families;
}

}  // namespace

std::vector<Comparison> compare(const Sample& sample, const std::optional<SampleModel>& model) {
  const bool is_one_a_cell = sample.is_one_a_cell();
  std::vector<Comparison> list;
  for (const Family& family : families_of(sample)) {
    add_rank_tests(sample, family, is_one_a_cell ? Unit::cell : Unit::observation, list);
    if (!is_one_a_cell) {
      add_rank_tests(sample, with_medians(family), Unit::cell_median, list);
      add_clustered_tests(sample, family, list);
    }
    const bool has_cells = std::ranges::all_of(family.groups, [](const Group& g) { return n_cells_of(g.values) > 1; });
    if (model && has_cells) add_model_tests(sample, family, *model, list);
  }
  return list;
}

}  // namespace mbtfm::statistics
