#include "pipeline/statistics/comparisons.h"

#include <algorithm>
#include <map>

#include "pipeline/contract/errors.h"
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

/// Kruskal–Wallis, Mann–Whitney.
void add_rank_tests(const Sample& sample, const Family& family, Unit unit, std::vector<Comparison>& list) {
  std::vector<std::vector<double>> values;
  for (const Group& g : family.groups) values.push_back(values_of(g.values));
  if (family.groups.size() > 2) {
    Comparison all = blank(sample, family, Test::kruskal_wallis, unit, all_of(family.groups), nullptr);
    const TestResult h = kruskal_wallis(values);
    all.statistic = h.statistic;
    all.degrees = static_cast<double>(values.size()) - 1;
    all.p_value = h.p_value;
    all.effect = h.statistic / (all.n_a - 1);
    all.effect_name = "epsilon squared";
    list.push_back(std::move(all));
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (std::size_t k = i + 1; k < values.size(); ++k) {
      Comparison pair = blank(sample, family, Test::mann_whitney, unit, family.groups[i], &family.groups[k]);
      const TestResult u = mann_whitney(values[i], values[k]);
      pair.statistic = u.statistic;
      pair.p_value = u.p_value;
      pair.effect = 2 * u.statistic / (static_cast<double>(pair.n_a) * pair.n_b) - 1;
      pair.effect_name = "rank-biserial correlation";
      list.push_back(std::move(pair));
    }
  }
}

TestResult clustered_test(const std::vector<const Group*>& groups) {
  std::vector<ClusteredValue> values;
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const Observation& o : groups[g]->values)
      values.push_back({.value = o.value, .group = static_cast<int>(g), .cell = o.cell});
  return clustered_rank_test(values);
}

/// Datta & Satten's.
void add_clustered_tests(const Sample& sample, const Family& family, std::vector<Comparison>& list) {
  const auto add = [&](Comparison c, const std::vector<const Group*>& groups) {
    const TestResult f = clustered_test(groups);
    c.statistic = f.statistic;
    c.p_value = f.p_value;
    list.push_back(std::move(c));
  };
  const Group all = all_of(family.groups);
  std::vector<const Group*> pointers;
  for (const Group& g : family.groups) pointers.push_back(&g);
  if (pointers.size() > 2) {
    const double cells = n_cells_of(all.values), q = static_cast<double>(pointers.size()) - 1;
    Comparison c = blank(sample, family, Test::clustered_rank_sum, Unit::cell, all, nullptr);
    c.degrees = cells - q;
    add(std::move(c), pointers);
  }
  for (std::size_t i = 0; i < pointers.size(); ++i) {
    for (std::size_t k = i + 1; k < pointers.size(); ++k) {
      Comparison c = blank(sample, family, Test::clustered_rank_sum, Unit::cell, *pointers[i], pointers[k]);
      c.degrees = n_cells_of(all_of({*pointers[i], *pointers[k]}).values) - 1;
      const double n_pairs = static_cast<double>(c.n_a) * c.n_b;
      c.effect =
          2 * mann_whitney(values_of(pointers[i]->values), values_of(pointers[k]->values)).statistic / n_pairs - 1;
      c.effect_name = "rank-biserial correlation";
      add(std::move(c), {pointers[i], pointers[k]});
    }
  }
}

/// F of all groups, t of each difference.
void add_model_tests(const Sample& sample, const Family& family, const SampleModel& model,
                     std::vector<Comparison>& list) {
  const auto n_groups = static_cast<Eigen::Index>(family.groups.size());
  const auto difference = [&](Eigen::Index a, Eigen::Index b) {
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(model.fit.mean.size());
    const auto index = [&](Eigen::Index g) { return model.index[family.groups[g].index]; };
    weights[index(a)] += 1;
    weights[index(b)] -= 1;
    return weights;
  };
  if (n_groups > 2) {
    Eigen::MatrixXd contrasts(n_groups - 1, model.fit.mean.size());
    for (Eigen::Index g = 1; g < n_groups; ++g) contrasts.row(g - 1) = difference(g, 0);
    const FTest f = test_all_zero(model.fit, contrasts);
    Comparison all = blank(sample, family, Test::mixed_model, Unit::cell, all_of(family.groups), nullptr);
    all.statistic = f.f;
    all.degrees = f.denominator_degrees;
    all.p_value = f.p_value;
    list.push_back(std::move(all));
  }
  for (Eigen::Index i = 0; i < n_groups; ++i) {
    for (Eigen::Index k = i + 1; k < n_groups; ++k) {
      Comparison pair = blank(sample, family, Test::mixed_model, Unit::cell, family.groups[i], &family.groups[k]);
      const Contrast c = contrast_of(model.fit, difference(i, k));
      pair.statistic = c.t;
      pair.degrees = c.degrees;
      pair.p_value = c.p_value;
      pair.effect = c.estimate;
      pair.effect_name = "difference of means" + (sample.unit.empty() ? "" : " (" + sample.unit + ")");
      pair.interval = Interval{c.low, c.high};
      list.push_back(std::move(pair));
    }
  }
}

/// Run one kind of test and correct its pairs. What cannot be tested (all values equal, too few cells) is left out.
template <class Add>
void add_corrected(std::vector<Comparison>& list, Add&& add_tests) {
  std::vector<Comparison> tests;
  try {
    add_tests(tests);
  } catch (const InvalidData&) {
    return;
  }
  std::vector<double> p_values;
  for (const Comparison& c : tests)
    if (!c.group_b.empty()) p_values.push_back(c.p_value);
  const std::vector<double> corrected = holm(p_values);
  std::size_t next = 0;
  for (Comparison& c : tests) {
    if (!c.group_b.empty()) c.p_holm = corrected[next++];
    list.push_back(std::move(c));
  }
}

Family with_medians(Family family) {
  for (Group& g : family.groups) g.values = medians_by_cell(g.values);
  std::erase_if(family.groups, [](const Group& g) { return g.values.size() < 2; });
  return family;
}

std::vector<Family> families_of(const Sample& sample) {
  std::vector<Family> families;
  for (int c = 0; c < sample.n_conditions() && sample.n_kinds() > 1; ++c) {
    Family family{.question = Question::between_kinds, .within = sample.conditions[c]};
    for (int k = 0; k < sample.n_kinds(); ++k)
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
    add_corrected(list, [&](auto& tests) {
      add_rank_tests(sample, family, is_one_a_cell ? Unit::cell : Unit::observation, tests);
    });
    if (!is_one_a_cell) {
      const Family medians = with_medians(family);
      if (medians.groups.size() > 1)
        add_corrected(list, [&](auto& tests) { add_rank_tests(sample, medians, Unit::cell_median, tests); });
      add_corrected(list, [&](auto& tests) { add_clustered_tests(sample, family, tests); });
    }
    const bool has_cells = std::ranges::all_of(family.groups, [](const Group& g) { return n_cells_of(g.values) > 1; });
    if (model && has_cells) add_corrected(list, [&](auto& tests) { add_model_tests(sample, family, *model, tests); });
  }
  return list;
}

}  // namespace mbtfm::statistics
