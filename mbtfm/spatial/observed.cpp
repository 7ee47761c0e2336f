#include "mbtfm/spatial/observed.h"

#include <algorithm>
#include <cmath>

#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/order_statistics.h"
#include "substrate/compliance.h"
#include "substrate/ellipse.h"

namespace mbtfm::spatial {
namespace {

/// Between neighbours: in a plane where they lie in a sheet thinner than that.
double distance_between_um(const std::vector<Vec3>& points, const std::vector<double>& depths) {
  const auto n = static_cast<double>(points.size());
  const double area = extent_of(points).area_um2();
  if (!(area > 0)) throw InvalidData("displacement", "beads spread over an area", "all of them on one line");
  const double deepest = numerics::quantile(depths, 0.95);
  const double in_plane = std::sqrt(area / n);
  return deepest < in_plane ? in_plane : std::cbrt(area * deepest / n);
}

}  // namespace

numerics::Near near_beads(const Observed& observed) {
  return {std::get<std::vector<Vec3>>(observed.at.points_um), observed.distance_um};
}

Observed observe(const std::vector<BeadInSpace>& beads, const Gel& gel, const Ground& ground,
                 const SpatialParameters& parameters) {
  check(beads);
  constexpr double kFewest = 4;       // a force, a couple and a noise are more than three vectors determine
  constexpr double kErrorsAbove = 3;  // of its height a bead may lie above the surface
  constexpr double kRounding_um = 0.02;
  Observed observed;
  std::vector<Vec3> points;
  std::vector<double> depths;
  std::vector<const BeadInSpace*> taken;
  for (const BeadInSpace& bead : beads) {
    Vec3 at = bead.position_um;
    if (!bead.flag.empty()) {
      ++observed.n_flagged;
      continue;
    }
    if (!ground.knows({at.x, at.y})) {
      ++observed.n_beyond;
      continue;
    }
    const double height = ground.height_um({at.x, at.y});
    const double sigma_z = bead.sigma_z_um > 0 ? bead.sigma_z_um : parameters.axial_sigma_ratio * bead.sigma_um;
    if (height - at.z > kErrorsAbove * sigma_z + kRounding_um) {
      ++observed.n_above;
      continue;
    }
    if (at.z > gel.thickness_um) {
      ++observed.n_below_base;
      continue;
    }
    at.z = std::max(at.z, height);
    points.push_back(at);
    depths.push_back(at.z - height);
    taken.push_back(&bead);
  }
  observed.n_beads = static_cast<int>(taken.size());
  if (observed.n_beads < kFewest) {
    throw InvalidData("displacement", "at least 4 beads in the gel that are not flagged",
                      std::to_string(observed.n_beads) + " of " + std::to_string(beads.size()) + " (" +
                          std::to_string(observed.n_flagged) + " flagged, " + std::to_string(observed.n_above) +
                          " above the surface, " + std::to_string(observed.n_below_base) + " below the base, " +
                          std::to_string(observed.n_beyond) + " where no surface is known)");
  }
  observed.distance_um = distance_between_um(points, depths);
  observed.depth_um = numerics::quantile(depths, 0.5);
  observed.at = {std::move(points), parameters.with_axial ? substrate::Components::all : substrate::Components::along};
  observed.states_errors = std::ranges::all_of(taken, [](const BeadInSpace* b) { return b->sigma_um > 0; });
  const Eigen::Index n = observed.n_components();
  observed.displacement_um.resize(n * observed.n_beads);
  observed.sigma_um.resize(n * observed.n_beads);
  for (Eigen::Index i = 0; i < observed.n_beads; ++i) {
    const BeadInSpace& bead = *taken[i];
    const double sigma = observed.states_errors ? bead.sigma_um : 1;
    const double sigma_z =
        observed.states_errors && bead.sigma_z_um > 0 ? bead.sigma_z_um : parameters.axial_sigma_ratio * sigma;
    const double u[] = {bead.displacement_um.x, bead.displacement_um.y, bead.displacement_um.z};
    const double s[] = {sigma, sigma, sigma_z};
    for (Eigen::Index c = 0; c < n; ++c) {
      observed.displacement_um[n * i + c] = u[c];
      observed.sigma_um[n * i + c] = s[c];
    }
  }
  return observed;
}

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
