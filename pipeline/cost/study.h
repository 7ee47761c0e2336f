/// What accuracy costs in time: the stages again and again, each time with one knob turned, for one cell or several.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/cell_kind.h"
#include "pipeline/runner/stages.h"

namespace mbtfm::cost {

// The knobs that trade accuracy for time, and the rungs of each.

/// One choice of one knob; everything else is as the cell has it.
struct Rung {
  std::string knob, value;
  std::vector<runner::Setting> settings = {};
  double bead_share = 1;            ///< of the beads that are used
  std::optional<int> threads = {};  ///< or as many as the study has
};

/// Whether it needs the cell's images: it turns a knob of segmentation or tracking.
bool needs_images(const Rung& rung);

enum class Extent { quick, whole };  ///< whole: those that take minutes, too

inline constexpr const char* kAsItIs = "as it is";
inline constexpr const char* kPreset = "preset";

/// The cell as it is comes first, then knob by knob, rungs from coarse to fine.
std::vector<Rung> ladder(Extent extent);
/// The same of a cell in space. @param spacing_um  of its lattice of tractions, which the rungs widen and narrow
std::vector<Rung> ladder_in_space(Extent extent, double spacing_um);

/// The groups of knobs that are drawn together, of one kind of cells.
std::vector<std::string> groups_of(CellKind kind);
/// The one of a knob.
std::string group_of(const std::string& knob, CellKind kind);

struct StudyOptions {
  std::filesystem::path stage_folder;  ///< where the stages' executables are
  int threads = 1;
  double budget_s = 600;  ///< no run is begun after this
  int repeats = 3;        ///< of each rung, at most
  Extent extent = Extent::quick;
  std::function<void(const std::string&)> say;
};

struct Measurement {
  Rung rung;
  double seconds = 0;      ///< of all stages, one after the other, median of the repeats
  double cpu_seconds = 0;  ///< of all threads, likewise
  double peak_memory_MB = 0;
  int n_runs = 0;            ///< 0: there was no time for it
  std::string failure = {};  ///< how it ended, where not well
  int n_fibres = 0;          ///< that the reference knows, too; none in space
  double error = 0;  ///< |t − reference| / |reference|: over the tensions of these, or over the map of tractions
  double force_error = 0;   ///< of the total force, relative
  double stated_error = 0;  ///< what the error budget says of the tensions, or the standard errors of the tractions
};

struct Study {
  CellKind kind = {};
  std::string reference;    ///< what errors are against: "the truth", or the finest rung
  bool has_images = false;  ///< times are those of all stages; else of network and fit, and nothing is segmented again
  std::vector<Measurement> measurements = {};
};

/// Runs the stages in a scratch folder below CELL/cost. Of a cell without images, or without all of them, segmentation
/// and displacements are taken as they are. Of a cell in space the stage `traction` alone is run.
/// @throws InputError where the cell was not run yet, or is a sheet
Study measure(const std::filesystem::path& cell, const StudyOptions& options);

/// The same rungs of several cells as one: root mean squares of the errors, means of the rest. One cell's best rung is
/// the luckiest, too; over several luck levels out. A rung counts where it was measured in all of them.
/// @throws UsageError where they are of two kinds
Study combined(const std::vector<Study>& studies);

// The study as a table, a picture and a page.

/// Indices of the measurements that no other one beats in both processor time and error, the quickest
/// first. Failed ones and ones that were not run are left out.
std::vector<int> front_of(const std::vector<Measurement>& measurements);

/// By how much another measurement beats this one: the largest share s such that one takes no more time and errs by s
/// less, or errs no more and takes s less. 0 on the front.
double distance_to_front(const std::vector<Measurement>& measurements, int index);

/// cost.csv, cost.svg and cost.md in this folder. @throws OutputError
void write_study(const std::filesystem::path& folder, const Study& study, const std::string& cell_name);

/// The part of docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::cost
