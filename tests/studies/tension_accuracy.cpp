/// tension_accuracy STUDY [repeats] [cells] [folder]: how well tensions are found, for notes/validation.md. Studies:
/// descent, noise, deviations, beside-fttc, directions, types. A table (CSV) on stdout; charts
/// (SVG) into the folder.
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "mbtfm/tensions/model_checks.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"
#include "samples/experiment/experiment.h"
#include "tests/support/chart.h"
#include "tests/support/tension_scene.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::tensions;
using test::TensionScene;

constexpr double kPi = 3.14159265358979323846;

struct Arguments {
  int n_repeats = 10, n_cells = 1;
  std::filesystem::path folder;
};

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

void save(const Arguments& a, const std::string& name, const std::vector<test::Panel>& panels) {
  files::write_text(a.folder / (name + ".svg"), test::chart(panels));
}

Cell drawn_cell(std::uint64_t seed) {
  const drawing::ScenarioParameters p;
  return drawing::draw_cell(p.cell, p.tension, drawing::field_um(p.microscope), seed).cell;
}

TensionScene thesis_scene(std::uint64_t seed, int n_beads, double noise) {
  const Cell cell = drawn_cell(seed);
  return test::scene_of(cell, test::thesis_tensions_nN(cell.fibres.size(), seed), n_beads, noise,
                        static_cast<unsigned>(seed));
}

double condition_of(const Eigen::MatrixXd& H) {
  const Eigen::VectorXd values = numerics::symmetric_eigen(H).values;
  return values.maxCoeff() / values.minCoeff();
}

/// What conjugate gradients have to cope with: the condition number of d²Phi/dt² at the solution.
void print_conditions(const tensions::TensionProblem& problem, const Eigen::VectorXd& solution_nN) {
  const Eigen::MatrixXd J = problem.jacobian(problem.evaluate(solution_nN));
  const Eigen::MatrixXd H = J.transpose() * J;
  const Eigen::Index n_fibres = H.rows() - 1;
  const Eigen::VectorXd scale = H.diagonal().cwiseSqrt().cwiseInverse();
  std::printf("network_over_median_fibre,condition,of_fibres_alone,all_scaled_to_equal_weight\n");
  Eigen::VectorXd fibres = H.diagonal().tail(n_fibres);
  std::sort(fibres.begin(), fibres.end());
  std::printf("%.3g,%.3g,%.3g,%.3g\n", H(0, 0) / fibres[n_fibres / 2], condition_of(H),
              condition_of(H.bottomRightCorner(n_fibres, n_fibres)),
              condition_of(scale.asDiagonal() * H * scale.asDiagonal()));
}

