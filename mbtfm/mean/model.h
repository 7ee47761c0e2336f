/// The fields of all cells on common nodes, and a model as their mean would show it.
#pragma once

#include "mbtfm/mean/cells.h"

namespace mbtfm::mean {

/// Of each cell: as asked, or by the least expected error, the same length lambda E for all.
std::vector<double> lambdas_of(const std::vector<Registered>& cells, std::optional<double> asked_um_per_kPa,
                               const tractions::TractionParameters& fttc, int threads);

/// By cell, then by node.
using Samples = std::vector<std::vector<std::optional<Sample>>>;
/// The field made of each cell, at all nodes.
Samples samples_of(std::size_t n_cells, const std::vector<Vec2>& nodes, const std::vector<Motion>& motions, int threads,
                   const std::function<CellField(int cell)>& field_of_cell);

/// Tractions of a table, each as that of the nearest row; beyond the outermost ones none.
std::function<Vec2(Vec2)> model_in(const Path& file);
/// The model as the mean of these cells would show it, by node.
std::vector<Vec2> blurred_model(const std::function<Vec2(Vec2)>& model, const std::vector<Registered>& cells,
                                const std::vector<double>& lambdas, const tractions::TractionParameters& fttc,
                                const std::vector<Vec2>& nodes, const Alignment& alignment, std::uint64_t seed,
                                int threads);

}  // namespace mbtfm::mean
