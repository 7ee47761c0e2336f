/// What the fit noticed of its data and of its own answer.
#pragma once

#include <optional>
#include <vector>

#include "mbtfm/tensions/beyond_cut.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/missing_adhesions.h"
#include "mbtfm/tensions/placement.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/findings.h"
#include "pipeline/contract/fit_summary.h"

namespace mbtfm::tensions {

/// What the findings are read off.
struct FitOutcome {
  const EnsembleFit& fit;
  const LinearData& data;
  const Cell& cell;  ///< with its fibres, whether in the network or not
  const FitSummary& summary;
  const std::vector<Tension>& tensions;
  const std::vector<MissingFibre>& missing;
  const std::vector<MissingAdhesion>& missing_adhesions;
  const std::optional<FoundMotion>& motion;
  const std::optional<CurvedMotion>& curved;
  const std::optional<FoundPlacement>& place;
  const std::optional<ForcesBeyond>& beyond;  ///< none: not allowed for
  const Effect& strain;                       ///< large ones of the gel
  bool has_far_beads;                         ///< they determine the noise by themselves
};

/// In the order in which a user should read them.
std::vector<Finding> findings_of(const FitOutcome& outcome);

/// Of what the beads do beyond their noise (squares, as far as the noise is known), the share that the fit leaves; 0 if
/// they do nothing beyond it.
double unexplained_share(const FitSummary& summary);

/// Adhesions (their ids) whose nearest bead is three times the beads' distance away or further: the beads' distance is
/// that of as many on a lattice over the field that they span.
std::vector<int> adhesions_without_beads(const std::vector<Adhesion>& adhesions, const std::vector<Vec2>& beads_um);

/// |sum of forces| and |sum of torques| over the sums of the adhesions' magnitudes, what passes through a cut included:
/// rounding only.
struct Imbalance {
  double force = 0, torque = 0;
};
Imbalance imbalance_of(const EnsembleFit& fit);

}  // namespace mbtfm::tensions
