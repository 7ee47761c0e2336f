#include "pipeline/files/sheet_files.h"

#include "pipeline/files/json_record.h"
#include "pipeline/files/own_files.h"

namespace mbtfm::files {
namespace {

Columns<SheetEstimate> part(const char* name, const char* meaning, std::optional<double> SheetErrorParts::*of) {
  return {name, meaning, member(&SheetEstimate::parts, of), kResultMayLack};
}

}  // namespace

Table<SheetEstimate> sheet_estimate_table() {
  using Row = SheetEstimate;
  return {
      .file = "sheet_fit.csv",
      .row = "each number of a sheet that the beads were asked for (`mbtfm-sheet --displacement`)",
      .columns = {
          {"quantity", "with its unit; stiffness is E h / (1 - nu²)", &Row::quantity},
          {"part",
           "of the sheet, where parts contract each by its own: inside, edge, or a cell of the label image; mean, of a "
           "contraction that varies; or the bundle; else empty",
           &Row::part},
          {"value", "where the misfit is least", &Row::value, kResult},
          {"sigma", "standard error; empty if the beads do not determine the quantity", &Row::sigma, kResult},
          {"low", "lower end of the 95 % interval; empty: none", &Row::low, kResult},
          {"high", "upper end of the 95 % interval; empty: none", &Row::high, kResult},
          {"identifiable", "the beads limit it to both sides", &Row::identifiable},
          part("by_beads",
               "part of sigma by noise of the beads' displacements; the squares of all parts add up to that of sigma",
               &SheetErrorParts::beads),
          part("by_motion", "part by the motion that all beads share; empty: none was allowed for",
               &SheetErrorParts::motion),
          part("by_model", "part by what the sheet leaves of the beads beyond their noise", &SheetErrorParts::model),
          part("by_variation",
               "part by a contraction that varies by 20 % over the sheet, slowly; empty: its variation is fitted",
               &SheetErrorParts::variation),
          part("by_mesh", "part by the sheet's triangles", &SheetErrorParts::mesh),
          part("by_outline", "part by the place of the outline (`outline_error_um`)", &SheetErrorParts::outline),
          part("by_gel",
               "part by the gel's modulus, thickness and Poisson's ratio; empty: no errors of these were given",
               &SheetErrorParts::gel),
          part("by_substrate", "part by what the model leaves out of the gel", &SheetErrorParts::substrate)}};
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
