#include "samples/colonies/folder.h"

#include "continuum/sheet/tables.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/text.h"
#include "pipeline/stage/parameters.h"
#include "samples/colonies/colony.h"
#include "samples/drawing/raster.h"
#include "samples/drawing/render.h"

namespace mbtfm::colonies {
namespace {

/// With the names that the fit of a sheet gives its rows.
void write_numbers(const std::filesystem::path& file, const sheet::Solution& solution) {
  files::CsvText csv({"quantity", "value"});
  const double M = solution.sheet.material.stiffness_nN_per_um();
  double s = 0;
  for (const double at_point : solution.sheet.contraction_nN_per_um) s = std::max(s, at_point);
  csv.add("contraction_nN_per_um").add(s).end_row();
  csv.add("stiffness_nN_per_um").add(M).end_row();
  csv.add("contraction_over_stiffness").add(s / M).end_row();
  csv.add("line_tension_nN").add(solution.sheet.line_tension_nN).end_row();
  csv.add("mean_tension_nN_per_um").add(sheet::balance_of(solution).mean_tension_nN_per_um).end_row();
  files::write_text(file, csv.str());
}

void write_tractions(const std::filesystem::path& file, const sheet::Solution& solution, const Pose& pose) {
  files::CsvText csv({"x_um", "y_um", "area_um2", "tx_kPa", "ty_kPa"});
  for (const GroundPatch& patch : solution.patches) {
    const Vec2 place = pose.at(patch.position_um), traction = pose.vector(patch.traction_kPa);
    csv.add(place.x).add(place.y).add(patch.area_um2).add(traction.x).add(traction.y).end_row();
  }
  files::write_text(file, csv.str());
}

void write_dipoles(const std::filesystem::path& file, const std::vector<Dipole>& dipoles) {
  files::CsvText csv({"x_um", "y_um", "arm_x_um", "arm_y_um", "force_nN"});
  for (const Dipole& d : dipoles)
    csv.add(d.middle_um.x).add(d.middle_um.y).add(d.arm_um.x).add(d.arm_um.y).add(d.force_nN).end_row();
  files::write_text(file, csv.str());
}

/// Light of a phase contrast microscope: cells darker than what is around them, with grains, and a bright halo.
images::Image phase_photons(const Colony& colony, const drawing::ScenarioParameters& p, int threads) {
  constexpr double kHalo_um = 2.5, kHalo = 0.9, kDark = 0.25, kGrain_um = 1.5, kGrain = 0.12;
  constexpr std::uint64_t kGrains = 73;  // a stream that a cell's drawing does not use
  const drawing::MicroscopeParameters m = drawing::at_quality(p.microscope);
  images::Image light = drawing::coverage_of(colony.outline_um, m.image_size_px, m.pixel_size_um);
  const images::Image wide = drawing::blurred(light, kHalo_um, threads);
  drawing::Random random(p.seed, drawing::Stream::specimen, kGrains);
  const images::Image grain = drawing::smooth_noise(m.image_size_px, m.pixel_size_um, kGrain_um, random, threads);
  for (std::size_t i = 0; i < light.pixels.size(); ++i) {
    const double inside = light.pixels[i];
    const double value = 1 - inside * (kDark + kGrain * grain.pixels[i]) + kHalo * (1 - inside) * wide.pixels[i];
    light.pixels[i] = static_cast<float>(m.protein_photons * std::max(0.0, value));
  }
  return light;
}

}  // namespace

void write_folder(const Colony& colony, const sheet::Solution& solution, const Whole& whole,
                  const experiment::FileNamer& file) {
  Whole copy = whole;
  stage::ParameterList list;
  declare(list, copy.scenario);
  declare(list, copy.colony);
  declare(list, copy.sheet);
  const sheet::Material& material = solution.sheet.material;
  files::write_text(file("cell.toml"),
                    stage::to_toml(list, {"", "gel"}) + "\n[sheet]\nthickness_um = " + shortest(material.thickness_um) +
                        "\npoisson_ratio = " + shortest(material.poisson_ratio) + "\n\n[run]\nmodel = \"sheet\"\n");
  files::write_text(file("truth/scenario.toml"), stage::to_toml(list, {"", "gel", "scenario", "colony", "sheet"}));
  files::write_outline(file("1_segment/outline.csv"), colony.outline_um);
  if (!colony.adhesive_um.empty()) files::write_outline(file("adhesive.csv"), colony.adhesive_um.front());
  write_numbers(file("truth/sheet.csv"), solution);
  write_tractions(file("truth/traction.csv"), solution, colony.pose);
  write_dipoles(file("truth/dipoles.csv"), colony.dipoles);
  files::write_displacement(file("truth/displacement.csv"), colony.displacement);
  if (!whole.scenario.images) files::write_displacement(file("2_track/displacement.csv"), colony.measured);
}

void write_images(const Colony& colony, const drawing::ScenarioParameters& p, const experiment::FileNamer& file,
                  const Work& work) {
  experiment::write_bead_images(colony.measured, p, file, work);
  images::write_tiff(file("phase.tif"), drawing::recorded(phase_photons(colony, p, work.threads),
                                                          drawing::at_quality(p.microscope), p.seed, 0, work.threads));
}

}  // namespace mbtfm::colonies
