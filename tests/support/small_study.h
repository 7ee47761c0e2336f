/// Studies of two to six cells in which little can be known: what ordinary labs have in their first week, and what
/// damage and chance make of it. In memory, and as folders.
#pragma once

#include "pipeline/files/sheet_files.h"
#include "tests/support/simulated_study.h"

namespace mbtfm::test {

/// What a study lacks. Each is drawn by itself, so that they meet in all combinations.
struct Lack {
  int n_cells = 2, n_conditions = 1;
  double fibres_by_type = 4;
  bool has_types_alike = false;
  double cell_sd_nN = 0, fibre_sd_nN = 0, error_nN = 0;
  double offset_nN = 10;              ///< small: many tensions end at zero
  double share_without_interval = 0;  ///< of the tensions
  double share_uncertain = 0;         ///< not identifiable
  double share_of_empty_cells = 0;    ///< without fibres
  bool are_tensions_equal = false, are_adhesions_equal = false, are_adhesions_missing = false;
  bool are_adhesion_forces_zero = false, are_forces_equal = false, are_networks_unknown = false, has_directions = false;

  std::string str() const {
    std::ostringstream text;
    text << n_cells << " cells, " << n_conditions << " conditions, " << fibres_by_type << " fibres a type, sd "
         << cell_sd_nN << " and " << fibre_sd_nN << ", error " << error_nN << ", offset " << offset_nN
         << ", without interval " << share_without_interval << ", uncertain " << share_uncertain << ", empty "
         << share_of_empty_cells << ", equal: tensions " << are_tensions_equal << " adhesions " << are_adhesions_equal
         << " forces " << are_forces_equal << ", adhesions missing " << are_adhesions_missing << " zero "
         << are_adhesion_forces_zero << ", directions " << has_directions << ", networks unknown "
         << are_networks_unknown;
    return text.str();
  }
};

inline Lack drawn_lack(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto one_of = [&](std::initializer_list<double> list) { return *(list.begin() + random() % list.size()); };
  const auto once_in = [&](unsigned n) { return random() % n == 0; };
  Lack lack;
  lack.n_cells = 2 + static_cast<int>(random() % 5);
  lack.n_conditions = 1 + static_cast<int>(random() % static_cast<unsigned>(std::min(3, lack.n_cells)));
  lack.fibres_by_type = one_of({0.3, 1, 4, 10});
  lack.has_types_alike = once_in(2);
  lack.cell_sd_nN = one_of({0, 0, 1, 5});
  lack.fibre_sd_nN = one_of({0, 0, 1});
  lack.error_nN = one_of({0, 0.01, 0.5, 20});
  lack.offset_nN = one_of({10, 10, 0, -3, -100});
  lack.share_without_interval = one_of({0, 0, 0.3, 1});
  lack.share_uncertain = one_of({0, 0, 0.5, 1});
  lack.share_of_empty_cells = one_of({0, 0, 0.5});
  lack.are_tensions_equal = once_in(6);
  lack.are_adhesions_equal = once_in(4);
  lack.are_adhesions_missing = once_in(10);
  lack.are_adhesion_forces_zero = once_in(10);
  lack.are_forces_equal = once_in(4);
  lack.has_directions = once_in(2);
  lack.are_networks_unknown = once_in(4);
  return lack;
}

inline statistics::Study small_study(const Lack& lack, std::uint64_t seed) {
  statistics::Study study = simulated_study({.n_cells = lack.n_cells,
                                             .n_conditions = lack.n_conditions,
                                             .mean_fibres_by_type = lack.fibres_by_type,
                                             .offset_nN = lack.offset_nN,
                                             .types_differ = !lack.has_types_alike,
                                             .cell_sd_nN = lack.cell_sd_nN,
                                             .fibre_sd_nN = lack.fibre_sd_nN,
                                             .error_nN = lack.error_nN,
                                             .seed = seed});
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (statistics::StudyCell& cell : study.cells) {
    if (uniform(random) < lack.share_of_empty_cells) {
      cell.cell.fibres.clear();
      cell.tensions.resize(1);
    }
    for (Tension& t : cell.tensions) {
      if (t.fibre_id == 0) {
        t.identifiable = !lack.are_networks_unknown;
        continue;
      }
      if (lack.are_tensions_equal) t = {.fibre_id = t.fibre_id, .tension_nN = 3, .low_nN = 3, .high_nN = 3};
      const double half = t.high_nN ? *t.high_nN - t.tension_nN : 0;
      t.tension_nN = std::max(0.0, t.tension_nN);
      t.low_nN = std::max(0.0, t.tension_nN - half);
      t.high_nN = t.tension_nN + half;
      if (uniform(random) < lack.share_without_interval) t.low_nN = t.high_nN = {};
      if (uniform(random) < lack.share_uncertain) t.identifiable = false;
    }
    for (AdhesionForce& f : cell.forces) {
      if (lack.are_adhesions_equal) f.force_nN = {1, 0};
      if (lack.are_adhesion_forces_zero) f.force_nN = {0, 0};
      if (lack.are_adhesions_equal || lack.are_adhesion_forces_zero) f.sigma_nN = 0;
    }
    for (Adhesion& a : cell.cell.adhesions)
      if (!lack.are_adhesions_equal) a.area_um2 *= 0.5 + uniform(random);
    if (lack.are_adhesions_missing) {
      cell.forces.clear();
      cell.cell.adhesions.clear();
    }
    cell.fit.total_force_nN = 0;
    for (const AdhesionForce& f : cell.forces) cell.fit.total_force_nN += norm(f.force_nN);
    if (lack.are_forces_equal) {
      cell.fit.total_force_nN = 10;
      cell.fit.network_surface_tension_nN_per_um = 0.07;
    }
    cell.fit.network_force_nN = 0.2 * cell.fit.total_force_nN;
    cell.fit.fibre_force_nN = cell.fit.total_force_nN - cell.fit.network_force_nN;
    for (const statistics::Relation relation : statistics::kRelations) {
      const int n = lack.has_directions ? static_cast<int>(random() % 4) : 0;
      for (int i = 0; i < n; ++i)
        cell.directions.push_back({relation, 1, {}, uniform(random) * statistics::largest_angle_deg(relation)});
    }
  }
  return study;
}

/// A cell of a study as the folder that it was read from.
inline void write_finished_cell(const fs::path& folder, const statistics::StudyCell& cell) {
  fs::create_directories(folder / "1_segment");
  fs::create_directories(folder / "4_fit");
  files::write_text(folder / "cell.toml", "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8.4\n");
  files::write_adhesions(folder / "1_segment/adhesions.csv", cell.cell.adhesions);
  files::write_fibres(folder / "1_segment/fibres.csv", folder / "1_segment/fibre_points.csv", cell.cell.fibres);
  files::write_outline(folder / "1_segment/outline.csv", cell.cell.outline_um);
  files::write_tensions(folder / "4_fit/tensions.csv", cell.tensions, cell.cell.fibres);
  files::write_adhesion_forces(folder / "4_fit/adhesion_forces.csv", cell.forces, cell.cell.adhesions);
  files::write_fit_summary(folder / "4_fit/fit.json", cell.fit);
}

/// A sheet of a study as the folder that it was read from.
inline void write_finished_sheet(const fs::path& folder, const statistics::StudyCell& cell) {
  fs::create_directories(folder / "1_segment");
  fs::create_directories(folder / "3_sheet");
  files::write_text(folder / "cell.toml",
                    "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8.4\n[run]\nmodel = \"sheet\"\n");
  files::write_outline(folder / "1_segment/outline.csv", cell.cell.outline_um);
  std::string nodes = "x_um,y_um\n";
  for (const Vec2& at : cell.cell.outline_um) nodes += std::to_string(at.x) + "," + std::to_string(at.y) + "\n";
  files::write_text(folder / "3_sheet/sheet.csv", nodes);
  files::write(folder / "3_sheet/sheet_fit.csv", files::sheet_estimate_table(), cell.sheet->estimates);
  Figures figures = {{"mean_tension_nN_per_um", cell.sheet->mean_tension_nN_per_um},
                     {"total_force_nN", cell.sheet->total_force_nN},
                     {"area_um2", cell.sheet->area_um2},
                     {"relative_l2", cell.sheet->relative_l2},
                     {"expected_relative_l2", cell.sheet->expected_relative_l2}};
  if (cell.sheet->strain_energy_fJ) figures.emplace_back("strain_energy_fJ", *cell.sheet->strain_energy_fJ);
  files::write_figures(folder / "3_sheet/sheet.json", figures);
}

/// A cell in space of a study as the folder that it was read from.
inline void write_finished_cell_in_space(const fs::path& folder, const statistics::StudyCell& cell) {
  const statistics::SpaceFigures& s = *cell.space;
  for (const char* part : {"1_segment", "2_track", "3_surface", "4_traction"}) fs::create_directories(folder / part);
  files::write_text(folder / "cell.toml",
                    "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8.4\n[track]\nz_points = \"into-gel\"\n");
  if (!cell.cell.outline_um.empty()) files::write_outline(folder / "1_segment/outline.csv", cell.cell.outline_um);
  files::write_displacement_in_space(folder / "2_track/displacement_3d.csv",  // the cells have beads of their own
                                     {{{s.total_force_nN, 2, 3}, {0.1, 0, 0}, 0.02, 0.06, {}}});
  files::write_surface(folder / "3_surface/surface.vtp", {{0, 0}, {10, 10}, 4, 4, std::vector<double>(16), {}});
  std::string tractions =
      "x_um,y_um,z_um,tx_kPa,ty_kPa,tz_kPa,sigma_tx_kPa,sigma_ty_kPa,sigma_tz_kPa,resolution_um,normal_kPa,tangential_"
      "kPa,area_um2\n";
  const auto add = [&](double x, double y, double z) {
    std::ostringstream row;
    row.precision(17);
    row << "1,2,0," << x << "," << y << "," << z << ",0.1,0.1,0.1,9," << -z << "," << std::hypot(x, y) << ",10\n";
    tractions += row.str();
  };
  add(0.1, 0, 0), add(0, 0, -0.2), add(0.6 * s.largest_traction_kPa, 0, 0.8 * s.largest_traction_kPa), add(0, 0.3, 0);
  files::write_text(folder / "4_traction/traction.csv", tractions);
  Figures figures = {{"method", s.method},
                     {"tractions_over", std::string("the cell")},
                     {"total_force_nN", s.total_force_nN},
                     {"normal_force_nN", s.normal_force_nN},
                     {"net_force_x_nN", 0.6 * s.net_force_nN},
                     {"net_force_y_nN", 0.0},
                     {"net_force_z_nN", -0.8 * s.net_force_nN},
                     {"moment_x_nN_um", 0.0},
                     {"moment_y_nN_um", -0.6 * s.net_moment_nN_um},
                     {"moment_z_nN_um", 0.8 * s.net_moment_nN_um},
                     {"strain_energy_fJ", s.strain_energy_fJ},
                     {"relative_l2", cell.fit.relative_l2},
                     {"noise_um", cell.fit.noise_um}};
  const auto add_known = [&](const char* name, const std::optional<double>& value) {
    if (value) figures.emplace_back(name, *value);
  };
  add_known("total_force_sigma_nN", s.total_force_sigma_nN);
  add_known("contractile_moment_nN_um", s.contractile_moment_nN_um);
  add_known("contractile_moment_sigma_nN_um", s.contractile_moment_sigma_nN_um);
  add_known("median_resolution_um", s.resolution_um);
  files::write_figures(folder / "4_traction/traction.json", figures);
  if (s.adhesions.empty()) return;
  files::write_adhesions(folder / "1_segment/adhesions.csv", round_cell().adhesions);
  std::ostringstream forces;
  forces.precision(17);
  forces << "adhesion_id,x_um,y_um,z_um,area_um2,fx_nN,fy_nN,fz_nN,sigma_nN\n";
  for (const auto& a : s.adhesions) {
    forces << a.adhesion_id << ",1,2,0,3," << 0.6 * a.force_nN << ",0," << 0.8 * a.force_nN << ",";
    if (a.sigma_nN) forces << *a.sigma_nN;
    forces << "\n";
  }
  files::write_text(folder / "4_traction/traction_adhesion_forces.csv", forces.str());
}

}  // namespace mbtfm::test
