/// The finished cells of a folder: what was measured in each, under which condition, and which do not enter.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/cell_kind.h"
#include "pipeline/contract/findings.h"
#include "pipeline/contract/fit_summary.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/results.h"
#include "pipeline/contract/sheet_results.h"
#include "pipeline/stage/parameters_fwd.h"
#include "pipeline/statistics/directions.h"

namespace mbtfm::statistics {

/// What the study was made to compare between conditions.
enum class PrimaryMeasure {
  automatic,          ///< of the kind that the study has most of: tension; contraction; total force in space
  tension,            ///< of the fibres of one type
  total_force,        ///< of the cells of the kind that the study has most of
  contraction,        ///< of the sheets
  mean_tension,       ///< of the sheets
  strain_energy,      ///< of the cells in space, or of the sheets
  contractile_moment  ///< of the cells in space
};
constexpr auto words(PrimaryMeasure) {
  return std::array{"auto",         "tension",       "total-force",       "contraction",
                    "mean-tension", "strain-energy", "contractile-moment"};
}

struct StudyParameters {
  std::string condition_from{};    ///< empty: the table's column `condition`, else all cells are of one condition
  std::string conditions{};        ///< their order, with commas between them: the first is the reference
  std::string replicate_from{};    ///< empty: the table's column `replicate` or `day`, else none
  std::string exclude_findings{};  ///< cells with these open findings do not enter: ids with commas between them
  PrimaryMeasure primary = PrimaryMeasure::automatic;
  FibreType primary_type = FibreType::ventral;  ///< the strongest, and those that most experiments are about
  bool with_not_converged = false;              ///< a fit that did not converge is no measurement
  bool list = false;                            ///< for other programs: what they leave out is what stats leaves out
  bool with_bad = false;                        ///< what a finding says not to use is no measurement
  double weak_tension_nN = 1;                   ///< most dorsal fibres of U2OS cells are below it (thesis 3.5)
  double strong_tension_nN = 5;                 ///< a third of the ventral ones are above it
  double near_adhesion_um = 1.5;                ///< beads lie some 1 um apart: about seven of them around an adhesion
  int bootstrap_draws = 2000;                   ///< ends of the intervals then repeat to some 5 % of their half width
  std::uint64_t bootstrap_seed = 1;
  int fibre_types = 3;  ///< an edge fibre is held at both ends as a ventral one is, and few cells have enough of them
};
void declare(stage::ParameterList& list, StudyParameters& parameters);
/// The tensions above which shares are given, each once.
std::vector<double> thresholds_nN(const StudyParameters& parameters);

/// What was found of a cell in space.
struct SpaceFigures {
  std::string method;         ///< of the tractions: each smooths in its way
  double total_force_nN = 0;  ///< sum of the sizes of all tractions
  std::optional<double> total_force_sigma_nN = {};
  double strain_energy_fJ = 0;  ///< of the gel
  /// > 0: inward. None: made by a version that did not give it.
  std::optional<double> contractile_moment_nN_um = {}, contractile_moment_sigma_nN_um = {};
  double normal_force_nN = 0;  ///< sum of the sizes of their normal parts
  double largest_traction_kPa = 0;
  double net_force_nN = 0, net_moment_nN_um = 0;  ///< of a cell that nothing else holds: errors alone
  std::optional<double> resolution_um = {};       ///< median over the surface
  struct OfAdhesion {
    int adhesion_id = 0;
    double force_nN = 0;
    std::optional<double> sigma_nN = {};
  };
  std::vector<OfAdhesion> adhesions = {};  ///< where an image shows them

  double normal_share() const { return total_force_nN > 0 ? normal_force_nN / total_force_nN : 0; }
};

/// What people decided who looked at a cell: its rows of review.csv in the folder of the study.
struct Review {
  std::string verdict = {};  ///< kAccepted, kLeftOut, or empty
  std::string note = {};
  std::vector<int> fibres_left_out = {};
  bool is_of_other_fibres = false;  ///< it named fibres, and the cell was segmented again since
};
inline constexpr const char *kReview = "review.csv", *kAccepted = "accepted", *kLeftOut = "left out";

/// A finished cell.
struct StudyCell {
  std::string name;            ///< its folder, relative to the study's
  int condition = 0;           ///< index into Study::conditions
  std::string replicate = {};  ///< day, dish or animal; empty: not given
  Cell cell = {};
  std::vector<AdhesionForce> forces = {};
  std::vector<Tension> tensions = {};
  FitSummary fit = {};
  std::vector<Direction> directions = {};
  std::optional<double> fttc_force_nN =
      {};                                  ///< of the usual method, in the outline; none: it was not asked, or has none
  std::vector<Finding> findings = {};      ///< of all its stages
  std::optional<SheetSummary> sheet = {};  ///< of a sheet, or a colony: it has no fibres, no adhesions, and of `fit` no
                                           ///< more than what the fit leaves and whether it converged
  std::optional<SpaceFigures> space = {};  ///< of a cell in space, likewise
  Review review = {};                      ///< the fibres that it leaves out are not in cell and tensions

