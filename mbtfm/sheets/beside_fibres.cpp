#include "mbtfm/sheets/beside_fibres.h"

#include <ranges>

#include "continuum/sheet/forward.h"
#include "continuum/sheet/mesh_size.h"
#include "mbtfm/sheets/sheet_fit.h"
#include "pipeline/contract/errors.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::sheets {
namespace {

/// None where the outline crosses itself, or bends so much that it asks for more triangles than this is worth.
std::shared_ptr<const sheet::Elements> coarse_elements(const sheet::Region& region) {
  constexpr double kMostTriangles = 500;
  const double narrow = sheet::narrow_um(region);
  sheet::TriangleSize size{
      .at_curves_um = narrow / 8, .largest_um = narrow / 3, .growth = 0.4, .most_turn_rad = 0.8, .most_notch_rad = 0.8};
  while (sheet::expected_triangles(region, size) > kMostTriangles)
    size = sheet::with_edge(size, 1.2 * size.at_curves_um);
  try {
    return std::make_shared<const sheet::Elements>(
        sheet::triangulated(region, size, static_cast<std::size_t>(4 * kMostTriangles)));
  } catch (const std::exception&) {  // also the triangulation's own: curves that cross where their polygon does not
    return nullptr;
  }
}

/// None where the sheet finds no balance with its gel.
std::optional<StiffnessTable> table_of(const std::shared_ptr<const sheet::Elements>& elements,
                                       std::vector<sheet::Bundle> bundles, const sheet::OnGel& ground, const Gel& gel,
                                       const sheet::Region& region, int threads) {
  try {
    return StiffnessTable({.elements = elements,
                           .contractions = {sheet::even(*elements, 1)},
                           .poisson_ratio = 0.5,
                           .n_rims = static_cast<int>(region.rims.size()),
                           .has_line = false,
                           .bundles = std::move(bundles)},
                          ground, gel, sheet::narrow_um(region), threads);
  } catch (const NotSolved&) {
    return {};
  }
}

std::vector<sheet::Bundle> bundles_of(const std::vector<Fibre>& fibres, const sheet::Elements& elements) {
  std::vector<sheet::Bundle> bundles;
  for (const Fibre& fibre : fibres) {
    try {
      bundles.push_back(sheet::within(elements, {{fibre.fibre_id, fibre.points_um}}).front());
    } catch (const InvalidData&) {  // it leaves the sheet between
    }
  }
  return bundles;
}

}  // namespace

std::vector<tensions::ModelScore> scores_of_sheets(const tensions::LinearData& data, const Cell& cell, const Gel& gel,
                                                   const substrate::Substrate& model, int threads) {
  if (!substrate::is_alike_everywhere(model.capabilities()) || data.offset_um.size() > 0) return {};
  std::vector<Polygon> outline = {cell.outline_um};
  outline.insert(outline.end(), cell.holes_um.begin(), cell.holes_um.end());
  if (!sheet::crossing_of(outline).empty()) return {};
  sheet::Region region;
  for (const Polygon& ring : outline) region.rims.emplace_back(ring);
  const std::shared_ptr<const sheet::Elements> elements = coarse_elements(region);
  if (!elements) return {};
  const sheet::OnGel ground(*elements, model, sheet::adhering_triangles(*elements, {}), threads);
  const std::optional<StiffnessTable> table =
      table_of(elements, bundles_of(cell.fibres, *elements), ground, gel, region, threads);
  if (!table) return {};
  tensions::LinearData of_sheet = data;
  of_sheet.motions.forces.resize(0, 0);  // of adhesions, which the sheet has none of
  const auto response = model.response({ground.patches(), 2}, {data.position_um});
  of_sheet.response = substrate::dense_response(response->displace(table->forces_nN()), threads);
  of_sheet = tensions::reweighted(std::move(of_sheet), data.bead_weight);
  const SheetFit fit = fit_sheet(of_sheet, *table, tensions::Loss::squares);
  const double as_in_cell = fit.variance / tensions::noise_variance(data);
  std::vector<tensions::ModelScore> scores;
  for (const SheetModel& sheet : fit.models | std::views::drop(1)) {  // the first is nothing
    scores.push_back(
        tensions::score_of(sheet.name, sheet.n_parameters, as_in_cell * sheet.chi_squared, sheet.relative_l2, data));
    scores.back().left_um = sheet.left_um;
  }
  return scores;
}

}  // namespace mbtfm::sheets
