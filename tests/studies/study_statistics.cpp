/// How far the tests and intervals of a study are to be trusted: p-values where nothing differs, coverage of intervals,
/// power, time. Prints tables; figures go to a folder.
/// study_statistics null|power|primary|time [SIMULATIONS] [FOLDER]
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "pipeline/charts/chart.h"
#include "pipeline/files/text.h"
#include "pipeline/statistics/study_files.h"
#include "tests/support/simulated_study.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::statistics;

/// Cells differ as much as the fibres of one do, and types have their own way in each.
test::StudySettings strong_cell_effects(int n_cells, std::uint64_t seed) {
  return {.n_cells = n_cells,
          .n_conditions = 2,
          .types_differ = false,
          .cell_sd_nN = 1,
          .type_in_cell_sd_nN = 0.7,
          .fibre_sd_nN = 1,
          .error_nN = 0.5,
          .seed = seed};
}

std::string name_of_test(const statistics::Comparison& c) {
  if (c.test == Test::mann_whitney)
    return c.unit == statistics::Unit::observation ? "Mann-Whitney, by fibre" : "Mann-Whitney, medians";
  return name_of(c.test);
}

/// p-values of dorsal against ventral (first condition) and of the conditions (ventral fibres), by question and test.
using PValues = std::map<std::pair<std::string, std::string>, std::vector<double>>;

struct Coverage {
  int n = 0, by_model = 0, by_bootstrap = 0;
};

void add_p_values(const statistics::Sample& sample, const std::optional<statistics::SampleModel>& model,
                  PValues& p_values) {
  for (const statistics::Comparison& c : statistics::compare(sample, model)) {
    const bool is_types = c.group_a == "dorsal" && c.group_b == "ventral" && c.within == "a";
    const bool is_conditions =
        c.question == Question::between_conditions && c.within == "ventral" && !c.group_b.empty();
    if (is_types || is_conditions) p_values[{name_of(c.question), name_of_test(c)}].push_back(c.p_value);
  }
}

double share_below(const std::vector<double>& values, double end) {
  int n = 0;
  for (const double v : values) n += v < end ? 1 : 0;
  return static_cast<double>(n) / static_cast<double>(values.size());
}

charts::Chart chart_of(const PValues& p_values, const std::string& question, int n_cells) {
  charts::Chart chart(question + ", " + std::to_string(n_cells) + " cells, no difference",
                      {.label = "p", .low = 0, .high = 1},
                      {.label = "share of the studies with a smaller p", .low = 0, .high = 1.4});
  chart.curve({{0, 0}, {1, 1}}, "stroke:#999;stroke-dasharray:4 3");
  chart.put_key(charts::Chart::KeySide::right);
  int next = 0;
  for (const auto& [key, values] : p_values) {
    if (key.first != question) continue;
    const std::string colour = charts::kColours[next++ % static_cast<int>(std::size(charts::kColours))];
    std::vector<Vec2> curve;
    for (int i = 0; i <= 100; ++i) curve.push_back({0.01 * i, share_below(values, 0.01 * i + 1e-12)});
    chart.curve(curve, "stroke:" + colour + ";stroke-width:1.8");
    chart.key(key.second, colour);
  }
  return chart;
}

void study_null(int n_simulations, const std::string& folder) {
  std::vector<charts::Chart> charts;
  std::printf("%-20s %-26s %8s %10s %10s\n", "question", "test", "cells", "p < 0.05", "p < 0.01");
  for (const int n_cells : {8, 12, 20, 40}) {
    PValues p_values;
    Coverage coverage;
    for (int i = 0; i < n_simulations; ++i) {
      const auto settings = strong_cell_effects(n_cells, 1000 + static_cast<std::uint64_t>(i));
      const statistics::Study study = test::simulated_study(settings);
      const statistics::Sample sample = statistics::sample_tensions(study);
      const auto model = statistics::model_of(sample).model;
      add_p_values(sample, model, p_values);
      const double truth = settings.offset_nN + 2.5;
      for (const statistics::Summary& s :
           statistics::summarise(sample, model, statistics::draw_cells(study, {.bootstrap_draws = 500}))) {
        if (!s.model || !s.mean_interval) continue;
        ++coverage.n;
        coverage.by_model += s.model->low <= truth && truth <= s.model->high ? 1 : 0;
        coverage.by_bootstrap += s.mean_interval->low <= truth && truth <= s.mean_interval->high ? 1 : 0;
      }
    }
    for (const auto& [key, values] : p_values) {
      std::printf("%-20s %-26s %8d %10.3f %10.3f\n", key.first.c_str(), key.second.c_str(), n_cells,
                  share_below(values, 0.05), share_below(values, 0.01));
    }
    std::printf(
        "coverage of the 95 %% intervals of the means, %d cells a condition: mixed model %.3f, bootstrap %.3f\n",
        n_cells / 2, static_cast<double>(coverage.by_model) / coverage.n,
        static_cast<double>(coverage.by_bootstrap) / coverage.n);
    std::fflush(stdout);
    if (n_cells != 12 && n_cells != 40) continue;
    charts.push_back(chart_of(p_values, "between kinds", n_cells));
    charts.push_back(chart_of(p_values, "between conditions", n_cells));
  }
  if (!folder.empty())
    files::write_text(folder + "/p_values.svg",
                      charts::svg_file(charts, 2,
                                       {std::to_string(n_simulations) +
                                        " simulated studies; broken line: what a test that holds its level gives."}));
}