// Fig. 3.4: the misfit over the equilibria solved, without noise.
void descent(const Arguments& a) {
  const TensionScene scene = thesis_scene(1, 2000, 0);
  const tensions::TensionProblem problem(scene.cables, scene.data.reduced, scene.adhesion_ids);
  const double size = 2 / scene.displacement_um.squaredNorm();
  const int n = problem.n_tensions();
  std::vector<int> fibres;
  for (int i = 1; i < n; ++i) fibres.push_back(i);
  tensions::FitParameters parameters;
  parameters.max_evaluations = 100 * a.n_repeats;
  parameters.tolerance = 1e-9;
  test::Panel panel{.title = "noise-free fit",
                    .x_label = "equilibria solved",
                    .y_label = "relative L2",
                    .series = {},
                    .is_log_x = true,
                    .is_log_y = true};
  std::printf("method,evaluations,relative_l2,error\n");
  const auto add = [&](const std::string& name, const tensions::TensionFit& fit) {
    test::Series series{.name = name, .x = {}, .y = {}};
    for (const tensions::Milestone& m : fit.history) {
      series.x.push_back(m.n_evaluations);
      series.y.push_back(std::max(1e-12, std::sqrt(size * std::max(0.0, m.objective))));
    }
    const double error = (fit.trial.tensions_nN - scene.tensions_nN).norm() / scene.tensions_nN.norm();
    std::printf("%s,%d,%.3g,%.3g\n", name.c_str(), fit.n_evaluations,
                std::sqrt(size * std::max(0.0, fit.trial.objective)), error);
    panel.series.push_back(std::move(series));
  };
  // thesis: from all tensions at the network's
  const tensions::Trial start = problem.evaluate(Eigen::VectorXd::Constant(n, 0.06));
  for (const auto method : {tensions::FitMethod::plain_cg, tensions::FitMethod::blockwise_cg}) {
    for (const auto gradients : values_of<tensions::Gradients>()) {
      parameters.method = method;
      parameters.gradients = gradients;
      add(name_of(method) + std::string(gradients == tensions::Gradients::exact ? "" : ", finite differences"),
          tensions::fit_tensions(problem, parameters, 2, start));
    }
  }
  parameters.gradients = tensions::Gradients::exact;
  add("network fixed",
      tensions::fit_conjugate_gradients(problem, parameters, 2, start, {{.tensions = fibres, .n_steps = 10}}));
  add("gauss-newton", tensions::fit_gauss_newton(problem, parameters, start));
  save(a, "descent", {panel});
  print_conditions(problem, scene.tensions_nN);
}

/// Mean of a ratio from which the share of chance is taken off, and its standard error.
struct WithoutChance {
  double sum = 0, squares = 0;
  int n = 0;
  void add(double ratio, double chance) { sum += ratio - chance, squares += (ratio - chance) * (ratio - chance), ++n; }
  double mean() const { return sum / n; }
  double standard_error() const { return std::sqrt(std::max(0.0, squares / n - mean() * mean()) / n); }
};

/// Sums over the repeats of one level of noise.
struct NoiseRow {
  double l2 = 0, total = 0, network = 0, plain_total = 0, plain_network = 0, deviation = 0, implied = 0, squares = 0;
  int n_repeats = 0, n_robust = 0, n = 0, n_deviations = 0, n_intervals = 0, n_covered = 0;
  int n_weak = 0, n_weak_covered = 0;  // true tensions below two standard errors: near the bound
  WithoutChance total_bias, network_bias;
};

/// The problem linearised at the truth: its estimates without bounds have a mean error of zero, and go up and down with
/// those of the fit. Taken off these they leave the bias, known from far fewer repeats (a control variate).
class Linearised {
 public:
  Linearised(const tensions::TensionProblem& problem, const Eigen::VectorXd& true_nN)
      : problem_(problem), truth_(problem.evaluate(true_nN)), jacobian_(problem.jacobian(truth_)) {
    total_gradient_ = problem.force_derivatives(truth_).transpose() * tensions::directions_of(truth_.forces_nN);
  }
  /// Errors of the tensions with the present noise.
  Eigen::VectorXd errors_nN() const {
    const Eigen::VectorXd residual = *problem_.data().compliance * truth_.forces_nN - problem_.data().target;
    return -numerics::solve_symmetric(jacobian_.transpose() * jacobian_, jacobian_.transpose() * residual);
  }
  double total_error_nN(const Eigen::VectorXd& errors_nN) const { return total_gradient_.dot(errors_nN); }

 private:
  const tensions::TensionProblem& problem_;
  tensions::Trial truth_;
  Eigen::MatrixXd jacobian_;
  Eigen::VectorXd total_gradient_;  // of the sum of the forces' sizes
};

