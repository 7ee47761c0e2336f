/// thesis_way CELL GEL [most] [beads]: the tension fit beside the thesis' way to the same misfit, in processor time of
/// one thread, both from begin to end in this one run. A table (CSV) on stdout.
///
/// The thesis' way (3.2.5): block-wise conjugate gradients with finite differences, the gel solved for in each
/// evaluation, until a trial is within one standard error of the minimum (2 Phi above it by one variance), or `most`
/// times our time is over. Our way: the compliance, the reduction of the beads, Gauss–Newton. Both start with all
/// tensions at 0.06 nN, on the same mesh and beads.
///
/// CELL: full   a U2OS cell, 20 fibres, 170 adhesions; 10 000 beads, or so many
///       small  a ring of 12 adhesions, 6 fibres, 480 beads: the thesis' way ends within seconds on a kept factor
/// GEL:  anew   finite elements refined at each adhesion, meshed, assembled and solved for in each evaluation, on the
///              first mesh: 2 % off where ours is 0.1 % off, and so the cheaper
///       kept   ours (split), whose factor stays, as the thesis' did not: an evaluation is one triangular solution. A
///              lower bound of the thesis' cost.
#include <cstdio>
#include <cstring>
#include <ctime>

#include "mbtfm/tensions/solved_misfit.h"
#include "samples/experiment/experiment.h"
#include "substrate/choice/factory.h"
#include "tests/support/tension_scene.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::tensions;
using test::TensionScene;

constexpr double kNoise = 0.07;  // as in experiments (thesis 3.3)
const Gel kGel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 60};

/// Ends a minimisation that knows no such end.
struct Stop {};

double seconds_since(std::clock_t begin) { return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC; }

TensionScene small_scene() {
  constexpr int kFibres = 6;
  Cell cell = test::round_cell(2.0 * kFibres, 2 * kFibres);
  for (int i = 1; i <= kFibres; ++i) test::add_ventral(cell, i, i + kFibres - i % 2);
  return test::scene_of(cell, test::thesis_tensions_nN(cell.fibres.size(), 1), 80 * kFibres, kNoise, 1);
}

TensionScene full_scene(int n_beads) {
  const drawing::ScenarioParameters p;
  const Cell cell = drawing::draw_cell(p.cell, p.tension, drawing::field_um(p.microscope), 1).cell;
  return test::scene_of(cell, test::thesis_tensions_nN(cell.fibres.size(), 1), n_beads, kNoise, 1);
}

std::unique_ptr<substrate::Substrate> our_gel() {
  return choice::make_substrate(kGel, {.model = substrate::ModelKind::split}, 1);
}

/// Double precision: finite differences take five digits.
std::unique_ptr<substrate::Substrate> thesis_gel(bool is_kept) {
  if (is_kept) return our_gel();
  return choice::make_substrate(
      kGel,
      {.model = substrate::ModelKind::refined, .displacement_tolerance = 0, .precision = numerics::Precision::double_},
      1);
}

Eigen::VectorXd thesis_start_nN(const tensions::TensionProblem& problem) {
  return Eigen::VectorXd::Constant(problem.n_tensions(), 0.06);
}

/// Prints whenever the time has grown by a quarter, and at the end.
class Trace {
 public:
  Trace(double signal_squared, double minimum) : signal_squared_(signal_squared), minimum_(minimum) {}
  void add(const char* way, double cpu_s, int n_evaluations, double misfit, bool is_last = false) {
    if (!is_last && cpu_s < next_s_) return;
    next_s_ = 1.25 * cpu_s;
    std::printf("%s,%.3f,%d,%.5f,%.2f\n", way, cpu_s, n_evaluations, std::sqrt(misfit / signal_squared_),
                misfit - minimum_);
  }

 private:
  double signal_squared_, minimum_, next_s_ = 0;
};

struct Ours {
  double compliance_s = 0, total_s = 0;
};

Ours run_ours(const TensionScene& scene, double signal_squared) {
  Ours ours;
  const auto gel = our_gel();
  const std::clock_t begin = std::clock();
  const tensions::LinearData data =
      tensions::reduce(scene.beads, gel->compliance_um_per_nN(scene.points_um, scene.ellipses));
  ours.compliance_s = seconds_since(begin);
  const tensions::TensionProblem problem(scene.cables, data.reduced, scene.adhesion_ids);
  const tensions::TensionFit fit =
      tensions::fit_gauss_newton(problem, {}, tensions::scaled_to_data(problem, thesis_start_nN(problem)));
  ours.total_s = seconds_since(begin);
  const double misfit = 2 * fit.trial.objective + data.reduced.floor_squared;
  Trace(signal_squared, misfit).add("ours", ours.total_s, fit.n_evaluations, misfit, true);
  return ours;
}

struct Thesis {
  double total_s = 0;
  int n_evaluations = 0;
  bool has_arrived = false;
  double left_above = 0;        ///< the minimum, in chi squared
  const char* end = "stopped";  ///< arrived, time over, or stopped: no step that its gradients show pays any more
};

