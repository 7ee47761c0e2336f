/// What a user says of a traction reconstruction.
#pragma once

#include <array>
#include <optional>

#include "mbtfm/inverse/regularisation.h"
#include "mbtfm/tractions/methods.h"
#include "pipeline/contract/gel.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::tractions {

using namespace inverse;  // criteria, spectra and scans are that room's

/// How the tractions of a lattice are read out.
enum class ReadOut {
  cells,  ///< their mean over the cell around each node: sums of traction times area are forces
  points  ///< at the nodes, as Butler et al. 2002
};
constexpr auto words(ReadOut) { return std::array{"cells", "points"}; }

struct TractionParameters {
  /// Unset: fttc; of beads in space group-l1 where there are adhesions, else tikhonov.
  std::optional<TractionMethod> method;
  GelModel gel_model = GelModel::layer;               ///< gels are some tens of um thick: a cell feels the base
  LambdaCriterion lambda_by = LambdaCriterion::risk;  ///< aims at the tractions; the others at the displacements
  std::optional<double> lambda_um_per_kPa;            ///< fixed instead
  std::optional<double> spacing_um;                   ///< of the lattice
  double padding = 1.5;  ///< neighbours' images half a field away: their dipole fields are small
  ReadOut read_out = ReadOut::cells;
  double gaussian_um = 0;  ///< regularisation smooths already
  double element_um = 2;   ///< bem: the finest that some 10 000 beads of 20 nm noise resolve
  double grow_um = 1.5;    ///< smoothed tractions spill over an adhesion's rim by about that
};
void declare(stage::ParameterList& list, TractionParameters& parameters);

}  // namespace mbtfm::tractions
