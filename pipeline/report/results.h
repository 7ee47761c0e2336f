/// What is in a finished cell folder.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/beads.h"
#include "pipeline/contract/fit_summary.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/network.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/results.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/map_parts.h"

namespace mbtfm::report {

/// The images behind a segmentation, as one picture, and where it lies.
struct Images {
  Path file;  ///< JPEG
  Extent place;
};

/// What the usual method (FTTC) says of the same beads: tractions at the middles of squares.
struct UsualMethod {
  std::vector<Vec2> positions_um, tractions_kPa;
  double spacing_um = 0;  ///< side of the squares
  double total_force_nN = 0;
  std::optional<double> lambda_um_per_kPa;  ///< none if no bead has moved
  std::string lambda_by;                    ///< the criterion that chose it
  std::string obstacle = {};                ///< why it has no tractions; empty: it has
};

struct CellResults {
  Path folder;
  std::string name;
  Gel gel;
  Cell cell = {};
  DisplacementField displacement;
  Network network;
  ContractedNetwork contracted;
  std::map<int, Tension> tensions;  ///< by fibre id; 0: the actin network
  std::vector<AdhesionForce> forces;
  FitSummary fit;
  std::optional<VectorField> residual;  ///< what the fitted model leaves of the measured displacement, at the beads
  std::optional<UsualMethod> usual_method;
  std::optional<Comparison> comparison;  ///< of a simulated cell
  std::optional<Images> images = {};     ///< of the cell
  std::optional<Images> bead_images;     ///< both on each other
  std::vector<MissingFibre> missing_fibres;
  std::vector<MissingAdhesion> missing_adhesions;
};

/// @throws InputError where a file that the stages write lacks or is malformed
CellResults read_results(const Path& cell);

bool has_origin(const Cell& cell, AdhesionOrigin origin);
/// Some were put where nobody saw one.
bool has_assumed(const Cell& cell);
/// Adhesion by id.
std::map<int, const Adhesion*> adhesions_by_id(const Cell& cell);

/// |sum of forces| and |sum of torques about the centre of the adhesions|, relative to the sum of the magnitudes.
struct Balance {
  double net_force = 0, net_torque = 0;
  bool has_moments = false;  ///< those of single adhesions are in the table, and counted
};
Balance balance_of(const CellResults& results);

/// A number of fit.json; none where it is not there or is no number.
std::optional<double> figure_of(const FitSummary& fit, std::string_view name);

}  // namespace mbtfm::report
