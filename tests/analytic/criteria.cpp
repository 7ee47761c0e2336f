/// What the criteria for lambda are defined to be, against the definitions themselves: leaving data out, a Gaussian's
/// density, the error of the tractions. Each on linear problems small enough to be solved outright.
#include <Eigen/Dense>

#include "mbtfm/inverse/regularisation.h"
#include "mbtfm/inverse/spectrum.h"
#include "mbtfm/tractions/dense_problem.h"
#include "tests/support/test.h"

namespace mbtfm::tractions {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kN = 40;

/// A bell of this width around each datum, on a ring: every datum has the same surroundings.
MatrixXd ring_of_bells(double width) {
  MatrixXd G(kN, kN);
  for (int i = 0; i < kN; ++i)
    for (int j = 0; j < kN; ++j) {
      const int apart = std::min((i - j + kN) % kN, (j - i + kN) % kN);
      G(i, j) = std::exp(-0.5 * std::pow(apart / width, 2));
    }
  return G;
}

/// Two waves of traction.
VectorXd some_tractions() {
  VectorXd t(kN);
  for (int i = 0; i < kN; ++i) {
    const double turn = 2 * std::numbers::pi * i / kN;
    t[i] = std::sin(turn) + 0.5 * std::cos(3 * turn);
  }
  return t;
}

VectorXd noise_of(double sigma, int n, unsigned seed) {
  test::Normal normal(seed, sigma);
  VectorXd noise(n);
  for (double& e : noise) e = normal();
  return noise;
}

/// The tractions as a linear map of the data.
MatrixXd solver_of(const MatrixXd& G, double lambda) {
  const MatrixXd normal = G.transpose() * G + lambda * lambda * MatrixXd::Identity(G.cols(), G.cols());
  return normal.ldlt().solve(G.transpose());
}

std::vector<ScanPoint> scan_of(const MatrixXd& G, const VectorXd& u) {
  std::vector<ScanPoint> points;
  for (const double lambda : lambdas_between(10, 1e-2)) {
    const MatrixXd K = solver_of(G, lambda);
    const VectorXd t = K * u;
    points.push_back(
        {.lambda = lambda, .misfit = (u - G * t).squaredNorm(), .norm = t.squaredNorm(), .degrees = (G * K).trace()});
  }
  return points;
}

LambdaScan judged(const MatrixXd& G, const VectorXd& u, double variance) {
  return judge(
      scan_of(G, u), kN, variance, [](double) { return 0; }, unbiased_risks(kN));
}

/// Mean square of the error with which the others predict each datum.
double error_of_prediction(const MatrixXd& G, const VectorXd& u, double lambda) {
  double sum = 0;
  for (int left_out = 0; left_out < kN; ++left_out) {
    MatrixXd others = G;
    others.row(left_out).setZero();
    const double predicted = G.row(left_out).dot(solver_of(others, lambda) * u);
    sum += std::pow(u[left_out] - predicted, 2) / kN;
  }
  return sum;
}

TEST(Criteria, cross_validation_leaves_out_each_datum_where_all_are_alike) {
  const MatrixXd G = ring_of_bells(2);
  const VectorXd u = G * some_tractions() + noise_of(0.5, kN, 1);
  const LambdaScan scan = judged(G, u, 0.25);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const double error = error_of_prediction(G, u, scan.points[i].lambda);
    EXPECT_NEAR(scan.gcv[i], error, 1e-9 * error) << "lambda " << scan.points[i].lambda;  // rounding, at 1e3 of G
  }
  // and its lambda is the one that predicts best, between the points of the scan too: as far as its spline follows
  // a minimum as wide as the scan's step
  double least = 1e300, best = 0;
  for (double lambda = 10; lambda > 1e-2; lambda /= 1.02) {
    const double error = error_of_prediction(G, u, lambda);
    if (error < least) least = error, best = lambda;
  }
  EXPECT_NEAR(std::log(scan.by_gcv / best), 0, std::log(1.1));  // an eighth of the scan's step
  EXPECT_LE(error_of_prediction(G, u, scan.by_gcv), 1.001 * least);
}

