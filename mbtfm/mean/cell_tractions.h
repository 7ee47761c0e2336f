/// Tractions of a registered cell by FTTC, and what the same way makes of other tractions.
#pragma once

#include <functional>

#include "mbtfm/mean/average.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/gel.h"

namespace mbtfm::mean {

/// A cell's beads in its own frame, with the gel under it, and how it is laid onto the reference.
struct Registered {
  DisplacementField beads;
  Gel gel;
  Motion motion;
  double shift_error_um = 0, angle_error_rad = 0;
};

/// That of the least expected error of the tractions.
double lambda_by_risk_um_per_kPa(const Registered& cell, const tractions::TractionParameters& parameters);

CellField field_of(const Registered& cell, const tractions::TractionParameters& parameters, double lambda_um_per_kPa);

/// What FTTC would find of these tractions from the cell's beads, without noise: tractions of the reference's frame are
/// brought to the cell, displace its beads, and are found again. So a model is blurred as the cell is.
/// @param traction_kPa  by place
CellField blurred(const std::function<Vec2(Vec2 place_um)>& traction_kPa, const Registered& cell,
                  const tractions::TractionParameters& parameters, double lambda_um_per_kPa);

/// Which part of a wave of traction is left: of the mean, along and across the wave, by the regularisation of each cell
/// and its error of registration, in turn.
struct WaveShare {
  double wavelength_um = 0, along = 0, across = 0, registration = 0;
};
std::vector<WaveShare> wave_shares(const std::vector<Registered>& cells, const std::vector<double>& lambdas_um_per_kPa,
                                   GelModel model, double size_um);

/// Standard deviation of the Gaussian that leaves half of the wave of which this leaves half.
double gaussian_um(const std::vector<WaveShare>& shares, const std::function<double(const WaveShare&)>& share);

}  // namespace mbtfm::mean