/// How often a difference is found.
void study_power(int n_simulations) {
  std::printf("%-26s %8s %14s %10s\n", "test", "cells", "difference", "p < 0.05");
  for (const int n_cells : {12, 40}) {
    for (const double effect : {1.0, 2.0}) {
      PValues p_values;
      for (int i = 0; i < n_simulations; ++i) {
        auto settings = strong_cell_effects(n_cells, 5000 + static_cast<std::uint64_t>(i));
        settings.condition_effect_nN = effect;
        const statistics::Sample sample = statistics::sample_tensions(test::simulated_study(settings));
        add_p_values(sample, statistics::model_of(sample).model, p_values);
      }
      for (const auto& [key, values] : p_values) {
        if (key.first == "between conditions")
          std::printf("%-26s %8d %11.1f nN %10.3f\n", key.second.c_str(), n_cells, effect, share_below(values, 0.05));
      }
    }
  }
}

void study_time() {
  for (const int n_cells : {100, 300}) {
    auto settings = strong_cell_effects(n_cells, 1);
    settings.mean_fibres_by_type = 7;
    statistics::Study study = test::simulated_study(settings);
    for (statistics::StudyCell& c : study.cells) {  // as many adhesions as the thesis' cells have: 170
      while (c.cell.adhesions.size() < 170) {
        Adhesion a = c.cell.adhesions[c.cell.adhesions.size() % 12];
        AdhesionForce f = c.forces[c.forces.size() % 12];
        a.adhesion_id = f.adhesion_id = static_cast<int>(c.cell.adhesions.size()) + 1;
        a.area_um2 *= 1 + 0.001 * a.adhesion_id;
        f.force_nN = (1 + 0.001 * a.adhesion_id) * f.force_nN;
        c.cell.adhesions.push_back(a);
        c.forces.push_back(f);
      }
    }
    const auto start = std::chrono::steady_clock::now();
    const statistics::StudyParameters parameters;
    const statistics::Analysis analysis = statistics::analyse(study, parameters);
    const auto analysed = std::chrono::steady_clock::now();
    const auto figures = statistics::figures_of(study, analysis, parameters);
    const std::string html = statistics::study_html(study, analysis, figures, parameters, "statistics");
    const std::chrono::duration<double> first = analysed - start, second = std::chrono::steady_clock::now() - analysed;
    std::printf("%d cells, %zu fibres, %zu adhesions: analysis %.1f s, figures and page %.1f s (%zu kB)\n", n_cells,
                analysis.tensions.sample.values.size(), analysis.adhesion_forces.sample.values.size(), first.count(),
                second.count(), html.size() / 1000);
  }
}

/// How often the primary test finds a difference if there is none. 500 simulations tell 5 % to 1 %, and the six figures
/// together stray to 7 % by chance now and then; 10 000 tell it to 0.2 %.
void study_primary(int n_simulations) {
  std::printf("cells,replicates,simulations,p_below_0.05,standard_error\n");
  for (const int n_cells : {8, 12, 24}) {
    for (const bool has_days : {false, true}) {
      int n = 0, n_found = 0;
      for (int k = 0; k < n_simulations; ++k) {
        Study study = test::simulated_study(strong_cell_effects(n_cells, 7000 + static_cast<std::uint64_t>(k)));
        for (std::size_t i = 0; has_days && i < study.cells.size(); ++i)
          study.cells[i].replicate = std::to_string(i % 4);
        const Sample sample = sample_tensions(study);
        const ModelResult model = model_of(sample);
        const auto kind = std::ranges::find(sample.kinds, name_of(FibreType::ventral)) - sample.kinds.begin();
        const Primary primary = primary_of(study, "tension of ventral fibres", sample, static_cast<int>(kind),
                                           model.model, compare(sample, model.model));
        for (const PrimaryDifference& d : primary.differences) ++n, n_found += d.p_holm < 0.05 ? 1 : 0;
      }
      const double share = static_cast<double>(n_found) / n;
      std::printf("%d,%s,%d,%.4f,%.4f\n", n_cells, has_days ? "4" : "none", n, share,
                  std::sqrt(share * (1 - share) / n));
      std::fflush(stdout);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  const int n_simulations = argc > 2 ? std::atoi(argv[2]) : 500;
  if (what == "null") {
    study_null(n_simulations, argc > 3 ? argv[3] : "");
  } else if (what == "power") {
    study_power(n_simulations);
  } else if (what == "primary") {
    study_primary(n_simulations);
  } else if (what == "time") {
    study_time();
  } else {
    std::fprintf(stderr, "study_statistics null|power|primary|time [SIMULATIONS] [FOLDER]\n");
    return 2;
  }
}
