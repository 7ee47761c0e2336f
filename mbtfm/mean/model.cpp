#include "mbtfm/mean/model.h"

#include <algorithm>
#include <random>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::mean {

std::vector<double> lambdas_of(const std::vector<Registered>& cells, std::optional<double> asked_um_per_kPa,
                               const tractions::TractionParameters& fttc, int threads) {
  if (asked_um_per_kPa) return std::vector<double>(cells.size(), *asked_um_per_kPa);
  std::vector<double> lambdas(cells.size());
  numerics::parallel_for(static_cast<int>(cells.size()), threads,
                         [&](int k) { lambdas[k] = lambda_by_risk_um_per_kPa(cells[k], fttc); });
  // gels differ: a length, lambda E, is the same for all
  std::vector<double> lengths;
  for (std::size_t k = 0; k < cells.size(); ++k) lengths.push_back(lambdas[k] * cells[k].gel.youngs_modulus_kPa);
  const double length = numerics::quantile(lengths, 0.5);
  for (std::size_t k = 0; k < cells.size(); ++k) lambdas[k] = length / cells[k].gel.youngs_modulus_kPa;
  return lambdas;
}

Samples samples_of(std::size_t n_cells, const std::vector<Vec2>& nodes, const std::vector<Motion>& motions, int threads,
                   const std::function<CellField(int cell)>& field_of_cell) {
  Samples samples(n_cells);
  numerics::parallel_for(static_cast<int>(n_cells), threads, [&](int k) {
    const CellField field = field_of_cell(k);
    for (const Vec2 node : nodes) samples[k].push_back(field.at(node, motions));
  });
  return samples;
}

std::function<Vec2(Vec2)> model_in(const Path& file) {
  std::vector<GroundPatch> patches = files::read_tractions(file);
  std::set<double> columns;
  for (const GroundPatch& patch : patches) columns.insert(patch.position_um.x);
  const std::size_t n_columns = columns.size(), n_rows = patches.size() / std::max<std::size_t>(1, n_columns);
  if (n_columns < 2 || n_rows < 2 || n_columns * n_rows != patches.size())
    throw InputError(file.string(), "tractions on a whole lattice of at least two columns and rows",
                     std::to_string(patches.size()) + " rows, " + std::to_string(n_columns) + " columns");
  std::ranges::sort(patches, [](const GroundPatch& a, const GroundPatch& b) {
    return std::pair(a.position_um.y, a.position_um.x) < std::pair(b.position_um.y, b.position_um.x);
  });
  const Vec2 low = patches.front().position_um, high = patches.back().position_um;
  const double spacing = (high.x - low.x) / static_cast<double>(n_columns - 1);
  for (GroundPatch& patch : patches) patch.area_um2 = spacing * spacing;
  const CellField field(patches, {}, {low, high});
  return [field](Vec2 place) { return field.at(place).value_or(Sample{}).traction_kPa; };
}

std::vector<Vec2> blurred_model(const std::function<Vec2(Vec2)>& model, const std::vector<Registered>& cells,
                                const std::vector<double>& lambdas, const tractions::TractionParameters& fttc,
                                const std::vector<Vec2>& nodes, const Alignment& alignment, std::uint64_t seed,
                                int threads) {
  const Vec2 centre = centroid_um(alignment.reference_um);
  std::vector<Motion> errors;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  for (const Registered& cell : cells) {
    const double x = normal(random), y = normal(random), angle = normal(random);
    errors.push_back({centre, centre + cell.shift_error_um * Vec2{x, y}, cell.angle_error_rad * angle, false});
  }
  const Samples samples = samples_of(cells.size(), nodes, alignment.motions, threads, [&](int k) {
    const auto off = [&](Vec2 place) { return errors[k].vector(model(errors[k].back_um(place))); };
    return blurred(off, cells[k], fttc, lambdas[k]);
  });
  std::vector<Vec2> means;
  for (const NodeMean& node : mean_of(nodes, samples, alignment.reference_um)) means.push_back(node.mean.traction_kPa);
  return means;
}

}  // namespace mbtfm::mean
