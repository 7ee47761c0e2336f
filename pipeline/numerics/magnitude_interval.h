/// How long a vector is whose components are known with an error.
#pragma once

namespace mbtfm::numerics {

struct MagnitudeInterval {
  double low = 0, high = 0;
};

/// 95 % interval of the length F of a plane vector, from the length R that was found, both components with the same
/// normal error σ. R follows Rice's distribution, P(R) = 1 − Q₁(F/σ, R/σ) with Marcum's Q, and
///
///   low:   P(R | low)  = 0.975, 0 where P(R | 0) is less
///   high:  P(R | high) = 0.025 P(R | 0)
///
/// Covers the true length in 95 % of the cases where it is 5 σ or more, in 97.5 % up to 2 σ; never negative,
/// never empty. Without the factor P(R | 0), which is 1 from 3 σ on, a small R would leave no length at all.
/// @param sigma  0: the length is exact; infinite: so is `high`
/// Source: Rice, Bell Syst. Tech. J. 24, 46 (1945), (3.10-11); Read, J. Phys. G 28, 2693 (2002), for the factor.
MagnitudeInterval magnitude_interval_95(double magnitude, double sigma);

}  // namespace mbtfm::numerics
