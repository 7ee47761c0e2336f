/// How an elastic surface answers to waves of traction: its Green's function in Fourier space.
#pragma once

#include "mbtfm/waves.h"

namespace mbtfm::inverse {

enum class GelModel { half_space, layer };

/// Displacement (um) by a wave of unit traction (1 kPa), along and across its wave vector.
struct WaveCompliance {
  double along_um_per_kPa = 0, across_um_per_kPa = 0;
};
/// docs/theory.md (8). @param wave_number_per_um  > 0
WaveCompliance wave_compliance(const Gel& gel, GelModel model, double wave_number_per_um);

/// What lies beyond the lattice.
enum class Surroundings {
  periodic,  ///< its own images: a wave is exactly itself
  open       ///< nothing more: the lattice is padded, and its zero wave stands for all that are longer than it
};

/// What the values at the nodes mean.
enum class Basis {
  waves,  ///< a sum of the lattice's waves
  cells   ///< traction even over the cell around each node: its waves are weaker by sinc(kx a/2) sinc(ky a/2)
};

/// The compliance of every stored wave of a lattice, in the frame of its wave vector.
class SurfaceSpectrum {
 public:
  SurfaceSpectrum(const Gel& gel, GelModel model, const Lattice& lattice, Surroundings surroundings,
                  Basis basis = Basis::waves);

  /// Write each wave times f(compliance), f acting on the along and the across part, to `result`, which may be `waves`.
  template <class F>
  void apply(const WaveField& waves, const F& f, WaveField& result) const;
  /// Sum over the stored waves of weight · (f(along) + f(across)).
  template <class F>
  double trace(const Eigen::ArrayXd& weights, const F& f) const;
  /// Of all waves that displace the surface at all.
  double smallest_um_per_kPa() const { return smallest_; }

 private:
  Eigen::ArrayXd along_, across_;
  Eigen::ArrayXd cos_, sin_;  ///< of twice the direction of the wave vector
  double smallest_ = 0;
};

// A symmetric tensor with p along and q across the direction phi is (p + q)/2 + (p − q)/2 [cos 2phi, sin 2phi; …].
template <class F>
void SurfaceSpectrum::apply(const WaveField& waves, const F& f, WaveField& result) const {
  for (Eigen::Index k = 0; k < waves.x.size(); ++k) {
    const double p = f(along_[k]), q = f(across_[k]);
    const double even = 0.5 * (p + q), odd = 0.5 * (p - q);
    const double xx = even + odd * cos_[k], yy = even - odd * cos_[k], xy = odd * sin_[k];
    const std::complex<double> x = waves.x[k], y = waves.y[k];
    result.x[k] = xx * x + xy * y;
    result.y[k] = xy * x + yy * y;
  }
}

template <class F>
double SurfaceSpectrum::trace(const Eigen::ArrayXd& weights, const F& f) const {
  double sum = 0;
  for (Eigen::Index k = 0; k < weights.size(); ++k) sum += weights[k] * (f(along_[k]) + f(across_[k]));
  return sum;
}

}  // namespace mbtfm::inverse
