#include "mbtfm/sheets/beside_fibres.h"

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
                                       const sheet::OnGel& ground, const Gel& gel, const sheet::Region& region,
                                       int threads) {
  try {
    return StiffnessTable({.elements = elements,
                           .contractions = {sheet::even(*elements, 1)},
                           .poisson_ratio = 0.5,
                           .n_rims = static_cast<int>(region.rims.size()),
                           .has_line = false},
                          ground, gel, sheet::narrow_um(region), threads);
  } catch (const NotSolved&) {
    return {};
  }
}

}  // namespace

std::optional<tensions::ModelScore> score_of_sheet(const tensions::LinearData& data,
                                                   const std::vector<Polygon>& outline_um, const Gel& gel,
                                                   const substrate::Substrate& model, int threads) {
  if (!substrate::is_alike_everywhere(model.capabilities()) || data.offset_um.size() > 0) return {};
  if (!sheet::crossing_of(outline_um).empty()) return {};
  sheet::Region region;
  for (const Polygon& ring : outline_um) region.rims.emplace_back(ring);
  const std::shared_ptr<const sheet::Elements> elements = coarse_elements(region);
  if (!elements) return {};
  const sheet::OnGel ground(*elements, model, sheet::adhering_triangles(*elements, {}), threads);
  const std::optional<StiffnessTable> table = table_of(elements, ground, gel, region, threads);
  if (!table) return {};
  tensions::LinearData of_sheet = data;
  of_sheet.motions.forces.resize(0, 0);  // of adhesions, which the sheet has none of
  const auto response = model.response({ground.patches(), 2}, {data.position_um});
  of_sheet.response = substrate::dense_response(response->displace(table->forces_nN()), threads);
  of_sheet = tensions::reweighted(std::move(of_sheet), data.bead_weight);
  const SheetFit fit = fit_sheet(of_sheet, *table, tensions::Loss::squares);
  constexpr int kParameters = 2;
  const double misfit =
      (tensions::displace(of_sheet.reduced, fit.node_amplitudes) - of_sheet.reduced.target).squaredNorm() +
      of_sheet.reduced.floor_squared;
  tensions::ModelScore score = tensions::score_of("sheet", kParameters, misfit / tensions::noise_variance(data),
                                                  tensions::relative_l2(of_sheet, fit.node_amplitudes), data);
  score.left_um = data.displacement_um - of_sheet.response->displace(fit.node_amplitudes);
  return score;
}

}  // namespace mbtfm::sheets
