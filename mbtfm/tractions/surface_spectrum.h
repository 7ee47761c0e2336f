/// How an elastic surface answers to waves of traction: its Green's function in Fourier space.
#pragma once

#include "pipeline/contract/gel.h"
#include "pipeline/numerics/waves.h"

namespace mbtfm::tractions {

using numerics::Lattice;
using numerics::NodeField;
using numerics::WaveField;
using numerics::WaveTransform;

/// What lies beyond the lattice.
enum class Surroundings {
  periodic,  ///< its own images: a wave is exactly itself
  open       ///< nothing more: the lattice is padded, and its zero wave represents all longer ones
};

double sinc(double x);

/// The compliance of every stored wave of a lattice, in the frame of its wave vector.
class SurfaceSpectrum {
 public:
  SurfaceSpectrum(const Gel& gel, GelModel model, const Lattice& lattice, Surroundings surroundings);

  const Eigen::ArrayXd& along_um_per_kPa() const { return along_; }  ///< by wave
  const Eigen::ArrayXd& across_um_per_kPa() const { return across_; }
  /// Of all waves that displace the surface at all.
  double smallest_um_per_kPa() const { return smallest_; }

  /// To the frame of the wave vectors, in which the compliance is diagonal: x becomes along, y across. And back: it is
  /// a reflection.
  void turn(WaveField& waves) const {
    for (Eigen::Index k = 0; k < waves.x.size(); ++k) turn(k, waves.x[k], waves.y[k]);
  }
  void turn(Eigen::Index wave, std::complex<double>& x, std::complex<double>& y) const {
    const double c = cos_[wave], s = sin_[wave];
    const std::complex<double> along = c * x + s * y;
    y = s * x - c * y;
    x = along;
  }
  /// Tractions (x, y) to displacements.
  void displace(WaveField& waves) const {
    for (Eigen::Index k = 0; k < waves.x.size(); ++k) {
      turn(k, waves.x[k], waves.y[k]);
      waves.x[k] *= along_[k];
      waves.y[k] *= across_[k];
      turn(k, waves.x[k], waves.y[k]);
    }
  }

 private:
  Eigen::ArrayXd along_, across_;
  Eigen::ArrayXd cos_, sin_;  ///< of the direction of the wave vector
  double smallest_ = 0;
};

}  // namespace mbtfm::tractions
