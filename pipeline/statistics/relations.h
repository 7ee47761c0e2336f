/// What goes with what: forces of cells with their size, force of adhesions with their area, directions.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/statistics/bootstrap.h"
#include "pipeline/statistics/directions.h"

namespace mbtfm::statistics {

struct Study;

/// A force of the cells against a measure of their size, with a line through the origin (thesis figs. 3.11, 3.12, A.1,
/// A.2).
struct Correlation {
  std::string force, size;  ///< columns of cells.csv
  std::string size_unit;    ///< for people: what one more of is counted
  bool is_of_total = false;
  std::string condition;
  std::vector<double> x = {}, y = {};
  std::vector<int> cells = {};                  ///< indices into Study::cells
  std::optional<LineThroughOrigin> line = {};   ///< none below kFewestForALine cells
  std::optional<Interval> slope_interval = {};  ///< 95 %, by the bootstrap of cells; none without a line
};
/// Below five points a slope and a correlation say next to nothing: the points alone are shown.
inline constexpr std::size_t kFewestForALine = 5;
std::vector<Correlation> correlate_forces(const Study& study, const std::vector<CellWeights>& draws);

/// Mean force of the adhesions whose area lies between two values (thesis fig. 3.13).
struct AreaBin {
  std::string condition;
  bool is_connected = false;
  double low_um2 = 0, high_um2 = 0;
  int n_cells = 0, n_adhesions = 0;
  double mean_area_um2 = 0, mean_force_nN = 0;
  std::optional<Interval> interval_nN = {};  ///< 95 % of the mean force, by the bootstrap of cells
};
/// Bins of as many adhesions each, all conditions together; none of no adhesions.
std::vector<AreaBin> bin_by_area(const Study& study, const std::vector<CellWeights>& draws);

/// Angles of one relation under one condition.
struct DirectionSummary {
  Relation relation = Relation::adhesion_fibre;
  std::string condition;
  int n_cells = 0, n = 0;
  std::vector<double> angles_deg = {};
  double mean_angle_deg = 0, mean_cosine = 0;
  std::optional<Interval> angle_interval_deg = {}, cosine_interval = {};  ///< 95 %, by the bootstrap of cells
};
std::vector<DirectionSummary> summarise_directions(const Study& study, const std::vector<CellWeights>& draws);

}  // namespace mbtfm::statistics
