/// What is in a finished cell folder whose beads are in space; maps of tractions, and how far two of them differ.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/results_in_space.h"
#include "pipeline/contract/surface.h"

namespace mbtfm::report {

/// The beads of such a cell, in its folder.
inline constexpr const char* kBeadsInSpace = "2_track/displacement_3d.csv";

struct SpaceResults {
  Path folder;
  std::string name;
  Gel gel;
  HeightMap surface;
  std::vector<BeadInSpace> beads;
  std::vector<SurfaceTraction> tractions;
  std::vector<PartForce> forces;  ///< empty: no adhesions are known
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

/// On an even lattice of x and y, some of whose places may lack.
struct SpaceMap {
  std::vector<Vec3> at_um, traction_kPa;
  std::vector<double> area_um2;             ///< of the surface around each
  double total_force_nN = 0;                ///< sum of the sizes
  std::optional<double> stated_error = {};  ///< root mean square of the standard errors over that of the tractions
};
/// What the stage found.
SpaceMap map_of(const SpaceResults& results);
/// Its strongest traction's size.
double largest_kPa(const SpaceMap& map);

/// Of a simulated cell.
bool has_space_truth(const Path& cell);
/// @throws InputError
SpaceMap true_space_map(const Path& cell);

/// The tractions of a map, bilinear between the neighbours of its lattice.
class TractionsBetween {
 public:
  /// @throws InputError for less than two columns or rows
  explicit TractionsBetween(const SpaceMap& map);
  struct Found {
    Vec3 traction_kPa = {};  ///< zero beyond the last places, and where one lacks as if it were zero there
    bool is_whole = false;   ///< none of the four neighbours lacks
  };
  Found at(Vec2 place_um) const;

 private:
  Vec2 in_steps(Vec2 place_um) const;
  Vec2 origin_um_, spacing_um_, last_;  ///< last_: column and row
  std::map<std::pair<long, long>, Vec3> traction_kPa_;
};

/// sqrt(∫ |t − t_reference|² dA / ∫ |t_reference|² dA) over the places of the reference.
double difference(const SpaceMap& map, const SpaceMap& reference);

}  // namespace mbtfm::report
