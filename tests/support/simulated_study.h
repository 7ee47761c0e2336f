/// Studies of many cells with known means, scatter and errors, in memory.
#pragma once

#include <random>

#include "pipeline/statistics/study.h"
#include "tests/support/fake_cell.h"

namespace mbtfm::test {

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
  statistics::Study study;
  for (int c = 0; c < s.n_conditions; ++c)
    study.conditions.push_back(s.n_conditions == 1 ? "" : std::string(1, static_cast<char>('a' + c)));
  for (int i = 0; i < s.n_cells; ++i) {
    statistics::StudyCell cell{.name = "cell_" + std::to_string(i),
                               .condition = i * s.n_conditions / s.n_cells,
                               .cell = round_cell(),
                               .forces = {},
                               .tensions = {},
                               .fit = {},
                               .directions = {}};
    cell.cell.fibres.clear();
    cell.tensions.push_back({.fibre_id = 0, .tension_nN = 0.06, .low_nN = {}, .high_nN = {}});
    const double of_cell = s.cell_sd_nN * normal(random);
    for (const FibreType type : kFibreTypes) {
      const double of_type = s.type_in_cell_sd_nN * normal(random);
      const double mean = s.types_differ ? (type == FibreType::dorsal ? 1.5 : type == FibreType::arc ? 2.5 : 4) : 2.5;
      const int n = std::poisson_distribution<int>(s.mean_fibres_by_type)(random);
      for (int k = 0; k < n; ++k) {
        const int id = static_cast<int>(cell.cell.fibres.size()) + 1;
        cell.cell.fibres.push_back({.fibre_id = id,
                                    .type = type,
                                    .width_um = 0.6,
                                    .start_adhesion_id = {},
                                    .end_adhesion_id = {},
                                    .points_um = {{20, 20}, {30, 30.0 + id}}});
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
                             .connected = a.adhesion_id % 3 == 0,
                             .moment_nN_um = {}});
      cell.fit.total_force_nN += norm(cell.forces.back().force_nN);
    }
    cell.fit.network_force_nN = 0.2 * cell.fit.total_force_nN;
    cell.fit.fibre_force_nN = 0.8 * cell.fit.total_force_nN;
    cell.fit.network_surface_tension_nN_per_um = 0.07 * std::exp(0.1 * normal(random));
    cell.fit.converged = true;
    study.cells.push_back(std::move(cell));
  }
  return study;
}

}  // namespace mbtfm::test