/// @param true_network_nN  force with every fibre at the network's tension
void add_forces(NoiseRow& row, const TensionScene& scene, const tensions::EnsembleFit& fit, double true_network_nN,
                const Linearised& linearised) {
  const double true_total_nN = tensions::total_nN(scene.forces_nN);
  const Eigen::VectorXd errors_nN = linearised.errors_nN();
  row.total_bias.add(fit.total_force_nN.value / true_total_nN, linearised.total_error_nN(errors_nN) / true_total_nN);
  row.network_bias.add(fit.network_force_nN.value / true_network_nN, errors_nN[0] / scene.tensions_nN[0]);
  row.plain_total += tensions::total_nN(fit.forces.nN) / true_total_nN;
  row.total += fit.total_force_nN.value / true_total_nN;
  row.plain_network += tensions::total_nN(fit.forces.of_network_nN) / true_network_nN;
  row.network += fit.network_force_nN.value / true_network_nN;
}

/// @param limit_nN  Cramér–Rao, by tension
void add_tensions(NoiseRow& row, const Eigen::VectorXd& true_nN, const Eigen::VectorXd& limit_nN,
                  const tensions::EnsembleFit& fit) {
  for (Eigen::Index i = 0; i < limit_nN.size(); ++i) {
    const tensions::Estimate& estimate = fit.tensions.nN[i];
    const double t = true_nN[i], error = estimate.value - t;
    const tensions::Interval interval = tensions::interval_95(estimate);
    const int is_covered = interval.low <= t && t <= interval.high ? 1 : 0;
    row.n_covered += is_covered;
    ++row.n_intervals;
    row.n_weak_covered += t < 2 * limit_nN[i] ? is_covered : 0;
    row.n_weak += t < 2 * limit_nN[i] ? 1 : 0;
    if (i > 0)
      row.deviation += std::abs(error) / t, row.implied += std::sqrt(2 / kPi) * limit_nN[i] / t, ++row.n_deviations;
    if (t < 3 * limit_nN[i]) continue;  // the bound makes those better than the limit
    row.squares += std::pow(error / limit_nN[i], 2);
    ++row.n;
  }
}

/// Noise of the same size anew: of the data reduced (see reweighted) only the target changes.
void measure_again(TensionScene& scene, double noise, unsigned seed) {
  tensions::LinearData& data = scene.data;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, noise * scene.largest_um);
  for (Eigen::Index row = 0; row < data.displacement_um.size(); ++row)
    data.displacement_um[row] = scene.displacement_um[row] + normal(random);
  const Eigen::VectorXd weighted_u = data.weight_per_um.cwiseProduct(data.displacement_um);
  Eigen::MatrixXd target = data.response->pull_back(data.weight_per_um.cwiseProduct(weighted_u));
  numerics::solve_upper_transposed(*data.reduced.compliance, target);
  data.reduced.target = target;
  data.reduced.floor_squared = weighted_u.squaredNorm() - data.reduced.target.squaredNorm();
}

void add_repeats(NoiseRow& row, TensionScene& scene, double noise, int n_repeats, unsigned first_seed) {
  test::measure(scene, noise, first_seed);
  const Eigen::VectorXd limit = test::cramer_rao_nN(scene);
  const tensions::TensionProblem problem(scene.cables, scene.data.reduced, scene.adhesion_ids);
  const double true_network_nN = tensions::total_nN(
      problem.evaluate(Eigen::VectorXd::Constant(scene.tensions_nN.size(), scene.tensions_nN[0])).forces_nN);
  const Linearised linearised(problem, scene.tensions_nN);
  for (int r = 0; r < n_repeats; ++r) {
    measure_again(scene, noise, first_seed + static_cast<unsigned>(r));
    const tensions::EnsembleFit fit = test::fit_own_network(scene);
    row.l2 += tensions::relative_l2(fit.data, fit.forces.nN);
    row.n_robust += fit.misfit.loss == tensions::Loss::squares ? 0 : 1;
    ++row.n_repeats;
    add_forces(row, scene, fit, true_network_nN, linearised);
    add_tensions(row, scene.tensions_nN, limit, fit);
  }
}

