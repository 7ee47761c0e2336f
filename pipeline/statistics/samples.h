/// One quantity of a study as a flat list of observations, each with its cell, kind and condition.
#pragma once

#include <string>
#include <vector>

#include "pipeline/statistics/mixed_model.h"
#include "pipeline/statistics/study.h"

namespace mbtfm::statistics {

enum class Observed {
  fibres,
  adhesions,
  cells,    ///< with fibres
  sheets,   ///< or their parts, where these have contractions of their own
  bundles,  ///< in the sheets
  cells_in_space,
  adhesions_in_space  ///< of these
};
constexpr auto words(Observed) {
  return std::array{"fibres", "adhesions", "cells", "sheets", "bundles", "cells in space", "adhesions in space"};
}

/// `group` of an observation is condition · n kinds + kind; `cell` is its index in the study.
struct Sample {
  std::string column;      ///< of the tables, with its unit: tension_nN
  std::string name, unit;  ///< for people
  Observed each = Observed::fibres;
  std::vector<std::string> kinds, conditions;
  int n_compared = 0;  ///< of the kinds, the first: tests compare them with each other, and leave out the others
  std::vector<Observation> values = {};
  int n_without_error = 0;  ///< observations whose error is not known: that of the others is taken, or zero if none is
  bool is_never_negative = true;

  /// Whether no cell has two: then the observation is the cell's.
  bool is_one_a_cell() const;
  /// Of which kind its cells are.
  CellKind of_cells() const;
  const char* cell_name() const { return in_study(of_cells()).cell; }
  /// What its cells are called.
  const char* cells_name() const { return in_study(of_cells()).cells; }
  int n_kinds() const { return static_cast<int>(kinds.size()); }
  int n_conditions() const { return static_cast<int>(conditions.size()); }
  int group_of(int condition, int kind) const { return condition * n_kinds() + kind; }
  std::vector<Observation> of_group(int condition, int kind) const;
  /// "4.1 nN"
  std::string amount(const std::string& value) const { return unit.empty() ? value : value + " " + unit; }
  std::string amount(double value) const;
  /// "tension (nN)"
  std::string label() const { return unit.empty() ? name : name + " (" + unit + ")"; }
};

/// An adhesion that was seen, and has a force.
struct SeenAdhesion {
  bool is_connected = false;
  double area_um2 = 0, force_nN = 0;
  std::optional<double> sigma_nN = {};  ///< of the force
};
std::vector<SeenAdhesion> seen_adhesions(const StudyCell& cell);

/// Of each row of the table of measures (samples.cpp): tensions, adhesions, figures of cells with fibres, of sheets, of
/// cells in space; without what the study has no cell of, and what no sheet or cell in space has. The network's figures
/// are of the cells whose network's tension is known.
std::vector<Sample> samples_of(const Study& study);
/// Of one row. @param column  "tension_nN"
Sample sample_of(const Study& study, const std::string& column);
inline constexpr const char* kResolution = "space_resolution_um";

/// Whether it is a measurement: not given by the user, and limited to both sides by the beads.
bool enters(const SheetEstimate& estimate);
/// The standard error without what all sheets on gels of one kind share: errors of the gel's numbers and of its model
/// are no scatter of sheets. That of a contraction which varies is shared if all vary alike, and scatter, which the
/// statistics see, if not.
std::optional<double> own_error(const SheetEstimate& estimate);

/// What a cell's force may depend on.
struct CellFigures {
  double n_adhesions = 0, n_fibres = 0, adhesion_area_um2 = 0, cell_area_um2 = 0;
};
CellFigures figures_of(const StudyCell& cell);

std::vector<double> values_of(const std::vector<Observation>& observations);
int n_cells_of(const std::vector<Observation>& observations);

}  // namespace mbtfm::statistics
