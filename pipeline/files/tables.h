/// The tables that pass between stages: columns and rows.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/beads.h"
#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/columns.h"

namespace mbtfm::files {

Table<Adhesion> adhesion_table();
Table<Fibre> fibre_table();

struct FibrePoint {
  int fibre_id = 0, point = 0;
  Vec2 position_um;
};
Table<FibrePoint> fibre_point_table();

struct OutlinePoint {
  Vec2 position_um;
  int ring = 0;
  bool is_cut = false;
};
Table<OutlinePoint> outline_table();

Table<Vec2> point_table();
Table<Bead> displacement_table();
Table<BeadInSpace> displacement_in_space_table();

struct FibreTension {
  Tension tension;
  std::optional<FibreType> type;  ///< none: the actin network, or not known
};
/// With none where `fibres` lacks the fibre.
std::vector<FibreTension> with_types(const std::vector<Tension>& tensions, const std::vector<Fibre>& fibres);
Table<FibreTension> tension_table();

struct ForceOnAdhesion {
  AdhesionForce force;
  const Adhesion* adhesion = nullptr;
  std::vector<double> more = {};  ///< of further columns
};
inline const Adhesion& adhesion_of(const ForceOnAdhesion& force) { return *force.adhesion; }
std::vector<ForceOnAdhesion> forces_on(const std::vector<Adhesion>& adhesions,
                                       const std::vector<AdhesionForce>& forces);
Table<ForceOnAdhesion> adhesion_force_table();

struct Reaction {
  int vertex = 0;
  Vec2 force_nN;
};
Table<Reaction> reaction_table();

Table<MissingFibre> missing_fibre_table();
Table<MissingAdhesion> missing_adhesion_table();

/// Where images.jpg lies.
struct ImagePlace {
  Vec2 low_um, size_um;
};
Table<ImagePlace> image_place_table();

/// What the tracker says of a frame of a time series.
struct FrameRow {
  int frame = 0;
  std::string image = {};
  std::optional<int> n_tracked = {};
  std::optional<double> drift_x_um = {}, drift_y_um = {}, turn_deg = {}, noise_um = {}, largest_displacement_um = {};
  std::string refused = {};  ///< why it has no displacements
};
Table<FrameRow> frame_table();

/// Their part of docs/columns.md.
std::string pages_of_cell_tables();

}  // namespace mbtfm::files