// Fig. 3.6, and how large errors are and are said to be.
void noise(const Arguments& a) {
  const std::vector<double> levels = {0.01, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.25};
  test::Series l2{.name = "L2", .x = levels, .y = {}}, total{.name = "total", .x = levels, .y = {}},
      network{.name = "network", .x = levels, .y = {}}, deviation{.name = "found", .x = levels, .y = {}},
      implied{.name = "Cramér–Rao", .x = levels, .y = {}};
  std::printf(
      "noise,relative_l2,total_force,network_force,uncorrected_total,uncorrected_network,mean_relative_deviation,"
      "implied_by_limit,rms_over_limit,coverage,near_zero,coverage_near_zero,robust,total_without_chance,its_error,"
      "network_without_chance,its_error\n");
  std::vector<TensionScene> scenes;
  for (int c = 1; c <= a.n_cells; ++c) scenes.push_back(thesis_scene(static_cast<std::uint64_t>(c), 10000, 0));
  unsigned seed = 1;
  for (const double level : levels) {
    NoiseRow r;
    for (TensionScene& scene : scenes) {
      add_repeats(r, scene, level, a.n_repeats, seed);
      seed += static_cast<unsigned>(a.n_repeats);
    }
    const double n = r.n_repeats;
    l2.y.push_back(r.l2 / n), total.y.push_back(r.total / n), network.y.push_back(r.network / n);
    deviation.y.push_back(r.deviation / r.n_deviations), implied.y.push_back(r.implied / r.n_deviations);
    std::printf("%g,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%.3f,%.4f,%d,%.4f,%d,%.4f,%.4f,%.4f,%.4f\n", level, r.l2 / n,
                r.total / n, r.network / n, r.plain_total / n, r.plain_network / n, deviation.y.back(),
                implied.y.back(), std::sqrt(r.squares / std::max(1, r.n)), double(r.n_covered) / r.n_intervals,
                r.n_weak, double(r.n_weak_covered) / std::max(1, r.n_weak), r.n_robust, r.total_bias.mean(),
                r.total_bias.standard_error(), r.network_bias.mean(), r.network_bias.standard_error());
  }
  save(a, "noise",
       {{.title = "misfit", .x_label = "noise / largest displacement", .y_label = "relative L2", .series = {l2}},
        {.title = "forces, fitted over true",
         .x_label = "noise / largest displacement",
         .y_label = "ratio",
         .series = {total, network}},
        {.title = "mean relative deviation",
         .x_label = "noise / largest displacement",
         .y_label = "of the fibres' tensions",
         .series = {deviation, implied}}});
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return (values[values.size() / 2] + values[(values.size() - 1) / 2]) / 2;
}

// The mean relative deviation from cell to cell, in the thesis' formulation of the network and in ours, truth and fit
// alike, and what the Cramér–Rao limit implies.
void deviations(const Arguments& a) {
  const std::vector<double> levels = {0.05, 0.07, 0.1};
  std::printf("network,noise,median_found,median_implied,median_ratio,cells,cells_whose_limit_is_below_a_tenth\n");
  for (const bool is_thesis : {true, false}) {
    std::vector<std::vector<double>> found(levels.size()), implied(levels.size()), ratio(levels.size());
    for (int c = 1; c <= a.n_cells; ++c) {
      const Cell cell = drawn_cell(static_cast<std::uint64_t>(c));
      const Eigen::VectorXd truth = test::thesis_tensions_nN(cell.fibres.size(), static_cast<std::uint64_t>(c));
      TensionScene scene = test::scene_of(cell, truth, 10000, 0, static_cast<unsigned>(c),
                                          is_thesis ? test::thesis_network() : mesh::NetworkParameters{});
      const auto fibres = Eigen::seq(1, Eigen::last);
      for (std::size_t l = 0; l < levels.size(); ++l) {
        test::measure(scene, levels[l], 1);
        const Eigen::VectorXd limit = test::cramer_rao_nN(scene);
        implied[l].push_back(std::sqrt(2 / kPi) * limit(fibres).cwiseQuotient(truth(fibres)).mean());
        double sum = 0;
        for (int r = 0; r < a.n_repeats; ++r) {
          measure_again(scene, levels[l], static_cast<unsigned>(a.n_repeats * c + r));
          const Eigen::VectorXd error = test::values_of(test::fit_own_network(scene)) - truth;
          sum += error(fibres).cwiseAbs().cwiseQuotient(truth(fibres)).mean();
        }
        found[l].push_back(sum / a.n_repeats);
        ratio[l].push_back(found[l].back() / implied[l].back());
      }
    }
    for (std::size_t l = 0; l < levels.size(); ++l)
      std::printf("%s,%g,%.3f,%.3f,%.2f,%d,%d\n", is_thesis ? "thesis" : "default", levels[l], median(found[l]),
                  median(implied[l]), median(ratio[l]), a.n_cells,
                  int(std::count_if(implied[l].begin(), implied[l].end(), [](double m) { return m <= 0.1; })));
  }
}

