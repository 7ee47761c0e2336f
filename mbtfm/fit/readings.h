/// Is there a simple mistake in how the displacement was read? Where the model leaves much of it, other readings of the
/// same numbers are tried: images mirrored or turned against each other, components exchanged or of the other sign,
/// another scale, a field that was smoothed. One that explains much more names the mistake.
#pragma once

#include <optional>
#include <string>

#include "mbtfm/tensions/linear_data.h"
#include "pipeline/contract/findings.h"

namespace mbtfm::fit {

struct GelUnderCell;

struct Reading {
  std::string what;              ///< what mends it: "once the bead images are mirrored from left to right"
  double unexplained_share = 0;  ///< of what the beads do beyond their noise
  double unexplained_as_is = 0;  ///< the same of the displacement as it was given
};

/// Of a fit that leaves more than this of what the beads do beyond their noise, other readings are looked for.
inline constexpr double kMuchUnexplained = 0.05;

/// The way of reading the displacement that the model explains best: images mirrored, transposed or turned, components
/// exchanged or of the other sign, places of another scale. The model is linear in its tensions, of any sign.
/// @param beads  as they were given, in the frame of the images
/// @param force_derivatives  of the adhesions' forces by tension: 2·adhesions × tensions. Forces independent of each
///                           other would explain much of what is read wrongly, too
/// @param noise_um  of a component, as beads far from the cell show it
Reading best_reading(const GelUnderCell& on, const DisplacementField& beads, const MatrixXd& force_derivatives,
                     double noise_um);

/// The smoothing under which the model explains the displacement best: a Gaussian of 0.5 to 6 um over its beads.
/// @param force_derivatives, noise_um  as above
Reading best_smoothing(const tensions::LinearData& data, const MatrixXd& force_derivatives, double noise_um);

/// @param symptom  read_otherwise or field_smoothed
std::optional<Finding> noticed_reading(Symptom symptom, const Reading& reading);

/// The best ones. None: not looked for.
struct Readings {
  std::optional<Reading> other = {}, smoothed = {};
};
/// One of them is noticed.
bool is_read_wrongly(const Readings& readings);

}  // namespace mbtfm::fit
