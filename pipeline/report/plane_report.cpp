/// The page of a cell with fibres on a flat gel.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/json.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/report/kinds.h"
#include "pipeline/report/maps.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"
#include "pipeline/report/results.h"
#include "pipeline/report/stage_page.h"
#include "pipeline/report/tensions.h"
#include "pipeline/report/texts.h"

namespace mbtfm::report {
namespace {

/// A file of the cell as it lies in its folder.
Download file_of(const CellResults& results, const std::string& file) {
  const fs::path path = results.folder / file;
  return {results.name + "_" + path.filename().string(), files::read_text(path)};
}

std::string tension_section(const CellResults& results) {
  std::string charts = figure(tension_plot(results), sentence("cell.tensions-chart"), tension_plot_legend(results));
  constexpr std::size_t kFitOneRow = 20;
  if (results.cell.fibres.size() > kFitOneRow) charts = "<div class=\"tall\">" + charts + "</div>\n";
  if (const auto chart = tensions_by_type(results)) charts += figure(*chart, sentence("cell.types-chart"));
  return section("Tensions", "<div class=\"grid\">\n" + charts + html_of(network_map(results)) +
                                 html_of(contracted_network_map(results)) + "</div>\n" +
                                 html_of(tension_table(results), file_of(results, "4_fit/tensions.csv")) +
                                 tension_notes(results));
}

std::string map_section(const CellResults& results) {
  std::string html = "<p class=\"sub screen\">" + sentence("cell.mouse") + "</p><div class=\"grid\">\n" +
                     html_of(segmentation_map(results));
  if (results.bead_images)
    for (const Figure& map : bead_maps(results)) html += html_of(map);
  html += html_of(adhesion_map(results));
  const bool has_usual = results.usual_method && results.usual_method->obstacle.empty();
  if (has_usual) html += html_of(usual_method_map(results));
  for (const Figure& map : displacement_maps(results)) html += html_of(map);
  if (results.cell.fibres.empty()) html += html_of(contracted_network_map(results));
  html += "</div>\n";
  if (results.usual_method && !has_usual) html += note("cell.no-fttc", html_escaped(results.usual_method->obstacle));
  return section("Maps", html + note("cell.axes"));
}

std::string adhesion_section(const CellResults& results) {
  const auto by_id = adhesions_by_id(results.cell);
  std::vector<AdhesionForce> forces = results.forces;
  std::ranges::stable_sort(
      forces, [](const AdhesionForce& a, const AdhesionForce& b) { return norm(a.force_nN) > norm(b.force_nN); });
  Table all{"Forces of the adhesions",
            {number("adhesion"), number("force (nN)"), number("std. error (nN)"), number("Fx (nN)"), number("Fy (nN)"),
             number("traction (kPa)"), number("area (µm²)"), number("x (µm)"), number("y (µm)"), "fibre ends on it"}};
  const bool is_some_assumed = has_assumed(results.cell);
  if (is_some_assumed) all.columns.push_back("seen");
  for (const AdhesionForce& force : forces) {
    const Adhesion& adhesion = *by_id.at(force.adhesion_id);
    const double magnitude = norm(force.force_nN);
    const std::optional<int> decimals = decimals_for(force.sigma_nN);
    all.rows.push_back({std::to_string(force.adhesion_id), rounded(magnitude, decimals),
                        rounded(force.sigma_nN, decimals), rounded(force.force_nN.x, decimals),
                        rounded(force.force_nN.y, decimals), rounded(magnitude / area_stood_for_um2(adhesion), 2),
                        rounded(area_stood_for_um2(adhesion), 2), fmt::format("{:.1f}", adhesion.position_um.x),
                        fmt::format("{:.1f}", adhesion.position_um.y), force.connected ? "yes" : "no"});
    if (is_some_assumed)
      all.rows.back().push_back(is_assumed(adhesion.origin) ? "no: " + std::string(name_of(adhesion.origin)) : "yes");
  }
  constexpr std::size_t kTop = 12;  // fits a screen
  const Table top{"The strongest of the adhesions",
                  all.columns,
                  {all.rows.begin(), all.rows.begin() + std::min(kTop, all.rows.size())}};
  const Balance balance = balance_of(results);
  std::string html = paragraph("cell.balance", top.rows.size(), all.rows.size(), power_of_ten(balance.net_force),
                               power_of_ten(balance.net_torque),
                               balance.has_moments ? "" : " " + sentence("cell.balance-without-moments"));
  if (has_origin(results.cell, AdhesionOrigin::candidate)) html += note("cell.candidates");
  html += html_of(top, file_of(results, "4_fit/adhesion_forces.csv"));
  if (all.rows.size() > kTop) html += folded(fmt::format("All {} adhesions", all.rows.size()), html_of(all));
  return section("Forces of the adhesions", html);
}

std::string figure_pairs(const CellResults& results) {
  const FitSummary& fit = results.fit;
  std::vector<std::pair<std::string, std::string>> pairs = {
      {"relative L2", readable(fit.relative_l2)},
      {"relative L2 expected of the noise", readable(fit.expected_relative_l2)},
      {"noise of a displacement component (nm)", readable(1000 * fit.noise_um)},
      {"total force (nN)", readable(fit.total_force_nN)},
      {"force of the network (nN)", readable(fit.network_force_nN)},
      {"force of the fibres (nN)", readable(fit.fibre_force_nN)},
      {"meshes", std::to_string(fit.n_meshes)},
      {"iterations", std::to_string(fit.iterations)},
      {"converged", fit.converged ? "yes" : "no"}};
  for (const auto& [name, value] : fit.more) pairs.emplace_back(name, text_of_figure(value));
  return html_of_pairs("The fit in numbers", pairs);
}

/// "Over 6 frames the total force goes from 6 nN to 71 nN; …"
std::string sentence_of(const files::ForceOverTime& s) {
  std::string text = sentence("cell.series", counted(s.n_frames, "frames"), readable(s.first_nN), readable(s.last_nN),
                              readable(s.largest_change_nN));
  if (s.n_without_fit > 0) text += " " + counted(s.n_without_fit, "frames") + " could not be fitted.";
  return text;
}

/// Of a time series; empty for a cell of one frame.
std::string series_section(const fs::path& cell) {
  const std::optional<files::ForceOverTime> series = files::force_over_time(cell);
  if (!series) return "";
  const fs::path picture = cell / "4_fit/tracks.svg", animation = cell / "4_fit/series.png";
  constexpr std::uintmax_t kMost_bytes = 20'000'000;  // more would make the page slow
  std::string moving;
  if (files::is_own_file(animation) && fs::file_size(animation) < kMost_bytes)
    moving = "<figure><img alt=\"The frames in turn\" style=\"width:100%\" src=\"" +
             data_address(animation, "image/png") +
             "\"><figcaption>The frames in turn (<code>4_fit/series.png</code>).</figcaption></figure>\n";
  return section("Over time", paragraph("cell.series-files", html_escaped(sentence_of(*series))) + moving +
                                  (files::is_own_text(picture) ? files::read_text(picture) : std::string()));
}

std::string of_the_gel(const Gel& gel) {
  return sentence("cell.methods-gel", readable(gel.youngs_modulus_kPa), readable(gel.poisson_ratio),
                  readable(gel.thickness_um));
}

/// Beads in the area that they cover.
std::string of_the_beads(const CellResults& results) {
  DisplacementField used = results.displacement;
  std::erase_if(used, [](const Bead& bead) { return !bead.flag.empty(); });
  const double density = beads_per_um2(used);
  std::string text = fmt::format("Displacements were known at {} beads", used.size());
  if (density > 0) text += fmt::format(" ({} per µm²)", readable(density));
  return text + fmt::format(", with a noise of {} nm for each component.", readable(1000 * results.fit.noise_um));
}

std::string of_the_fit(const CellResults& results) {
  const FitSummary& fit = results.fit;
  const bool is_ensemble = fit.n_meshes > 1;
  return sentence("cell.methods-fit", results.network.links.size(), results.cell.fibres.size(),
                  results.cell.adhesions.size(), results.tensions.size(),
                  is_ensemble ? sentence("cell.methods-meshes", fit.n_meshes) + " " : "",
                  is_ensemble ? " and the spread between the meshes" : "", readable(fit.relative_l2),
                  readable(fit.expected_relative_l2));
}

std::string effects_that_are_on(const Provenance& provenance) {
  std::string list;
  std::set<std::string> named;  // stages share effects
  for (const EffectLine& effect : provenance.effects)
    if (effect.is_on && named.insert(effect.name).second) list += (list.empty() ? "" : ", ") + effect.name;
  return list.empty() ? "" : " Effects that were computed: " + list + ".";
}

/// With the numbers of this cell.
std::string methods(const CellResults& results, const Provenance& provenance) {
  return sentence("cell.methods", program_of(provenance), of_the_gel(results.gel), of_the_beads(results),
                  of_the_fit(results), effects_that_are_on(provenance));
}

/// A quantity with its standard error and what each source adds to it; in squares these add up.
struct BudgetLine {
  std::optional<int> fibre_id = {};  ///< none: a sum of forces; 0: the actin network
  std::string type = {};             ///< of the fibre, or the sum's name
  double value_nN = 0, total_nN = 0;
  /// source, standard error; none where it is not known
  std::vector<std::pair<std::string, std::optional<double>>> parts_nN = {};
};

std::vector<BudgetLine> lines_of(const ErrorBudget& budget, const std::vector<Fibre>& fibres) {
  std::vector<BudgetLine> lines;
  const auto add = [&](std::optional<int> fibre_id, const std::string& type, double value_nN, const ErrorParts& parts) {
    BudgetLine& line = lines.emplace_back(BudgetLine{fibre_id, type, value_nN, total(parts)});
    for_each_part(parts, [&](const char* source, const std::optional<double>& part) {
      line.parts_nN.emplace_back(source, part);
    });
  };
  for (const TensionError& t : budget.tensions) {
    const auto fibre = std::ranges::find(fibres, t.fibre_id, &Fibre::fibre_id);
    add(t.fibre_id, fibre == fibres.end() ? "network" : mbtfm::name_of(fibre->type), t.tension_nN, t.parts_nN);
  }
  add({}, "total force", budget.total_force_nN, budget.total_force_parts_nN);
  if (budget.cut_force) add({}, "force through the cut", budget.cut_force->force_nN, budget.cut_force->parts_nN);
  return lines;
}

std::string name_of(const BudgetLine& line) {
  if (!line.fibre_id) return line.type;
  return *line.fibre_id == 0 ? "network" : fmt::format("{} {}", line.type, *line.fibre_id);
}

/// The sources' colours, in the order of the parts.
const char* colour(std::size_t i) { return charts::kColours[i % std::size(charts::kColours)]; }

std::string share_text(const BudgetLine& line, const std::string& source, double part_nN) {
  return fmt::format("{}: {} ± {} nN\n{}: {} nN, {:.0f} % of the squared error", name_of(line), readable(line.value_nN),
                     readable(line.total_nN), source, readable(part_nN),
                     100 * part_nN * part_nN / (line.total_nN * line.total_nN));
}

/// A bar as long as the standard error, each source's piece by its share of the square.
charts::Chart chart_of(const std::vector<BudgetLine>& lines) {
  double longest = 0;
  std::vector<std::string> names;
  for (const BudgetLine& line : lines) {
    longest = std::max(longest, line.total_nN);
    names.push_back(name_of(line));
  }
  charts::Chart chart("Where the errors come from",
                      {"standard error of the tension (nN)", 0, longest > 0 ? 1.03 * longest : 1},
                      charts::row_axis(names));
  constexpr double kRow_px = 19;
  chart.frame_height(kRow_px * static_cast<double>(lines.size()));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    double from_nN = 0;
    for (std::size_t k = 0; k < lines[i].parts_nN.size(); ++k) {
      const auto& [source, part_nN] = lines[i].parts_nN[k];
      if (!part_nN || !(*part_nN > 0) || !(lines[i].total_nN > 0)) continue;
      const double to_nN = from_nN + *part_nN * *part_nN / lines[i].total_nN;
      const double row = static_cast<double>(i);
      chart.bar({from_nN, row - 0.33}, {to_nN, row + 0.33}, std::string("fill:") + colour(k),
                share_text(lines[i], source, *part_nN));
      from_nN = to_nN;
    }
  }
  if (!lines.empty())
    for (std::size_t k = 0; k < lines.front().parts_nN.size(); ++k)
      chart.key(lines.front().parts_nN[k].first, colour(k));
  return chart;
}

/// A chart and a table; empty where the fit states no budget.
std::string error_budget_html(const CellResults& results) {
  if (!results.fit.error_budget) return {};
  const std::vector<BudgetLine> budget = lines_of(*results.fit.error_budget, results.cell.fibres);
  std::vector<BudgetLine> fibres;
  std::string csv = "fibre_id,type,value_nN,total_nN", columns = "fibre_id: fibre, type: of, value_nN, total_nN";
  for (const auto& [source, part] : budget.front().parts_nN) {
    csv += "," + source + "_nN";
    columns += ", " + source + "_nN";
  }
  for (const BudgetLine& line : budget) {
    // the network's tension is that of a cable, hundreds of times smaller
    if (line.fibre_id && *line.fibre_id > 0) fibres.push_back(line);
    csv += fmt::format("\n{},{},{},{}", line.fibre_id ? std::to_string(*line.fibre_id) : "", line.type,
                       shortest(line.value_nN), shortest(line.total_nN));
    for (const auto& [source, part] : line.parts_nN) csv += "," + (part ? shortest(*part) : std::string());
  }
  std::ranges::stable_sort(fibres, std::ranges::greater(), &BudgetLine::total_nN);
  return "<div class=\"grid\">" + figure(chart_of(fibres), sentence("cell.error-chart")) + "</div>\n" +
         folded("Error budget in numbers",
                html_of(Listing{"Error budget", {}, results.name + "_error_budget.csv", csv + "\n", columns}));
}

}  // namespace

