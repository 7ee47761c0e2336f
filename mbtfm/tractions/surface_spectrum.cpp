#include "mbtfm/tractions/surface_spectrum.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "substrate/greens/wave.h"
#include "substrate/material.h"

namespace mbtfm::tractions {

using std::numbers::pi;

double sinc(double x) { return x == 0 ? 1 : std::sin(x) / x; }

namespace {

/// The mean of the compliance over the rectangle of wave numbers around zero that has no wave but the zero one. The
/// half-space's 1/k is integrable there: k dk dphi cancels it. By symmetry only the mean of along and across is left.
double mean_around_zero(const Gel& gel, GelModel model, double side_x_per_um, double side_y_per_um) {
  constexpr int kAngles = 16, kRadii = 64;  // midpoints: to 1e-4, of one wave among thousands
  double sum = 0;
  for (const auto& [half, other] :
       {std::pair{side_x_per_um / 2, side_y_per_um / 2}, std::pair{side_y_per_um / 2, side_x_per_um / 2}}) {
    const double corner = std::atan2(other, half);
    for (int a = 0; a < kAngles; ++a) {
      const double reach = half / std::cos(corner * (a + 0.5) / kAngles);
      for (int r = 0; r < kRadii; ++r) {
        const double k = reach * (r + 0.5) / kRadii;
        const greens::WaveCompliance c = greens::wave_compliance(gel, model, k);
        sum += 0.5 * (c.along_um_per_kPa + c.across_um_per_kPa) * k * (reach / kRadii) * (corner / kAngles);
      }
    }
  }
  return 4 * sum / (side_x_per_um * side_y_per_um);
}

double zero_wave_um_per_kPa(const Gel& gel, GelModel model, Surroundings surroundings, double step_x, double step_y) {
  if (surroundings == Surroundings::open) return mean_around_zero(gel, model, step_x, step_y);
  // A periodic half-space yields to a mean traction without end: its mean displacement shows nothing, and 0 marks that.
  if (model == GelModel::half_space) return 0;
  return gel.thickness_um / substrate::shear_modulus_kPa(gel);  // simple shear: (8) as k -> 0
}

}  // namespace

SurfaceSpectrum::SurfaceSpectrum(const Gel& gel, GelModel model, const Lattice& lattice, Surroundings surroundings) {
  const int n_x = lattice.n_columns, n_y = lattice.n_rows;
  const int n_half = n_x / 2 + 1;
  const Eigen::Index n_waves = static_cast<Eigen::Index>(n_half) * n_y;
  for (auto* array : {&along_, &across_, &cos_, &sin_}) array->setZero(n_waves);
  const double step_x = 2 * pi / (n_x * lattice.spacing_um), step_y = 2 * pi / (n_y * lattice.spacing_um);
  smallest_ = std::numeric_limits<double>::infinity();
  for (int j = 0; j < n_y; ++j) {
    for (int i = 0; i < n_half; ++i) {
      if (i == 0 && j == 0) continue;
      const Eigen::Index at = i + static_cast<Eigen::Index>(n_half) * j;
      const double k_x = step_x * i, k_y = step_y * (2 * j <= n_y ? j : j - n_y);
      const double k2 = k_x * k_x + k_y * k_y;
      const greens::WaveCompliance c = greens::wave_compliance(gel, model, std::sqrt(k2));
      smallest_ = std::min({smallest_, c.along_um_per_kPa, c.across_um_per_kPa});
      cos_[at] = k_x / std::sqrt(k2);
      sin_[at] = k_y / std::sqrt(k2);
      along_[at] = c.along_um_per_kPa;
      across_[at] = c.across_um_per_kPa;
      if (2 * i != n_x && 2 * j != n_y) continue;
      // The shortest wave of an even lattice runs both ways at once: the mean of the two tensors, whose mixed part
      // cancels.
      const double x_share = k_x * k_x / k2;
      const double along = along_[at], across = across_[at];
      along_[at] = x_share * along + (1 - x_share) * across;
      across_[at] = x_share * across + (1 - x_share) * along;
      cos_[at] = 1;
      sin_[at] = 0;
    }
  }
  along_[0] = across_[0] = zero_wave_um_per_kPa(gel, model, surroundings, step_x, step_y);
  cos_[0] = 1;
}

}  // namespace mbtfm::tractions
