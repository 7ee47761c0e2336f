/// All that is said of a study: computed once, for the tables, the figures and the report.
#pragma once

#include <string>
#include <vector>

#include "pipeline/statistics/comparisons.h"
#include "pipeline/statistics/primary.h"
#include "pipeline/statistics/relations.h"
#include "pipeline/statistics/summaries.h"

namespace mbtfm::statistics {

/// A sample with what was found of it.
struct Measure {
  Sample sample;
  std::optional<SampleModel> model;
  std::string obstacle = {};  ///< why there is no model; empty: there is one
  std::vector<Summary> summaries = {};
  std::vector<Comparison> comparisons = {};
};

struct Analysis {
  bool has_fibres = true;  ///< some cells have them: else nothing is said of fibres and adhesions on flat gels
  Primary primary;
  Measure tensions;
  std::vector<Summary> tensions_by_cell;
  std::vector<ShareAbove> shares;
  Measure adhesion_forces, adhesion_areas;
  std::vector<Measure> cells = {}, sheets, in_space;
  std::vector<Correlation> correlations;
  std::vector<AreaBin> area_bins;
  std::vector<DirectionSummary> directions;
  std::vector<std::string> warnings;  ///< sentences on what the numbers cannot carry

  /// Those of every sample of which the study has cells: tensions, adhesions, cells, sheets, cells in space.
  std::vector<const Measure*> measures() const;
};

/// What the primary comparison compares; none: no cell of the study has it.
struct PrimaryChoice {
  const Measure* measure = nullptr;
  int kind = 0;      ///< of the measure's sample
  std::string name;  ///< "tension of ventral fibres"
};
PrimaryChoice primary_choice(const Study& study, const Analysis& analysis, const StudyParameters& parameters);

Analysis analyse(const Study& study, const StudyParameters& parameters);

/// "control: ", or nothing where the study has one condition.
std::string prefix_of(const std::string& condition);
/// "ventral", "transverse arc", "connected": a kind as people say it.
std::string kind_for_people(const std::string& kind);

}  // namespace mbtfm::statistics
