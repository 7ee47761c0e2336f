/// Experiments that no one thought of: gel, cell, tensions, beads and camera at random, over more than what
/// laboratories have; and what must hold of the chain's answer whatever the scene.
#pragma once

#include "pipeline/contract/errors.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/results.h"
#include "tests/support/program.h"

namespace mbtfm::test {

/// Uniform numbers of a seed, with every standard library the same.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  /// Evenly in the logarithm.
  double decades(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  int whole(int low, int high) { return static_cast<int>(std::floor(uniform(low, high + 1.0))); }
  bool happens(double chance) { return uniform(0, 1) < chance; }
  template <class T>
  T one_of(const std::vector<T>& values) {
    return values[whole(0, static_cast<int>(values.size()) - 1)];
  }

 private:
  std::mt19937_64 engine_;
};

struct RandomScene {
  std::uint64_t seed = 0;
  bool has_images = false;
  std::string scenario;  ///< for mbtfm-simulate
  std::string settings;  ///< for the end of cell.toml
};

/// The cell's size sets the field, the number of adhesions and the fibres' spacing, so that most scenes can be drawn.
inline RandomScene random_scene(std::uint64_t seed) {
  Dice dice(seed);
  RandomScene scene{.seed = seed, .has_images = dice.happens(0.25)};
  std::ostringstream text;
  const double diameter_um = dice.decades(18, 90);
  const double pixel_um = dice.uniform(0.08, 0.16);
  const double field_um = diameter_um * dice.uniform(1.45, 2.2);
  text << "pixel_size_um = " << pixel_um << "\n[gel]\nyoungs_modulus_kPa = " << dice.decades(0.5, 50)
       << "\npoisson_ratio = " << dice.one_of<double>({0.3, 0.45, 0.48, 0.495, 0.4999})
       << "\nthickness_um = " << dice.decades(5, 300) << "\n[scenario]\ndiameter_um = " << diameter_um
       << "\nimage_size_px = " << std::lround(field_um / pixel_um) << "\nelongation = " << dice.uniform(1, 2.2)
       << "\nn_corners = " << dice.whole(4, 12) << "\ncorner_jitter = " << dice.uniform(0, 0.25)
       << "\nedge_concavity = " << dice.uniform(0, 0.15) << "\n";
  const double room = std::pow(diameter_um / 66, 2);
  const int n_ventral = dice.whole(0, std::max(1, static_cast<int>(10 * room)));
  const int n_dorsal = dice.whole(0, std::max(1, static_cast<int>(10 * room)));
  const int n_adhesions = 3 + 2 * n_ventral + n_dorsal + static_cast<int>(dice.uniform(0, 180) * room);
  text << "n_ventral = " << n_ventral << "\nn_dorsal = " << n_dorsal
       << "\nn_arc = " << dice.whole(0, static_cast<int>(6 * room)) << "\nn_adhesions = " << n_adhesions
       << "\nn_pairs = " << (dice.happens(0.2) ? std::min(2, n_ventral / 2) : 0) << "\n";
  const double strength = dice.decades(0.2, 5);
  text << "dorsal_median_nN = " << 0.8 * strength << "\nventral_median_nN = " << 3.8 * strength
       << "\narc_median_nN = " << 1.7 * strength << "\nsmallest_tension_nN = " << 0.05 * strength
       << "\nlargest_tension_nN = " << 15 * strength
       << "\nsurface_tension_nN_per_um = " << 0.07 * strength * dice.decades(0.1, 3) << "\n";
  text << "noise = " << dice.decades(0.01, 0.5)
       << "\nbeads = " << std::lround(field_um * field_um * dice.decades(0.1, 1))
       << "\nlost_bead_fraction = " << dice.uniform(0, 0.1) << "\n";
  if (scene.has_images) {
    text << "image_quality = \"" << dice.one_of<std::string>({"good", "ordinary", "poor"})
         << "\"\ndrift_x_um = " << dice.uniform(-1, 1) << "\ndrift_y_um = " << dice.uniform(-1, 1) << "\n";
  }
  scene.scenario = text.str();
  scene.settings = "\n[network]\nedge_length_um = " + std::to_string(dice.uniform(1.2, 2)) + "\n";
  return scene;
}

/// What came of a scene.
struct SceneOutcome {
  enum class Kind { answered, refused, cannot_be_drawn };
  Kind kind = Kind::answered;
  std::vector<std::string> faults;   ///< what must hold and does not
  std::string message;               ///< of a refusal
  int n_tensions = 0, n_within = 0;  ///< fibres matched with a true one; those within three stated standard errors
  double relative_error = 0;
};

/// Within three times the standard error that the 95 % interval states on the truth's side.
inline bool is_within_three_errors(const Tension& t, double truth_nN) {
  constexpr double kErrors = 3 / 1.96;
  const double misfit = truth_nN - t.tension_nN;
  if (misfit >= 0) return misfit <= kErrors * (t.high_nN.value() - t.tension_nN);
  return t.low_nN.value() == 0 || -misfit <= kErrors * (t.tension_nN - t.low_nN.value());
}

inline void check_answer(const std::filesystem::path& cell, SceneOutcome& outcome) {
  const auto fault = [&](bool holds, const std::string& what) {
    if (!holds) outcome.faults.push_back(what);
  };
  // the readers refuse what is not finite
  const auto adhesions = files::read_adhesions(cell / "1_segment/adhesions.csv");
  const auto forces = files::read_adhesion_forces(cell / "4_fit/adhesion_forces.csv");
  const FitSummary summary = files::read_fit_summary(cell / "4_fit/fit.json");
  files::read_displacement(cell / "4_fit/fitted_displacement.csv");
  fault(adhesions.size() == forces.size(), "one force an adhesion");
  Vec2 net_nN;
  double total_nN = 0, torque_nN_um = 0, torques_nN_um = 0, across_adhesions_nN_um = 0;
  for (std::size_t a = 0; a < std::min(adhesions.size(), forces.size()); ++a) {
    const double torque = cross(adhesions[a].position_um, forces[a].force_nN) + forces[a].moment_nN_um.value_or(0);
    net_nN += forces[a].force_nN;
    total_nN += norm(forces[a].force_nN);
    torque_nN_um += torque;
    torques_nN_um += std::abs(torque);
    across_adhesions_nN_um += 0.5 * adhesions[a].major_axis_um * norm(forces[a].force_nN);
  }
  // each of a thousand free vertices is at rest to 1e-9 of the largest tension; what pulls along the edge has no row
  const double edge_nN = report::figure_of(summary, "edge_force_nN").value_or(0);
  fault(norm(net_nN) <= 1e-6 * total_nN + edge_nN, "no net force");
  // what adhesions bear beside the network acts at their centres, where the network's part has a moment
  const double beside = std::sqrt(std::max(0.0, 1 - report::figure_of(summary, "network_explains").value()));
  const bool turns = std::abs(torque_nN_um) > 1e-6 * torques_nN_um + beside * across_adhesions_nN_um;
  fault(edge_nN > 0 || !turns, "no net torque");
  fault(summary.relative_l2 >= 0 && summary.relative_l2 <= 1.5, "a fit no worse than none");
  for (const Tension& t : files::read_tensions(cell / "4_fit/tensions.csv")) {
    fault(t.tension_nN >= 0, "tensions that pull");
    fault(t.low_nN && t.high_nN && *t.low_nN <= t.tension_nN && t.tension_nN <= *t.high_nN, "an interval around each");
  }
  const report::Comparison comparison = report::compare_with_truth(cell);
  outcome.relative_error = comparison.relative_error;
  for (const report::ComparedFibre& f : comparison.fibres) {
    if (!f.tension || !f.true_tension_nN) continue;
    ++outcome.n_tensions;
    outcome.n_within += is_within_three_errors(*f.tension, *f.true_tension_nN);
  }
}

/// Simulate and run a scene in `cell`, which does not exist yet.
/// @param before  as run_program
inline SceneOutcome run_scene(const RandomScene& scene, const std::filesystem::path& cell,
                              const std::string& before = {}) {
  SceneOutcome outcome;
  const std::filesystem::path file = cell.string() + ".toml";
  files::write_text(file, scene.scenario);
  const Outcome made =
      run_program("mbtfm-simulate --quiet --scenario " + file.string() + " --seed " + std::to_string(scene.seed) +
                      (scene.has_images ? " --images" : "") + " --out " + cell.string(),
                  before);
  if (made.code == exit_code::kUsage) return {.kind = SceneOutcome::Kind::cannot_be_drawn, .message = made.output};
  if (made.code != 0) return {.faults = {"a simulation"}, .message = made.output};
  files::write_text(cell / "cell.toml", files::read_text(cell / "cell.toml") + scene.settings);
  const Outcome run = run_program("mbtfm run " + cell.string(), before);
  if (run.code == exit_code::kInput || run.code == exit_code::kNotSolved || run.code == exit_code::kNoAnswer) {
    // poor images may be refused; adhesions, fibres and displacements of a cell as it was drawn may not
    std::vector<std::string> faults;
    if (!scene.has_images) faults.push_back("an answer where adhesions, fibres and displacements are given");
    return {.kind = SceneOutcome::Kind::refused, .faults = faults, .message = run.output};
  }
  if (run.code != 0)
    return {.faults = {"an answer or a refusal, not exit code " + std::to_string(run.code)}, .message = run.output};
  try {
    check_answer(cell, outcome);
  } catch (const std::exception& error) {
    outcome.faults.push_back(std::string("outputs that can be read: ") + error.what());
  }
  return outcome;
}

}  // namespace mbtfm::test
