/// How many cells it takes to see a difference between two conditions.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "samples/plan/grid.h"
#include "samples/plan/scene.h"

namespace mbtfm::plan {

/// By fibre type, all in nN.
struct Scatter {
  Quantity type = Quantity::ventral;
  double mean_nN = 0;
  double between_cells_nN = 0;  ///< standard deviation of a cell's own mean
  double within_nN = 0;         ///< of the fibres of a cell about it
  double error_nN = 0;          ///< root mean square standard error of a fibre's tension
  double fibres_per_cell = 0;
  std::string source = {};  ///< of the scatter
};

/// Of the scene: its own fibres' scatter, and between cells what the parameters say.
std::vector<Scatter> scatter_of(const Scene& scene, const Computed& computed, const Point& point, double between_cells);
/// The same with means and scatter of a finished study: statistics/types.csv and variances.csv in its folder.
/// @throws InputError if a file is missing or malformed, or states the scatter of no type
std::vector<Scatter> scatter_of_study(const std::filesystem::path& statistics, std::vector<Scatter> scatter);

/// Chance that a two-sided t test at 5 % of the means of two groups of n cells each, m fibres in each cell, sees a
/// difference d. With s² = between² + (within² + error²) / m the variance of a cell's mean, t has 2 (n − 1) degrees of
/// freedom and the non-centrality d / sqrt(2 s² / n).
double power_of(const Scatter& scatter, double difference_nN, double fibres_per_cell, int cells);
/// Cells of each condition for this power; none where ten thousand are not enough.
std::optional<int> cells_for(const Scatter& scatter, double difference_nN, double fibres_per_cell, double power);

struct CellNumbers {
  Scatter scatter;
  double difference = 0;  ///< over the mean
  double fibres_per_cell = 0;
  std::optional<int> cells;   ///< of each condition
  std::vector<double> power;  ///< at kCells
};
inline constexpr int kCells[] = {5, 10, 20, 40, 80};
/// Over several differences and numbers of fibres.
std::vector<CellNumbers> cell_numbers(const std::vector<Scatter>& scatter, double difference, double power);

}  // namespace mbtfm::plan