  CellKind kind() const { return sheet ? CellKind::sheet : space ? CellKind::space : CellKind::plane; }
};

/// A cell that cannot be used, or a folder that cannot be searched for cells.
struct LeftOutCell {
  std::string name, condition, reason;
  Review review = {};
};

struct Study {
  /// As the parameters order them, the others by the alphabet; the first is the reference. One without a name where
  /// none were asked for.
  std::vector<std::string> conditions;
  std::vector<StudyCell> cells = {};  ///< those that enter
  std::vector<LeftOutCell> left_out;
  Path folder = {};                        ///< names are relative to it
  int n_fibre_types = 3;                   ///< 3: edge fibres count as ventral; 5: unclassified ones are compared
  std::vector<std::string> warnings = {};  ///< of the table of conditions and of the review

  /// Of a cell of that name; the study's own, if that is the only cell.
  Path folder_of(const std::string& name) const { return fs::exists(folder / name) ? folder / name : folder; }
};
/// The name of its condition.
const std::string& condition_of(const Study& study, const StudyCell& cell);
/// The type as which a fibre counts.
FibreType counted_type(const Study& study, FibreType type);

int n_of_kind(const Study& study, CellKind kind);
/// Those that have fibres.
int n_with_fibres(const Study& study);

/// What a study has to know of a kind of cells.
struct KindInStudy {
  const char *cell, *cells;                       ///< "cell"; of sheets "sheet"
  const char* found;                              ///< what the title says of them
  PrimaryMeasure primary;                         ///< of a study that has most of them
  std::map<PrimaryMeasure, std::string> columns;  ///< of the measures that they have
  const char *heading, *figure;                   ///< of their figures; the name of its file
  const char *parts, *of_part;  ///< small dots of that figure, and what is added to the name of a part's measure
  const char* how_to_read;      ///< sentence on their measures, or none
  std::vector<std::string> files, further_files;  ///< that must be there, and that are read if they are
};
const KindInStudy& in_study(CellKind kind);
/// In the order in which a page names them.
inline constexpr std::array kKindsOfCells = {CellKind::plane, CellKind::sheet, CellKind::space};

/// @param table  column `cell` (a cell's folder), any columns of conditions, and `exclude` with the reason why a cell
///               must not enter, empty for those that do; or none
/// A cell whose files are malformed, or lead out of it, is left out, and so is a copy of another cell.
/// @throws InputError where no cell is left (unless parameters.list), or the table is malformed or names a cell that is
/// not there
Study read_study(const Path& folder, const StudyParameters& parameters, const std::optional<Path>& table, int threads);

struct CellNote {
  std::string condition = {};          ///< empty where none are asked for
  std::string replicate = {};          ///< day, dish or animal; empty if none are given
  std::string reason_to_exclude = {};  ///< empty: it enters
};

struct CellNotes {
  std::vector<CellNote> of_cells;
  std::vector<std::string> warnings = {};  ///< sentences on what was taken for the same
};

/// A cell that is not in the table does not enter. The table is read as people write it (foreign_table.h). Conditions
/// and replicates that differ in capitals alone are one, spelled as it is first.
/// @param names  folders of the cells, relative to the study's
/// @param condition_from, replicate_from  see StudyParameters; empty: the table's column `condition`; `replicate`, else
///                                        `day`, where it has one
/// @throws InputError where a cell has no such folder above it, the table no such column, or a row no cell
CellNotes notes_of(const std::vector<std::string>& names, const std::string& condition_from,
                   const std::string& replicate_from, const std::optional<Path>& table);

/// Null where it has none. @param fibre_id  0: the network
const Tension* tension_of(const StudyCell& cell, int fibre_id);

/// A fibre whose tension could be identified, and is known to within anything that a fibre can carry.
struct MeasuredFibre {
  const StudyCell* cell = nullptr;
  const Fibre* fibre = nullptr;
  const Tension* tension = nullptr;
};
std::vector<MeasuredFibre> measured_fibres(const StudyCell& cell);
std::vector<MeasuredFibre> measured_fibres(const Study& study);

/// Whether the network's tension could be identified. Else its share of the total force, the fibres' and its surface
/// tension are not known either, whatever numbers the fit gives.
bool is_network_known(const StudyCell& cell);

/// Half the 95 % interval over its quantile: of the upper half, where zero cuts the lower; none without an interval,
/// or with one of no length.
std::optional<double> standard_error_nN(const Tension& tension);

}  // namespace mbtfm::statistics
