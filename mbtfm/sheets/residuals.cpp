#include "mbtfm/sheets/residuals.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/extent.h"
#include "pipeline/numerics/near.h"

namespace mbtfm::sheets {
namespace {

/// Of each bead that is used the near ones that are used, both ways.
using Neighbours = std::vector<std::vector<int>>;

bool is_used(const Residuals& r, std::size_t bead) { return r.weight_per_um(2 * static_cast<Index>(bead)) > 0; }

Neighbours neighbours_of(const Residuals& r, double near_um) {
  constexpr double kFewest = 6;  // of a hexagonal lattice
  std::vector<Vec2> places;
  std::vector<int> bead_of;
  for (std::size_t b = 0; b < r.position_um.size(); ++b)
    if (is_used(r, b)) {
      places.push_back(r.position_um[b]);
      bead_of.push_back(static_cast<int>(b));
    }
  Neighbours near(r.position_um.size());
  if (places.empty()) return near;
  const double area_of_each_um2 = extent_of(places).area_um2() / static_cast<double>(places.size());
  const double radius_um = std::max(near_um, std::sqrt(kFewest * area_of_each_um2 / std::numbers::pi));
  const numerics::Neighbours<Vec2> found(places, radius_um);
  for (std::size_t k = 0; k < places.size(); ++k)
    for (const int other : found.within(places[k], radius_um, static_cast<int>(places.size())))
      if (other != static_cast<int>(k)) near[bead_of[k]].push_back(bead_of[other]);
  return near;
}

/// K X: each component is summed over the near beads.
MatrixXd summed(const Neighbours& near, const MatrixXd& X) {
  MatrixXd sums = MatrixXd::Zero(X.rows(), X.cols());
  for (std::size_t b = 0; b < near.size(); ++b)
    for (const int other : near[b]) sums.middleRows(2 * static_cast<Index>(b), 2) += X.middleRows(2 * Index{other}, 2);
  return sums;
}

/// A quadratic form rᵀKr. @param KB, Kl  K times what the fit follows, and times the stated errors
/// @param trace, trace_of_square  of K  @param v  variance of the noise
Statistic quadratic(const Residuals& r, const MatrixXd& l, const MatrixXd& KB, const MatrixXd& Kl, double trace,
                    double trace_of_square, double v) {
  const MatrixXd BKB = numerics::small_transposed_product(r.followed, KB), G = numerics::small_product(r.inverse, BKB),
                 lKl = numerics::small_transposed_product(l, Kl),
                 BKl = numerics::small_transposed_product(r.followed, Kl);
  const double of_square = r.inverse.cwiseProduct(numerics::small_transposed_product(KB, KB)).sum();
  const double of_noise = trace_of_square - 2 * of_square + G.cwiseProduct(G.transpose()).sum();
  const double of_both = Kl.squaredNorm() - numerics::congruence(BKl.transpose(), r.inverse).trace();
  return {.value = 0,
          .expected = v * (trace - G.trace()) + lKl.trace(),
          .sigma = std::sqrt(std::max(0.0, 2 * v * v * of_noise + 4 * v * of_both + 2 * lKl.squaredNorm()))};
}

Statistic over(Statistic s, double divisor) { return {s.value / divisor, s.expected / divisor, s.sigma / divisor}; }

}  // namespace

double Misfit::excess() const {
  constexpr double kSizeKnown = 0.2, kShared = 0.05;
  return std::max(chi_squared_per_degree.excess(kSizeKnown), correlation.excess(kShared));
}

Misfit misfit_of(const Residuals& r, double near_um, const MatrixXd& errors_um) {
  Misfit misfit;
  const double chi_squared = r.weighted.squaredNorm();
  if (!(r.degrees > 0 && chi_squared > 0)) return misfit;
  MatrixXd l = r.weight_per_um.asDiagonal() * errors_um;
  l -= numerics::small_product(r.followed,
                               numerics::small_product(r.inverse, numerics::small_transposed_product(r.followed, l)));
  const double n = r.degrees + r.inverse.cwiseProduct(numerics::small_transposed_product(r.followed, r.followed)).sum();
  misfit.chi_squared_per_degree = quadratic(r, l, r.followed, l, n, n, r.has_errors ? 1 : chi_squared / r.degrees);
  misfit.chi_squared_per_degree.value = chi_squared;
  misfit.chi_squared_per_degree = over(misfit.chi_squared_per_degree, r.degrees);

  const Neighbours near = neighbours_of(r, near_um);
  double n_pairs = 0;
  for (const std::vector<int>& others : near) n_pairs += 2 * static_cast<double>(others.size());  // of components
  if (n_pairs == 0) return misfit;
  const double v = chi_squared / r.degrees;
  misfit.correlation = quadratic(r, l, summed(near, r.followed), summed(near, l), 0, n_pairs, v);
  misfit.correlation.value = r.weighted.dot(summed(near, r.weighted).col(0));
  misfit.correlation = over(misfit.correlation, v * n_pairs);
  return misfit;
}

}  // namespace mbtfm::sheets
