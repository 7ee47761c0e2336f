#include "mbtfm/tractions/neighbour_noise.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "mbtfm/inverse/loss.h"
#include "pipeline/numerics/near.h"

namespace mbtfm::tractions {

namespace {

constexpr std::size_t kFewest = 40;  // beads: half of them, 40 components, give a deviation to 13 %
constexpr int kNeighbours = 20;      // for six numbers each way: their own noise adds a fifth to the variance

/// How far a bead is from what its neighbours predict, in the noise's own measure, and the strain that they show.
struct Prediction {
  double strain = 0;
  Vec2 residual_um;
};

std::optional<Prediction> predicted(const DisplacementField& beads, int bead, const std::vector<int>& neighbours) {
  const auto n = static_cast<Eigen::Index>(neighbours.size());
  Eigen::MatrixXd powers(n, 6), u(n, 2);
  const double scale_um = norm(beads[neighbours.back()].position_um - beads[bead].position_um);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Bead& b = beads[neighbours[k]];
    const Vec2 d = 1 / scale_um * (b.position_um - beads[bead].position_um);
    powers.row(k) << 1, d.x, d.y, d.x * d.x, d.x * d.y, d.y * d.y;
    u.row(k) << b.displacement_um.x, b.displacement_um.y;
  }
  const Eigen::MatrixXd normal = powers.transpose() * powers;
  const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
  constexpr double kDetermined = 1e-6;  // of the largest pivot: neighbours on one line leave none of the others
  if (!(solver.vectorD().minCoeff() > kDetermined * solver.vectorD().maxCoeff())) return std::nullopt;
  const Eigen::MatrixXd fit = solver.solve(powers.transpose() * u);
  const double own_share = solver.solve(Eigen::VectorXd::Unit(6, 0))[0];  // of the prediction's variance
  const double by_noise = 1 / std::sqrt(1 + own_share);
  const Vec2 offset = beads[bead].displacement_um - Vec2{fit(0, 0), fit(0, 1)};
  return Prediction{.strain = fit.middleRows(1, 2).norm() / scale_um, .residual_um = by_noise * offset};
}

}  // namespace

std::optional<double> noise_from_neighbours_um(const DisplacementField& beads) {
  if (beads.size() < kFewest || !(beads_per_um2(beads) > 0)) return std::nullopt;
  const numerics::Neighbours<Vec2> near(points_of(beads), std::sqrt(2 / beads_per_um2(beads)));
  std::vector<Prediction> predictions;
  for (int i = 0; i < std::ssize(beads); ++i) {
    std::vector<int> neighbours = near.nearest(beads[i].position_um, kNeighbours + 1);
    std::erase(neighbours, i);
    neighbours.resize(kNeighbours);
    if (const auto p = predicted(beads, i, neighbours)) predictions.push_back(*p);
  }
  if (predictions.size() < kFewest) return std::nullopt;
  const auto half = predictions.begin() + static_cast<std::ptrdiff_t>(predictions.size() / 2);
  std::nth_element(predictions.begin(), half, predictions.end(),
                   [](const Prediction& a, const Prediction& b) { return a.strain < b.strain; });
  std::vector<double> magnitudes;
  for (auto p = predictions.begin(); p != half; ++p)
    magnitudes.insert(magnitudes.end(), {std::abs(p->residual_um.x), std::abs(p->residual_um.y)});
  return inverse::scale_of(std::move(magnitudes), 1);
}

std::optional<double> assume_noise_um(DisplacementField& beads) {
  if (state_errors(beads)) return std::nullopt;
  const std::optional<double> sigma_um = noise_from_neighbours_um(beads);
  const bool is_found = sigma_um && *sigma_um > 0;  // a computed field has none
  for (Bead& b : beads) b.sigma_um = is_found ? *sigma_um : 0;
  return is_found ? sigma_um : std::nullopt;
}

}  // namespace mbtfm::tractions
