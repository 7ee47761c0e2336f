/// effects_cost [REPEATS [EFFECT]]: what an effect costs that is off, against a path that does not know of it. Each is
/// run in a process of its own, in turn; median seconds of the processor and peak memory, and by how much the pairs
/// differ. EFFECT: rows that have this in their name.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "mbtfm/tensions/effects.h"
#include "mbtfm/tensions/series.h"
#include "network/cables/effects.h"
#include "segment/beads/track.h"
#include "substrate/choice/factory.h"
#include "tests/support/bead_pair.h"
#include "tests/support/substrate_scene.h"
#include "tests/support/tension_scene.h"

namespace mbtfm {
namespace {

std::string asked_for;  // set by main; empty: all rows

struct Cost {
  double seconds = 0, peak_MB = 0;
};

Cost cost_of(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    work();
    _exit(0);
  }
  int status = 0;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  if (status != 0) std::exit(1);
  const auto seconds = [](timeval t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return {seconds(usage.ru_utime) + seconds(usage.ru_stime), static_cast<double>(usage.ru_maxrss) / 1024};
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Of the median, from the middle half of the values (1.35 deviations wide where they are Gaussian, 1.25 / sqrt(n)).
double error_of_median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const double middle_half = values[3 * values.size() / 4] - values[values.size() / 4];
  return 1.25 / 1.35 * middle_half / std::sqrt(static_cast<double>(values.size()));
}

void compare(const std::string& effect, int n, const std::function<void()>& off, const std::function<void()>& without) {
  if (effect.find(asked_for) == std::string::npos) return;
  std::vector<double> seconds[2], memory[2], percent;
  for (int i = 0; i < n; ++i) {
    for (int turn = 0; turn < 2; ++turn) {
      const int k = (i + turn) % 2;  // who goes first changes
      const Cost cost = cost_of(k == 0 ? off : without);
      seconds[k].push_back(cost.seconds);
      memory[k].push_back(cost.peak_MB);
    }
    percent.push_back(100 * (seconds[0].back() / seconds[1].back() - 1));
  }
  std::printf("| %s | %.3f | %.3f | %+.1f ± %.1f %% | %.1f | %.1f |\n", effect.c_str(), median(seconds[0]),
              median(seconds[1]), median(percent), error_of_median(percent), median(memory[0]), median(memory[1]));
  std::fflush(stdout);
}

/// 170 adhesions, 10 000 beads, on a gel so thick that all effects of the gel are off.
void compare_gel(int n) {
  const Gel gel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 50000};
  const auto points = test::scattered_points(10000, 50);
  const auto ellipses = test::scattered_ellipses(170, 30);
  const auto run = [&](const std::string& model) {
    choice::make_substrate(gel, test::model_named(model), 1)->compliance_um_per_nN(points, ellipses);
  };
  compare(
      "finite thickness, sides, grading, vertical", n, [&] { run("auto"); }, [&] { run("half-space"); });
  Gel thin = gel;
  thin.thickness_um = 60;
  const auto run_on = [&](const std::string& model) {
    choice::make_substrate(thin, test::model_named(model), 1)->compliance_um_per_nN(points, ellipses);
  };
  compare(
      "finite sides, grading, vertical", n, [&] { run_on("auto"); }, [&] { run_on("layer"); });
}

void compare_fit(int n) {
  Cell cell = test::round_cell(25, 40);
  for (int k = 1; k <= 8; ++k) test::add_ventral(cell, k, k + 17);
  Eigen::VectorXd tensions = Eigen::VectorXd::Constant(9, 3);
  tensions[0] = 0.06;
  const test::TensionScene scene = test::scene_of(cell, tensions, 5000, 0.05, 1);
  const auto fit = [&](std::optional<tensions::Loss> loss) {
    test::TensionScene copy = test::scene_of(cell, tensions, 10, 0.05, 1);
    copy.beads = scene.beads;
    copy.data = scene.data;
    copy.adhesion_ids = scene.adhesion_ids;
    tensions::FitParameters parameters;
    parameters.loss = loss;
    test::fit_own_network(copy, parameters);
  };
  compare(
      "robust loss", n, [&] { fit({}); }, [&] { fit(tensions::Loss::squares); });
  const std::vector<double> given(tensions.data(), tensions.data() + tensions.size());
  const auto contract = [&](double stiffness) {
    const cables::CableNetwork cables(scene.cables.network(), {.axial_stiffness_nN = stiffness});
    for (int k = 0; k < 10; ++k) cables.equilibrium(given);
  };
  compare(
      "elasticity of cables (against on)", n, [&] { contract(0); }, [&] { contract(50); });
}

/// Adhesions and beads alike, with fibres or without: those that are switched off leave the cell that never had any.
void compare_fibres(int n) {
  const Cell even = test::round_cell(25, 40);
  Cell fibrous = even;
  for (int k = 1; k <= 8; ++k) test::add_ventral(fibrous, k, k + 17);
  const test::TensionScene scene = test::scene_of(even, Eigen::VectorXd::Constant(1, 0.06), 5000, 0.05, 1);
  const auto fit = [&](const Cell& cell) {
    tensions::LinearData data = scene.data;
    std::vector<cables::CableNetwork> networks;
    networks.emplace_back(mesh::generate_network(cell, {}).network);
    tensions::fit_ensemble(networks, data, scene.adhesion_ids, {.n_meshes = 1}, 1);
  };
  const auto fit_without = [&] {
    Cell cell = fibrous;
    cables::take_fibres(cell, Switch::off);
    fit(cell);
  };
  compare("stress fibres", n, fit_without, [&] { fit(even); });
}

/// Three frames of a series, against as many cells that are no series.
void compare_series(int n) {
  Cell cell = test::round_cell(25, 40);
  for (int k = 1; k <= 8; ++k) test::add_ventral(cell, k, k + 17);
  Eigen::VectorXd tensions = Eigen::VectorXd::Constant(9, 3);
  tensions[0] = 0.06;
  test::TensionScene scene = test::scene_of(cell, tensions, 5000, 0.05, 1);
  std::vector<tensions::SeriesFrame> frames;
  for (int f = 1; f <= 3; ++f) {
    contract(scene, tensions * (1 + 0.1 * f));
    measure(scene, 0.05, static_cast<unsigned>(f));
    frames.push_back({.frame = f, .refused = {}, .beads = scene.beads});
  }
  std::vector<cables::CableNetwork> networks;
  networks.emplace_back(scene.cables.network());
  const tensions::FitParameters parameters{.n_meshes = 1};
  const tensions::Trial start = tensions::uniform_start({networks.front(), scene.data.reduced, scene.adhesion_ids});
  const auto off = [&] {
    const Effect coupling = tensions::decide_time_coupling(true, Switch::off);
    tensions::fit_series(frames, networks, substrate::dense_response(scene.compliance_um_per_nN), {},
                         scene.adhesion_ids, parameters, false, coupling.is_on, 1, start);
  };
  const auto one_by_one = [&] {
    for (const tensions::SeriesFrame& frame : frames) {
      tensions::LinearData data = tensions::reduce(frame.beads, scene.compliance_um_per_nN);
      tensions::fit_ensemble(networks, data, scene.adhesion_ids, parameters, 1, {}, &start);
    }
  };
  compare("time coupling", n, off, one_by_one);
}

void compare_tracking(int n) {
  const auto pair = test::draw_bead_pair(test::ring_of_adhesions(512, 6), {.width = 512, .n_beads = 5200});
  const auto track = [&](Switch drift) {
    beads::TrackParameters parameters;
    parameters.drift_affine = drift;
    beads::track_beads(pair.relaxed, pair.stressed, 0.1, parameters, 1);
  };
  compare(
      "affine drift", n, [&] { track(Switch::automatic); }, [&] { track(Switch::off); });
}

}  // namespace
}  // namespace mbtfm

int main(int argc, char** argv) {
  const int n = argc > 1 ? std::atoi(argv[1]) : 5;
  mbtfm::asked_for = argc > 2 ? argv[2] : "";
  std::printf("| off | seconds | without | difference | MB | without |\n|---|---|---|---|---|---|\n");
  mbtfm::compare_gel(n);
  mbtfm::compare_fit(n);
  mbtfm::compare_fibres(n);
  mbtfm::compare_series(n);
  mbtfm::compare_tracking(n);
}