/// Arrows of force, at the adhesions or patches.
std::string arrows(const std::string& title, const Cell& cell, const std::vector<std::pair<Vec2, Vec2>>& forces,
                   double um_per_nN, double left_px) {
  constexpr double kScale = 3.6;  // px per um
  double low_x = 1e9, low_y = 1e9;
  for (const Vec2 p : cell.outline_um) low_x = std::min(low_x, p.x), low_y = std::min(low_y, p.y);
  const auto x = [&](double um) { return left_px + 20 + kScale * (um - low_x); };
  const auto y = [&](double um) { return 40 + kScale * (um - low_y); };
  std::string svg =
      test::format("<text x=\"%.0f\" y=\"20\" font-weight=\"bold\">%s</text>\n<path d=\"", left_px + 20, title.c_str());
  for (std::size_t i = 0; i < cell.outline_um.size(); ++i)
    svg += test::format("%s%.1f,%.1f", i == 0 ? "M" : "L", x(cell.outline_um[i].x), y(cell.outline_um[i].y));
  svg += "Z\" fill=\"#f4f4f4\" stroke=\"#999\"/>\n";
  for (const Fibre& f : cell.fibres) {
    svg += "<path d=\"";
    for (std::size_t i = 0; i < f.points_um.size(); ++i)
      svg += test::format("%s%.1f,%.1f", i == 0 ? "M" : "L", x(f.points_um[i].x), y(f.points_um[i].y));
    svg += "\" fill=\"none\" stroke=\"#E69F00\" stroke-width=\"1\"/>\n";
  }
  svg += "<path d=\"";
  for (const auto& [at, force] : forces) {
    const Vec2 tip = at + um_per_nN * force;
    const Vec2 d = kScale * um_per_nN * force;
    if (norm(d) < 1) continue;
    const Vec2 e = (1 / norm(d)) * d;
    const double head = std::min(5.0, 0.4 * norm(d));
    svg += test::format("M%.1f,%.1fL%.1f,%.1fm%.1f,%.1fL%.1f,%.1fl%.1f,%.1f", x(at.x), y(at.y), x(tip.x), y(tip.y),
                        head * (-e.x - 0.5 * e.y), head * (-e.y + 0.5 * e.x), x(tip.x), y(tip.y),
                        head * (-e.x + 0.5 * e.y), head * (-e.y - 0.5 * e.x));
  }
  return svg + "\" fill=\"none\" stroke=\"#0072B2\" stroke-width=\"1.2\"/>\n";
}

std::vector<std::pair<Vec2, Vec2>> at_adhesions(const Cell& cell, const Eigen::VectorXd& forces_nN) {
  std::vector<std::pair<Vec2, Vec2>> list;
  for (std::size_t i = 0; i < cell.adhesions.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    list.push_back({cell.adhesions[i].position_um, {forces_nN[row], forces_nN[row + 1]}});
  }
  return list;
}

