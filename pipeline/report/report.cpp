#include "pipeline/report/report.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/version.h"
#include "pipeline/files/base64.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/hash.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/report/error_budget.h"
#include "pipeline/report/findings.h"
#include "pipeline/report/maps.h"
#include "pipeline/report/methods.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"
#include "pipeline/report/provenance.h"
#include "pipeline/report/results.h"
#include "pipeline/report/sheet_report.h"
#include "pipeline/report/space_report.h"
#include "pipeline/report/tension_plot.h"
#include "pipeline/report/tension_table.h"

namespace mbtfm::report {

// view_in_paraview.py and view_in_paraview_3d.py, made into C++ by the build
extern const std::string_view kParaviewScript, kParaviewScriptInSpace;

namespace {

/// A file of the cell as it lies in its folder.
Download file_of(const CellResults& results, const std::string& file) {
  const fs::path path = results.folder / file;
  return {results.name + "_" + path.filename().string(), files::read_text(path)};
}

std::string by_type(const CellResults& results) {
  const auto chart = tensions_by_type(results);
  if (!chart) return {};
  return figure(*chart, "Each mark is a fibre; the line is the mean of its type. Hollow: not identifiable.");
}

std::string tension_section(const CellResults& results) {
  return section("Tensions", "<div class=\"grid\">\n" +
                                 figure(tension_plot(results),
                                        "By type, the strongest first. The interval holds the bead noise and, if "
                                        "several meshes were fitted, the spread between them.",
                                        tension_plot_legend(results)) +
                                 by_type(results) + html_of(network_map(results, NetworkForm::original)) + "</div>\n" +
                                 html_of(tension_table(results), file_of(results, "4_fit/tensions.csv")) +
                                 tension_notes(results));
}

/// Why the usual method has no map.
std::string usual_method_note(const CellResults& results) {
  if (!results.usual_method || results.usual_method->obstacle.empty()) return {};
  return "<p class=\"sub\">The usual method (FTTC) has no answer for these beads: " +
         html_escaped(results.usual_method->obstacle) + ".</p>\n";
}

std::string map_section(const CellResults& results) {
  std::string html =
      "<p class=\"sub screen\">Rest the mouse on something to read about it. Ctrl and wheel, or the buttons, zoom; "
      "dragging moves; a double click shows all again.</p><div class=\"grid\">\n" +
      html_of(segmentation_map(results));
  if (results.bead_images) html += html_of(bead_map(results));
  html += html_of(adhesion_map(results));
  if (results.usual_method && results.usual_method->obstacle.empty()) html += html_of(usual_method_map(results));
  for (const Figure& map : displacement_maps(results)) html += html_of(map);
  html += html_of(network_map(results, NetworkForm::contracted));
  return section("Maps", html + "</div>\n" + usual_method_note(results) +
                             "<p class=\"sub\">Axes: x to the right, y down, as in the image; origin at the outer "
                             "corner of its top left pixel.</p>");
}

std::string adhesion_section(const CellResults& results) {
  const auto by_id = adhesions_by_id(results.cell);
  std::vector<AdhesionForce> forces = results.forces;
  std::ranges::stable_sort(
      forces, [](const AdhesionForce& a, const AdhesionForce& b) { return norm(a.force_nN) > norm(b.force_nN); });
  Table all{{number("adhesion"), number("force (nN)"), number("std. error (nN)"), number("Fx (nN)"), number("Fy (nN)"),
             number("traction (kPa)"), number("area (µm²)"), number("x (µm)"), number("y (µm)"), "fibre ends on it"},
            {},
            "Forces of the adhesions"};
  const bool has_assumed = std::ranges::any_of(by_id, [](const auto& a) { return is_assumed(a.second->origin); });
  const bool are_candidates =
      std::ranges::any_of(by_id, [](const auto& a) { return a.second->origin == AdhesionOrigin::candidate; });
  if (has_assumed) all.columns.push_back("seen");
  for (const AdhesionForce& force : forces) {
    const Adhesion& adhesion = *by_id.at(force.adhesion_id);
    const double magnitude = norm(force.force_nN);
    const bool has_error = force.sigma_nN && *force.sigma_nN > 0;
    const std::optional<int> decimals = has_error ? std::optional(decimals_for(*force.sigma_nN)) : std::nullopt;
    all.rows.push_back({std::to_string(force.adhesion_id), rounded(magnitude, decimals),
                        rounded(force.sigma_nN, decimals), rounded(force.force_nN.x, decimals),
                        rounded(force.force_nN.y, decimals), rounded(magnitude / area_stood_for_um2(adhesion), 2),
                        rounded(area_stood_for_um2(adhesion), 2), fmt::format("{:.1f}", adhesion.position_um.x),
                        fmt::format("{:.1f}", adhesion.position_um.y), force.connected ? "yes" : "no"});
    if (has_assumed)
      all.rows.back().push_back(is_assumed(adhesion.origin) ? "no: " + std::string(name_of(adhesion.origin)) : "yes");
  }
  constexpr std::size_t kTop = 12;  // fits a screen
  Table top{all.columns,
            {all.rows.begin(), all.rows.begin() + std::min(kTop, all.rows.size())},
            "The strongest of the adhesions"};
  const Balance balance = balance_of(results);
  std::string html = fmt::format(
      "<p>The {} strongest of {}. Balance: the sum of all forces is {} of the sum of their magnitudes, that of their "
      "torques {}{}.</p>\n",
      top.rows.size(), all.rows.size(), power_of_ten(balance.net_force), power_of_ten(balance.net_torque),
      balance.has_moments ? "" : " (without the moments inside single adhesions, which are not in the table)");
  if (are_candidates)
    html +=
        "<p class=\"sub\">Candidates are places where an adhesion may be. Nobody saw one there: read their tractions "
        "as a traction density (force over the area of a lattice cell), and sums over neighbours rather than single "
        "forces.</p>\n";
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

std::string effects_table(const Provenance& provenance) {
  const bool are_timed =
      std::ranges::any_of(provenance.effects, [](const EffectLine& effect) { return !effect.seconds.empty(); });
  Table table{{"effect", "stage", "on", "why"}, {}, "Effects, and why they are on or off"};
  if (are_timed) table.columns.push_back(number("seconds"));
  for (const EffectLine& effect : provenance.effects) {
    std::vector<std::string> row = {html_escaped(effect.name), html_escaped(effect.stage), effect.is_on ? "on" : "off",
                                    html_escaped(effect.why)};
    if (are_timed) row.push_back(effect.seconds);
    table.rows.push_back(row);
  }
  return html_of(table);
}

/// "Over 6 frames the total force goes from 6 nN to 71 nN; …"
std::string sentence_of(const files::ForceOverTime& s) {
  std::string text = "Over " + counted(s.n_frames, "frames") + " the total force goes from " + readable(s.first_nN) +
                     " nN to " + readable(s.last_nN) + " nN; its largest change from the first frame is " +
                     readable(s.largest_change_nN) + " nN.";
  if (s.n_without_fit > 0) text += " " + counted(s.n_without_fit, "frames") + " could not be fitted.";
  return text;
}

}  // namespace

/// Of a time series; empty for a cell of one frame.
std::string series_section(const fs::path& cell) {
  const std::optional<files::ForceOverTime> series = files::force_over_time(cell);
  if (!series) return "";
  const fs::path picture = cell / "4_fit/tracks.svg", animation = cell / "4_fit/series.png";
  constexpr std::uintmax_t kMost_bytes = 20'000'000;  // more would make the page slow
  std::string moving;
  if (files::is_own_file(animation) && fs::file_size(animation) < kMost_bytes)
    moving = "<figure><img alt=\"The frames in turn\" style=\"width:100%\" src=\"data:image/png;base64," +
             files::base64(files::read_text(animation)) +
             "\"><figcaption>The frames in turn (<code>4_fit/series.png</code>).</figcaption></figure>\n";
  return section("Over time", "<p>" + html_escaped(sentence_of(*series)) +
                                  " Tables: <code>4_fit/tracks.csv</code> and "
                                  "<code>4_fit/frames.csv</code>. All else on this page is of the first frame.</p>\n" +
                                  moving + (files::is_own_text(picture) ? files::read_text(picture) : std::string()));
}

std::string provenance_section(const Provenance& provenance, const std::string& figures) {
  Table stages{{"stage", "state", "result", number("seconds"), number("memory (MB)"), "version"}, {}, "Stages"};
  for (const StageLine& stage : provenance.stages) {
    stages.rows.push_back({html_escaped(stage.name), html_escaped(stage.state),
                           html_escaped(stage.summary.empty() ? stage.why : stage.summary), stage.seconds,
                           stage.peak_memory_MB, html_escaped(stage.version)});
  }
  std::string html = html_of(stages);
  if (!provenance.started.empty())
    html += fmt::format("<p class=\"sub\">Run by mbtfm {} from {} to {} on {}.</p>\n", html_escaped(provenance.version),
                        html_escaped(provenance.started), html_escaped(provenance.ended),
                        html_escaped(provenance.processor));
  if (!provenance.preset.empty())
    html += fmt::format("<p class=\"sub\">Preset: {}; it holds for all that cell.toml does not set.</p>\n",
                        html_escaped(provenance.preset));
  if (!provenance.effects.empty()) html += "<h3>Effects</h3>\n" + effects_table(provenance);
  html += figures;
  for (const StageLine& stage : provenance.stages) {
    if (!stage.parameters.empty())
      html += folded("Parameters of " + stage.name, html_of_pairs("Parameters of " + stage.name, stage.parameters));
    if (!stage.figures.empty())
      html += folded("Figures of " + stage.name, html_of_pairs("Figures of " + stage.name, stage.figures));
    if (!stage.inputs.empty())
      html += folded("Inputs of " + stage.name + " (SHA-256)", html_of_pairs("Inputs of " + stage.name, stage.inputs));
  }
  return section("How it was computed", html);
}

namespace {

/// Of the program's version and all that the report shows: the outputs of the stages, the truth, cell.toml, and which
/// preset or accuracy was asked for.
std::string fingerprint(const fs::path& cell) {
  std::vector<fs::path> files = {cell / "cell.toml"};
  for (const char* folder :
       {"1_segment", "2_track", "3_network", "4_fit", "3_surface", "4_traction", "3_sheet", "truth"}) {
    if (!files::is_folder(cell / folder)) continue;
    for (const fs::directory_entry& entry : fs::directory_iterator(cell / folder))
      if (files::is_own_file(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  const Provenance provenance = read_provenance(cell / "run.json");
  std::string all =
      std::string(kVersion) + " " + provenance.preset + " " + (provenance.accuracy ? provenance.accuracy->verdict : "");
  for (const fs::path& file : files)
    all += "\n" + file.lexically_relative(cell).generic_string() + " " + files::sha256_of_file(file);
  return files::sha256(all);
}

}  // namespace

CellKind kind_of(const fs::path& cell) { return read_provenance(cell / "run.json").kind; }

bool has_results(const fs::path& cell) {
  switch (kind_of(cell)) {
    case CellKind::plane:
      return files::is_own_file(cell / "4_fit/fit.json");
    case CellKind::space:
      return files::is_own_file(cell / "4_traction/traction.json");
    case CellKind::sheet:
      return files::is_own_file(cell / "3_sheet/sheet.json");
  }
  throw InternalError("unknown kind of cell");
}

std::string report_html(const fs::path& cell) {
  const Provenance provenance = read_provenance(cell / "run.json");
  if (provenance.kind == CellKind::space) return report_in_space(cell);
  if (provenance.kind == CellKind::sheet) return report_of_sheet(cell);
  const CellResults results = read_results(cell);
  const std::string head = fmt::format(
      "<h1>{}</h1><p class=\"what\">Tensions of the stress fibres and forces of the adhesions of one cell, by "
      "model-based traction force microscopy</p>\n<p class=\"sub\">Gel: Young’s modulus {} kPa, Poisson’s ratio {}, {} "
      "µm thick · mbtfm {}</p>\n",
      html_escaped(results.name), readable(results.gel.youngs_modulus_kPa), readable(results.gel.poisson_ratio),
      readable(results.gel.thickness_um), kVersion);
  std::string body = findings_section(facts_of(results), provenance);
  if (!results.cell.fibres.empty()) body += tension_section(results);
  body += series_section(cell) + map_section(results) + adhesion_section(results);
  if (results.fit.error_budget) body += section("Error budget", error_budget_html(results));
  body += section("For your methods section", methods_paragraph(results, provenance)) +
          provenance_section(provenance, folded("Figures of the fit", figure_pairs(results)));
  return page(results.name + " – mbtfm", head, body);
}

void update_report(const fs::path& cell) {
  files::check_cell_folder(cell);
  if (const CellKind kind = kind_of(cell); kind != CellKind::sheet) {  // ParaView shows 3_sheet/sheet.vtu as it is
    const fs::path script = cell / "view_in_paraview.py";
    const std::string view(kind == CellKind::space ? kParaviewScriptInSpace : kParaviewScript);
    if (!files::is_own_text(script) || files::read_text(script) != view) files::write_whole(script, view);
  }
  const fs::path file = cell / "report.html";
  const std::string signature = "<!-- made from " + fingerprint(cell) + " -->\n";
  if (files::is_own_text(file) && files::read_text(file).ends_with(signature)) return;
  files::write_whole(file, report_html(cell) + signature);
}

}  // namespace mbtfm::report
