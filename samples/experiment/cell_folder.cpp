#include "samples/experiment/cell_folder.h"

#include <algorithm>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/parameters.h"
#include "samples/drawing/render.h"

namespace mbtfm::experiment {

namespace {

void write_segmentation(const Cell& cell, const std::string& folder, const FileNamer& file) {
  files::write_adhesions(file(folder + "/adhesions.csv"), cell.adhesions);
  files::write_fibres(file(folder + "/fibres.csv"), file(folder + "/fibre_points.csv"), cell.fibres);
  files::write_outline(file(folder + "/outline.csv"), cell.outline_um, cell.holes_um);
}

/// Where each bead really was in both images (noise and drift included).
void write_beads(const std::filesystem::path& file, const std::vector<Vec2>& relaxed,
                 const std::vector<Vec2>& stressed) {
  files::CsvText csv({"x_um", "y_um", "stressed_x_um", "stressed_y_um"});
  for (std::size_t i = 0; i < relaxed.size(); ++i)
    csv.add(relaxed[i].x).add(relaxed[i].y).add(stressed[i].x).add(stressed[i].y).end_row();
  files::write_text(file, csv.str());
}

enum class Shows { cell, beads };

/// As the camera records it. @param exposure  number of the image
void write_image(const FileNamer& file, const std::string& name, Shows shows, const images::Image& photons,
                 int exposure, const drawing::ScenarioParameters& p, const Work& work) {
  work.tell(0.5 + 0.1 * exposure, "rendering " + name);
  images::Image counts = drawing::recorded(photons, drawing::at_quality(p.microscope), p.seed, exposure, work.threads);
  drawing::add_hot_pixels(p.faults.n_hot_pixels, p.seed, counts);
  if (shows == Shows::cell) drawing::spoil(p.faults, counts);
  images::write_tiff(file(name), counts);
}

void add(images::Image& image, const images::Image& other) {
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] += other.pixels[i];
}

}  // namespace

void expect_simulated(const std::filesystem::path& cell) {
  if (files::is_file(cell / "truth/scenario.toml")) return;
  for (const char* name : {"cell.toml", "paxillin.tif", "actin.tif", "beads_stressed.tif", "beads_relaxed.tif",
                           "surface_beads.tif", "surface.vtp", "1_segment", "2_track", "truth"})
    if (std::filesystem::exists(std::filesystem::symlink_status(cell / name)))
      throw UsageError((cell / name).string() +
                       " is there, and no simulation made it: nothing is written over it; name a new folder");
}

void refuse_given_segmentation(const std::filesystem::path& cell) {
  if (std::filesystem::exists(cell / "1_segment") && !std::filesystem::exists(cell / "run.json"))
    throw UsageError(cell.string() + " holds an experiment without images: choose another folder or remove it");
}

void write_cell_folder(const Experiment& e, const drawing::ScenarioParameters& parameters, const FileNamer& file) {
  drawing::ScenarioParameters copy = parameters;
  stage::ParameterList list;
  declare(list, copy);
  files::write_text(file("cell.toml"), stage::to_toml(list, {"", "gel"}));
  files::write_text(file("truth/scenario.toml"), stage::to_toml(list, {"", "gel", "scenario"}));
  write_segmentation(e.cell, "truth", file);
  if (e.neighbour) files::write_outline(file("truth/" + std::string(files::kNeighboursFile)), e.neighbour->outline_um);
  files::write_tensions(file("truth/tensions.csv"), e.tensions, e.cell.fibres);
  files::write_adhesion_forces(file("truth/adhesion_forces.csv"), e.forces, e.cell.adhesions);
  files::write_displacement(file("truth/displacement.csv"), e.displacement);
  files::write_network(file("truth/network.vtu"), e.network);
  if (parameters.images) return;
  write_segmentation(e.cell, "1_segment", file);
  const double field_um = drawing::field_um(parameters.microscope);
  const auto is_seen = [&](Vec2 p) { return std::min({p.x, p.y, field_um - p.x, field_um - p.y}) > 0; };
  if (e.neighbour && std::ranges::any_of(e.neighbour->outline_um, is_seen))
    files::write_outline(file("1_segment/" + std::string(files::kNeighboursFile)), e.neighbour->outline_um);
  files::write_displacement(file("2_track/displacement.csv"), e.measured);
}

void write_bead_images(const DisplacementField& measured, const drawing::ScenarioParameters& p, const FileNamer& file,
                       const Work& work) {
  const drawing::MicroscopeParameters m = drawing::at_quality(p.microscope);
  std::vector<Vec2> relaxed, stressed;
  for (const Bead& bead : measured) {
    relaxed.push_back(drawing::before_stage_moved(bead.position_um, p));
    stressed.push_back(bead.position_um + bead.displacement_um);
  }
  drawing::BeadImages beads = drawing::bead_spots(relaxed, stressed, p.lost_bead_fraction, m, p.seed);
  for (drawing::Spot& bead : beads.relaxed) {
    bead.sigma_um *= p.faults.relaxed_defocus;
    bead.total *= 1 - p.faults.light_lost;
  }
  for (drawing::Spot& bead : beads.stressed) bead.sigma_um *= p.faults.stressed_defocus;
  write_image(file, "beads_relaxed.tif", Shows::beads, drawing::photons_of(beads.relaxed, m, work.threads), 2, p, work);
  write_image(file, "beads_stressed.tif", Shows::beads, drawing::photons_of(beads.stressed, m, work.threads), 3, p,
              work);
  write_beads(file("truth/beads.csv"), relaxed, stressed);
}

void write_images(const Experiment& e, const drawing::ScenarioParameters& p, const FileNamer& file, const Work& work) {
  const int threads = work.threads;
  const drawing::MicroscopeParameters m = drawing::at_quality(p.microscope);
  images::Image paxillin = drawing::paxillin_specimen(e.cell, m, p.seed, threads),
                actin = drawing::actin_specimen(e.cell, p.actin, m, p.seed, threads);
  if (e.neighbour) {
    add(paxillin, drawing::paxillin_specimen(*e.neighbour, m, p.seed + 1, threads));
    add(actin, drawing::actin_specimen(*e.neighbour, p.actin, m, p.seed + 1, threads));
  }
  drawing::add_debris(e.cell, p.faults, p.seed, paxillin, actin);
  write_image(file, "paxillin.tif", Shows::cell, drawing::photons_of(paxillin, m, threads), 0, p, work);
  write_image(file, "actin.tif", Shows::cell, drawing::photons_of(actin, m, threads), 1, p, work);
  DisplacementField beads = e.measured;
  beads.insert(beads.end(), e.beyond.begin(), e.beyond.end());
  write_bead_images(beads, p, file, work);
}

StageReport report_of(const Experiment& e, const std::string& scenario) {
  StageReport report;
  report.figures = {{"n_adhesions", static_cast<std::int64_t>(e.cell.adhesions.size())},
                    {"n_fibres", static_cast<std::int64_t>(e.cell.fibres.size())},
                    {"n_vertices", static_cast<std::int64_t>(e.network.vertices_um.size())},
                    {"total_force_nN", e.total_force_nN},
                    {"largest_displacement_um", e.largest_displacement_um},
                    {"noise_um", e.noise_um}};
  report.summary = scenario + ": " + std::to_string(e.cell.adhesions.size()) + " adhesions, " +
                   std::to_string(e.cell.fibres.size()) + " fibres, total force " + brief(e.total_force_nN) +
                   " nN, largest displacement " + brief(e.largest_displacement_um) + " um, noise " + brief(e.noise_um) +
                   " um";
  return report;
}

}  // namespace mbtfm::experiment