// Fig. 3.5: a quarter of noise, beside FTTC.
void beside_fttc(const Arguments& a) {
  const Cell cell = drawn_cell(1);
  TensionScene scene = test::scene_of(cell, test::thesis_tensions_nN(cell.fibres.size(), 1), 10000, 0.25, 1);
  const tensions::EnsembleFit fit = test::fit_own_network(scene);
  const Gel gel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 60};
  const tractions::TractionInputs inputs{
      .beads = scene.beads, .gel = gel, .adhesions = cell.adhesions, .outline_um = cell.outline_um};
  const tractions::TractionParameters p;
  const tractions::Reconstruction fttc = tractions::reconstruct_fttc(inputs, p, 2);
  Eigen::VectorXd by_fttc = Eigen::VectorXd::Zero(scene.forces_nN.size());
  const std::vector<AdhesionForce> forces = tractions::forces_by_adhesion(fttc.patches, cell.adhesions, p.grow_um);
  for (std::size_t i = 0; i < forces.size(); ++i) {
    by_fttc[2 * static_cast<Eigen::Index>(i)] = forces[i].force_nN.x;
    by_fttc[2 * static_cast<Eigen::Index>(i) + 1] = forces[i].force_nN.y;
  }
  std::printf("method,total_force,force_error\n");
  for (const auto& [name, f] :
       {std::pair<const char*, const Eigen::VectorXd&>{"model", fit.forces.nN}, {"fttc", by_fttc}}) {
    std::printf("%s,%.3f,%.3f\n", name, tensions::total_nN(f) / tensions::total_nN(scene.forces_nN),
                (f - scene.forces_nN).norm() / scene.forces_nN.norm());
  }
  constexpr double kScale_um_per_nN = 1.2;
  files::write_text(
      a.folder / "beside-fttc.svg",
      test::open_svg(960, 265) + arrows("true forces", cell, at_adhesions(cell, scene.forces_nN), kScale_um_per_nN, 0) +
          arrows("model-based, 25 % noise", cell, at_adhesions(cell, fit.forces.nN), kScale_um_per_nN, 320) +
          arrows("FTTC, 25 % noise", cell, at_adhesions(cell, by_fttc), kScale_um_per_nN, 640) + "</svg>\n");
}

// Fig. 3.10: directions of the model's forces against those found without it.
void directions(const Arguments& a) {
  std::vector<double> isotropic, full;
  for (int c = 1; c <= a.n_cells; ++c) {
    TensionScene scene = thesis_scene(static_cast<std::uint64_t>(c), 10000, 0.07);
    const tensions::EnsembleFit fit = test::fit_own_network(scene);
    const tensions::ReducedData& d = scene.data.reduced;
    const Eigen::VectorXd free = tensions::free_forces_nN(d);
    const tensions::TensionProblem problem(scene.cables, d, scene.adhesion_ids);
    const Eigen::VectorXd equal = tensions::uniform_start(problem).forces_nN;
    for (Eigen::Index row = 0; row < free.size(); row += 2) {
      const Eigen::Vector2d f = free.segment<2>(row);
      if (f.norm() < 1) continue;  // nN: below the noise its direction is chance
      isotropic.push_back(f.dot(equal.segment<2>(row)) / (f.norm() * equal.segment<2>(row).norm()));
      full.push_back(f.dot(fit.forces.nN.segment<2>(row)) / (f.norm() * fit.forces.nN.segment<2>(row).norm()));
    }
  }
  const auto mean = [](const std::vector<double>& v) {
    double sum = 0;
    for (const double x : v) sum += x / static_cast<double>(v.size());
    return sum;
  };
  std::printf("model,mean_cosine,adhesions\nisotropic,%.3f,%zu\nfull,%.3f,%zu\n", mean(isotropic), isotropic.size(),
              mean(full), full.size());
  save(a, "directions",
       {{.title = "directions of adhesion forces",
         .x_label = "cosine to the independently found force",
         .y_label = "share of the adhesions",
         .series = {test::histogram("isotropic network", isotropic, -1, 1, 20),
                    test::histogram("with fibres", full, -1, 1, 20)}}});
}

