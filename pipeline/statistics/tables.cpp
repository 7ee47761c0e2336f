#include <fmt/format.h>

#include <cmath>
#include <map>

#include "pipeline/files/csv.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {
namespace {

files::CsvText& add(files::CsvText& csv, const std::optional<Interval>& interval) {
  return csv.add(interval ? std::optional(interval->low) : std::nullopt)
      .add(interval ? std::optional(interval->high) : std::nullopt);
}

std::string cells_csv(const Study& study) {
  const std::vector<std::string> header = {"cell",
                                           "condition",
                                           "included",
                                           "reason",
                                           "n_adhesions",
                                           "n_fibres",
                                           "n_dorsal",
                                           "n_arc",
                                           "n_ventral",
                                           "cell_area_um2",
                                           "adhesion_area_um2",
                                           "total_force_nN",
                                           "network_force_nN",
                                           "fibre_force_nN",
                                           "network_tension_nN",
                                           "network_surface_tension_nN_per_um",
                                           "relative_l2",
                                           "expected_relative_l2",
                                           "noise_um",
                                           "n_meshes",
                                           "converged",
                                           "findings",
                                           "n_edge"};
  files::CsvText csv(header);
  for (const StudyCell& c : study.cells) {
    std::map<FibreType, int> n_of;
    for (const Fibre& fibre : c.cell.fibres) ++n_of[fibre.type];
    const CellFigures figures = figures_of(c);
    std::optional<double> network_tension;
    for (const Tension& t : c.tensions) {
      if (t.fibre_id == 0) network_tension = t.tension_nN;
    }
    csv.add(c.name).add(study.conditions[static_cast<std::size_t>(c.condition)]).add(1).add("");
    csv.add(static_cast<int>(figures.n_adhesions)).add(static_cast<int>(c.cell.fibres.size()));
    for (const FibreType type : {FibreType::dorsal, FibreType::arc, FibreType::ventral}) csv.add(n_of[type]);
    csv.add(figures.cell_area_um2).add(figures.adhesion_area_um2);
    const auto where_known = [&](double value) { return is_network_known(c) ? std::optional(value) : std::nullopt; };
    csv.add(c.fit.total_force_nN).add(where_known(c.fit.network_force_nN)).add(where_known(c.fit.fibre_force_nN));
    csv.add(network_tension)
        .add(where_known(c.fit.network_surface_tension_nN_per_um))
        .add(c.fit.relative_l2)
        .add(c.fit.expected_relative_l2);
    csv.add(c.fit.noise_um).add(c.fit.n_meshes).add(c.fit.converged ? 1 : 0).add(open_ids(c.findings));
    csv.add(n_of[FibreType::edge]);
    csv.end_row();
  }
  for (const LeftOutCell& c : study.left_out) {
    csv.add(c.name).add(c.condition).add(0).add(c.reason);
    for (std::size_t i = 4; i < header.size(); ++i) csv.add("");
    csv.end_row();
  }
  return csv.str();
}

std::string adhesions_csv(const Study& study) {
  files::CsvText csv({"cell", "condition", "adhesion_id", "x_um", "y_um", "area_um2", "eccentricity", "fx_nN", "fy_nN",
                      "force_nN", "traction_kPa", "sigma_nN", "connected", "origin"});
  for (const StudyCell& c : study.cells) {
    std::map<int, const Adhesion*> by_id;
    for (const Adhesion& adhesion : c.cell.adhesions) by_id[adhesion.adhesion_id] = &adhesion;
    for (const AdhesionForce& force : c.forces) {
      const Adhesion& a = *by_id.at(force.adhesion_id);
      csv.add(c.name).add(study.conditions[static_cast<std::size_t>(c.condition)]).add(a.adhesion_id);
      csv.add(a.position_um.x).add(a.position_um.y).add(a.area_um2).add(a.eccentricity);
      csv.add(force.force_nN.x).add(force.force_nN.y).add(norm(force.force_nN));
      csv.add(norm(force.force_nN) / area_stood_for_um2(a)).add(force.sigma_nN).add(force.connected ? 1 : 0);
      csv.add(name_of(a.origin));
      csv.end_row();
    }
  }
  return csv.str();
}

std::string fibres_csv(const Study& study) {
  files::CsvText csv({"cell", "condition", "fibre_id", "type", "length_um", "width_um", "confidence", "tension_nN",
                      "low_nN", "high_nN", "sigma_nN", "identifiable"});
  for (const StudyCell& c : study.cells) {
    std::map<int, const Tension*> tension;
    for (const Tension& t : c.tensions) tension[t.fibre_id] = &t;
    for (const Fibre& fibre : c.cell.fibres) {
      const auto t = tension.find(fibre.fibre_id);
      if (t == tension.end()) continue;
      csv.add(c.name).add(study.conditions[static_cast<std::size_t>(c.condition)]).add(fibre.fibre_id);
      csv.add(name_of(fibre.type)).add(length_um(fibre.points_um)).add(fibre.width_um).add(fibre.confidence);
      csv.add(t->second->tension_nN).add(t->second->low_nN).add(t->second->high_nN);
      csv.add(standard_error_nN(*t->second)).add(t->second->identifiable ? 1 : 0);
      csv.end_row();
    }
  }
  return csv.str();
}

void add_summary(files::CsvText& csv, const Summary& s) {
  csv.add(s.n_cells).add(s.n).add(s.plain.mean);
  add(csv, s.mean_interval);
  csv.add(s.model ? std::optional(s.model->estimate) : std::nullopt);
  add(csv, s.model ? std::optional(Interval{s.model->low, s.model->high}) : std::nullopt);
  csv.add(s.plain.median);
  add(csv, s.median_interval);
  csv.add(s.plain.standard_deviation).add(s.typical_error);
  csv.add(s.without_error ? std::optional(s.without_error->standard_deviation) : std::nullopt);
}

/// Columns of add_summary; `unit` begins with an underscore or is empty.
std::vector<std::string> summary_columns(const std::string& counted, const std::string& unit) {
  std::vector<std::string> list = {"n_cells", "n_" + counted};
  for (const char* name : {"mean", "mean_low", "mean_high", "model_mean", "model_low", "model_high", "median",
                           "median_low", "median_high", "sd", "typical_error", "sd_without_error"}) {
    list.push_back(name + unit);
  }
  return list;
}

std::string types_csv(const Study& study, const Analysis& analysis) {
  std::vector<std::string> header = {"condition", "cell", "type"};
  for (const std::string& column : summary_columns("fibres", "_nN")) header.push_back(column);
  std::vector<double> thresholds;
  for (const ShareAbove& s : analysis.shares) {
    if (std::find(thresholds.begin(), thresholds.end(), s.threshold_nN) != thresholds.end()) continue;
    thresholds.push_back(s.threshold_nN);
    for (const char* what : {"", "_low", "_high", "_without_error"})
      header.push_back(fmt::format("fraction_above_{:g}_nN{}", s.threshold_nN, what));
  }
  files::CsvText csv(header);
  for (const Summary& s : analysis.tensions.summaries) {
    csv.add(s.condition).add("all").add(s.kind);
    add_summary(csv, s);
    for (const ShareAbove& share : analysis.shares) {
      if (share.condition != s.condition || share.kind != s.kind) continue;
      csv.add(share.share.value).add(share.share.interval.low).add(share.share.interval.high).add(share.without_error);
    }
    csv.end_row();
  }
  const Sample& sample = analysis.tensions.sample;
  for (const Summary& s : analysis.tensions_by_cell) {
    csv.add(s.condition).add(s.cell).add(s.kind);
    add_summary(csv, s);
    for (const double threshold : thresholds) {
      int n = 0;
      for (const Observation& o : sample.values) {
        n += study.cells[static_cast<std::size_t>(o.cell)].name == s.cell && o.value > threshold &&
             sample.kinds[static_cast<std::size_t>(o.kind)] == s.kind;
      }
      csv.add(static_cast<double>(n) / s.n).add("").add("").add("");
    }
    csv.end_row();
  }
  return csv.str();
}

std::string summaries_csv(const Analysis& analysis) {
  std::vector<std::string> header = {"quantity", "condition", "kind"};
  for (const std::string& column : summary_columns("observations", "")) header.push_back(column);
  files::CsvText csv(header);
  for (const Measure* m : analysis.measures()) {
    for (const Summary& s : m->summaries) {
      csv.add(m->sample.column).add(s.condition).add(s.kind);
      add_summary(csv, s);
      csv.end_row();
    }
  }
  return csv.str();
}

/// The scatter between cells, between the kinds of a cell and within them.
std::string variances_csv(const Analysis& analysis) {
  files::CsvText csv({"quantity", "component", "standard_deviation", "remark"});
  for (const Measure* m : analysis.measures()) {
    const auto row = [&](const std::string& component, const std::optional<double>& variance) {
      const char* remark = m->model ? "too few values to tell it from the others" : m->obstacle.c_str();
      csv.add(m->sample.column).add(component).add(variance ? std::optional(std::sqrt(*variance)) : std::nullopt);
      csv.add(variance ? *variance > 0 ? "" : "no more than the errors explain" : remark).end_row();
    };
    const MixedFit fit = m->model ? m->model->fit : MixedFit{};
    row("cell", fit.cell_variance);
    row("kind in a cell", fit.cell_kind_variance);
    for (std::size_t k = 0; k < m->sample.kinds.size(); ++k)
      row("within: " + m->sample.kinds[k], k < fit.residual_variance.size() ? fit.residual_variance[k] : std::nullopt);
  }
  return csv.str();
}

std::string tests_csv(const Analysis& analysis) {
  files::CsvText csv({"quantity", "question", "within", "test", "unit", "group_a", "group_b", "n_a", "n_b", "cells_a",
                      "cells_b", "statistic", "degrees_of_freedom", "p", "p_holm", "effect", "effect_is", "effect_low",
                      "effect_high"});
  for (const Measure* m : analysis.measures()) {
    for (const Comparison& t : m->comparisons) {
      const bool is_pair = !t.group_b.empty();
      csv.add(t.column)
          .add(name_of(t.question))
          .add(t.within)
          .add(name_of(t.test))
          .add(name_of(t.unit))
          .add(t.group_a)
          .add(t.group_b);
      csv.add(t.n_a).add(is_pair ? std::optional(t.n_b) : std::nullopt);
      csv.add(t.cells_a).add(is_pair ? std::optional(t.cells_b) : std::nullopt);
      csv.add(t.statistic).add(t.degrees).add(t.p_value).add(t.p_holm);
      csv.add(t.effect_name.empty() ? std::nullopt : std::optional(t.effect)).add(t.effect_name);
      add(csv, t.interval).end_row();
    }
  }
  return csv.str();
}

std::string correlations_csv(const Analysis& analysis) {
  files::CsvText csv({"force", "size", "condition", "n_cells", "slope", "slope_error", "slope_low", "slope_high", "r"});
  for (const Correlation& c : analysis.correlations) {
    csv.add(c.force).add(c.size).add(c.condition).add(c.line.n).add(c.line.slope).add(c.line.slope_error);
    add(csv, c.slope_interval).add(c.line.correlation).end_row();
  }
  return csv.str();
}

std::string area_bins_csv(const Analysis& analysis) {
  files::CsvText csv({"condition", "connected", "area_low_um2", "area_high_um2", "n_cells", "n_adhesions",
                      "mean_area_um2", "mean_force_nN", "low_nN", "high_nN"});
  for (const AreaBin& b : analysis.area_bins) {
    csv.add(b.condition).add(b.is_connected ? 1 : 0).add(b.low_um2).add(b.high_um2).add(b.n_cells).add(b.n_adhesions);
    csv.add(b.mean_area_um2).add(b.mean_force_nN);
    add(csv, b.interval_nN).end_row();
  }
  return csv.str();
}

std::string directions_csv(const Study& study) {
  files::CsvText csv({"cell", "condition", "relation", "adhesion_id", "fibre_id", "angle_deg"});
  for (const StudyCell& c : study.cells) {
    for (const Direction& d : c.directions) {
      csv.add(c.name).add(study.conditions[static_cast<std::size_t>(c.condition)]).add(name_of(d.relation));
      csv.add(d.adhesion_id).add(d.fibre_id).add(d.angle_deg).end_row();
    }
  }
  return csv.str();
}

std::string direction_means_csv(const Analysis& analysis) {
  files::CsvText csv({"relation", "condition", "n_cells", "n", "mean_angle_deg", "low_deg", "high_deg", "chance_deg",
                      "mean_cosine", "cosine_low", "cosine_high"});
  for (const DirectionSummary& s : analysis.directions) {
    csv.add(name_of(s.relation)).add(s.condition).add(s.n_cells).add(s.n).add(s.mean_angle_deg);
    add(csv, s.angle_interval_deg).add(largest_angle_deg(s.relation) / 2).add(s.mean_cosine);
    add(csv, s.cosine_interval).end_row();
  }
  return csv.str();
}

}  // namespace