TEST(Criteria, a_lambda_that_cross_validation_does_not_choose_predicts_worse_on_average) {
  // by this factor to either side, in each draw: beyond chance, three standard errors of the mean difference
  constexpr int kDraws = 200;
  const MatrixXd G = ring_of_bells(2);
  const VectorXd truth = G * some_tractions();
  for (const double factor : {0.4, 2.5}) {
    double worse = 0, squares = 0;
    for (unsigned draw = 0; draw < kDraws; ++draw) {
      const VectorXd u = truth + noise_of(0.5, kN, 100 + draw);
      const auto error_at = [&](double lambda) { return (G * (solver_of(G, lambda) * u) - truth).squaredNorm(); };
      const double chosen = judged(G, u, 0.25).by_gcv, difference = error_at(factor * chosen) - error_at(chosen);
      worse += difference / kDraws;
      squares += difference * difference / kDraws;
    }
    EXPECT_GT(worse, 3 * std::sqrt((squares - worse * worse) / kDraws)) << "factor " << factor;
  }
}

TEST(Criteria, evidence_is_the_density_of_the_data_where_tractions_are_Gaussian) {
  // u is Gaussian with the covariance a (1 + G Gᵀ / lambda²), whose scale a is as the data have it
  const MatrixXd G = ring_of_bells(2);
  const VectorXd u = G * some_tractions() + noise_of(0.5, kN, 2);
  const LambdaScan scan = judged(G, u, 0.25);
  const auto log_density = [&](double lambda) {
    const MatrixXd C = MatrixXd::Identity(kN, kN) + G * G.transpose() / (lambda * lambda);
    const Eigen::LLT<MatrixXd> root(C);
    const double log_determinant = 2 * root.matrixLLT().diagonal().array().log().sum();
    return -0.5 * kN * std::log(u.dot(root.solve(u))) - 0.5 * log_determinant;
  };
  // the determinant is summed by trapezia: off by h²/6 times the change of the slope of `degrees` in log lambda
  const double h = std::log(scan.points[0].lambda / scan.points[1].lambda);
  double steepest = 0;
  for (std::size_t i = 1; i < scan.points.size(); ++i)
    steepest = std::max(steepest, (scan.points[i].degrees - scan.points[i - 1].degrees) / h);
  for (std::size_t i = 1; i < scan.points.size(); ++i) {
    const double rise = log_density(scan.points[i].lambda) - log_density(scan.points[0].lambda);
    EXPECT_NEAR(scan.evidence[i] - scan.evidence[0], rise, h * h / 6 * steepest) << "lambda " << scan.points[i].lambda;
  }
}

TEST(Criteria, risk_is_the_squared_error_of_the_tractions_on_average_up_to_a_constant) {
  constexpr int kDraws = 400;
  constexpr double kSigma = 0.05;
  const MatrixXd G = ring_of_bells(0.6);  // steep enough for each traction to show in the data
  const VectorXd t = some_tractions();
  std::vector<double> sums, squares, lambdas;
  for (unsigned draw = 0; draw < kDraws; ++draw) {
    const VectorXd u = G * t + noise_of(kSigma, kN, 1000 + draw);
    const LambdaScan scan = judged(G, u, kSigma * kSigma);
    sums.resize(scan.points.size(), 0), squares.resize(scan.points.size(), 0), lambdas.resize(scan.points.size(), 0);
    double first = 0;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const double lambda = scan.points[i].lambda;
      const double constant = scan.risk[i] - (solver_of(G, lambda) * u - t).squaredNorm();
      if (i == 0) first = constant;
      sums[i] += (constant - first) / kDraws;
      squares[i] += std::pow(constant - first, 2) / kDraws;
      lambdas[i] = lambda;
    }
  }
  for (std::size_t i = 1; i < sums.size(); ++i) {
    const double standard_error = std::sqrt((squares[i] - sums[i] * sums[i]) / kDraws);
    EXPECT_LE(std::abs(sums[i]), 4 * standard_error) << "lambda " << lambdas[i];
  }
}

/// Tractions whose answers fall by `fall` from one direction to the next, of length one but for that.
MatrixXd falling(int n_data, int n_unknowns, double fall, unsigned seed) {
  test::Normal normal(seed);
  MatrixXd any(n_data, n_unknowns);
  for (double& a : any.reshaped()) a = normal();
  MatrixXd G = any.householderQr().householderQ() * MatrixXd::Identity(n_data, n_unknowns);
  for (int k = 0; k < n_unknowns; ++k) G.col(k) *= std::pow(fall, k);
  return G;
}

