#include "mbtfm/tractions/neighbour_noise.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "pipeline/contract/extent.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::tractions {

namespace {

constexpr std::size_t kFewest = 40;      // beads: half of them, 40 components, tell a deviation to 13 %
constexpr std::size_t kNeighbours = 20;  // for six numbers each way: their own noise adds a fifth to the variance

/// Beads in square boxes of about two, row by row.
class Boxes {
 public:
  explicit Boxes(const DisplacementField& beads) : beads_(beads) {
    const auto [low, high] = extent_of(beads, &Bead::position_um);
    low_ = low;
    side_um_ = std::sqrt(2 * (high.x - low_.x) * (high.y - low_.y) / static_cast<double>(beads.size()));
    n_columns_ = 1 + static_cast<int>((high.x - low_.x) / side_um_);
    n_rows_ = 1 + static_cast<int>((high.y - low_.y) / side_um_);
    members_.resize(static_cast<std::size_t>(n_columns_) * n_rows_);
    for (std::size_t i = 0; i < beads.size(); ++i) members_[box_of(column_of(i), row_of(i))].push_back(i);
  }

  /// The nearest beads, nearest first: rings of boxes until the next ring is farther than the last of them.
  std::vector<std::size_t> nearest(std::size_t bead) const {
    struct Candidate {
      double distance_um;
      std::size_t bead;
      auto operator<=>(const Candidate&) const = default;
    };
    std::vector<Candidate> found;
    for (int ring = 0; ring <= std::max(n_columns_, n_rows_); ++ring) {
      for_ring(bead, ring, [&](std::size_t other) {
        if (other != bead) found.push_back({norm(beads_[other].position_um - beads_[bead].position_um), other});
      });
      std::sort(found.begin(), found.end());
      if (found.size() >= kNeighbours && found[kNeighbours - 1].distance_um <= ring * side_um_) break;
    }
    std::vector<std::size_t> nearest;
    for (std::size_t k = 0; k < std::min(kNeighbours, found.size()); ++k) nearest.push_back(found[k].bead);
    return nearest;
  }

 private:
  int column_of(std::size_t i) const { return static_cast<int>((beads_[i].position_um.x - low_.x) / side_um_); }
  int row_of(std::size_t i) const { return static_cast<int>((beads_[i].position_um.y - low_.y) / side_um_); }
  std::size_t box_of(int column, int row) const { return static_cast<std::size_t>(row) * n_columns_ + column; }
  template <class Use>
  void for_ring(std::size_t bead, int ring, const Use& use) const {
    const int column = column_of(bead), row = row_of(bead);
    for (int j = std::max(0, row - ring); j <= std::min(n_rows_ - 1, row + ring); ++j) {
      for (int i = std::max(0, column - ring); i <= std::min(n_columns_ - 1, column + ring); ++i) {
        if (std::max(std::abs(i - column), std::abs(j - row)) != ring) continue;
        for (const std::size_t other : members_[box_of(i, j)]) use(other);
      }
    }
  }
  const DisplacementField& beads_;
  Vec2 low_;
  double side_um_ = 0;
  int n_columns_ = 0, n_rows_ = 0;
  std::vector<std::vector<std::size_t>> members_;
};

/// How far a bead is from what its neighbours predict, in the noise's own measure, and the strain that they tell of.
struct Prediction {
  double strain = 0;
  Vec2 residual_um;
};

std::optional<Prediction> predicted(const DisplacementField& beads, std::size_t bead,
                                    const std::vector<std::size_t>& neighbours) {
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
  const Boxes boxes(beads);
  std::vector<Prediction> predictions;
  for (std::size_t i = 0; i < beads.size(); ++i) {
    if (const auto p = predicted(beads, i, boxes.nearest(i))) predictions.push_back(*p);
  }
  if (predictions.size() < kFewest) return std::nullopt;
  const auto half = predictions.begin() + static_cast<std::ptrdiff_t>(predictions.size() / 2);
  std::nth_element(predictions.begin(), half, predictions.end(),
                   [](const Prediction& a, const Prediction& b) { return a.strain < b.strain; });
  std::vector<double> magnitudes;
  for (auto p = predictions.begin(); p != half; ++p) {
    magnitudes.push_back(std::abs(p->residual_um.x));
    magnitudes.push_back(std::abs(p->residual_um.y));
  }
  return 1.4826 * numerics::median_in(magnitudes);  // the median's of a Gaussian
}

std::optional<double> assume_noise_um(DisplacementField& beads) {
  if (std::ranges::all_of(beads, [](const Bead& b) { return b.sigma_um > 0; })) return std::nullopt;
  const std::optional<double> sigma_um = noise_from_neighbours_um(beads);
  const bool is_found = sigma_um && *sigma_um > 0;  // a computed field has none
  for (Bead& b : beads) b.sigma_um = is_found ? *sigma_um : 0;
  return is_found ? sigma_um : std::nullopt;
}

}  // namespace mbtfm::tractions
