/// Seeded random numbers that are the same with every standard library: the engine is the standard's, whose bits are
/// fixed; the distributions, which the standard leaves to each library, are our own.
#pragma once

#include <cstdint>
#include <optional>
#include <random>

namespace mbtfm::drawing {

/// What a stream of random numbers is for. Each has its own, so that more noise or more beads leave the cell as it is.
enum class Stream : std::uint64_t {
  outline,
  tensions,
  fibres,
  adhesions,
  beads,
  noise,
  specimen,
  optics,
  camera,
  faults
};

class Random {
 public:
  /// @param index  further streams of the same kind (one a row of an image, say)
  Random(std::uint64_t seed, Stream stream, std::uint64_t index = 0);

  /// Evenly in [0, 1).
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// 0 … n−1.
  int below(int n) { return static_cast<int>(uniform() * n); }
  /// Mean 0, standard deviation 1 (Box & Muller 1958).
  double normal();
  /// Number of events of the given mean >= 0 (Hörmann 1993, PTRS; by multiplication below 10).
  double poisson(double mean);

 private:
  std::mt19937_64 engine_;
  std::optional<double> spare_;
};

/// A log-normal variable kept between two bounds: what lies outside is drawn again.
struct LogNormal {
  double median = 1;  ///< before the bounds
  double log_sd = 0;  ///< of the logarithm; 0: the median itself
  double low = 0;
  double high = 0;
};
/// @throws UsageError where next to nothing lies between the bounds
double draw(Random& random, const LogNormal& distribution);
double mean_of(const LogNormal& distribution);
/// The same distribution with its median moved so that the mean between the bounds is `mean`.
/// @throws UsageError where the mean is not between the bounds
LogNormal with_mean(LogNormal distribution, double mean);

}  // namespace mbtfm::drawing
