/// One quantity of a study as a flat list of observations, each with its cell, kind and condition.
#pragma once

#include <string>
#include <vector>

#include "pipeline/statistics/mixed_model.h"
#include "pipeline/statistics/study.h"

namespace mbtfm::statistics {

enum class Observed { fibres, adhesions, cells };
constexpr auto words(Observed) { return std::array{"fibres", "adhesions", "cells"}; }

/// `group` of an observation is condition · n kinds + kind; `cell` is its index in the study.
struct Sample {
  std::string column;      ///< of the tables, with its unit: tension_nN
  std::string name, unit;  ///< for people
  Observed each = Observed::fibres;
  std::vector<std::string> kinds, conditions;
  std::vector<Observation> values;
  int n_without_error = 0;  ///< observations whose error is not known: that of the others is taken, or zero if none is
  bool is_never_negative = true;

  int n_kinds() const { return static_cast<int>(kinds.size()); }
  int n_conditions() const { return static_cast<int>(conditions.size()); }
  int group_of(int condition, int kind) const { return condition * n_kinds() + kind; }
  std::vector<Observation> of_group(int condition, int kind) const;
};

Sample sample_tensions(const Study& study);
Sample sample_adhesion_forces(const Study& study);
Sample sample_adhesion_areas(const Study& study);
/// Total, fibre and network force, surface tension of the network: one value a cell, all but the first of those whose
/// network's tension is known.
std::vector<Sample> sample_cells(const Study& study);

/// What a cell's force may depend on.
struct CellFigures {
  double n_adhesions = 0, n_fibres = 0, adhesion_area_um2 = 0, cell_area_um2 = 0;
};
CellFigures figures_of(const StudyCell& cell);

std::vector<double> values_of(const std::vector<Observation>& observations);
int n_cells_of(const std::vector<Observation>& observations);

}  // namespace mbtfm::statistics
