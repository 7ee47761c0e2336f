#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/json.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"

namespace mbtfm::files {

namespace {

/// The one list of the members, for reader and writer.
template <class Summary, class Visit>
void for_each_member(Summary& s, const Visit& visit) {
  visit("relative_l2", s.relative_l2);
  visit("expected_relative_l2", s.expected_relative_l2);
  visit("noise_um", s.noise_um);
  visit("total_force_nN", s.total_force_nN);
  visit("network_force_nN", s.network_force_nN);
  visit("fibre_force_nN", s.fibre_force_nN);
  visit("network_surface_tension_nN_per_um", s.network_surface_tension_nN_per_um);
  visit("n_meshes", s.n_meshes);
  visit("iterations", s.iterations);
  visit("converged", s.converged);
}

nlohmann::ordered_json json_of_parts(const ErrorParts& parts) {
  nlohmann::ordered_json json;
  for_each_part(parts, [&](const char* name, const std::optional<double>& part) {
    json[name] = part ? nlohmann::ordered_json(*part) : nlohmann::ordered_json();
  });
  return json;
}

ErrorParts parts_of(const JsonRecord& record) {
  ErrorParts parts;
  for_each_part(parts, [&](const char* name, auto& part) {
    if (const auto value = record.find(name)) part = value->number();
  });
  return parts;
}

nlohmann::ordered_json json_of_budget(const ErrorBudget& budget, const std::vector<Fibre>& fibres) {
  nlohmann::ordered_json json = {{"fibres", nlohmann::ordered_json::array()}};
  for (const TensionError& t : budget.tensions) {
    nlohmann::ordered_json row = {{"fibre_id", t.fibre_id}, {"type", "network"}, {"tension_nN", t.tension_nN}};
    for (const Fibre& f : fibres)
      if (f.fibre_id == t.fibre_id) row["type"] = name_of(f.type);
    row["parts_nN"] = json_of_parts(t.parts_nN);
    row["total_nN"] = total(t.parts_nN);
    json["fibres"].push_back(row);
  }
  json["total_force"] = {{"total_force_nN", budget.total_force_nN},
                         {"parts_nN", json_of_parts(budget.total_force_parts_nN)},
                         {"total_nN", total(budget.total_force_parts_nN)}};
  if (budget.cut_force) {
    json["cut_force"] = {{"cut_force_nN", budget.cut_force->force_nN},
                         {"parts_nN", json_of_parts(budget.cut_force->parts_nN)},
                         {"total_nN", total(budget.cut_force->parts_nN)}};
  }
  return json;
}

ErrorBudget budget_of(const JsonRecord& record) {
  ErrorBudget budget;
  for (const JsonRecord& row : record.at("fibres").list()) {
    budget.tensions.push_back({.fibre_id = row.at("fibre_id").integer(),
                               .tension_nN = row.at("tension_nN").number(),
                               .parts_nN = parts_of(row.at("parts_nN"))});
  }
  const JsonRecord force = record.at("total_force");
  budget.total_force_nN = force.at("total_force_nN").number();
  budget.total_force_parts_nN = parts_of(force.at("parts_nN"));
  if (const auto cut = record.find("cut_force"))
    budget.cut_force = {.force_nN = cut->at("cut_force_nN").number(), .parts_nN = parts_of(cut->at("parts_nN"))};
  return budget;
}

void read(const JsonRecord& record, double& member) { member = record.number(); }
void read(const JsonRecord& record, int& member) { member = record.integer(); }
void read(const JsonRecord& record, bool& member) { member = record.is_true(); }

}  // namespace

FitSummary read_fit_summary(const Path& file) {
  FitSummary summary;
  const JsonRecord record(file, "a fit summary as mbtfm-fit writes it", "delete it to run the fit again");
  for_each_member(summary, [&](const char* name, auto& member) { read(record.at(name), member); });
  for (const auto& [key, value] : record.members()) {
    const std::string& name = key;  // Clang 14 lets no lambda take a part of a pair
    bool is_named = false;
    for_each_member(summary, [&](const char* known, auto&) { is_named = is_named || name == known; });
    if (name == "error_budget") summary.error_budget = budget_of(value);
    const bool is_figure = !value.json().is_object() && !value.json().is_null();
    if (!is_named && name != "error_budget" && is_figure) summary.more.emplace_back(name, value.figure());
  }
  return summary;
}

void write_fit_summary(const Path& file, const FitSummary& summary, const std::vector<Fibre>& fibres) {
  nlohmann::ordered_json json;
  for_each_member(summary, [&](const char* name, const auto& member) { json[name] = member; });
  for (const auto& [name, value] : summary.more) json[name] = json_of(value);
  if (summary.error_budget) json["error_budget"] = json_of_budget(*summary.error_budget, fibres);
  write_text(file, json_text(json, 2) + "\n");
}

void write_figures(const Path& file, const Figures& figures) {
  write_text(file, json_text(json_of(figures), 2) + "\n");
}

std::optional<ForceOverTime> force_over_time(const Path& cell) {
  const Path file = cell / "4_fit/frames.csv";
  if (!is_own_file(file)) return std::nullopt;
  const CsvTable frames(file);
  ForceOverTime series;
  for (int row = 0; row < frames.n_rows(); ++row) {
    const std::optional<double> force_nN = frames.optional_number(row, "total_force_nN");
    if (!force_nN) {
      ++series.n_without_fit;
      continue;
    }
    if (series.n_frames++ == 0) series.first_nN = *force_nN;
    series.last_nN = *force_nN;
    const double change_nN = *force_nN - series.first_nN;
    if (std::abs(change_nN) > std::abs(series.largest_change_nN)) series.largest_change_nN = change_nN;
  }
  return series.n_frames > 0 ? std::optional(series) : std::nullopt;
}

CellResult read_cell_result(const Path& cell) {
  CellResult result{.fit = read_fit_summary(cell / "4_fit/fit.json")};
  if (result.fit.error_budget) result.total_error_nN = total(result.fit.error_budget->total_force_parts_nN);
  std::map<int, FibreType> types;
  for (const Fibre& fibre : read_fibres(cell / "1_segment/fibres.csv", cell / "1_segment/fibre_points.csv"))
    types[fibre.fibre_id] = fibre.type;
  for (const Tension& tension : read_tensions(cell / "4_fit/tensions.csv")) {
    const auto type = types.find(tension.fibre_id);
    if (type == types.end()) continue;  // the network
    CellResult::OfType& of = result.types[type->second];
    of.mean_nN += (tension.tension_nN - of.mean_nN) / ++of.n;
    ++result.n_fibres;
    result.n_uncertain += is_uncertain(tension);
  }
  result.over_time = force_over_time(cell);
  return result;
}

}  // namespace mbtfm::files
