/// The three runs of mbtfm-sheet: a sheet under its own contraction, under given tractions, and fitted to beads.
#pragma once

#include "mbtfm/sheet_stage/inputs.h"
#include "pipeline/contract/effects.h"
#include "pipeline/contract/figures.h"
#include "pipeline/report/stage_page.h"
#include "substrate/compliance.h"

namespace mbtfm::sheet_stage {

struct Run {
  Solution solution;
  Figures figures;
  std::vector<Effect> effects;
  std::optional<Balance> balance = {};       ///< with what holds the sheet at cuts; unset: by the solution alone
  std::string told = {};                     ///< for the last line
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

}  // namespace mbtfm::sheet_stage
