#include "samples/gels/folder.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/text.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/parameters.h"
#include "samples/drawing/psf.h"
#include "samples/drawing/random.h"
#include "samples/drawing/stack.h"

namespace mbtfm::gels {
namespace {

using drawing::Random;
using drawing::Stream;

drawing::StackMicroscope microscope_of(const GelScene& scene, const SpaceParameters& space,
                                       const drawing::ScenarioParameters& p) {
  drawing::StackMicroscope m;
  m.optics.numerical_aperture = space.numerical_aperture;
  m.optics.gel_index = space.gel_index, m.optics.immersion_index = space.immersion_index;
  m.pixel_size_um = p.microscope.pixel_size_um;
  m.image_size_px = p.microscope.image_size_px;
  m.z_step_um = space.z_step_um;
  m.bead_photons = space.peak_photons;
  m.bead_brightness_log_sd = p.microscope.bead_brightness_log_sd;
  m.bleached = space.bleached;
  m.counts_per_photon = p.microscope.counts_per_photon;
  m.camera_offset = p.microscope.camera_offset;
  m.read_noise = p.microscope.read_noise;
  constexpr double kAbove_um = 3;
  double low = scene.gel.thickness_um, high = 0;
  const HeightMap map = map_of(scene);
  for (const double z : map.z_um) low = std::min(low, z), high = std::max(high, z);
  m.first_um = std::floor(low - kAbove_um);
  const double last = std::min(high + space.bead_depth_um, scene.gel.thickness_um) + kAbove_um;
  m.n_slices = std::max(8, static_cast<int>(std::ceil((last - m.first_um) / m.focus_step_um())));
  return m;
}

/// What the stage did, for the tracker: [track] of cell.toml.
std::string track_table(const drawing::StackMicroscope& m) {
  return "\n[track]\nz_points = \"into-gel\"\nfirst_slice_z_um = " + shortest(m.first_um) +
         "\nrefractive_index_ratio = " + shortest(m.optics.gel_index / m.optics.immersion_index) + "\n";
}

void write_patches(const std::filesystem::path& file, const std::vector<Patch>& patches) {
  files::CsvText csv({"patch", "x_um", "y_um", "z_um", "radius_um", "fx_nN", "fy_nN", "fz_nN", "aimed_fx_nN",
                      "aimed_fy_nN", "aimed_fz_nN"});
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const Patch& p = patches[k];
    csv.add(std::to_string(k + 1)).add(p.centre_um.x).add(p.centre_um.y).add(p.centre_um.z).add(p.radius_um);
    for (const Vec3& f : {p.force_nN, p.aimed_nN}) csv.add(f.x).add(f.y).add(f.z);
    csv.end_row();
  }
  files::write_text(file, csv.str());
}

void write_surface_tractions(const std::filesystem::path& file, const std::vector<TractionSample>& samples) {
  files::CsvText csv({"x_um", "y_um", "z_um", "nx", "ny", "nz", "tx_kPa", "ty_kPa", "tz_kPa"});
  for (const TractionSample& s : samples) {
    for (const Vec3& v : {s.place_um, s.normal, s.traction_kPa}) csv.add(v.x).add(v.y).add(v.z);
    csv.end_row();
  }
  files::write_text(file, csv.str());
}

void write_sources(const std::filesystem::path& file, const std::vector<FieldUnderASurface::Source>& sources) {
  files::CsvText csv({"x_um", "y_um", "z_um", "fx_nN", "fy_nN", "fz_nN"});
  for (const auto& s : sources) {
    for (const Eigen::Vector3d& v : {s.position_um, s.force_nN}) csv.add(v.x()).add(v.y()).add(v.z());
    csv.end_row();
  }
  files::write_text(file, csv.str());
}

/// A random walk of the stage, its mean taken off.
drawing::StageMotion walk(double step_um, int n_slices, std::uint64_t seed, std::uint64_t which) {
  if (step_um == 0) return {};
  Random random(seed, Stream::optics, 100 + which);
  drawing::StageMotion motion;
  Vec2 at, mean;
  for (int k = 0; k < n_slices; ++k) {
    at += Vec2{step_um * random.normal(), step_um * random.normal()};
    motion.shift_um.push_back(at);
    mean += (1.0 / n_slices) * at;
  }
  for (Vec2& shift : motion.shift_um) shift = shift - mean;
  return motion;
}

void write_slices(const std::filesystem::path& file, const drawing::StackMicroscope& m,
                  const drawing::StageMotion& relaxed, const drawing::StageMotion& stressed) {
  files::CsvText csv({"slice", "z_um", "relaxed_x_um", "relaxed_y_um", "stressed_x_um", "stressed_y_um"});
  for (int k = 0; k < m.n_slices; ++k) {
    csv.add(std::to_string(k + 1)).add(m.first_um + (k + 0.5) * m.focus_step_um());
    for (const drawing::StageMotion* s : {&relaxed, &stressed}) {
      const Vec2 shift = s->shift_um.empty() ? Vec2{} : s->shift_um[k];
      csv.add(shift.x).add(shift.y);
    }
    csv.end_row();
  }
  files::write_text(file, csv.str());
}

}  // namespace