// Fig. 3.15: tensions drawn by type, and with dorsal and ventral exchanged.
void types(const Arguments& a) {
  const drawing::ScenarioParameters p;
  const drawing::DrawnCell drawn = drawing::draw_cell(p.cell, p.tension, drawing::field_um(p.microscope), 1);
  tensions::TypeTensions by_type;  // of twenty other cells
  for (std::uint64_t seed = 101; seed <= 120; ++seed) {
    const drawing::DrawnCell other = drawing::draw_cell(p.cell, p.tension, drawing::field_um(p.microscope), seed);
    for (std::size_t i = 0; i < other.tensions_nN.size(); ++i)
      by_type[other.cell.fibres[i].type].push_back(other.tensions_nN[i]);
  }
  Eigen::VectorXd tensions(static_cast<Eigen::Index>(drawn.tensions_nN.size()) + 1);
  tensions[0] = 0.06;
  for (std::size_t i = 0; i < drawn.tensions_nN.size(); ++i)
    tensions[static_cast<Eigen::Index>(i) + 1] = drawn.tensions_nN[i];
  TensionScene scene = test::scene_of(drawn.cell, tensions, 3000, 0.07, 1);
  const tensions::EnsembleFit fit = test::fit_own_network(scene);
  std::vector<FibreType> of_fibres;
  for (const Fibre& f : drawn.cell.fibres) of_fibres.push_back(f.type);
  const tensions::TensionProblem problem(scene.cables, scene.data.reduced, scene.adhesion_ids);
  const double begin = now_s();
  const tensions::CrossValidation result =
      tensions::cross_validate(problem, fit.data, fit.meshes[0].fit.trial, of_fibres, by_type, a.n_repeats, 1, 2);
  std::vector<double> all = result.own;
  all.insert(all.end(), result.exchanged.begin(), result.exchanged.end());
  const auto [low, high] = std::minmax_element(all.begin(), all.end());
  const auto median = [](std::vector<double> v) {
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
  };
  int n_worse = 0;
  for (std::size_t i = 0; i < result.own.size(); ++i) n_worse += result.exchanged[i] > result.own[i] ? 1 : 0;
  std::printf(
      "draws,median_l2_own,median_l2_exchanged,share_exchanged_worse,fitted_l2,seconds\n%d,%.4f,%.4f,%.3f,%.4f,%.1f\n",
      a.n_repeats, median(result.own), median(result.exchanged), double(n_worse) / a.n_repeats,
      tensions::relative_l2(fit.data, fit.forces.nN), now_s() - begin);
  save(a, "types",
       {{.title = "tensions drawn by type",
         .x_label = "relative L2",
         .y_label = "share of the draws",
         .series = {test::histogram("own types", result.own, *low, *high, 24),
                    test::histogram("dorsal and ventral exchanged", result.exchanged, *low, *high, 24)}}});
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 1 << 12);
  const Arguments a{.n_repeats = argc > 2 ? std::atoi(argv[2]) : 10,
                    .n_cells = argc > 3 ? std::atoi(argv[3]) : 1,
                    .folder = argc > 4 ? argv[4] : "."};
  const std::pair<const char*, void (*)(const Arguments&)> studies[] = {
      {"descent", descent},         {"noise", noise},           {"deviations", deviations},
      {"beside-fttc", beside_fttc}, {"directions", directions}, {"types", types}};
  for (const auto& [name, run] : studies) {
    if (argc > 1 && std::strcmp(argv[1], name) == 0) {
      run(a);
      return 0;
    }
  }
  std::fprintf(stderr,
               "tension_accuracy descent|noise|deviations|beside-fttc|directions|types [repeats] "
               "[cells] [folder]\n");
  return 2;
}
