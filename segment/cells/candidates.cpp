#include "segment/cells/candidates.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::cells {

void declare(stage::ParameterList& list, CandidateParameters& p) {
  list.table("segment");
  list.add("adhesions", p.adhesions);
  list.add("candidate_spacing_um", p.candidate_spacing_um, Range::size_um());
  list.add("candidate_band_um", p.candidate_band_um, Range::size_um());
  list.add("anchor_area_um2", p.anchor_area_um2, Range::area_um2());
}

AdhesionSource source_of(const CandidateParameters& p, bool shows_adhesions, bool has_mask) {
  if (!p.adhesions) return shows_adhesions ? AdhesionSource::image : AdhesionSource::cell;
  if (p.adhesions == AdhesionSource::image && !shows_adhesions)
    throw UsageError(
        "adhesions = image: no adhesion image, no adhesion mask and no adhesions drawn by hand are given; give one, or "
        "set adhesions = cell");
  if (p.adhesions == AdhesionSource::pattern && !has_mask)
    throw UsageError(
        "adhesions = pattern: no adhesion mask is given, which says where the pattern is; give it as --adhesion-mask");
  return *p.adhesions;
}

std::vector<Vec2> hexagonal_lattice(Vec2 low_um, Vec2 high_um, double spacing_um, Placement placement) {
  const double rows_um = std::sqrt(3.0) / 2 * spacing_um;
  const double shift = placement == Placement::second ? 0.5 : 0;  // of each lattice vector
  const Vec2 middle = 0.5 * (low_um + high_um);
  const int n_rows = static_cast<int>(std::ceil((high_um.y - low_um.y) / 2 / rows_um)) + 1;
  std::vector<Vec2> points;
  for (int row = -n_rows; row <= n_rows; ++row) {
    const double y = middle.y + (row + shift) * rows_um;
    if (y < low_um.y || y > high_um.y) continue;
    // a column further along x, a row half a column aside
    const double aside = (0.5 * (row + shift) + shift) * spacing_um;
    const int first = static_cast<int>(std::ceil((low_um.x - middle.x - aside) / spacing_um));
    const int last = static_cast<int>(std::floor((high_um.x - middle.x - aside) / spacing_um));
    for (int column = first; column <= last; ++column) points.push_back({middle.x + aside + column * spacing_um, y});
  }
  return points;
}

Adhesion disc(Vec2 position_um, double diameter_um, AdhesionOrigin origin) {
  return {.adhesion_id = 0,
          .position_um = position_um,
          .area_um2 = std::numbers::pi / 4 * diameter_um * diameter_um,
          .major_axis_um = diameter_um,
          .minor_axis_um = diameter_um,
          .origin = origin};
}

Adhesion anchor(Vec2 position_um, double area_um2) {
  return disc(position_um, std::sqrt(4 / std::numbers::pi * area_um2), AdhesionOrigin::anchor);
}

int next_id(const std::vector<Adhesion>& adhesions) {
  int largest_id = 0;
  for (const Adhesion& a : adhesions) largest_id = std::max(largest_id, a.adhesion_id);
  return largest_id + 1;
}

Adhesion Anchors::at(Vec2 end) {
  Adhesion made = anchor(end, area_um2_);
  for (std::size_t i = n_seen_; i < adhesions_.size(); ++i)
    if (norm(adhesions_[i].position_um - end) < made.major_axis_um / 2) return adhesions_[i];
  made.adhesion_id = next_id(adhesions_);
  adhesions_.push_back(made);
  return made;
}

std::vector<Adhesion> candidates_at(const std::vector<Vec2>& ends_um, double spacing_um) {
  std::vector<Adhesion> candidates;
  for (const Vec2 end : ends_um) {
    const bool is_near = std::ranges::any_of(
        candidates, [&](const Adhesion& other) { return norm(other.position_um - end) < spacing_um; });
    if (!is_near) candidates.push_back(disc(end, spacing_um, AdhesionOrigin::candidate));
  }
  return numbered(std::move(candidates));
}

std::vector<Adhesion> numbered(std::vector<Adhesion> adhesions) {
  for (std::size_t i = 0; i < adhesions.size(); ++i) adhesions[i].adhesion_id = static_cast<int>(i) + 1;
  return adhesions;
}

}  // namespace mbtfm::cells
