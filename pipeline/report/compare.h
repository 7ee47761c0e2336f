/// What was found of a simulated cell beside the truth.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/results.h"

namespace mbtfm::report {

/// Mean distance of the points of each line from the other line, taken at points `step_um` apart; of the two
/// directions, the larger.
double line_distance_um(const Polyline& a, const Polyline& b, double step_um);

struct FibreMatch {
  int found_index = 0;
  int true_index = 0;
  double distance_um = 0;
};

/// Pairs of one found and one true fibre each, the closest first; fibres without a partner are left out.
std::vector<FibreMatch> match_fibres(const std::vector<Fibre>& found, const std::vector<Fibre>& truth);

/// A found fibre, a true one, or both.
struct ComparedFibre {
  std::optional<Fibre> found = {};
  std::optional<Tension> tension = {};  ///< of the found one
  std::optional<Fibre> truth = {};
  std::optional<double> true_tension_nN = {};
};

struct Comparison {
  std::vector<ComparedFibre> fibres = {};  ///< the found ones in order of id, then the missed ones
  Tension network = {};
  std::optional<double> true_network_nN = {};
  double relative_error = 0;  ///< |t − truth| / |truth| over the fibres that are found
  int n_matched = 0;
  int n_long = 0;                  ///< true fibres longer than kLongFibre_um
  int n_long_found_and_typed = 0;  ///< of those, found, and of the right type
  double total_force_nN = 0;
  std::optional<double> true_total_force_nN = {};
};

/// Shorter fibres hold less than three links of a network of the default edge length: not asked for.
inline constexpr double kLongFibre_um = 4;

bool has_truth(const std::filesystem::path& cell);

/// Fibres are matched by where they lie; without truth/fibres.csv the segmentation is the truth, and ids are the same.
/// @throws InputError where the cell has no truth or no fit
Comparison compare_with_truth(const std::filesystem::path& cell);

/// Of a sheet or a cell in space: what was found, its 95 % interval, and the truth.
struct ComparedNumber {
  std::string quantity;
  std::optional<double> found, low, high;
  double truth = 0;
};
struct ComparedNumbers {
  std::vector<ComparedNumber> numbers = {};  ///< empty: no truth is known
  std::string note = {};                     ///< of the map of tractions
};
/// @throws InputError if the truth is known and the cell has not been run
ComparedNumbers compare_numbers(const std::filesystem::path& cell);
/// The same as a section of a page; empty if no truth is known.
std::string truth_section(const std::filesystem::path& cell);

/// The comparison as a table for a terminal.
std::string comparison_text(const std::filesystem::path& cell);

}  // namespace mbtfm::report