/// Minimises this misfit until within one standard error of the minimum, or until the time or the evaluations are over.
Thesis minimise(const tensions::TensionProblem& compliance_given, const tensions::SolvedMisfit& misfit_of,
                double minimum, double most_s, int most_evaluations, Trace* trace) {
  Thesis thesis;
  double least = 1e300;
  const std::clock_t begin = std::clock();
  const tensions::SolvedMisfit until_there = [&](const Eigen::VectorXd& forces_nN) {
    const double misfit = misfit_of(forces_nN);
    least = std::min(least, misfit);
    ++thesis.n_evaluations;  // one thread
    thesis.total_s = seconds_since(begin);
    thesis.has_arrived = least <= minimum + 1;
    const bool is_last = thesis.has_arrived || thesis.total_s >= most_s || thesis.n_evaluations >= most_evaluations;
    if (trace) trace->add("thesis", thesis.total_s, thesis.n_evaluations, least, is_last);
    if (!is_last) return misfit;
    thesis.end = thesis.has_arrived ? "arrived" : "time over";
    throw Stop();
  };
  tensions::FitParameters parameters;
  parameters.method = tensions::FitMethod::blockwise_cg;
  parameters.gradients = tensions::Gradients::finite_difference;
  parameters.max_evaluations = 2 * most_evaluations;
  parameters.tolerance = 1e-300;  // its steps are short long before the minimum
  const tensions::TensionProblem problem(compliance_given.cell(), compliance_given.data(),
                                         compliance_given.adhesion_ids(), until_there);
  try {
    tensions::fit_tensions(problem, parameters, 1, problem.evaluate(thesis_start_nN(problem)));
  } catch (const Stop&) {
  }
  thesis.left_above = least - minimum;
  return thesis;
}

/// @param to_the_end  the evaluations until it arrives: counted on the compliance, which gives the same iterates to
///                    rounding as the gel is linear
Thesis run_thesis(const TensionScene& scene, bool is_kept, double signal_squared, double most_s, Thesis& to_the_end) {
  const auto gel = thesis_gel(is_kept);
  const tensions::LinearData data =
      tensions::reduce(scene.beads, gel->compliance_um_per_nN(scene.points_um, scene.ellipses));
  const tensions::TensionProblem problem(scene.cables, data.reduced, scene.adhesion_ids);
  const tensions::TensionFit end =
      tensions::fit_gauss_newton(problem, {}, tensions::scaled_to_data(problem, thesis_start_nN(problem)));
  const double minimum = 2 * end.trial.objective + data.reduced.floor_squared;
  constexpr int kMostEvaluations = 50000;
  const tensions::SolvedMisfit by_compliance = [&](const Eigen::VectorXd& forces_nN) {
    return (*data.reduced.compliance * forces_nN - data.reduced.target).squaredNorm() + data.reduced.floor_squared;
  };
  to_the_end = minimise(problem, by_compliance, minimum, 1e300, kMostEvaluations, nullptr);
  Trace trace(signal_squared, minimum);
  return minimise(problem, tensions::solved_misfit(*gel, scene.points_um, scene.ellipses, data), minimum, most_s,
                  kMostEvaluations, &trace);
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 1 << 12);
  const bool is_full = argc > 1 && std::strcmp(argv[1], "full") == 0;
  const bool is_kept = argc > 2 && std::strcmp(argv[2], "kept") == 0;
  if (argc < 3 || (!is_full && std::strcmp(argv[1], "small") != 0) || (!is_kept && std::strcmp(argv[2], "anew") != 0)) {
    std::fprintf(stderr, "thesis_way full|small anew|kept [most] [beads]\n");
    return 2;
  }
  const double most = argc > 3 ? std::atof(argv[3]) : 1000;
  const TensionScene scene = is_full ? full_scene(argc > 4 ? std::atoi(argv[4]) : 10000) : small_scene();
  double signal_squared = 0;
  for (const Bead& b : scene.beads)
    signal_squared += dot(b.displacement_um, b.displacement_um) / (b.sigma_um * b.sigma_um);
  // deal.II is loaded with the first mesh of a process: of neither way's time, both need it
  our_gel()->compliance_um_per_nN({scene.points_um.front()}, {scene.ellipses.front()});
  std::printf("way,cpu_s,evaluations,relative_l2,chi_squared_above_minimum\n");
  const Ours ours = run_ours(scene, signal_squared);
  Thesis to_the_end;
  const Thesis thesis = run_thesis(scene, is_kept, signal_squared, most * ours.total_s, to_the_end);
  const double evaluation_s = thesis.total_s / thesis.n_evaluations, fit_s = ours.total_s - ours.compliance_s;
  const char* more = thesis.has_arrived ? "" : ">";
  std::printf("\nour_compliance_s,our_fit_s,thesis_s,end,above_minimum,ratio,ratio_compliance_given\n");
  std::printf("%.3f,%.3f,%.3f,%s,%.2f,%s%.0f,%s%.0f\n", ours.compliance_s, fit_s, thesis.total_s, thesis.end,
              thesis.left_above, more, thesis.total_s / ours.total_s, more, thesis.total_s / fit_s);
  std::printf("\nseconds_an_evaluation,evaluations_to_the_end,end,above_minimum,ratio_put_together\n");
  std::printf("%.4f,%d,%s,%.2f,%s%.0f\n", evaluation_s, to_the_end.n_evaluations, to_the_end.end, to_the_end.left_above,
              to_the_end.has_arrived ? "" : ">", evaluation_s * to_the_end.n_evaluations / ours.total_s);
}
