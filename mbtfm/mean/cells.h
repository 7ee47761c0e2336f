/// What mbtfm-mean is asked for, the cells of a folder, and the reference that they are laid onto.
#pragma once

#include <array>

#include "mbtfm/mean/align.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::mean {

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
