/// Random numbers that are the same on every platform (the standard's distributions are not).
#pragma once

#include <cstdint>
#include <random>

namespace mbtfm::mesh {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  /// Evenly spread over [0, 1), from the upper 53 bits.
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

 private:
  std::mt19937_64 engine_;
};

}  // namespace mbtfm::mesh
