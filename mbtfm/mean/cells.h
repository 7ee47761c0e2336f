/// What mbtfm-mean is asked for, the cells of a folder, and the reference that they are laid onto.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "mbtfm/mean/images.h"
#include "mbtfm/mean/outputs.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/words.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::mean {

// Cells of one shape, laid onto a reference; which cells do not belong there.

/// What the folder of a cell holds.
struct Cell {
  std::string name;
  Path outline_file;
  Polygon outline_um;
  DisplacementField beads;
  Gel gel;
  Brightness image = {};  ///< where it is registered by images
};

struct Alignment {
  Polygon reference_um;
  std::vector<Motion> motions;  ///< of the reference's symmetry, the identity first
  Mirrors mirrors = Mirrors::not_tried;
  double largest_misfit = 0.1;  ///< of the reference's size
};

/// The outline that lies nearest to all others: that of the least sum of squared misfits.
int most_typical(const std::vector<Polygon>& outlines_um, Mirrors mirrors, int threads);

/// Whether mirrors are tried: as the switch says, or where the reference is not its own mirror image.
Mirrors mirrors_for(Switch setting, const Polygon& reference_um);

/// @throws UsageError where the reference does not have the symmetry
void expect_symmetric(const Alignment& alignment, const std::string& symmetry);

/// Each cell's best way onto the reference; those that do not fit are marked, with the reason.
/// @param image  of the reference, to lay the cells' images onto; the outlines then show how well they fit, and which
/// cells have another shape
std::vector<CellRow> aligned(const std::vector<Cell>& cells, const Alignment& alignment, int threads,
                             const Brightness* image = nullptr);

// What is asked for.

enum class Others { refused, left_out };
constexpr auto words(Others) { return std::array{"refused", "left-out"}; }

/// What cells are laid onto each other by.
enum class By { outlines, images };
constexpr auto words(By) { return std::array{"outlines", "images"}; }

struct Parameters {
  std::optional<double> pixel_size_um;
  Gel gel;
  std::string reference = {};
  By register_by = By::outlines;
  std::string image = "phase.tif";
  std::string symmetry = "C1";
  Switch mirror = Switch::automatic;
  double largest_misfit = Alignment{}.largest_misfit;
  Others others = Others::refused;
  GelModel gel_model = GelModel::layer;
  std::optional<double> lambda_um_per_kPa;
  std::optional<double> spacing_um;
  std::uint64_t seed = 1;
};
void declare(stage::ParameterList& list, Parameters& p);

/// The cells below the folder of that input, by name, without their flagged beads.
/// @throws InputError if there are fewer than two, or if one lacks its gel or image
std::vector<Cell> read_cells(stage::StageContext& context, const Parameters& p);

/// An outline, and the cell that it is of; none: that of a pattern.
struct Reference {
  Polygon outline_um;
  const Cell* cell = nullptr;
};
Reference reference_of(stage::StageContext& context, const Parameters& p, const std::vector<Cell>& cells);

/// @throws InputError at the first cell of another shape, where those are refused
std::vector<CellRow> rows_of(stage::StageContext& context, const Parameters& p, const std::vector<Cell>& cells,
                             const Reference& reference, const Alignment& alignment);

}  // namespace mbtfm::mean
