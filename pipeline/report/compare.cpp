#include "pipeline/report/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/polyline.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/own_files.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/space_results.h"
#include "pipeline/report/stage_page.h"
#include "pipeline/report/texts.h"

namespace mbtfm::report {
namespace {

constexpr const char* kSheetTruth = "truth/sheet.csv";

double sum_of_magnitudes(const std::vector<AdhesionForce>& forces) {
  double sum = 0;
  for (const AdhesionForce& force : forces) sum += norm(force.force_nN);
  return sum;
}

/// Index of the true fibre by found fibre.
std::map<int, int> partners(const std::vector<Fibre>& found, const std::vector<Fibre>& truth, bool by_place) {
  std::map<int, int> partner;
  if (by_place)
    for (const FibreMatch& match : match_fibres(found, truth)) partner[match.found_index] = match.true_index;
  else
    for (std::size_t i = 0; i < found.size(); ++i) partner[static_cast<int>(i)] = static_cast<int>(i);
  return partner;
}

void add_figures(Comparison& comparison) {
  double error2 = 0, truth2 = 0;
  for (const ComparedFibre& fibre : comparison.fibres) {
    if (fibre.truth && length_um(fibre.truth->points_um) > kLongFibre_um) {
      ++comparison.n_long;
      if (fibre.found && fibre.found->type == fibre.truth->type) ++comparison.n_long_found_and_typed;
    }
    if (!fibre.tension || !fibre.true_tension_nN) continue;
    ++comparison.n_matched;
    error2 += std::pow(fibre.tension->tension_nN - *fibre.true_tension_nN, 2);
    truth2 += std::pow(*fibre.true_tension_nN, 2);
  }
  comparison.relative_error = truth2 > 0 ? std::sqrt(error2 / truth2) : 0;
}

std::string label(const std::optional<Fibre>& fibre) { return fibre ? std::to_string(fibre->fibre_id) : "–"; }

/// Mean over a's length of the distance from b: midpoints of pieces no longer than step_um, weighted by length.
double directed_distance_um(const Polyline& a, const Polyline& b, double step_um) {
  double sum = 0, length = 0;
  for (std::size_t i = 1; i < a.size(); ++i) {
    const double piece = norm(a[i] - a[i - 1]);
    const int n = std::max(1, static_cast<int>(std::ceil(piece / step_um)));
    for (int k = 0; k < n; ++k) sum += piece / n * distance_to_line_um(b, a[i - 1] + (k + 0.5) / n * (a[i] - a[i - 1]));
    length += piece;
  }
  return sum / length;
}

}  // namespace

double line_distance_um(const Polyline& a, const Polyline& b, double step_um) {
  return std::max(directed_distance_um(a, b, step_um), directed_distance_um(b, a, step_um));
}

std::vector<FibreMatch> match_fibres(const std::vector<Fibre>& found, const std::vector<Fibre>& truth) {
  // Two lines further apart on average are different fibres: about the spacing of bundles that one can resolve, and it
  // admits a fibre that was followed over 60 % of its length or more (a 10 um long one that lacks 4 um at an end is
  // 0.4 · 2 um = 0.8 um away).
  constexpr double kLargestDistance_um = 1.5, kStep_um = 0.25;
  std::vector<FibreMatch> candidates;
  for (int i = 0; i < static_cast<int>(found.size()); ++i) {
    for (int k = 0; k < static_cast<int>(truth.size()); ++k) {
      const double distance = line_distance_um(found[i].points_um, truth[k].points_um, kStep_um);
      if (distance <= kLargestDistance_um) candidates.push_back({i, k, distance});
    }
  }
  std::ranges::sort(candidates, [](const FibreMatch& a, const FibreMatch& b) {
    return std::tie(a.distance_um, a.found_index, a.true_index) < std::tie(b.distance_um, b.found_index, b.true_index);
  });
  std::vector<bool> is_found_taken(found.size()), is_true_taken(truth.size());
  std::vector<FibreMatch> matches;
  for (const FibreMatch& candidate : candidates) {
    if (is_found_taken[candidate.found_index] || is_true_taken[candidate.true_index]) continue;
    is_found_taken[candidate.found_index] = is_true_taken[candidate.true_index] = true;
    matches.push_back(candidate);
  }
  return matches;
}

bool has_truth(const fs::path& cell) { return files::is_own_file(cell / "truth/tensions.csv"); }

Comparison compare_with_truth(const fs::path& cell) {
  files::check_cell_folder(cell);
  if (!has_truth(cell))
    throw InputError((cell / "truth/tensions.csv").string(), "the true tensions of a simulated cell", "none",
                     "compare is for cells that mbtfm-simulate or mbtfm demo made");
  if (!files::is_own_file(cell / "4_fit/tensions.csv"))
    throw InputError(cell.string(), "a cell that was run", "no 4_fit/tensions.csv", "mbtfm run " + cell.string());
  const std::vector<Fibre> found =
      files::read_fibres(cell / "1_segment/fibres.csv", cell / "1_segment/fibre_points.csv");
  const bool by_place = files::is_own_file(cell / "truth/fibres.csv");
  const std::vector<Fibre> truth =
      by_place ? files::read_fibres(cell / "truth/fibres.csv", cell / "truth/fibre_points.csv") : found;

  std::map<int, Tension> tension;
  for (const Tension& t : files::read_tensions(cell / "4_fit/tensions.csv")) tension[t.fibre_id] = t;
  std::map<int, double> true_tension_nN;
  for (const Tension& t : files::read_tensions(cell / "truth/tensions.csv")) true_tension_nN[t.fibre_id] = t.tension_nN;
  const auto truth_of = [&](int fibre_id) {
    const auto t = true_tension_nN.find(fibre_id);
    return t == true_tension_nN.end() ? std::nullopt : std::optional(t->second);
  };
  Comparison comparison{.network = tension[0], .true_network_nN = truth_of(0)};
  const std::map<int, int> partner = partners(found, truth, by_place);
  std::vector<bool> is_true_found(truth.size());
  for (int i = 0; i < static_cast<int>(found.size()); ++i) {
    ComparedFibre& fibre = comparison.fibres.emplace_back(ComparedFibre{.found = found[i]});
    if (const auto t = tension.find(found[i].fibre_id); t != tension.end()) fibre.tension = t->second;
    if (const auto p = partner.find(i); p != partner.end()) {
      is_true_found[p->second] = true;
      fibre.truth = truth[p->second];
      fibre.true_tension_nN = truth_of(fibre.truth->fibre_id);
    }
  }
  for (std::size_t k = 0; k < truth.size(); ++k)
    if (!is_true_found[k])
      comparison.fibres.push_back({.truth = truth[k], .true_tension_nN = truth_of(truth[k].fibre_id)});
  add_figures(comparison);
  comparison.total_force_nN = files::read_fit_summary(cell / "4_fit/fit.json").total_force_nN;
  if (files::is_own_file(cell / "truth/adhesion_forces.csv"))
    comparison.true_total_force_nN = sum_of_magnitudes(files::read_adhesion_forces(cell / "truth/adhesion_forces.csv"));
  return comparison;
}

namespace {

/// Each quantity of truth/sheet.csv that the fit has.
ComparedNumbers numbers_of_sheet(const fs::path& cell) {
  const files::CsvTable truth(cell / kSheetTruth), found(cell / "3_sheet/sheet_fit.csv");
  ComparedNumbers all;
  for (int i = 0; i < truth.n_rows(); ++i)
    for (int k = 0; k < found.n_rows(); ++k)
      if (found.text(k, "quantity") == truth.text(i, "quantity") && found.text(k, "part").empty())
        all.numbers.push_back({truth.text(i, "quantity"), found.optional_number(k, "value"),
                               found.optional_number(k, "low"), found.optional_number(k, "high"),
                               truth.number(i, "value")});
  return all;
}

ComparedNumbers numbers_in_space(const fs::path& cell) {
  const SpaceResults results = read_space_results(cell);
  const SpaceMap map = map_of(results), truth = true_space_map(cell);
  ComparedNumber force{.quantity = "total_force_nN",
                       .found = results.number("total_force_nN"),
                       .low = {},
                       .high = {},
                       .truth = truth.total_force_nN};
  constexpr double k95 = 1.96;
  if (const auto sigma = results.find("total_force_sigma_nN")) {
    force.low = *force.found - k95 * *sigma;
    force.high = *force.found + k95 * *sigma;
  }
  return {{force, {"largest_traction_kPa", largest_kPa(map), {}, {}, largest_kPa(truth)}},
          fmt::format("tractions over the surface: |t - truth| / |truth| = {:.2f}", difference(map, truth))};
}

}  // namespace

ComparedNumbers compare_numbers(const fs::path& cell) {
  if (files::is_own_file(cell / kSheetTruth)) return numbers_of_sheet(cell);
  return has_space_truth(cell) ? numbers_in_space(cell) : ComparedNumbers{};
}

std::string truth_section(const fs::path& cell) {
  const ComparedNumbers compared = compare_numbers(cell);
  if (compared.numbers.empty()) return {};
  Table table{"Beside the truth",
              {"quantity", number("found"), number("low"), number("high"), number("truth"), number("error (%)")}};
  for (const ComparedNumber& n : compared.numbers)
    table.rows.push_back({heading_of(n.quantity), rounded(n.found, {}), rounded(n.low, {}), rounded(n.high, {}),
                          rounded(n.truth, {}),
                          n.found && n.truth != 0 ? with_sign(100 * (*n.found / n.truth - 1), 1) : "–"});
  return section("Beside the truth", paragraph("cell.truth-is-known") + html_of(table) + "<p>" +
                                         html_escaped(capitalised(compared.note)) + "</p>\n");
}

std::string comparison_text(const fs::path& cell) {
  const std::string report = "\nreport: " + (cell / "report.html").string() + "\n";
  if (const ComparedNumbers compared = compare_numbers(cell); !compared.numbers.empty()) {
    constexpr const char* kNumbers = "{:<36} {:>9} {:>9} {:>9} {:>9}\n";
    std::string text = fmt::format(fmt::runtime(kNumbers), "quantity", "found", "low", "high", "truth");
    for (const ComparedNumber& n : compared.numbers)
      text += fmt::format(fmt::runtime(kNumbers), n.quantity, rounded(n.found, {}), rounded(n.low, {}),
                          rounded(n.high, {}), rounded(n.truth, {}));
    return text + (compared.note.empty() ? "" : "\n" + compared.note) + report;
  }
  const Comparison comparison = compare_with_truth(cell);
  constexpr const char* kRow = "{:>5}  {:>5}  {:<12} {:<8} {:>9} {:>9} {:>9} {:>9}\n";
  std::string text =
      fmt::format(fmt::runtime(kRow), "fibre", "true", "type", "true", "tension", "low", "high", "truth");
  text += fmt::format(fmt::runtime(kRow), "id", "id", "", "type", "nN", "nN", "nN", "nN");
  text += fmt::format(fmt::runtime(kRow), 0, 0, "network", "network", rounded(comparison.network.tension_nN, {}),
                      rounded(comparison.network.low_nN, {}), rounded(comparison.network.high_nN, {}),
                      rounded(comparison.true_network_nN, {}));
  for (const ComparedFibre& fibre : comparison.fibres) {
    const Tension t = fibre.tension.value_or(Tension{});
    text += fmt::format(fmt::runtime(kRow), label(fibre.found), label(fibre.truth),
                        fibre.found ? name_of(fibre.found->type) : "–", fibre.truth ? name_of(fibre.truth->type) : "–",
                        fibre.tension ? rounded(t.tension_nN, {}) : "–", rounded(t.low_nN, {}), rounded(t.high_nN, {}),
                        rounded(fibre.true_tension_nN, {}));
  }
  text += fmt::format("\ntensions of the {} fibres found: |t - truth| / |truth| = {:.3f}\n", comparison.n_matched,
                      comparison.relative_error);
  if (comparison.n_long > 0) {
    text += fmt::format("true fibres longer than {:g} um: {} of {} found and typed right ({:.0f} %)\n", kLongFibre_um,
                        comparison.n_long_found_and_typed, comparison.n_long,
                        100.0 * comparison.n_long_found_and_typed / comparison.n_long);
  }
  text += fmt::format("total force: {:.1f} nN", comparison.total_force_nN);
  if (comparison.true_total_force_nN) {
    text += fmt::format(", truth {:.1f} nN ({:+.1f} %)", *comparison.true_total_force_nN,
                        100 * (comparison.total_force_nN / *comparison.true_total_force_nN - 1));
  }
  return text + report;
}

}  // namespace mbtfm::report
