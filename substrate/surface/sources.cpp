#include "substrate/surface/sources.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/place.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/stage/help.h"
#include "pipeline/stage/parameters.h"
#include "substrate/surface/beads.h"
#include "substrate/surface/formula.h"
#include "substrate/surface/missing.h"
#include "substrate/surface/points.h"

namespace mbtfm::surface {

void declare(stage::ParameterList& list, Parameters& p) {
  list.table("surface");
  list.add("formula", p.formula, stage::help_on("surface", "formula", {formulas_listed()}));
  const mbtfm::Range place = possible_place_um();
  list.add("low_x_um", p.low_x_um, place);
  list.add("low_y_um", p.low_y_um, place);
  list.add("high_x_um", p.high_x_um, place);
  list.add("high_y_um", p.high_y_um, place);
  list.add("spacing_um", p.spacing_um, mbtfm::Range::mesh_um());
  list.add("z_points", p.z_points);
  list.add("zero_at", p.zero_at);
  list.add("method", p.method);
  list.add("sigma_z_um", p.sigma_z_um, mbtfm::Range::positive());
  list.add("pixel_size_um", p.pixel_size_um, mbtfm::Range::pixel_um());
  list.add("z_unit_um", p.z_unit_um, mbtfm::Range::positive());
  list.add("z_step_um", p.z_step_um, mbtfm::Range::mesh_um());
  list.add("length_unit_um", p.length_unit_um, mbtfm::Range::positive());
  list.add("largest_hole_um", p.largest_hole_um, mbtfm::Range::zero_or_size_um());
  list.add("slice_um", p.slice_um, mbtfm::Range::zero_or_size_um());
  list.add("alpha_radius_um", p.alpha_radius_um, mbtfm::Range::zero_or_size_um());
  list.add("slices_along", p.slices_along);
}

double sign_of(const Parameters& p, const std::string& source) {
  return due(p.z_points, "z_points", source) == ZPoints::into_gel ? 1 : -1;
}

Rectangle rectangle_of(const Parameters& p) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  return {{p.low_x_um.value_or(-kFar), p.low_y_um.value_or(-kFar)},
          {p.high_x_um.value_or(kFar), p.high_y_um.value_or(kFar)}};
}

namespace {

/// The vertices within the rectangle.
HeightMap cut(const HeightMap& map, const Rectangle& to) {
  const auto lines = [](double origin, double spacing, int n, double low, double high) {
    std::vector<int> kept;
    for (int k = 0; k < n; ++k) {
      const double at = origin + k * spacing;
      if (at >= low && at <= high) kept.push_back(k);
    }
    return kept;
  };
  const auto columns = lines(map.origin_um.x, map.spacing_um.x, map.n_x, to.low.x, to.high.x);
  const auto rows = lines(map.origin_um.y, map.spacing_um.y, map.n_y, to.low.y, to.high.y);
  if (std::min(columns.size(), rows.size()) < 4)
    throw UsageError("expected a rectangle low_x_um … high_y_um that holds at least 4 x 4 heights");
  HeightMap kept{.origin_um = map.origin_um + Vec2{columns[0] * map.spacing_um.x, rows[0] * map.spacing_um.y},
                 .spacing_um = map.spacing_um,
                 .n_x = static_cast<int>(columns.size()),
                 .n_y = static_cast<int>(rows.size()),
                 .z_um = {},
                 .sigma_um = {}};
  for (const int j : rows) {
    for (const int i : columns) kept.z_um.push_back(map.z_um[static_cast<std::size_t>(j) * map.n_x + i]);
  }
  return kept;
}

/// Heights of a fit on a lattice over all that it covers.
template <class Fit>
HeightMap heights_of(const Fit& fit, const Parameters& p) {
  const Lattice& l = fit.lattice;
  const Vec2 high = at_place(l, {1.0 * l.n_x, 1.0 * l.n_y});
  constexpr double kShareOfSide = 0.5;  // a spline through them differs from the fit by less than its error
  const double spacing = p.spacing_um.value_or(kShareOfSide * std::min(l.side_um.x, l.side_um.y));
  HeightMap map = sampled([&](Vec2 at) { return fit.height_um(at); }, l.corner_um, high, spacing);
  map.sigma_um = sampled([&](Vec2 at) { return fit.sigma_um(at); }, l.corner_um, high, spacing).z_um;
  return map;
}

void note_off(Made& made, const Places& places, const std::vector<int>& off) {
  for (const int k : off) {
    const Vec3& p = places.at_um[k];
    made.off_um.push_back({p.x, p.y});
  }
  made.share_off = static_cast<double>(off.size()) / static_cast<double>(places.at_um.size());
  made.figures.emplace_back("n_off_the_surface", static_cast<std::int64_t>(off.size()));
}

}  // namespace

Made from_formula(const Parameters& p) {
  for (const auto* side : {&p.low_x_um, &p.low_y_um, &p.high_x_um, &p.high_y_um}) {
    if (!*side) throw UsageError("expected --low_x_um, --low_y_um, --high_x_um and --high_y_um with --formula");
  }
  const Rectangle r = rectangle_of(p);
  const double spacing = p.spacing_um.value_or(std::max(r.high.x - r.low.x, r.high.y - r.low.y) / 200);
  return {.map = sampled(formula_of(p.formula), r.low, r.high, spacing), .from = "formula " + p.formula};
}