SceneSize size_of(const drawing::ScenarioParameters& p) {
  return {
      .field_um = drawing::field_um(p.microscope), .n_beads = p.beads, .noise = p.noise, .seed = p.seed, .gel = p.gel};
}

void write_folder(const GelScene& scene, const SpaceParameters& space, const drawing::ScenarioParameters& parameters,
                  const FileNamer& file) {
  drawing::ScenarioParameters copy = parameters;
  SpaceParameters space_copy = space;
  stage::ParameterList list;
  declare(list, copy);
  declare(list, space_copy);
  files::write_text(file("cell.toml"),
                    stage::to_toml(list, {"", "gel"}) + track_table(microscope_of(scene, space, parameters)));
  files::write_text(file("truth/scenario.toml"), stage::to_toml(list, {"", "gel", "scenario", "space"}));
  files::write_surface(file("surface.vtp"), map_of(scene));
  write_patches(file("truth/patches.csv"), scene.patches);
  write_surface_tractions(file("truth/surface_traction.csv"), scene.surface);
  write_sources(file("truth/sources.csv"), scene.sources);
  files::write_displacement_in_space(file("truth/displacement_3d.csv"), scene.truth);
  if (!parameters.images) files::write_displacement_in_space(file("2_track/displacement_3d.csv"), scene.measured);
}

void write_stacks(const GelScene& scene, const SpaceParameters& space, const drawing::ScenarioParameters& p,
                  const FileNamer& file, int threads, const Progress& progress) {
  const auto tell = [&](double fraction, const char* what) {
    if (progress) progress(fraction, what);
  };
  const drawing::StackMicroscope m = microscope_of(scene, space, p);
  tell(0.4, "the point-spread function");
  const drawing::PointSpread spread(m.optics, m.n_slices * m.focus_step_um(), m.pixel_size_um, threads);
  Random random(p.seed, Stream::optics, 3);
  const drawing::LogNormal brightness{.median = 1, .log_sd = m.bead_brightness_log_sd, .low = 0.3, .high = 3};
  std::vector<drawing::GlowingBead> relaxed, stressed, on_surface;
  for (const BeadInSpace& bead : scene.truth) {
    const double light = drawing::draw(random, brightness), fate = random.uniform();
    if (fate >= 0.5 * p.lost_bead_fraction) relaxed.push_back({bead.position_um, light});
    const Vec3 drift{p.drift_x_um, p.drift_y_um, 0};
    if (fate < 1 - 0.5 * p.lost_bead_fraction)
      stressed.push_back({bead.position_um + bead.displacement_um + drift, light});
  }
  for (const Vec3& place : scene.surface_beads_um) on_surface.push_back({place, drawing::draw(random, brightness)});
  const drawing::StageMotion of_relaxed = walk(space.slice_drift_um, m.n_slices, p.seed, 0),
                             of_stressed = walk(space.slice_drift_um, m.n_slices, p.seed, 1);
  write_slices(file("truth/slices.csv"), m, of_relaxed, of_stressed);
  const auto write = [&](const char* name, const std::vector<drawing::GlowingBead>& beads,
                         const drawing::StageMotion& stage, int exposure) {
    tell(0.5 + 0.15 * exposure, name);
    images::write_tiff(file(name), drawing::recorded_stack(beads, m, spread, stage, p.seed, exposure, threads));
  };
  write("beads_stressed.tif", stressed, of_stressed, 0);
  write("beads_relaxed.tif", relaxed, of_relaxed, 1);
  if (!on_surface.empty()) write("surface_beads.tif", on_surface, of_relaxed, 2);
}

StageReport report_of(const GelScene& scene, SpaceScene kind) {
  double total_nN = 0;
  for (const Patch& patch : scene.patches) total_nN += norm(patch.force_nN);
  StageReport report;
  report.figures = {{"n_beads", static_cast<std::int64_t>(scene.truth.size())},
                    {"n_patches", static_cast<std::int64_t>(scene.patches.size())},
                    {"n_sources", static_cast<std::int64_t>(scene.sources.size())},
                    {"total_force_nN", total_nN},
                    {"largest_displacement_um", scene.largest_displacement_um},
                    {"noise_um", scene.noise_um},
                    {"share_beside_patches", scene.share_beside_patches}};
  report.summary = std::string(name_of(kind)) + ": " + std::to_string(scene.patches.size()) +
                   " patches, whose forces are " + brief(total_nN) + " nN in all, largest displacement " +
                   brief(scene.largest_displacement_um) + " um, " + std::to_string(scene.truth.size()) + " beads";
  return report;
}

}  // namespace mbtfm::gels
