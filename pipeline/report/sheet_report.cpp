/// The page of a cell or colony that is fitted as a contracting sheet.
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "pipeline/files/json.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/sheet_files.h"
#include "pipeline/files/text.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/kinds.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"
#include "pipeline/report/stage_page.h"
#include "pipeline/report/texts.h"

namespace mbtfm::report {
namespace {

struct SheetResults {
  std::string name;
  files::JsonRecord figures;
  std::vector<SheetEstimate> estimates;
  double number(const char* figure) const { return figures.at(figure).number(); }
};

SheetResults read_sheet(const fs::path& cell) {
  const fs::path folder = cell / "3_sheet";
  return {fs::weakly_canonical(cell).filename().string(),
          files::JsonRecord(folder / "sheet.json", "the figures of a sheet", "run the stage sheet again"),
          files::read(folder / "sheet_fit.csv", files::sheet_estimate_table())};
}

std::vector<std::string> facts_of(const SheetResults& r) {
  return {"Fitted to the beads: " + r.figures.at("fitted").text() + ". In brackets: 95 % intervals.",
          sentence("sheet.mean-tension", readable(r.number("mean_tension_nN_per_um")), readable(r.number("area_um2")),
                   readable(r.number("total_force_nN"))),
          sentence("sheet.misfit", readable(r.number("relative_l2")), readable(r.number("expected_relative_l2")))};
}

/// A parameter of the stage that fitted the sheet, as run.json has it.
std::string parameter(const Provenance& provenance, const std::string& name) {
  for (const StageLine& stage : provenance.stages) {
    if (stage.name != "sheet") continue;
    for (const auto& [key, value] : stage.parameters)
      if (key == name) return value;
  }
  return "?";
}

std::string methods(const SheetResults& r, const Provenance& provenance) {
  const bool has_motion = parameter(provenance, "effects.common_motion") != "off";
  return sentence("sheet.methods", program_of(provenance), parameter(provenance, "sheet.thickness_um"),
                  parameter(provenance, "sheet.poisson_ratio"), parameter(provenance, "gel.youngs_modulus_kPa"),
                  parameter(provenance, "gel.poisson_ratio"), parameter(provenance, "gel.thickness_um"),
                  r.number("n_triangles"), r.number("n_beads"), has_motion ? sentence("sheet.methods-motion") : "",
                  r.figures.at("fitted").text(), readable(r.number("relative_l2")),
                  readable(r.number("expected_relative_l2")));
}

}  // namespace

std::vector<Listing> tables_of_sheet(const fs::path& estimates, const fs::path& models, const std::string& of) {
  const std::string fit_csv = files::read_text(estimates);
  return {{"What the beads show", sentence("sheet.estimates"), of + "sheet_fit.csv", fit_csv,
           sentence("sheet.columns-of-estimates")},
          {"Does the scene call for the sheet?", sentence("sheet.models"), of + "sheet_models.csv",
           files::read_text(models), sentence("sheet.columns-of-models")},
          {"Where the errors come from", sentence("sheet.error-parts"), of + "sheet_fit.csv", fit_csv,
           sentence("sheet.columns-of-error-parts")}};
}

CellPage page_of_sheet(const Path& cell, const Provenance& provenance) {
  const SheetResults r = read_sheet(cell);
  const Path folder = cell / "3_sheet";
  std::string body =
      section_of_picture("Tension and traction", files::read_text(folder / "sheet.svg"), sentence("sheet.picture")) +
      truth_section(cell);
  for (const Listing& table : tables_of_sheet(folder / "sheet_fit.csv", folder / "sheet_models.csv", r.name + "_"))
    body += section_of(table);
  return {.name = r.name,
          .what = sentence("sheet.subtitle"),
          .sub = provenance.kind_because,
          .facts = facts_of(r),
          .body = body,
          .methods = methods(r, provenance),
          .figures = {}};
}

Result result_of_sheet(const Path& cell, const Path& report) {
  const SheetResults r = read_sheet(cell);
  const double tension = r.number("mean_tension_nN_per_um"), force_nN = r.number("total_force_nN");
  nlohmann::ordered_json event = {{"event", "result"},
                                  {"total_force_nN", force_nN},
                                  {"mean_tension_nN_per_um", tension},
                                  {"estimates", nlohmann::ordered_json::array()},
                                  {"report", report.string()}};
  for (const SheetEstimate& e : r.estimates) {
    nlohmann::ordered_json parts = nlohmann::ordered_json::object();
    for_each_part(e.parts, [&](const char* name, const std::optional<double>& size) {
      if (size) parts[name] = *size;
    });
    event["estimates"].push_back({{"quantity", name_of(e.quantity)},
                                  {"part", e.part},
                                  {"value", e.value},
                                  {"sigma", files::json_of(e.sigma)},
                                  {"low", files::json_of(e.low)},
                                  {"high", files::json_of(e.high)},
                                  {"sigma_parts", parts}});
  }
  return {r.figures.at("fitted").text() + "; mean tension " + readable(tension) + " nN/µm; total force " +
              readable(force_nN) + " nN",
          files::json_text(event) + "\n"};
}

}  // namespace mbtfm::report
