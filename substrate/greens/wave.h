/// How the gel's surface answers to a wave of traction: its Green's function in Fourier space.
#pragma once

#include "pipeline/contract/gel.h"

namespace mbtfm::greens {

/// Displacement (um) by a wave of unit traction (1 kPa), along and across its wave vector.
struct WaveCompliance {
  double along_um_per_kPa = 0, across_um_per_kPa = 0;
};
/// docs/theory/reconstructions.md (8). @param wave_number_per_um  > 0
WaveCompliance wave_compliance(const Gel& gel, GelModel model, double wave_number_per_um);

}  // namespace mbtfm::greens
