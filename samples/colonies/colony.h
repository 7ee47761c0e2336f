/// Colonies that contract on a gel or on springs, with random dipoles inside: what their beads show.
#pragma once

#include <vector>

#include "continuum/sheet/forward.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/work.h"
#include "samples/colonies/parameters.h"
#include "samples/colonies/shapes.h"
#include "samples/drawing/scenario.h"

namespace mbtfm::colonies {

/// From the sheet's frame to the field's: turned about the origin, then moved.
struct Pose {
  Vec2 place_um;
  double angle_rad = 0;
  Vec2 vector(Vec2 v) const;
  Vec2 at(Vec2 p) const { return place_um + vector(p); }
  Vec2 back(Vec2 p) const;
};
Polygon posed(const Polygon& polygon, const Pose& pose);

struct Dipole {
  Vec2 middle_um, arm_um;  ///< from the middle to the second force
  double force_nN = 0;     ///< > 0: both point to the middle
};

/// One of them, in the frame of the field.
struct Colony {
  Pose pose;
  Polygon outline_um;
  std::vector<Polygon> adhesive_um;
  std::vector<Dipole> dipoles;
  DisplacementField displacement;  ///< true, at the beads
  DisplacementField measured;      ///< with noise
  double noise_um = 0, largest_displacement_um = 0;
};

/// What is the same for all colonies.
class Contracting {
 public:
  /// @throws UsageError where the sheet is not whole; InvalidData, NotSolved
  Contracting(const ColonyParameters& colony, const sheet::SheetParameters& sheet,
              const drawing::ScenarioParameters& scenario, const Work& work);

  const sheet::Solution& solution() const { return solution_; }
  bool is_on_gel() const { return gel_ != nullptr; }
  /// The colony of this number, from 0: the seed is the scenario's and the number.
  /// @throws UsageError where it does not lie in the field
  Colony colony(int number) const;

 private:
  std::vector<Vec2> displaced_um(const std::vector<Vec2>& points_um, const std::vector<Dipole>& dipoles) const;
  ColonyParameters parameters_;
  drawing::ScenarioParameters scenario_;
  Outline outline_;
  sheet::Solution solution_;
  std::unique_ptr<const substrate::Substrate> gel_;  ///< none: on springs
};

/// Of a colony: the scenario's, another for each number.
std::uint64_t seed_of(const drawing::ScenarioParameters& scenario, int number);

}  // namespace mbtfm::colonies