namespace {

std::string findings_csv(const Study& study) {
  files::CsvText csv({"cell", "condition", "id", "severity", "number", "threshold", "text"});
  for (const StudyCell& c : study.cells) {
    for (const Finding& f : c.findings) {
      csv.add(c.name).add(study.conditions[static_cast<std::size_t>(c.condition)]).add(f.id).add(name_of(f.severity));
      csv.add(f.number).add(f.threshold).add(f.text).end_row();
    }
  }
  return csv.str();
}

}  // namespace

std::vector<std::pair<std::string, std::string>> tables_of(const Study& study, const Analysis& analysis) {
  return {{"cells.csv", cells_csv(study)},
          {"findings.csv", findings_csv(study)},
          {"adhesions.csv", adhesions_csv(study)},
          {"fibres.csv", fibres_csv(study)},
          {"types.csv", types_csv(study, analysis)},
          {"tests.csv", tests_csv(analysis)},
          {"summaries.csv", summaries_csv(analysis)},
          {"variances.csv", variances_csv(analysis)},
          {"correlations.csv", correlations_csv(analysis)},
          {"adhesion_bins.csv", area_bins_csv(analysis)},
          {"directions.csv", directions_csv(study)},
          {"direction_means.csv", direction_means_csv(analysis)}};
}

}  // namespace mbtfm::statistics
