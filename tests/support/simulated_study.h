/// Studies of many cells with known means, scatter and errors, in memory.
#pragma once

#include <random>

#include "pipeline/statistics/study.h"
#include "tests/support/fake_cell.h"

namespace mbtfm::test {

/// Squares in a row, shared out to conditions a, b, …; what pulls in them is still to come.
inline statistics::Study study_of_squares(const std::string& name, int n_cells, int n_conditions) {
  statistics::Study study;
  for (int c = 0; c < n_conditions; ++c)
    study.conditions.push_back(n_conditions == 1 ? "" : std::string(1, static_cast<char>('a' + c)));
  for (int i = 0; i < n_cells; ++i) {
    const double x = 50.0 * i;
    study.cells.push_back({.name = name + std::to_string(i),
                           .condition = i * n_conditions / n_cells,
                           .cell = {.outline_um = {{x, 0}, {x + 40, 0}, {x + 40, 40}, {x, 40}}},
                           .fit = {.converged = true}});
  }
  return study;
}

struct StudySettings {
  int n_cells = 20;
  int n_conditions = 1;
  double mean_fibres_by_type = 4;  ///< a cell may lack a type
  double offset_nN = 10;           ///< that zero does not cut the scatter
  bool types_differ = true;
  double condition_effect_nN = 0;  ///< from each condition to the next
  double cell_sd_nN = 1;           ///< shared by the fibres of a cell
  double type_in_cell_sd_nN = 0;   ///< shared by the fibres of a type in a cell
  double fibre_sd_nN = 1;
  double error_nN = 0.5;  ///< typical standard error of a tension
  std::uint64_t seed = 1;
};

inline statistics::Study simulated_study(const StudySettings& s) {
  std::mt19937_64 random(s.seed);
  std::normal_distribution<double> normal;
  statistics::Study study = study_of_squares("cell_", s.n_cells, s.n_conditions);
  for (statistics::StudyCell& cell : study.cells) {
    cell.cell = round_cell();
    cell.cell.fibres.clear();
    cell.tensions.push_back({.fibre_id = 0, .tension_nN = 0.06});
    const double of_cell = s.cell_sd_nN * normal(random);
    for (const FibreType type : {FibreType::dorsal, FibreType::arc, FibreType::ventral, FibreType::edge}) {
      const double of_type = s.type_in_cell_sd_nN * normal(random);
      const double mean = s.types_differ ? (type == FibreType::dorsal ? 1.5 : type == FibreType::arc ? 2.5 : 4) : 2.5;
      const int n = std::poisson_distribution<int>(s.mean_fibres_by_type)(random);
      for (int k = 0; k < n; ++k) {
        const int id = static_cast<int>(cell.cell.fibres.size()) + 1;
        cell.cell.fibres.push_back(
            {.fibre_id = id, .type = type, .width_um = 0.6, .points_um = {{20, 20}, {30, 30.0 + id}}});
        const double error = s.error_nN * std::uniform_real_distribution<double>(0.5, 1.5)(random);
        const double t = s.offset_nN + mean + cell.condition * s.condition_effect_nN + of_cell + of_type +
                         s.fibre_sd_nN * normal(random) + error * normal(random);
        cell.tensions.push_back(
            {.fibre_id = id, .tension_nN = t, .low_nN = t - 1.96 * error, .high_nN = t + 1.96 * error});
      }
    }
    for (const Adhesion& a : cell.cell.adhesions) {
      const double f = std::exp(0.5 * normal(random));
      cell.forces.push_back({.adhesion_id = a.adhesion_id,
                             .force_nN = {f, 0.5 * f},
                             .sigma_nN = 0.1,
                             .connected = a.adhesion_id % 3 == 0});
      cell.fit.total_force_nN += norm(cell.forces.back().force_nN);
    }
    cell.fit.network_force_nN = 0.2 * cell.fit.total_force_nN;
    cell.fit.fibre_force_nN = 0.8 * cell.fit.total_force_nN;
    cell.fit.network_surface_tension_nN_per_um = 0.07 * std::exp(0.1 * normal(random));
  }
  return study;
}

struct SheetStudySettings {
  int n_sheets = 12;
  int n_conditions = 2;
  double contraction_nN_per_um = 2;
  double condition_effect_nN_per_um = 0;  ///< from each condition to the next
  double sheet_sd_nN_per_um = 0.2;
  double error_nN_per_um = 0.1;      ///< standard error of a contraction, its own
  double gel_error_nN_per_um = 0.5;  ///< that of the gel's modulus, which all share; it moves none of them here
  std::uint64_t seed = 1;
};

/// Sheets whose other figures follow the contraction.
inline statistics::Study simulated_sheets(const SheetStudySettings& s) {
  test::Normal normal(s.seed);
  statistics::Study study = study_of_squares("sheet_", s.n_sheets, s.n_conditions);
  for (statistics::StudyCell& cell : study.cells) {
    const double value = s.contraction_nN_per_um + cell.condition * s.condition_effect_nN_per_um +
                         s.sheet_sd_nN_per_um * normal() + s.error_nN_per_um * normal(),
                 sigma = std::hypot(s.error_nN_per_um, s.gel_error_nN_per_um);
    const double stiffness = 20 * std::exp(0.2 * normal());
    cell.sheet = SheetSummary{.estimates = {{.quantity = SheetQuantity::contraction,
                                             .value = value,
                                             .sigma = sigma,
                                             .low = value - 1.96 * sigma,
                                             .high = value + 1.96 * sigma,
                                             .parts = {.beads = s.error_nN_per_um, .gel = s.gel_error_nN_per_um}},
                                            {.quantity = SheetQuantity::stiffness,
                                             .value = stiffness,
                                             .sigma = 4.0,
                                             .low = stiffness - 8,
                                             .high = stiffness + 8,
                                             .parts = {.beads = 4.0}},
                                            {.quantity = SheetQuantity::contraction_over_stiffness,
                                             .value = value / stiffness,
                                             .sigma = 0.02,
                                             .low = value / stiffness - 0.04,
                                             .high = value / stiffness + 0.04,
                                             .parts = {.beads = 0.02}}},
                              .mean_tension_nN_per_um = 0.8 * value,
                              .total_force_nN = 100 * std::abs(value),
                              .strain_energy_fJ = 30 * value * value,
                              .area_um2 = 1600 * std::exp(0.1 * normal()),
                              .relative_l2 = 0.3,
                              .expected_relative_l2 = 0.25};
    cell.fit.relative_l2 = 0.3;
    cell.fit.expected_relative_l2 = 0.25;
  }
  return study;
}

struct SpaceStudySettings {
  int n_cells = 12;
  int n_conditions = 2;
  double force_nN = 500;
  double condition_effect_nN = 0;  ///< from each condition to the next
  double cell_sd_nN = 50;
  double error_nN = 30;  ///< standard error of a total force
  int n_adhesions = 5;   ///< each has a share of the force; 0: no image shows them
  std::uint64_t seed = 1;
};

/// Cells on a gel in space whose other figures follow the force.
inline statistics::Study simulated_cells_in_space(const SpaceStudySettings& s) {
  test::Normal normal(s.seed);
  statistics::Study study = study_of_squares("space_", s.n_cells, s.n_conditions);
  for (statistics::StudyCell& cell : study.cells) {
    const double force =
        s.force_nN + cell.condition * s.condition_effect_nN + s.cell_sd_nN * normal() + s.error_nN * normal();
    cell.space = statistics::SpaceFigures{.method = "group-l1",
                                          .total_force_nN = force,
                                          .total_force_sigma_nN = s.error_nN,
                                          .strain_energy_fJ = 1e-3 * force * force,
                                          .contractile_moment_nN_um = 10 * force + 300 * normal(),
                                          .contractile_moment_sigma_nN_um = 100.0,
                                          .normal_force_nN = 0.3 * force,
                                          .largest_traction_kPa = 2 * std::exp(0.1 * normal()),
                                          .net_force_nN = 20,
                                          .net_moment_nN_um = 300,
                                          .resolution_um = 9 * std::exp(0.05 * normal())};
    for (int a = 0; a < s.n_adhesions; ++a)
      cell.space->adhesions.push_back(
          {a + 1, force / s.n_adhesions * std::exp(0.3 * normal()), s.error_nN / s.n_adhesions});
    cell.fit.relative_l2 = 0.3;
    cell.fit.noise_um = 0.02;
  }
  return study;
}

}  // namespace mbtfm::test
