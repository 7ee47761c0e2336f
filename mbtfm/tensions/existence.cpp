#include "mbtfm/tensions/existence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "pipeline/contract/errors.h"

namespace mbtfm::tensions {

namespace {

constexpr double kLeast_nN = 1e-9;  ///< far below any tension: for a fit without noise, or without other fibres

/// Sum of the squares of tensions.
struct Squares {
  double nN2 = 0;
  int n = 0;
  void add(double tension_nN) {
    nN2 += tension_nN * tension_nN;
    ++n;
  }
  double mean() const { return nN2 / std::max(1, n); }
};

}  // namespace

double log_odds(double confidence, double tension_nN, double sigma_nN, double usual_nN) {
  const double w = std::hypot(sigma_nN, usual_nN), x = tension_nN * usual_nN / (sigma_nN * w);
  const double phi = 0.5 * std::erfc(-x / std::numbers::sqrt2);
  return std::log(confidence / (1 - confidence)) + std::log(2 * sigma_nN / w) + x * x / 2 + std::log(phi);
}

std::vector<double> existence_of(const EnsembleFit& fit, const std::vector<Fibre>& fibres) {
  std::vector<const Fibre*> fitted;
  for (std::size_t i = 1; i < fit.tensions.fibre_ids.size(); ++i) {
    const auto fibre = std::ranges::find(fibres, fit.tensions.fibre_ids[i], &Fibre::fibre_id);
    MBTFM_ASSERT(fibre != fibres.end());
    fitted.push_back(&*fibre);
  }
  std::vector<double> existence;
  for (std::size_t i = 0; i < fitted.size(); ++i) {
    Squares of_type, of_all;
    for (std::size_t j = 0; j < fitted.size(); ++j) {
      if (j == i) continue;
      const double tension_nN = fit.tensions.nN[j + 1].value;
      of_all.add(tension_nN);
      if (fitted[j]->type == fitted[i]->type) of_type.add(tension_nN);
    }
    of_type.add(std::sqrt(of_all.mean()));
    const Estimate& tension = fit.tensions.nN[i + 1];
    const double odds = log_odds(fitted[i]->confidence, tension.value, std::max(kLeast_nN, tension.standard_error),
                                 std::max(kLeast_nN, std::sqrt(of_type.mean())));
    existence.push_back(1 / (1 + std::exp(-odds)));
  }
  return existence;
}

}  // namespace mbtfm::tensions