LambdaScan scan_by_direction(const MatrixXd& G, const VectorXd& u, double variance, SignalIn signal_in) {
  return Spectrum(G.transpose() * G, G.transpose() * u, u.squaredNorm(), static_cast<double>(u.size()))
      .scan(variance, signal_in);
}

TEST(Criteria, risk_by_direction_is_that_of_all_where_each_direction_is_resolved) {
  const MatrixXd G = falling(120, 40, 0.9, 1);
  const VectorXd u = G * VectorXd::Constant(40, 1) + noise_of(1e-2, 120, 4);
  EXPECT_NEAR(
      scan_by_direction(G, u, 1e-4, SignalIn::resolved).by_risk / scan_by_direction(G, u, 1e-4, SignalIn::felt).by_risk,
      1, 1e-6);
}

TEST(Criteria, risk_by_direction_does_not_follow_directions_of_noise_alone) {
  // 40 directions have a signal, 260 more are felt so little that noise is all they show. Error of the tractions over
  // that of the best lambda, in each draw.
  constexpr int kDraws = 60, kUnknowns = 300, kData = 400;
  const MatrixXd G = falling(kData, kUnknowns, 0.97, 2);
  VectorXd t = VectorXd::Zero(kUnknowns);
  t.head(40).setOnes();
  const Eigen::ArrayXd values = (G.transpose() * G).diagonal();
  double worst = 0, worst_of_all = 0;
  for (unsigned draw = 0; draw < kDraws; ++draw) {
    const VectorXd u = G * t + noise_of(0.1, kData, 3000 + draw);
    const LambdaScan scan = scan_by_direction(G, u, 0.01, SignalIn::resolved);
    const VectorXd pulled = G.transpose() * u;
    const auto error_at = [&](double lambda) {
      return ((pulled.array() / (values + lambda * lambda)).matrix() - t).norm();
    };
    double best = 1e300;
    for (const ScanPoint& p : scan.points) best = std::min(best, error_at(p.lambda));
    worst = std::max(worst, error_at(scan.by_risk) / best);
    worst_of_all = std::max(worst_of_all, error_at(scan_by_direction(G, u, 0.01, SignalIn::felt).by_risk) / best);
  }
  EXPECT_LE(worst, 1.15);
  EXPECT_GE(worst_of_all, 3) << "the scene is one in which the risk of all directions runs away";
}

TEST(Criteria, risk_of_fewer_data_than_unknowns_has_no_directions_of_rounding) {
  constexpr int kFelt = 30, kUnknowns = 50;
  const MatrixXd left = falling(kFelt, kFelt, 1, 5);  // both orthogonal
  const MatrixXd right = falling(kUnknowns, kFelt, 1, 6);
  const Eigen::ArrayXd s = Eigen::pow(0.8, Eigen::ArrayXd::LinSpaced(kFelt, 0, kFelt - 1));
  const MatrixXd G = left * s.matrix().asDiagonal() * right.transpose();
  const VectorXd u = noise_of(1, kFelt, 7);
  const Eigen::ArrayXd squares = (left.transpose() * u).array().square();
  const LambdaScan scan = scan_by_direction(G, u, 0.01, SignalIn::felt);
  EXPECT_LE(scan.points.back().lambda, 0.2 * s.minCoeff()) << "the scan goes to where nothing is smoothed";
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const double lambda2 = std::pow(scan.points[i].lambda, 2);
    const Eigen::ArrayXd stiffness = s.square() + lambda2;
    // (15) by direction, from the values of G itself
    const double risk =
        (2 * scan.variance / stiffness - (2 * lambda2 + s.square()) * squares / stiffness.square()).sum();
    EXPECT_NEAR(scan.risk[i] / risk, 1, 1e-6) << "lambda " << scan.points[i].lambda;
    EXPECT_NEAR(scan.points[i].degrees, (s.square() / stiffness).sum(), 1e-9);
  }
}

TEST(Criteria, do_not_depend_on_the_unit_of_the_displacements) {
  const MatrixXd G = ring_of_bells(2);
  const VectorXd u = G * some_tractions() + noise_of(0.5, kN, 3);
  const LambdaScan one = judged(G, u, 0.25), other = judged(G, 1000 * u, 1e6 * 0.25);
  for (const LambdaCriterion criterion : {LambdaCriterion::risk, LambdaCriterion::gcv, LambdaCriterion::evidence})
    EXPECT_NEAR(chosen_lambda(other, criterion) / chosen_lambda(one, criterion), 1, 1e-9) << name_of(criterion);
  EXPECT_EQ(one.by_l_curve.has_value(), other.by_l_curve.has_value());
}

