/// Fields of registered cells on common nodes, their mean and its error.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "mbtfm/mean/registration.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/gel.h"

namespace mbtfm::mean {

/// Displacement and traction of the gel's surface at a place.
struct Sample {
  Vec2 displacement_um, traction_kPa;
};

/// A cell's fields in the frame of the reference: found on a lattice of its own frame, cubic between its nodes (Keys
/// 1981), then turned with it. In the frame of the image the beads fill the lattice, however the cell lies in it; a
/// lattice of the reference's frame would have empty corners, and its tractions another regularisation for each turn.
class CellField {
 public:
  /// @param patches   of a lattice in the cell's own frame, rows first
  /// @param motion    from there to the reference
  /// @param seen      of the beads in the cell's own frame
  CellField(const std::vector<GroundPatch>& patches, const Motion& motion, const Extent& seen);
  /// None where the beads do not reach.
  std::optional<Sample> at(Vec2 place_um) const;
  /// The mean over the motions of a symmetric shape: at each place of the values at all its equivalents.
  std::optional<Sample> at(Vec2 place_um, const std::vector<Motion>& motions) const;

 private:
  Motion motion_;
  Extent seen_;
  Vec2 origin_um_;
  double spacing_um_ = 0;
  int n_columns_ = 0, n_rows_ = 0;
  std::vector<Sample> nodes_;
};

/// Mean over cells, and its standard error: from the scatter of the cells, so that it holds all that differs between
/// them: noise of beads, registration, biology.
struct NodeMean {
  Vec2 position_um;
  bool is_inside = false;  ///< of the reference
  int n_cells = 0;
  Sample mean;
  std::optional<Sample> sigma = {};  ///< of each component; none for fewer than two cells
};

/// @param samples  by cell, then by node
std::vector<NodeMean> mean_of(const std::vector<Vec2>& nodes_um,
                              const std::vector<std::vector<std::optional<Sample>>>& samples,
                              const Polygon& reference_um);

/// Nodes of a lattice over the reference and some margin.
std::vector<Vec2> lattice_over(const Polygon& reference_um, double margin_um, double spacing_um);

/// Where an outline reaches out: its points that are farthest from the centroid, each by a tenth more than the mean.
std::vector<Vec2> tips_of(const Polygon& reference_um);

/// By node: which part of the edge it belongs to.
enum class EdgePart { none, tip, edge };
std::vector<EdgePart> edge_parts(const std::vector<Vec2>& nodes_um, const Polygon& reference_um, double band_um,
                                 double tip_um);

/// Traction towards the centroid at the tips over that at the rest of the edge: both are linear in the tractions, so
/// that noise does not add to them as it does to magnitudes.
struct Ratio {
  double tip_kPa = 0, edge_kPa = 0, ratio = 0;
  double low = 0, high = 0;  ///< 95 % by resampling the cells
  int n_cells = 0;
};
std::optional<Ratio> tip_over_edge(const std::vector<Vec2>& nodes_um,
                                   const std::vector<std::vector<std::optional<Sample>>>& samples,
                                   const std::vector<EdgePart>& parts, Vec2 centre_um, std::uint64_t seed);

// Tractions of a registered cell by FTTC, and what the same way makes of other tractions.

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
