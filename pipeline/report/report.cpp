#include "pipeline/report/report.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/version.h"
#include "pipeline/files/hash.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/report/kinds.h"
#include "pipeline/report/page.h"
#include "pipeline/report/texts.h"

namespace mbtfm::report {

// view_in_paraview.py and view_in_paraview_3d.py, made into C++ by the build
extern const std::string_view kParaviewScript, kParaviewScriptInSpace;

namespace {

/// What a report of a kind of cell takes.
struct OfKind {
  const char* last_file;                   ///< of the last stage
  const std::string_view* view = nullptr;  ///< script for ParaView; none: it shows the files as they are
  CellPage (*page)(const Path& cell, const Provenance& provenance);
  Result (*result)(const Path& cell, const Path& report);
};
const OfKind& of(CellKind kind) {
  static constexpr std::array<OfKind, 3> kAll = {
      {{"4_fit/fit.json", &kParaviewScript, page_in_plane, result_in_plane},
       {"4_traction/traction.json", &kParaviewScriptInSpace, page_in_space, result_in_space},
       {"3_sheet/sheet.json", nullptr, page_of_sheet, result_of_sheet}}};
  return kAll.at(static_cast<std::size_t>(kind));
}

std::string effects_table(const Provenance& provenance, bool is_on) {
  Table table{is_on ? "Effects that were computed" : "Effects that are off", {"effect", "stage", "why"}};
  if (is_on) table.columns.push_back(number("seconds"));
  for (const EffectLine& effect : provenance.effects) {
    if (effect.is_on != is_on) continue;
    table.rows.push_back({html_escaped(effect.name), html_escaped(effect.stage), printed(effect.why)});
    if (is_on) table.rows.back().push_back(effect.seconds);
  }
  if (table.rows.empty()) return {};
  return is_on ? "<h3>Effects</h3>\n" + html_of(table)
               : folded(counted(table.rows.size(), "effect that is off", "effects that are off"), html_of(table));
}

/// Stages, effects, parameters. @param figures  HTML, of the last stage
std::string provenance_section(const Provenance& provenance, const std::string& figures) {
  Table stages{"Stages", {"stage", "state", "result", number("seconds"), number("memory (MB)"), "version"}};
  for (const StageLine& stage : provenance.stages) {
    stages.rows.push_back({html_escaped(stage.name), html_escaped(stage.state),
                           printed(stage.summary.empty() ? stage.why : stage.summary), stage.seconds,
                           stage.peak_memory_MB, html_escaped(stage.version)});
  }
  std::string html = html_of(stages);
  if (!provenance.started.empty())
    html += fmt::format("<p class=\"sub\">Run by mbtfm {} from {} to {} on {}.</p>\n", html_escaped(provenance.version),
                        html_escaped(provenance.started), html_escaped(provenance.ended),
                        html_escaped(provenance.processor));
  if (!provenance.preset.empty()) html += note("cell.preset", html_escaped(provenance.preset));
  html += effects_table(provenance, true) + effects_table(provenance, false) + figures;
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

bool has_results(const fs::path& cell) { return files::is_own_file(cell / of(kind_of(cell)).last_file); }

std::string report_html(const fs::path& cell) {
  const Provenance provenance = read_provenance(cell / "run.json");
  const CellPage of_cell = of(provenance.kind).page(cell, provenance);
  const std::string methods = "<p class=\"cite\">" + html_escaped(of_cell.methods) + "</p>\n";
  return html_of(Page{.title = of_cell.name,
                      .what = of_cell.what,
                      .sub = of_cell.sub,
                      .body = findings_section(of_cell.facts, provenance) + of_cell.body +
                              section("For your methods section", methods) +
                              provenance_section(provenance, of_cell.figures)});
}

void update_report(const fs::path& cell) {
  files::check_cell_folder(cell);
  if (const std::string_view* view = of(kind_of(cell)).view) {
    const fs::path script = cell / "view_in_paraview.py";
    if (!files::is_own_text(script) || files::read_text(script) != *view)
      files::write_whole(script, std::string(*view));
  }
  const fs::path file = cell / "report.html";
  const std::string signature = "<!-- made from " + fingerprint(cell) + " -->\n";
  if (files::is_own_text(file) && files::read_text(file).ends_with(signature)) return;
  files::write_whole(file, report_html(cell) + signature);
}

std::string result_line(const Path& cell) { return of(kind_of(cell)).result(cell, {}).line; }

std::string result_event(const Path& cell, const Path& report) { return of(kind_of(cell)).result(cell, report).event; }

}  // namespace mbtfm::report
