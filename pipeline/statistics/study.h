/// Many cells together: what was measured in each, and how fibre types differ.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/files.h"
#include "pipeline/contract/parameters.h"

namespace mbtfm::statistics {

struct StudyParameters {
  double weak_tension_nN = 1;    ///< most dorsal fibres of U2OS cells are below it (thesis 3.5)
  double strong_tension_nN = 5;  ///< a third of the ventral ones are above it
};
void declare(ParameterList& list, StudyParameters& parameters);

/// A finished cell.
struct StudyCell {
  std::string name;  ///< its folder, relative to the study's
  Cell cell;
  std::vector<AdhesionForce> forces;
  std::vector<Tension> tensions;
  FitSummary fit;
};

struct Study {
  std::vector<StudyCell> cells;
  std::vector<std::string> unfinished;  ///< cells without a fit
};

/// Files that are read of each cell, relative to its folder.
const std::vector<std::string>& files_of_a_cell();
/// @throws InputError where no cell is finished, or a file is malformed
Study read_study(const Path& folder);

/// A fibre whose tension could be identified.
struct MeasuredFibre {
  const StudyCell* cell = nullptr;
  const Fibre* fibre = nullptr;
  const Tension* tension = nullptr;
};
std::vector<MeasuredFibre> measured_fibres(const Study& study);

/// Tensions of one type, of one cell or of all.
struct TypeSummary {
  std::string cell;  ///< empty: all cells
  FibreType type = FibreType::arc;
  int n_cells = 0, n_fibres = 0;
  double mean_nN = 0, median_nN = 0, sd_nN = 0;
  double fraction_above_weak = 0, fraction_above_strong = 0;
};
std::vector<TypeSummary> summarise_types(const Study& study, const StudyParameters& parameters);

/// What is counted as one observation. The fibres of a cell are not independent of each other: tests by fibre
/// overstate the evidence, tests of the cells' medians do not.
enum class Unit { fibre, cell_median };
struct TypeTest {
  std::string test;
  Unit unit = Unit::fibre;
  std::string group_a, group_b;  ///< group_b empty: all types together
  int n_a = 0, n_b = 0;          ///< observations
  double statistic = 0, p_value = 1;
  std::optional<double> p_holm;  ///< corrected for the three pairs
  double effect = 0;             ///< pairs: rank-biserial correlation, −1 to 1; all: epsilon squared, 0 to 1
};
/// Kruskal–Wallis over the types, Mann–Whitney between each two; left out where a group has fewer than two values.
std::vector<TypeTest> test_types(const Study& study);

}  // namespace mbtfm::statistics