TEST(Criteria, the_variance_that_residuals_show_is_that_of_the_data) {
  const MatrixXd G = ring_of_bells(2);
  constexpr int kDraws = 400;
  for (const double lambda : {0.3, 1.0, 3.0}) {
    const MatrixXd H = G * solver_of(G, lambda);
    double mean = 0, squares = 0;
    for (unsigned draw = 0; draw < kDraws; ++draw) {
      const VectorXd e = noise_of(0.5, kN, 2000 + draw);
      const VectorXd r = e - H * e;
      const double variance = robust_variance(r, H.trace(), (H * H).trace());
      mean += variance / kDraws;
      squares += variance * variance / kDraws;
    }
    const double standard_error = std::sqrt((squares - mean * mean) / kDraws);
    // the median of n magnitudes lies high by about 1 / n of its square; and chance
    EXPECT_NEAR(mean, 0.25, 0.25 * 3 / kN + 3 * standard_error) << "lambda " << lambda;
  }
}

/// Beads of unequal errors, and loads that they answer to in no particular way.
struct Loaded {
  DisplacementField beads;
  MatrixXd G;
};

Loaded loaded(int n_beads, int n_loads) {
  test::Normal normal(7);
  Loaded scene{{}, MatrixXd(2 * n_beads, n_loads)};
  for (double& g : scene.G.reshaped()) g = normal();
  for (int i = 0; i < n_beads; ++i) {
    const double x = normal(), y = normal();
    scene.beads.push_back({.position_um = {1.0 * i, 0}, .displacement_um = {x, y}, .sigma_um = 1 + 0.1 * i});
  }
  return scene;
}

DenseProblem problem_of(const Loaded& scene, const DisplacementField& beads) {
  const Compliance answers = [&scene](const std::vector<Vec2>& at) {
    MatrixXd rows(2 * static_cast<Eigen::Index>(at.size()), scene.G.cols());
    for (std::size_t i = 0; i < at.size(); ++i)
      rows.middleRows(2 * static_cast<Eigen::Index>(i), 2) =
          scene.G.middleRows(2 * static_cast<Eigen::Index>(std::lround(at[i].x)), 2);
    return rows;
  };
  return DenseProblem(beads, answers, scene.G.cols(), {}, 0);
}

TEST(DenseProblem, its_degrees_of_freedom_and_covariance_are_those_of_its_answers_to_the_data) {
  constexpr int kBeads = 9, kLoads = 6;
  const Loaded scene = loaded(kBeads, kLoads);
  const LambdaScan scan = problem_of(scene, scene.beads).scan();
  for (const std::size_t at : {std::size_t{1}, scan.points.size() / 2}) {
    const double lambda = scan.points[at].lambda;
    double degrees = 0;
    MatrixXd covariance = MatrixXd::Zero(kLoads, kLoads);
    for (int component = 0; component < 2 * kBeads; ++component) {
      DisplacementField one = scene.beads;  // displaced by its standard error in this component, all else still
      for (Bead& b : one) b.displacement_um = {};
      Bead& bead = one[component / 2];
      (component % 2 == 0 ? bead.displacement_um.x : bead.displacement_um.y) = bead.sigma_um;
      const VectorXd answer = problem_of(scene, one).spectrum().solve(lambda);
      degrees += scene.G.row(component).dot(answer) / bead.sigma_um;
      covariance += answer * answer.transpose();
    }
    EXPECT_NEAR(scan.points[at].degrees, degrees, 1e-9 * degrees);
    // one datum of weight 1 has the variance that the errors state for the mean weight
    double mean_weight = 0;
    for (const Bead& b : scene.beads) mean_weight += 1 / (b.sigma_um * b.sigma_um) / kBeads;
    const MatrixXd stated = problem_of(scene, scene.beads).spectrum().covariance(lambda, 1 / mean_weight);
    EXPECT_LE((stated - covariance).norm(), 1e-9 * covariance.norm());
  }
}

}  // namespace
}  // namespace mbtfm::tractions
