#include "pipeline/files/sheet_files.h"

#include "pipeline/files/json_record.h"
#include "pipeline/files/own_files.h"

namespace mbtfm::files {
namespace {

Columns<SheetEstimate> part(const char* name, std::optional<double> SheetErrorParts::*of) {
  return {name, member(&SheetEstimate::parts, of), kResultMayLack};
}

}  // namespace

Table<SheetEstimate> sheet_estimate_table() {
  using Row = SheetEstimate;
  return {.file = "sheet_fit.csv",
          .columns = {{"quantity", &Row::quantity},
                      {"part", &Row::part},
                      {"value", &Row::value, kResult},
                      {"sigma", &Row::sigma, kResult},
                      {"low", &Row::low, kResult},
                      {"high", &Row::high, kResult},
                      {"identifiable", &Row::identifiable},
                      part("by_beads", &SheetErrorParts::beads),
                      part("by_motion", &SheetErrorParts::motion),
                      part("by_model", &SheetErrorParts::model),
                      part("by_variation", &SheetErrorParts::variation),
                      part("by_mesh", &SheetErrorParts::mesh),
                      part("by_outline", &SheetErrorParts::outline),
                      part("by_gel", &SheetErrorParts::gel),
                      part("by_substrate", &SheetErrorParts::substrate)}};
}

SheetSummary read_sheet_summary(const Path& folder) {
  const JsonRecord figures(folder / "sheet.json", "the figures of a sheet", "run the stage sheet again");
  SheetSummary s{.estimates = read(folder / "sheet_fit.csv", sheet_estimate_table()),
                 .mean_tension_nN_per_um = figures.at("mean_tension_nN_per_um").number(),
                 .total_force_nN = figures.at("total_force_nN").number(),
                 .area_um2 = figures.at("area_um2").number(),
                 .relative_l2 = figures.at("relative_l2").number(),
                 .expected_relative_l2 = figures.at("expected_relative_l2").number()};
  if (const auto energy = figures.find("strain_energy_fJ")) s.strain_energy_fJ = energy->number();
  return s;
}

OutlineSource source_of_outline(const Path& table) {
  const Path beside = table.parent_path() / "record.json";
  if (!is_own_file(beside)) return OutlineSource::found;
  const JsonRecord record(beside, "a record of mbtfm-segment");
  const std::optional<JsonRecord> figures = record.find("figures");
  if (!figures) return OutlineSource::found;
  if (figures->is_true_or("outline_drawn_by_hand", false)) return OutlineSource::drawn;
  return figures->is_true_or("outline_from_mask", false) ? OutlineSource::mask : OutlineSource::found;
}

}  // namespace mbtfm::files
