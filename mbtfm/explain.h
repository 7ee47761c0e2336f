/// What the tensions would be if an effect that is off were on: an estimate, from one Gauss–Newton step (two where the
/// network itself changes) at the fit's own solution. docs/effects.md says how near these come to a fit with it on.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "mbtfm/ensemble.h"

namespace mbtfm::inverse {

struct Change {
  std::string effect;
  Eigen::VectorXd by_tension_nN;  ///< with the effect, less without
};

/// With other displacements for the same forces: a compliance that has the effect. @param with  as the fit's data but
/// for that
Change change_by_data(const std::string& effect, const EnsembleFit& fit, const LinearData& without,
                      const LinearData& with);

/// With networks that carry other forces at the same tensions, and differ otherwise from each other.
Change change_by_networks(const std::string& effect, const EnsembleFit& fit, const LinearData& data,
                          const std::vector<network::CableNetwork>& with, const std::vector<int>& adhesion_ids,
                          int threads);

/// With a robust loss. @param data  weighed by squares
Change change_by_loss(const std::string& effect, const EnsembleFit& fit, const LinearData& data,
                      const std::string& robust_kind);

/// With a turn of the whole field, about its centre, found together with the tensions and taken off.
Change change_by_turn(const std::string& effect, const EnsembleFit& fit, const LinearData& data,
                      const std::vector<Vec2>& points_um);

/// |change| / |t| over the fibres, or of the network where there are none.
double relative(const Change& change, const EnsembleFit& fit);

/// "change the tensions by 0.8 %, that of fibre 7 by 0.05 nN"
std::string sentence(const Change& change, const EnsembleFit& fit);

/// Columns effect, fibre_id, change_nN.
void write_changes(const std::filesystem::path& file, const std::vector<Change>& changes, const EnsembleFit& fit);

}  // namespace mbtfm::inverse
