/// mbtfm-surface: the surface of a gel that is not flat, from what a user has of it.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/axes.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/place.h"
#include "pipeline/files/base64.h"
#include "pipeline/files/columns.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/text.h"
#include "pipeline/files/triangle_mesh.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/stage/help.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "segment/images/image.h"
#include "segment/images/png.h"
#include "substrate/surface/alpha_slices.h"
#include "substrate/surface/beads.h"
#include "substrate/surface/formula.h"
#include "substrate/surface/mesh.h"
#include "substrate/surface/missing.h"
#include "substrate/surface/picture.h"
#include "substrate/surface/points.h"
#include "substrate/surface/voxels.h"

namespace mbtfm::surface {
namespace {

enum class ZeroAt { as_given, mean };
constexpr auto words(ZeroAt) { return std::array{"as-given", "mean"}; }

enum class BeadMethod { likelihood, alpha_shape };
constexpr auto words(BeadMethod) { return std::array{"likelihood", "alpha-shape"}; }

struct Parameters {
  std::string formula = {};
  std::optional<double> low_x_um, low_y_um, high_x_um, high_y_um;
  std::optional<double> spacing_um;
  std::optional<ZPoints> z_points;
  ZeroAt zero_at = ZeroAt::as_given;
  BeadMethod method = BeadMethod::likelihood;
  std::optional<double> sigma_z_um;
  std::optional<double> pixel_size_um, z_unit_um, z_step_um, length_unit_um;
  double largest_hole_um = 5;  ///< about an adhesion
  double slice_um = 0;
  double alpha_radius_um = 0;
  SlicesAlong slices_along = SlicesAlong::kX;
};

void declare(stage::ParameterList& list, Parameters& p) {
  list.table("surface");
  list.add("formula", p.formula, stage::help_on("surface", "formula", {formulas_listed()}));
  const Range place = possible_place_um();
  list.add("low_x_um", p.low_x_um, place);
  list.add("low_y_um", p.low_y_um, place);
  list.add("high_x_um", p.high_x_um, place);
  list.add("high_y_um", p.high_y_um, place);
  list.add("spacing_um", p.spacing_um, Range::mesh_um());
  list.add("z_points", p.z_points);
  list.add("zero_at", p.zero_at);
  list.add("method", p.method);
  list.add("sigma_z_um", p.sigma_z_um, Range::positive());
  list.add("pixel_size_um", p.pixel_size_um, Range::pixel_um());
  list.add("z_unit_um", p.z_unit_um, Range::positive());
  list.add("z_step_um", p.z_step_um, Range::mesh_um());
  list.add("length_unit_um", p.length_unit_um, Range::positive());
  list.add("largest_hole_um", p.largest_hole_um, Range::zero_or_size_um());
  list.add("slice_um", p.slice_um, Range::zero_or_size_um());
  list.add("alpha_radius_um", p.alpha_radius_um, Range::zero_or_size_um());
  list.add("slices_along", p.slices_along);
}

/// What a source gives.
struct Made {
  HeightMap map;
  std::string from = {};          ///< "1200 beads, method likelihood"
  std::vector<Vec2> off_um = {};  ///< beads or points off the surface
  double share_off = 0, share_repaired = 0;
  double apart_um = 0;  ///< distance of the beads; 0: made of none
  std::string repaired = {};
  Figures figures = {};
};

template <class T>
const T& due(const std::optional<T>& value, const std::string& name, const std::string& source) {
  if (value) return *value;
  throw UsageError("expected --" + name + " with --" + source + ": the file does not say");
}

/// +1 where the z of the file points into the gel, else -1.
double sign_of(const Parameters& p, const std::string& source) {
  return due(p.z_points, "z_points", source) == ZPoints::into_gel ? 1 : -1;
}

struct Rectangle {
  Vec2 low, high;
  bool contains(double x, double y) const { return x >= low.x && x <= high.x && y >= low.y && y <= high.y; }
};
Rectangle rectangle_of(const Parameters& p) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  return {{p.low_x_um.value_or(-kFar), p.low_y_um.value_or(-kFar)},
          {p.high_x_um.value_or(kFar), p.high_y_um.value_or(kFar)}};
}

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

/// Cut, as coarse as asked for, its holes filled, z into the gel.
Made finished(HeightMap map, const Parameters& p, const std::string& source, std::string from) {
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

// --- the sources, in the order of preference

Made from_formula(const Parameters& p) {
  for (const auto* side : {&p.low_x_um, &p.low_y_um, &p.high_x_um, &p.high_y_um}) {
    if (!*side) throw UsageError("expected --low_x_um, --low_y_um, --high_x_um and --high_y_um with --formula");
  }
  const Rectangle r = rectangle_of(p);
  const double spacing = p.spacing_um.value_or(std::max(r.high.x - r.low.x, r.high.y - r.low.y) / 200);
  return {.map = sampled(formula_of(p.formula), r.low, r.high, spacing), .from = "formula " + p.formula};
}

double pixel_of(const images::Image& image, const Parameters& p, const std::string& source) {
  return p.pixel_size_um ? *p.pixel_size_um : due(image.pixel_size_um, "pixel_size_um", source);
}

Made from_height_map(const Path& file, const Parameters& p) {
  if (file.extension() == ".csv") {
    HeightMap map = files::read_heights(file);
    const std::string from = std::to_string(map.n_x) + " x " + std::to_string(map.n_y) + " heights of a table";
    return finished(std::move(map), p, "height_map", from);
  }
  const std::vector<images::Image> pages = images::read_slices(file, {.prefix = "height_map", .may_lack_pixels = true});
  if (pages.size() != 1)
    throw InputError(file.string(), "one page, its grey values the heights", std::to_string(pages.size()) + " pages",
                     "masks, slice after slice, are read with --masks");
  const images::Image& image = pages.front();
  const double pixel = pixel_of(image, p, "height_map"), unit = due(p.z_unit_um, "z_unit_um", "height_map");
  HeightMap map{.origin_um = {0.5 * pixel, 0.5 * pixel},
                .spacing_um = {pixel, pixel},
                .n_x = image.width,
                .n_y = image.height,
                .z_um = {},
                .sigma_um = {}};
  for (const float value : image.pixels) map.z_um.push_back(unit * value);
  return finished(std::move(map), p, "height_map",
                  "an image of " + std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels");
}

struct Places {
  std::vector<Vec3> at_um;
  std::vector<double> sigma_um;  ///< empty: not known
};
Places read_places(const Path& file, const Parameters& p, const std::string& source) {
  const double sign = sign_of(p, source);
  const Rectangle within = rectangle_of(p);
  const files::CsvTable table(file);
  table.require({"x_um", "y_um", "z_um"});
  const bool has_sigma = table.has("sigma_z_um");
  Places places;
  for (int row = 0; row < table.n_rows(); ++row) {
    const double x = table.number(row, "x_um"), y = table.number(row, "y_um");
    if (!within.contains(x, y)) continue;
    places.at_um.push_back({x, y, sign * table.number(row, "z_um")});
    if (has_sigma)
      places.sigma_um.push_back(table.number(row, "sigma_z_um", Range::positive()));
    else if (p.sigma_z_um)
      places.sigma_um.push_back(*p.sigma_z_um);
  }
  return places;
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

Made from_points(const Path& file, const Parameters& p) {
  const Places places = read_places(file, p, "points");
  const PointFit fit = fit_points(places.at_um, places.sigma_um);
  Made made{.map = heights_of(fit, p), .from = std::to_string(places.at_um.size()) + " points of the surface"};
  made.figures = {{"n_points", static_cast<std::int64_t>(places.at_um.size())},
                  {places.sigma_um.empty() ? "point_error_um" : "point_error_over_given", fit.error_scale}};
  note_off(made, places, fit.strays);
  return made;
}

Made from_mesh(const Path& file, const Parameters& p) {
  const TriangleMesh mesh = files::read_triangle_mesh(file, due(p.length_unit_um, "length_unit_um", "mesh"));
  const double spacing = p.spacing_um.value_or(suggested_spacing_um(mesh));
  MeshSurface sampled_mesh = sample_mesh(mesh, spacing);
  Made made = finished(std::move(sampled_mesh.map), p, "mesh", std::to_string(mesh.triangles.size()) + " triangles");
  if (sampled_mesh.n_flipped > 0) {
    made.share_repaired += static_cast<double>(sampled_mesh.n_flipped) / static_cast<double>(mesh.triangles.size());
    made.repaired += std::to_string(sampled_mesh.n_flipped) + " triangles faced the other way and were turned over. ";
  }
  made.figures.emplace_back("n_flipped", std::int64_t{sampled_mesh.n_flipped});
  return made;
}

/// The gel's share of each voxel, slices in the order of z into the gel.
VoxelStack read_masks(const Path& file, const Parameters& p) {
  std::vector<images::Image> slices = images::read_slices(file, {.prefix = "masks"});
  if (sign_of(p, "masks") < 0) std::ranges::reverse(slices);
  const images::Image& first = slices.front();
  VoxelStack stack{.n_x = first.width,
                   .n_y = first.height,
                   .n_z = static_cast<int>(slices.size()),
                   .pixel_um = pixel_of(first, p, "masks"),
                   .step_um = due(p.z_step_um, "z_step_um", "masks"),
                   .share = {}};
  float brightest = 0;
  for (const images::Image& slice : slices) brightest = std::max(brightest, std::ranges::max(slice.pixels));
  if (!(brightest > 0)) throw InputError(file.string(), "masks in which the gel is white", "black pixels alone");
  for (const images::Image& slice : slices) {
    for (const float value : slice.pixels) stack.share.push_back(value / brightest);
  }
  return stack;
}

Made from_masks(const Path& file, const Parameters& p) {
  const VoxelStack stack = read_masks(file, p);
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

Made from_beads(const Path& file, const Parameters& p) {
  const Places places = read_places(file, p, "beads");
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

struct Source {
  std::string name;  ///< of the file's flag
  Made (*read)(const Path&, const Parameters&);
};
const std::vector<Source>& sources() {
  static const std::vector<Source> table = {{"height_map", from_height_map},
                                            {"points", from_points},
                                            {"mesh", from_mesh},
                                            {"masks", from_masks},
                                            {"beads", from_beads}};
  return table;
}

Made made_from(stage::StageContext& context, const Parameters& p) {
  const auto is_given = [&](const Source& source) { return context.has_input(source.name); };
  const auto n_given = std::ranges::count_if(sources(), is_given) + (p.formula.empty() ? 0 : 1);
  if (n_given != 1) {
    throw UsageError("expected one of --formula, --height_map, --points, --mesh, --masks and --beads, found " +
                     std::to_string(n_given));
  }
  if (!p.formula.empty()) return from_formula(p);
  const Source& source = *std::ranges::find_if(sources(), is_given);
  const Path file = context.input(source.name);
  try {
    return source.read(file, p);
  } catch (const InvalidData& error) {
    throw InputError(file.string() + ": " + error.element, error.expected, error.found);
  }
}

StageReport run(const Parameters& p, stage::StageContext& context) {
  Made made = made_from(context, p);
  HeightMap& map = made.map;
  const auto n = static_cast<double>(map.z_um.size());
  double mean = 0, square = 0;
  for (const double z : map.z_um) mean += z / n;
  for (const double z : map.z_um) square += (z - mean) * (z - mean) / n;
  if (p.zero_at == ZeroAt::mean) {
    for (double& z : map.z_um) z -= mean;
    mean = 0;
  }
  files::write_surface(context.output("out"), map);
  const std::string picture = images::png_of({map.n_x, map.n_y, colours_of(map)});
  files::write_text(
      context.output_beside("out", ".svg"),
      picture_of(map, "data:image/png;base64," + files::base64(picture), made.off_um, "From " + made.from + "."));
  StageReport report;
  const auto [low, high] = std::ranges::minmax_element(map.z_um);
  report.summary = made.from + ": z from " + brief(*low) + " to " + brief(*high) + " um";
  report.figures = std::move(made.figures);
  report.figures.emplace_back("mean_z_um", mean);
  report.figures.emplace_back("rms_height_um", std::sqrt(square));
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

}  // namespace
}  // namespace mbtfm::surface

int main(int argc, char** argv) {
  using mbtfm::stage::FileArgument;
  using Kind = FileArgument::Kind;
  using namespace mbtfm::surface;
  return mbtfm::stage::run_stage<Parameters>({.name = "surface",
                                              .files = {{"height_map", Kind::optional_input},
                                                        {"points", Kind::optional_input},
                                                        {"mesh", Kind::optional_input},
                                                        {"masks", Kind::optional_input},
                                                        {"beads", Kind::optional_input},
                                                        {"out", Kind::output}}},
                                             argc, argv, run);
}
