/// The three runs of mbtfm-sheet: a sheet under its own contraction, under given tractions, and fitted to beads.
#pragma once

#include "continuum/outlines/rings.h"
#include "continuum/sheet/borders.h"
#include "mbtfm/sheet_stage/parameters.h"
#include "pipeline/contract/effects.h"
#include "pipeline/contract/figures.h"
#include "pipeline/report/stage_page.h"
#include "pipeline/stage/stage.h"
#include "substrate/compliance.h"

namespace mbtfm::sheet_stage {

struct Run {
  Solution solution;
  Figures figures;
  std::vector<Effect> effects;
  std::optional<Balance> balance = {};       ///< with what holds the sheet at cuts; unset: by the solution alone
  std::string fitted = {};                   ///< for the last line
  std::string varied = {};                   ///< what a varying contraction changes
  std::vector<report::Listing> tables = {};  ///< of the page
};

Run run_forward(const Parameters& p, stage::StageContext& context, const Region& region);
Run run_from_traction(const Parameters& p, stage::StageContext& context, const Region& region);
Run run_fit(const Parameters& p, stage::StageContext& context, const Region& region, double usual_outline_error_um);

// what they share

/// Says how thick the sheet is for its width. @returns the effect of the third dimension
Effect third_dimension(stage::StageContext& context, const Material& material, const Region& region);
/// Of the gel; how large the strains are is the sheet's own question.
std::vector<Effect> effects_of(const substrate::Substrate& gel);
/// displacement.csv: what the patches' forces make of the gel's surface.
/// @param points_um  of the file  @param taken_um  where these lie on the gel that is computed
void write_beads(stage::StageContext& context, const substrate::Substrate& model, const Solution& solution,
                 const std::vector<Vec2>& points_um, const std::vector<Vec2>& taken_um);

// The files that all runs of mbtfm-sheet read, and what they mean to a sheet.

Region region_of(const outlines::Rings& rings);

/// Where the sheet adheres: none where that is everywhere.
/// @throws InputError where that is nowhere
std::vector<Polygon> adhesive_area(const Parameters& p, stage::StageContext& context, const Region& sheet);

/// The triangles end at the border of the adhesive area where it lies inside of the sheet.
Region with_borders_of(Region region, const std::vector<Polygon>& adhesive_um);

/// The label image of the cells; lines between them are given to the nearest cell. @throws UsageError without a pixel
/// size
CellLabels read_labels(const Path& file, const std::optional<double>& pixel_um);

// What mbtfm-sheet writes of every run.

/// sheet.csv, traction.csv, sheet.vtu. @returns points that lie outside
std::size_t write_solution(stage::StageContext& context, const Solution& solution);
/// borders.csv and cell_tension.csv. @returns means over all borders, by their length
Figures write_cells(stage::StageContext& context, const Solution& solution, const std::optional<double>& pixel_um);
Figures figures_of(const Solution& solution, const Balance& balance);
/// sheet.html
void write_page(stage::StageContext& context, const Run& done, const Balance& balance);

}  // namespace mbtfm::sheet_stage
