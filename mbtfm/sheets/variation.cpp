#include "mbtfm/sheets/variation.h"

#include <cmath>

#include "pipeline/contract/extent.h"
#include "pipeline/contract/numbers.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::sheets {

MatrixXd smooth_patterns(const std::vector<Vec2>& places_um, const VectorXd& weights) {
  const Extent extent = extent_of(places_um);
  const double scale_um = std::sqrt(extent.area_um2());
  MatrixXd f(std::ssize(places_um), 6);
  for (Index k = 0; k < f.rows(); ++k) {
    const auto [x, y] = 1 / scale_um * (places_um[static_cast<std::size_t>(k)] - extent.middle_um());
    f.row(k) << 1, x, y, x * x - y * y, x * y, x * x + y * y;
  }
  const auto product = [&](Index i, Index j) { return f.col(i).cwiseProduct(weights).dot(f.col(j)); };
  for (Index k = 1; k < f.cols(); ++k)
    for (int round = 0; round < 2; ++round)  // the second takes off what rounding leaves (Golub & Van Loan, 5.2.9)
      for (Index j = 0; j < k; ++j) f.col(k) -= product(j, k) / product(j, j) * f.col(j);
  for (Index k = 1; k < f.cols(); ++k) f.col(k) *= kVariation / std::sqrt(3 * product(k, k) / weights.sum());
  return f.rightCols(5);
}

MatrixXd changes_by_variation_um(const sheet::OnGel& ground, const sheet::Scene& scene, const sheet::Solution& solution,
                                 const substrate::Substrate& gel, const std::vector<Vec2>& points_um) {
  const sheet::Elements& elements = *solution.elements;
  std::vector<Vec2> places_um;
  std::vector<double> area_um2;
  elements.for_each_point([&](int, int, const sheet::Shape& shape) {
    places_um.push_back(shape.place_um);
    area_um2.push_back(shape.weight_um2);
  });
  const MatrixXd patterns =
      smooth_patterns(places_um, VectorXd::Map(area_um2.data(), static_cast<Index>(area_um2.size())));
  MatrixXd loads_nN(2 * elements.n_nodes(), patterns.cols());
  for (Index k = 0; k < patterns.cols(); ++k) {
    sheet::Sheet part = solution.sheet;
    part.line_tension_nN = 0;
    for (std::size_t p = 0; p < part.contraction_nN_per_um.size(); ++p)
      part.contraction_nN_per_um[p] *= patterns(static_cast<Index>(p), k);
    loads_nN.col(k) = sheet::forces_of_contraction_nN(elements, part);
  }
  const MatrixXd forces_nN = ground.solve_all(scene.material, scene.adhesion_nN_per_um3, loads_nN).forces_nN;
  return gel.response({ground.patches(), 2}, {points_um})->displace(forces_nN);
}

std::string sentence_of_variation(const std::vector<FittedEstimate>& estimates, const VectorXd& moved) {
  std::string changes;
  for (Index k = 0; k < moved.size(); ++k) {
    const FittedEstimate& e = estimates[static_cast<std::size_t>(k)];
    if (is_given(e) || e.quantity == Quantity::contraction_over_stiffness || !(e.value > 0)) continue;
    changes += (changes.empty() ? "" : ", ") + std::string(for_people(e.quantity).name) +
               (e.part.empty() ? "" : " of " + e.part) + " by " + brief(100 * moved(k) / e.value) + " %";
  }
  if (changes.empty()) return changes;
  return "A contraction that varies by " + brief(100 * kVariation) + " % over the sheet would move: " + changes +
         ". The intervals contain this.";
}

}  // namespace mbtfm::sheets
