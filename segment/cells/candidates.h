/// Where adhesions may be, where nothing shows them: the force is then spread over candidates.
#pragma once

#include <optional>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::cells {

/// Where the adhesions come from.
enum class AdhesionSource {
  image,       ///< an image of them, a mask, or drawn by hand
  pattern,     ///< they may be anywhere on the adhesive pattern beneath the cell
  fibre_ends,  ///< at the ends of the fibres
  cell,        ///< there, and along the rim of the cell
  none         ///< nowhere: outline and fibres alone, as for a sheet
};
constexpr auto words(AdhesionSource) { return std::array{"image", "pattern", "fibre-ends", "cell", "none"}; }

struct CandidateParameters {
  std::optional<AdhesionSource> adhesions =
      {};  ///< unset: as they are seen, if anything shows them; else on the whole cell's rim
  /// Beads lie some 1 um apart and a force's field falls off within its own size: forces nearer than two such
  /// distances cannot be separated.
  double candidate_spacing_um = 2;
  /// From the cell's edge inwards: nine of ten adhesions of a spread cell lie this near to it.
  double candidate_band_um = 6;
  double anchor_area_um2 = 1;  ///< of a mature adhesion that holds a stress fibre; seen ones have 0.5 to 2 um²
};
void declare(stage::ParameterList& list, CandidateParameters& parameters);

/// The source that the parameters name; else the image where anything shows the adhesions, else the cell.
/// @throws UsageError where the source that they name is not there
AdhesionSource source_of(const CandidateParameters& parameters, bool shows_adhesions, bool has_mask);

/// Two independent guesses where the candidates are: what differs between their answers is the error of guessing.
enum class Placement { first, second };

/// Discs on a hexagonal lattice, which touch their neighbours: those whose centre `is_possible`. The second placement
/// is shifted by half a lattice cell along both axes. Ids from 1.
/// @param low_um,high_um  of the box to fill; the lattice has a point in its middle
template <class IsPossible>
std::vector<Adhesion> lattice_candidates(Vec2 low_um, Vec2 high_um, double spacing_um, Placement placement,
                                         const IsPossible& is_possible);

/// A disc of this diameter.
Adhesion disc(Vec2 position_um, double diameter_um, AdhesionOrigin origin);
/// The disc that holds an end of a drawn fibre where no adhesion is.
Adhesion anchor(Vec2 position_um, double area_um2);

/// An id that none of them has: after the largest.
int next_id(const std::vector<Adhesion>& adhesions);

/// Adds anchors; ends that meet share one.
class Anchors {
 public:
  /// @param adhesions  must outlive this
  Anchors(std::vector<Adhesion>& adhesions, double area_um2)
      : adhesions_(adhesions), n_seen_(adhesions.size()), area_um2_(area_um2) {}
  Adhesion at(Vec2 end);

 private:
  std::vector<Adhesion>& adhesions_;
  std::size_t n_seen_;
  double area_um2_;
};

/// Candidates at these ends of fibres, one for ends that are less than a spacing apart.
std::vector<Adhesion> candidates_at(const std::vector<Vec2>& ends_um, double spacing_um);

/// With ids from 1.
std::vector<Adhesion> numbered(std::vector<Adhesion> adhesions);

// --- implementation of the template

std::vector<Vec2> hexagonal_lattice(Vec2 low_um, Vec2 high_um, double spacing_um, Placement placement);

template <class IsPossible>
std::vector<Adhesion> lattice_candidates(Vec2 low_um, Vec2 high_um, double spacing_um, Placement placement,
                                         const IsPossible& is_possible) {
  std::vector<Adhesion> candidates;
  for (const Vec2 point : hexagonal_lattice(low_um, high_um, spacing_um, placement))
    if (is_possible(point)) candidates.push_back(disc(point, spacing_um, AdhesionOrigin::candidate));
  return numbered(std::move(candidates));
}

}  // namespace mbtfm::cells
