#include "pipeline/statistics/summaries.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "pipeline/contract/errors.h"
#include "pipeline/report/texts.h"

namespace mbtfm::statistics {
namespace {

std::vector<double> error_variances_of(const std::vector<Observation>& observations) {
  std::vector<double> list;
  for (const Observation& o : observations) list.push_back(o.error_variance);
  return list;
}

Summary plain_summary(const std::string& condition, const std::string& kind, const std::vector<Observation>& own) {
  const std::vector<double> values = values_of(own), errors = error_variances_of(own);
  double error = 0;
  for (const double e : errors) error += e / static_cast<double>(errors.size());
  return {.condition = condition,
          .kind = kind,
          .n_cells = n_cells_of(own),
          .n = static_cast<int>(own.size()),
          .plain = describe(values),
          .typical_error = error > 0 ? std::optional(std::sqrt(error)) : std::nullopt,
          .without_error = own.size() > 1 ? std::optional(deconvolved_moments(values, errors)) : std::nullopt,
          .model = {}};
}

std::optional<Interval> median_interval(std::vector<Observation> own, const std::vector<CellWeights>& draws) {
  std::ranges::sort(own, [](const Observation& a, const Observation& b) { return a.value < b.value; });
  std::vector<std::optional<double>> medians;
  for (const CellWeights& w : draws) {
    double n = 0, seen = 0;
    for (const Observation& o : own) n += w[o.cell];
    // the middle one, or the mean of the middle two, as of the values themselves
    std::optional<double> lower, upper;
    for (std::size_t i = 0; i < own.size() && !upper && n > 0; ++i) {
      seen += w[own[i].cell];
      if (2 * seen >= n && !lower) lower = own[i].value;
      if (2 * seen > n) upper = own[i].value;
    }
    medians.push_back(upper ? std::optional((*lower + *upper) / 2) : std::nullopt);
  }
  return bootstrap_interval(std::move(medians), n_cells_of(own));
}

}  // namespace

std::vector<CellWeights> draw_cells(const Study& study, const StudyParameters& parameters) {
  std::vector<int> condition;
  for (const StudyCell& cell : study.cells) condition.push_back(cell.condition);
  return draw_cells(condition, parameters.bootstrap_draws, parameters.bootstrap_seed);
}

ModelResult model_of(const Sample& sample) {
  if (sample.values.empty()) return {.model = {}, .obstacle = "no value is known"};
  if (n_cells_of(sample.values) < 2)
    return {.model = {}, .obstacle = std::string("there is a single ") + sample.cell_name()};
  std::vector<int> index(static_cast<std::size_t>(sample.n_conditions() * sample.n_kinds()), -1);
  for (const Observation& o : sample.values) index[o.group] = 0;
  int n = 0;
  for (int& i : index) i = i < 0 ? -1 : n++;
  std::vector<Observation> data = sample.values;
  for (Observation& o : data) o.group = index[o.group];
  if (std::ssize(data) == n)
    return {.model = {}, .obstacle = std::string("each needs values of two ") + sample.cells_name()};
  try {
    MixedFit fit = fit_mixed_model(std::move(data));
    if (!fit.converged) return {.model = {}, .obstacle = "the mixed model did not converge"};
    return {.model = SampleModel{.fit = std::move(fit), .index = std::move(index)}};
  } catch (const InvalidData&) {
    return {.model = {}, .obstacle = report::sentence("study.obstacle-no-scatter")};
  }
}

std::vector<Summary> summarise(const Sample& sample, const std::optional<SampleModel>& model,
                               const std::vector<CellWeights>& draws) {
  std::vector<Summary> list;
  for (int condition = 0; condition < sample.n_conditions(); ++condition) {
    for (int kind = 0; kind < sample.n_kinds(); ++kind) {
      const std::vector<Observation> own = sample.of_group(condition, kind);
      if (own.empty()) continue;
      Summary s = plain_summary(sample.conditions[condition], sample.kinds[kind], own);
      CellMean mean;
      for (const Observation& o : own) mean.add(o.cell, o.value);
      s.mean_interval = mean.interval(draws);
      s.median_interval = median_interval(own, draws);
      if (model && s.n_cells > 1) {
        const int g = model->index[sample.group_of(condition, kind)];
        s.model = contrast_of(model->fit, Eigen::VectorXd::Unit(model->fit.mean.size(), g));
        if (sample.is_never_negative) s.model = with_positive_interval(*s.model);
      }
      list.push_back(std::move(s));
    }
  }
  return list;
}

std::vector<Summary> summarise_by_cell(const Sample& sample, const Study& study) {
  std::map<std::pair<int, int>, std::vector<Observation>> groups;
  for (const Observation& o : sample.values) groups[{o.cell, o.kind}].push_back(o);
  std::vector<Summary> list;
  for (const auto& [key, own] : groups) {
    const StudyCell& cell = study.cells[key.first];
    list.push_back(plain_summary(study.conditions[cell.condition], sample.kinds[key.second], own));
    list.back().cell = cell.name;
  }
  return list;
}

std::vector<ShareAbove> shares_above(const Sample& tensions, const std::vector<double>& thresholds_nN) {
  std::vector<ShareAbove> list;
  for (int condition = 0; condition < tensions.n_conditions(); ++condition) {
    for (int kind = 0; kind < tensions.n_kinds(); ++kind) {
      const std::vector<Observation> own = tensions.of_group(condition, kind);
      if (own.empty()) continue;
      for (const double threshold : thresholds_nN) {
        std::map<int, CellCount> counts;
        for (const Observation& o : own) {
          ++counts[o.cell].n;
          counts[o.cell].n_with += o.value > threshold ? 1 : 0;
        }
        std::vector<CellCount> cells;
        for (const auto& [cell, count] : counts) cells.push_back(count);
        list.push_back(
            {.condition = tensions.conditions[condition],
             .kind = tensions.kinds[kind],
             .threshold_nN = threshold,
             .n_cells = static_cast<int>(cells.size()),
             .n = static_cast<int>(own.size()),
             .share = share_over_cells(cells),
             .without_error = deconvolved_fraction_above(values_of(own), error_variances_of(own), threshold)});
      }
    }
  }
  return list;
}

}  // namespace mbtfm::statistics
