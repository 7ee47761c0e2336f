#include "mbtfm/spatial/region.h"

#include <algorithm>

#include "mbtfm/spatial/observed.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "substrate/compliance.h"
#include "substrate/ellipse.h"

namespace mbtfm::spatial {
namespace {

std::string text_of(const Rectangle& r) {
  return "x " + brief(r.low_um.x) + " to " + brief(r.high_um.x) + ", y " + brief(r.low_um.y) + " to " +
         brief(r.high_um.y) + " um";
}

Rectangle grown(Rectangle r, double by) {
  r.low_um += Vec2{-by, -by};
  r.high_um += Vec2{by, by};
  return r;
}

Rectangle common(const Rectangle& a, const Rectangle& b) {
  return {{std::max(a.low_um.x, b.low_um.x), std::max(a.low_um.y, b.low_um.y)},
          {std::min(a.high_um.x, b.high_um.x), std::min(a.high_um.y, b.high_um.y)}};
}

bool is_empty(const Rectangle& r) { return r.low_um.x >= r.high_um.x || r.low_um.y >= r.high_um.y; }

Rectangle of_beads(const Observed& observed) {
  std::vector<Vec2> places;
  for (const Vec3& p : std::get<std::vector<Vec3>>(observed.at.points_um)) places.push_back({p.x, p.y});
  return extent_of(places);
}

struct Shape {
  Rectangle bounds;
  std::function<bool(Vec2)> is_part;
  std::string name;
};

Shape outline_shape(const Polygon& outline, double grow_um) {
  return {grown(extent_of(outline), grow_um),
          [outline, grow_um](Vec2 p) { return contains(outline, p) || distance_to_boundary_um(outline, p) <= grow_um; },
          "the outline"};
}

Shape adhesion_shape(const std::vector<Adhesion>& adhesions, double grow_um) {
  std::vector<Vec2> corners;
  for (const Adhesion& a : adhesions) {
    const Vec2 half = substrate::half_extent_um(substrate::ellipse_of(a)) + Vec2{grow_um, grow_um};
    corners.insert(corners.end(), {a.position_um - half, a.position_um + half});
  }
  return {extent_of(corners),
          [adhesions, grow_um](Vec2 p) { return tractions::adhesion_of_patches({p}, adhesions, grow_um).front() >= 0; },
          "the adhesions"};
}

}  // namespace

Expected expected_tractions(const SpatialInputs& inputs, const Observed& observed, const Ground& ground,
                            const SpatialParameters& parameters, double grow_um) {
  Region region = parameters.region;
  if (region == Region::automatic) region = inputs.outline_um.empty() ? Region::all : Region::outline;
  const Rectangle beads = of_beads(observed);
  Rectangle known = beads;
  if (ground.map()) known = common(known, {ground.map()->low_um(), ground.map()->high_um()});
  if (is_empty(known)) {
    throw InvalidData("the gel's surface", "one that lies above the beads, " + text_of(beads),
                      text_of({ground.map()->low_um(), ground.map()->high_um()}));
  }
  if (region == Region::all) return {known, [](Vec2) { return true; }, "the whole surface above the beads", 1};
  if (region == Region::outline && inputs.outline_um.empty())
    throw UsageError("traction.region = outline: --outline is missing");
  if (region == Region::adhesions && inputs.adhesions.empty())
    throw UsageError("traction.region = adhesions: --adhesions is missing or holds none");
  const Shape shape = region == Region::outline ? outline_shape(inputs.outline_um, 2 * observed.distance_um)
                                                : adhesion_shape(inputs.adhesions, grow_um);
  const Rectangle seen = common(known, shape.bounds);
  bool is_met = false;
  constexpr int kSamples = 200;  // each way
  for (int k = 0; k < kSamples * kSamples && !is_met && !is_empty(seen); ++k) {
    const Vec2 share = {(k % kSamples + 0.5) / kSamples, (k / kSamples + 0.5) / kSamples};
    is_met = shape.is_part({seen.low_um.x + share.x * (seen.high_um.x - seen.low_um.x),
                            seen.low_um.y + share.y * (seen.high_um.y - seen.low_um.y)});
  }
  if (!is_met) {
    throw InvalidData("traction.region = " + std::string(name_of(region)),
                      shape.name + " above the beads, " + text_of(beads),
                      "all of it elsewhere: " + text_of(shape.bounds));
  }
  return {parameters.background > 0 ? known : seen, shape.is_part, shape.name, parameters.background};
}

MatrixXd adhesion_areas_um2(const TractionMesh& mesh, const Ground& ground, const std::vector<Adhesion>& adhesions,
                            double grow_um) {
  MatrixXd areas = MatrixXd::Zero(static_cast<Index>(adhesions.size()), mesh.n_vertices());
  constexpr int kParts = 8;  // of a face's side: a rim is met to an eighth of it
  std::vector<Vec2> places;
  struct Share {
    std::vector<VertexShare> of_vertices;
    double area_um2;
  };
  std::vector<Share> all;
  over_faces(mesh, ground, kParts, Places::even, [&](Vec2 at, std::span<const VertexShare> shares, double area_um2) {
    places.push_back(at);
    all.push_back({{shares.begin(), shares.end()}, area_um2});
  });
  const std::vector<int> owner = tractions::adhesion_of_patches(places, adhesions, grow_um);
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (owner[k] < 0) continue;
    for (const auto& [vertex, share] : all[k].of_vertices) areas(owner[k], vertex) += share * all[k].area_um2;
  }
  for (Index a = 0; a < areas.rows(); ++a) {
    if (areas.row(a).sum() > 0) continue;  // else smaller than what is sampled: all of it where its middle is
    const Adhesion& adhesion = adhesions[a];
    const Vec2 at = adhesion.position_um;
    Index nearest = 0;
    for (Index v = 0; v < areas.cols(); ++v) {
      const auto away = [&](Index k) { return norm(mesh.quads.points_um[k] - at); };
      if (away(v) < away(nearest)) nearest = v;
    }
    areas(a, nearest) = adhesion.area_um2 * ground.stretch(at);
  }
  return areas;
}

}  // namespace mbtfm::spatial
