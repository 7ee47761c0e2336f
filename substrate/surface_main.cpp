/// mbtfm-surface: the surface of a gel that is not flat, from what a user has of it.
#include <algorithm>

#include "pipeline/files/base64.h"
#include "pipeline/files/columns.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/triangle_mesh.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/stage.h"
#include "segment/images/image.h"
#include "segment/images/png.h"
#include "substrate/surface/picture.h"
#include "substrate/surface/sources.h"

namespace mbtfm::surface {
namespace {

double pixel_of(const images::Image& image, const Parameters& p, const std::string& source) {
  return p.pixel_size_um ? *p.pixel_size_um : due(image.pixel_size_um, "pixel_size_um", source);
}

Made read_height_map(const Path& file, const Parameters& p) {
  if (file.extension() == ".csv") {
    HeightMap map = files::read_heights(file);
    const std::string from = std::to_string(map.n_x) + " x " + std::to_string(map.n_y) + " heights of a table";
    return from_heights(std::move(map), p, "height_map", from);
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
  return from_heights(std::move(map), p, "height_map",
                      "an image of " + std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels");
}

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

TriangleMesh read_mesh(const Path& file, const Parameters& p) {
  return files::read_triangle_mesh(file, due(p.length_unit_um, "length_unit_um", "mesh"));
}

/// By the flag of the file.
const std::vector<std::pair<std::string, Made (*)(const Path&, const Parameters&)>>& sources() {
  using P = Parameters;
  static const std::vector<std::pair<std::string, Made (*)(const Path&, const P&)>> table = {
      {"height_map", read_height_map},
      {"points", [](const Path& file, const P& p) { return from_points(read_places(file, p, "points"), p); }},
      {"mesh", [](const Path& file, const P& p) { return from_mesh(read_mesh(file, p), p); }},
      {"masks", [](const Path& file, const P& p) { return from_masks(read_masks(file, p), p); }},
      {"beads", [](const Path& file, const P& p) { return from_beads(read_places(file, p, "beads"), p); }}};
  return table;
}

Made made_from(stage::StageContext& context, const Parameters& p) {
  const auto is_given = [&](const auto& source) { return context.has_input(source.first); };
  const auto n_given = std::ranges::count_if(sources(), is_given) + (p.formula.empty() ? 0 : 1);
  if (n_given != 1) {
    throw UsageError("expected one of --formula, --height_map, --points, --mesh, --masks and --beads, found " +
                     std::to_string(n_given));
  }
  if (!p.formula.empty()) return from_formula(p);
  const auto& [name, read] = *std::ranges::find_if(sources(), is_given);
  const Path file = context.input(name);
  try {
    return read(file, p);
  } catch (const InvalidData& error) {
    throw InputError(file.string() + ": " + error.element, error.expected, error.found);
  }
}

StageReport run(const Parameters& p, stage::StageContext& context) {
  Made made = made_from(context, p);
  set_level(made, p.zero_at);
  files::write_surface(context.output("out"), made.map);
  const std::string picture = images::png_of({made.map.n_x, made.map.n_y, colours_of(made.map)});
  files::write_text(
      context.output_beside("out", ".svg"),
      picture_of(made.map, "data:image/png;base64," + files::base64(picture), made.off_um, "From " + made.from + "."));
  return report_of(made, context);
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
