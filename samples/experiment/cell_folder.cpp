#include "samples/experiment/cell_folder.h"

#include <string>

#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/text.h"
#include "pipeline/files/vtk_files.h"
#include "samples/drawing/render.h"

namespace mbtfm::experiment {

namespace {

/// Parameters that are set, as TOML, those of one table after another.
std::string to_toml(const stage::ParameterList& list, const std::vector<std::string>& tables) {
  std::string text;
  for (const std::string& table : tables) {
    if (!table.empty()) text += "\n[" + table + "]\n";
    for (const stage::Parameter& p : list.all()) {
      if (p.table != table || stage::to_text(p).empty()) continue;  // not set
      const bool is_text =
          std::holds_alternative<std::string*>(p.member) || std::holds_alternative<stage::Choice>(p.member);
      text += p.name + " = " + (is_text ? '"' + stage::to_text(p) + '"' : stage::to_text(p)) + "\n";
    }
  }
  return text;
}

void write_segmentation(const Cell& cell, const std::string& folder, const FileNamer& file) {
  files::write_adhesions(file(folder + "/adhesions.csv"), cell.adhesions);
  files::write_fibres(file(folder + "/fibres.csv"), file(folder + "/fibre_points.csv"), cell.fibres);
  files::write_outline(file(folder + "/outline.csv"), cell.outline_um, cell.holes_um);
}

/// Where each bead really was in both images (noise and drift included).
void write_beads(const std::filesystem::path& file, const std::vector<Vec2>& relaxed,
                 const std::vector<Vec2>& stressed) {
  files::CsvText csv({"x_um", "y_um", "stressed_x_um", "stressed_y_um"});
  for (std::size_t i = 0; i < relaxed.size(); ++i) {
    csv.add(relaxed[i].x).add(relaxed[i].y).add(stressed[i].x).add(stressed[i].y).end_row();
  }
  files::write_text(file, csv.str());
}

}  // namespace

void write_cell_folder(const Experiment& e, const drawing::ScenarioParameters& parameters, const FileNamer& file) {
  drawing::ScenarioParameters copy = parameters;
  stage::ParameterList list;
  declare(list, copy);
  files::write_text(file("cell.toml"), to_toml(list, {"", "gel"}));
  files::write_text(file("truth/scenario.toml"), to_toml(list, {"", "gel", "scenario"}));
  write_segmentation(e.cell, "truth", file);
  files::write_tensions(file("truth/tensions.csv"), e.tensions, e.cell.fibres);
  files::write_adhesion_forces(file("truth/adhesion_forces.csv"), e.forces, e.cell.adhesions);
  files::write_displacement(file("truth/displacement.csv"), e.displacement);
  files::write_network(file("truth/network.vtu"), e.network);
  if (parameters.images) return;
  write_segmentation(e.cell, "1_segment", file);
  files::write_displacement(file("2_track/displacement.csv"), e.measured);
}

void write_images(const Experiment& e, const drawing::ScenarioParameters& p, const FileNamer& file, const Work& work) {
  const int threads = work.threads;
  const drawing::MicroscopeParameters m = drawing::at_quality(p.microscope);
  const auto write = [&](const std::string& name, const images::Image& photons, int exposure) {
    work.tell(0.5 + 0.1 * exposure, "rendering " + name);
    images::write_tiff(file(name), drawing::recorded(photons, m, p.seed, exposure, threads));
  };
  std::vector<Vec2> relaxed, stressed;
  for (const Bead& bead : e.measured) {
    relaxed.push_back(bead.position_um);
    stressed.push_back(bead.position_um + bead.displacement_um + Vec2{p.drift_x_um, p.drift_y_um});
  }
  const drawing::BeadImages beads = drawing::bead_spots(relaxed, stressed, p.lost_bead_fraction, m, p.seed);
  write("paxillin.tif", drawing::photons_of(drawing::paxillin_specimen(e.cell, m, p.seed, threads), m, threads), 0);
  write("actin.tif", drawing::photons_of(drawing::actin_specimen(e.cell, p.actin, m, p.seed, threads), m, threads), 1);
  write("beads_relaxed.tif", drawing::photons_of(beads.relaxed, m, threads), 2);
  write("beads_stressed.tif", drawing::photons_of(beads.stressed, m, threads), 3);
  write_beads(file("truth/beads.csv"), relaxed, stressed);
}

}  // namespace mbtfm::experiment
