/// What is in a finished cell folder whose beads are in space.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/surface.h"

namespace mbtfm::report {

/// The beads of such a cell, in its folder.
inline constexpr const char* kBeadsInSpace = "2_track/displacement_3d.csv";

/// A row of 4_traction/traction.csv.
struct SurfaceTraction {
  Vec3 at_um, traction_kPa;
  std::optional<Vec3> sigma_kPa;
  std::optional<double> resolution_um;
  double normal_kPa = 0, tangential_kPa = 0, area_um2 = 0;
};

/// A row of 4_traction/traction_adhesion_forces.csv.
struct ForceInSpace {
  int adhesion_id = 0;
  Vec3 at_um, force_nN;
  double area_um2 = 0;
  std::optional<double> sigma_nN;  ///< along the force
};

struct SpaceResults {
  Path folder;
  std::string name;
  Gel gel;
  HeightMap surface;
  std::vector<BeadInSpace> beads;
  std::vector<SurfaceTraction> tractions;
  std::vector<ForceInSpace> forces;  ///< empty: no adhesions are known
  std::vector<Adhesion> adhesions;
  Polygon outline_um;  ///< empty: not known
  std::map<std::string, double> numbers;
  std::map<std::string, std::string> texts;  ///< of traction.json, too

  /// Of traction.json. @throws InputError where it is not there
  double number(const std::string& key) const;
  std::optional<double> find(const std::string& key) const;
  /// "net_force" in "nN": x, y, z.
  Vec3 vector(const std::string& key, const std::string& unit) const;
};

/// @throws InputError where a file that the stages write lacks or is malformed
SpaceResults read_space_results(const Path& cell);

}  // namespace mbtfm::report