CellPage page_in_plane(const Path& cell, const Provenance& provenance) {
  const CellResults results = read_results(cell);
  std::string body = results.cell.fibres.empty() ? std::string() : tension_section(results);
  body += series_section(cell) + map_section(results) + adhesion_section(results);
  if (results.fit.error_budget) body += section("Error budget", error_budget_html(results));
  return {.name = results.name,
          .what = sentence("cell.subtitle"),
          .sub = sentence("cell.gel", readable(results.gel.youngs_modulus_kPa), readable(results.gel.poisson_ratio),
                          readable(results.gel.thickness_um)),
          .facts = facts_of(results),
          .body = body,
          .methods = methods(results, provenance),
          .figures = folded("Figures of the fit", figure_pairs(results))};
}

Result result_in_plane(const Path& cell, const Path& report) {
  const files::CellResult result = files::read_cell_result(cell);
  std::string line = "total force " + with_error(result.fit.total_force_nN, result.total_error_nN, "nN");
  std::string tensions;
  for (const auto& [type, of] : result.types)
    tensions += (tensions.empty() ? "; mean tension: " : ", ") + std::string(name_of(type)) + " " +
                readable(of.mean_nN) + " nN (" + std::to_string(of.n) + ")";
  line += tensions;
  if (result.n_fibres > 0)
    line += "; " + std::to_string(result.n_uncertain) + " of " + std::to_string(result.n_fibres) + " uncertain";
  if (const std::optional<files::ForceOverTime>& series = result.over_time)
    line += "; over " + counted(series->n_frames, "frames") + " from " + readable(series->first_nN) + " to " +
            readable(series->last_nN) + " nN";
  nlohmann::ordered_json event = {{"event", "result"},
                                  {"total_force_nN", result.fit.total_force_nN},
                                  {"total_force_error_nN", files::json_of(result.total_error_nN)},
                                  {"mean_tension_nN", nlohmann::ordered_json::object()},
                                  {"fibres", result.n_fibres},
                                  {"uncertain", result.n_uncertain},
                                  {"report", report.string()}};
  for (const auto& [type, of] : result.types) event["mean_tension_nN"][name_of(type)] = of.mean_nN;
  return {line, files::json_text(event) + "\n"};
}

}  // namespace mbtfm::report