Made from_heights(HeightMap map, const Parameters& p, const std::string& source, std::string from) {
  const double sign = sign_of(p, source);
  for (double& z : map.z_um) z *= sign;
  map = cut(map, rectangle_of(p));
  const double finest = std::min(map.spacing_um.x, map.spacing_um.y);
  constexpr int kMostLines = 500;  // of a quarter of a million vertices
  const double asked = p.spacing_um.value_or(finest * std::ceil(1.0 * std::max(map.n_x, map.n_y) / kMostLines));
  const double by = std::clamp(asked / finest + 1e-9, 1.0, 1.0 * std::max(map.n_x, map.n_y));
  FilledMap whole = filled(binned(map, static_cast<int>(by)), p.largest_hole_um);
  Made made{.map = std::move(whole.map), .from = std::move(from)};
  if (whole.n_filled > 0) {
    made.share_repaired = static_cast<double>(whole.n_filled) / static_cast<double>(made.map.z_um.size());
    made.repaired = std::to_string(whole.n_filled) + " heights in holes were filled. ";
  }
  made.figures = {{"n_filled", std::int64_t{whole.n_filled}}};
  return made;
}

Made from_points(const Places& places, const Parameters& p) {
  const PointFit fit = fit_points(places.at_um, places.sigma_um);
  Made made{.map = heights_of(fit, p), .from = std::to_string(places.at_um.size()) + " points of the surface"};
  made.figures = {{"n_points", static_cast<std::int64_t>(places.at_um.size())},
                  {places.sigma_um.empty() ? "point_error_um" : "point_error_over_given", fit.error_scale}};
  note_off(made, places, fit.strays);
  return made;
}

Made from_mesh(const TriangleMesh& mesh, const Parameters& p) {
  const double spacing = p.spacing_um.value_or(suggested_spacing_um(mesh));
  MeshSurface sampled_mesh = sample_mesh(mesh, spacing);
  Made made =
      from_heights(std::move(sampled_mesh.map), p, "mesh", std::to_string(mesh.triangles.size()) + " triangles");
  if (sampled_mesh.n_flipped > 0) {
    made.share_repaired += static_cast<double>(sampled_mesh.n_flipped) / static_cast<double>(mesh.triangles.size());
    made.repaired += std::to_string(sampled_mesh.n_flipped) + " triangles faced the other way and were turned over. ";
  }
  made.figures.emplace_back("n_flipped", std::int64_t{sampled_mesh.n_flipped});
  return made;
}

Made from_masks(const VoxelStack& stack, const Parameters& p) {
  const VoxelPoints found = points_of_masks(stack);
  // the file's first slice is its z = 0
  const double offset = sign_of(p, "masks") < 0 ? -stack.step_um * (stack.n_z - 1) : 0;
  const Rectangle within = rectangle_of(p);
  Places places;
  for (const Vec3& at : found.points_um) {
    if (within.contains(at.x, at.y)) places.at_um.push_back(at + Vec3{0, 0, offset});
  }
  places.sigma_um.assign(places.at_um.size(), found.sigma_um);
  const PointFit fit = fit_points(places.at_um, places.sigma_um);
  Made made{.map = heights_of(fit, p), .from = std::to_string(stack.n_z) + " masks"};
  made.figures = {{"n_voxels_left_out", found.n_voxels_left_out}};
  note_off(made, places, fit.strays);
  return made;
}

Made from_beads(const Places& places, const Parameters& p) {
  const std::string n = std::to_string(places.at_um.size()) + " beads, method " + name_of(p.method);
  if (p.method == BeadMethod::alpha_shape) {
    const AlphaParameters alpha{.slice_um = p.slice_um, .radius_um = p.alpha_radius_um, .along = p.slices_along};
    constexpr double kSpacing_um = 1;  // the slices are wider
    return {.map = alpha_shape_surface(places.at_um, alpha, p.spacing_um.value_or(kSpacing_um)), .from = n};
  }
  if (places.sigma_um.empty()) due(p.sigma_z_um, "sigma_z_um", "beads");
  const SurfaceFit fit = fit_beads(places.at_um, places.sigma_um);
  Made made{.map = heights_of(fit, p), .from = n};
  made.figures = {{"n_beads", static_cast<std::int64_t>(places.at_um.size())},
                  {"beads_per_um3", fit.density_per_um3},
                  {"stiffness_along_crests", fit.smoothing.ratio}};
  made.apart_um = 1 / std::cbrt(fit.density_per_um3);
  note_off(made, places, fit.above_surface);
  return made;
}

void set_level(Made& made, ZeroAt zero_at) {
  std::vector<double>& z_um = made.map.z_um;
  const auto n = static_cast<double>(z_um.size());
  double mean = 0, square = 0;
  for (const double z : z_um) mean += z / n;
  for (const double z : z_um) square += (z - mean) * (z - mean) / n;
  if (zero_at == ZeroAt::mean) {
    for (double& z : z_um) z -= mean;
    mean = 0;
  }
  made.figures.emplace_back("mean_z_um", mean);
  made.figures.emplace_back("rms_height_um", std::sqrt(square));
}

StageReport report_of(const Made& made, stage::StageContext& context) {
  const HeightMap& map = made.map;
  const auto [low, high] = std::ranges::minmax_element(map.z_um);
  StageReport report;
  report.summary = made.from + ": z from " + brief(*low) + " to " + brief(*high) + " um";
  report.figures = made.figures;
  if (!map.sigma_um.empty()) {
    const double sigma = numerics::quantile(map.sigma_um, 0.5);
    report.figures.emplace_back("median_sigma_um", sigma);
    report.summary += ", standard error " + brief(sigma) + " um (median)";
  }
  context.notice(noticed(Symptom::off_the_surface, made.share_off, {.value = std::to_string(made.off_um.size())}));
  context.notice(noticed(Symptom::surface_level, made.apart_um == 0 ? 0 : made.apart_um / (*high - *low),
                         {.value = brief(*high - *low)}));
  context.notice(noticed(Symptom::surface_repaired, made.share_repaired, {.at = made.repaired}));
  return report;
}

}  // namespace mbtfm::surface
