/// Laws of reconstructions in space: on a half-space, whose answer is a closed form.
#include <Eigen/QR>

#include "mbtfm/inverse/spectrum.h"
#include "mbtfm/spatial/foresight.h"
#include "mbtfm/spatial/loss.h"
#include "mbtfm/spatial/problem.h"
#include "mbtfm/spatial/repeated.h"
#include "mbtfm/spatial/traction_mesh.h"
#include "pipeline/contract/errors.h"
#include "tests/support/findings.h"
#include "tests/support/half_space_problem.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::spatial;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::fires;
using test::HalfSpaceScene;
using tractions::TractionParameters;

double apart(const VectorXd& a, const VectorXd& b) { return (a - b).norm() / b.norm(); }

/// Of values 1, q, q², … as those of a gel fall.
MatrixXd smoothing_matrix(int rows, int cols) {
  test::Normal normal(3);
  const auto filled = [&](int r, int c) { return MatrixXd(MatrixXd::NullaryExpr(r, c, [&]() { return normal(); })); };
  const MatrixXd left = filled(rows, cols).householderQr().householderQ() * MatrixXd::Identity(rows, cols);
  const MatrixXd right = filled(cols, cols).householderQr().householderQ();
  const VectorXd values = VectorXd::NullaryExpr(cols, [&](Eigen::Index k) { return std::pow(0.97, k); });
  return left * values.asDiagonal() * right.transpose();
}

TEST(Recurrences, agree_with_the_dense_decomposition_at_every_lambda_and_in_their_own) {
  const MatrixXd A = smoothing_matrix(500, 240);
  test::Normal normal(5);
  constexpr double kNoise = 0.02;
  const VectorXd truth = VectorXd::NullaryExpr(240, [&]() { return normal(); });
  const VectorXd u = A * truth + kNoise * VectorXd::NullaryExpr(500, [&]() { return normal(); });
  const inverse::Spectrum dense(A.transpose() * A, A.transpose() * u, u.squaredNorm(), 500);
  const inverse::LinearMap map{[&](const MatrixXd& x) { return MatrixXd(A * x); },
                               [&](const MatrixXd& y) { return MatrixXd(A.transpose() * y); }, 500, 240};
  const inverse::Recurrences recurrences(map, u, {.steps = 150, .probes = 8, .seed = 1});
  for (const double lambda : {0.3, 0.1, 0.03})
    EXPECT_LE(apart(recurrences.solve(lambda), dense.solve(lambda)), 1e-6) << lambda;
  const auto ours = recurrences.scan(kNoise * kNoise), theirs = dense.scan(kNoise * kNoise, inverse::SignalIn::felt);
  for (const auto criterion :
       {inverse::LambdaCriterion::gcv, inverse::LambdaCriterion::evidence, inverse::LambdaCriterion::discrepancy}) {
    // traces by eight probes vary by sqrt(2 / (8 tr)) of themselves, tr ~ 100: 5 %; lambda follows by half of it
    EXPECT_NEAR(chosen_lambda(ours, criterion) / chosen_lambda(theirs, criterion), 1, 0.05) << name_of(criterion);
  }
  // The risk of the tractions has the trace over lambda², in a difference: its flat minimum moves by a fifth with them
  // (notes/tractions_in_space.md), which must not cost more than a few per cent of the error.
  const double our_risk = chosen_lambda(ours, inverse::LambdaCriterion::risk),
               their_risk = chosen_lambda(theirs, inverse::LambdaCriterion::risk);
  EXPECT_LE(apart(dense.solve(our_risk), truth), 1.03 * apart(dense.solve(their_risk), truth));
}

TEST(Spectra, separate_an_error_that_can_be_followed_from_noise_that_is_everywhere) {
  const MatrixXd A = smoothing_matrix(500, 240);
  const MatrixXd followed = A.householderQr().householderQ() * MatrixXd::Identity(500, 240);
  std::normal_distribution<double> normal;
  constexpr double kNoise = 0.02, kError = 0.05;
  int n_alarms = 0;
  constexpr int kSeeds = 20;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937_64 random(seed);
    const auto draw = [&](int n) { return VectorXd(VectorXd::NullaryExpr(n, [&]() { return normal(random); })); };
    const auto felt_least = [&](const VectorXd& u) {
      return inverse::Spectrum(A.transpose() * A, A.transpose() * u, u.squaredNorm(), 500).variance_felt_least();
    };
    const VectorXd noise = kNoise * draw(500);
    n_alarms += felt_least(noise).has_value();
    const auto found = felt_least(noise + kError * followed * draw(240));
    ASSERT_TRUE(found) << seed;
    // of 120 squares the mean varies by 13 %, its root by half of that: three times
    EXPECT_NEAR(std::sqrt(*found), std::hypot(kNoise, kError), 0.2 * kError) << seed;
  }
  EXPECT_LE(n_alarms, 1);  // three standard deviations one way: one in some hundred, and two of twenty in some fifty
}

TEST(Losses, weigh_beads_by_the_length_of_their_residual_whatever_its_direction) {
  for (const BeadLoss loss : {BeadLoss::l1, BeadLoss::huber, BeadLoss::biweight}) {
    EXPECT_LE(inverse::weight(shape_of(loss), 4, 3), inverse::weight(shape_of(loss), 1, 3)) << name_of(loss);
    EXPECT_GE(inverse::weight(shape_of(loss), 1, 3), 0) << name_of(loss);
  }
  EXPECT_EQ(inverse::weight(shape_of(BeadLoss::biweight), 6, 3), 0);
  EXPECT_EQ(inverse::weight(shape_of(BeadLoss::huber), 1, 3), 1);
}

TEST(Losses, find_the_scale_of_most_beads_and_their_variance) {
  test::Normal normal(11);
  Observed observed;
  observed.at = {std::vector<Vec3>(4000), substrate::Components::all};
  observed.states_errors = false;
  VectorXd residual = VectorXd::NullaryExpr(12000, [&]() { return 2 * normal(); });
  for (Eigen::Index b = 0; b < 400; ++b) residual.segment<3>(3 * b) *= 30;  // a tenth astray
  for (const BeadLoss loss : {BeadLoss::huber, BeadLoss::biweight}) {
    const Weighing w = weigh(loss, observed, residual, 0);
    // the median of the good is the 0.55 quantile of all: 4 % up; its own error is 1 %
    EXPECT_NEAR(w.scale / 2, 1.07, 0.07) << name_of(loss);
    // of a mean of the good beads: 95 % efficiency costs 5 % of its variance; outliers that keep some weight add
    // theirs, k² each where good ones have one: k = 2.0 for a tenth of them, with k/r of weight, adds up to 0.4
    const double relative = w.variance / w.by_row.sum() * (0.9 * 12000) / 4;
    EXPECT_GE(relative, 0.97) << name_of(loss);
    EXPECT_LE(relative, loss == BeadLoss::biweight ? 1.15 : 1.6) << name_of(loss);
  }
}

TEST(Losses, judge_a_bead_by_the_field_around_it_and_not_by_its_size) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> place(0, 40);
  std::normal_distribution<double> normal;
  constexpr int kBeads = 600, kAstray = 180;
  Observed observed;
  std::vector<Vec3> places;
  for (int b = 0; b < kBeads; ++b) places.push_back({place(random), place(random), place(random)});
  observed.sigma_um = VectorXd::Constant(3 * kBeads, 0.1);
  observed.displacement_um.resize(3 * kBeads);
  for (int b = 0; b < kBeads; ++b) {
    const Vec3 p = places[b];  // up to 120 standard errors
    observed.displacement_um.segment<3>(3 * b) << 0.3 * p.x, 0.1 * p.y - 0.2 * p.z, 5;
    for (int c = 0; c < 3; ++c) observed.displacement_um[3 * b + c] += 0.1 * normal(random);
    if (b < kAstray) observed.displacement_um[3 * b + b % 3] += b % 2 ? 4 : -4;
  }
  observed.at = {places, substrate::Components::all};
  observed.distance_um = 4.7;
  observed.n_beads = kBeads;
  for (const bool states_errors : {true, false}) {
    observed.states_errors = states_errors;
    const AmongNeighbours among = among_neighbours(observed);
    // 40 standard errors of a bead are 30 and more of bead and prediction; of Gaussian vectors one of 10 000 is
    // above 4.7
    EXPECT_GE(*std::min_element(among.distance.begin(), among.distance.begin() + kAstray), 10) << states_errors;
    EXPECT_LE(*std::max_element(among.distance.begin() + kAstray, among.distance.end()), 6) << states_errors;
    const std::vector<double> good = probabilities_of_good(BeadLoss::mixture, observed);
    EXPECT_LE(*std::max_element(good.begin(), good.begin() + kAstray), 0.05) << states_errors;
    EXPECT_GE(*std::min_element(good.begin() + kAstray, good.end()), 0.5) << states_errors;
  }
}

/// Of three levels, at random places.
TractionMesh split_at_random(const Ground& ground, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::bernoulli_distribution split(0.2);
  TractionMesh mesh = make_traction_mesh(ground, {{0, 0}, {20, 12}}, 3, [](Vec2 p) { return p.x + p.y > 3; });
  for (int round = 0; round < 3; ++round) {
    std::vector<bool> chosen(mesh.leaves.size());
    for (std::size_t f = 0; f < chosen.size(); ++f) chosen[f] = split(random);
    mesh = with_split(mesh, ground, chosen);
  }
  return mesh;
}

/// Of one lattice, the vertices of a finer one: rows of shares.
MatrixXd prolongation(const TractionMesh& mesh, const TractionMesh& finer) {
  MatrixXd P = MatrixXd::Zero(finer.n_vertices(), mesh.n_vertices());
  for (int v = 0; v < finer.n_vertices(); ++v)
    for (const auto& [vertex, share] : shares_at(mesh, finer.quads.points_um[v])) P(v, vertex) += share;
  return P;
}

constexpr double kRounding = 1e-11;

TEST(TractionMeshes, split_where_asked_differ_by_one_level_from_side_to_side) {
  const Ground ground(nullptr);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const TractionMesh mesh = split_at_random(ground, seed);
    EXPECT_GE(mesh.finest_level(), 2) << seed;
    for (const Leaf& a : mesh.leaves) {
      const Vec2 low = mesh.low_corner_um(a), size = mesh.size_um(a);
      for (const Leaf& b : mesh.leaves) {
        const Vec2 other = mesh.low_corner_um(b), far = other + mesh.size_um(b);
        const bool beside =
            std::abs(other.x - low.x - size.x) < 1e-9 && other.y < low.y + size.y - 1e-9 && far.y > low.y + 1e-9;
        EXPECT_LE(beside ? std::abs(a.level - b.level) : 0, 1) << seed;
      }
    }
  }
}

TEST(TractionMeshes, of_split_faces_carry_the_tractions_of_the_larger_ones_and_have_their_integrals) {
  const Ground ground(nullptr);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const TractionMesh mesh = split_at_random(ground, seed), even = evened(mesh, ground);
    const TractionMesh coarse = make_traction_mesh(ground, {{0, 0}, {20, 12}}, 3, [](Vec2 p) { return p.x + p.y > 3; });
    EXPECT_EQ(even.finest_level(), mesh.finest_level());
    EXPECT_EQ(even.n_vertices(), std::ssize(even.quads.points_um)) << "none hangs";
    EXPECT_LT(mesh.n_vertices(), std::ssize(mesh.quads.points_um)) << "some hang";
    const MatrixXd P = prolongation(mesh, even), Q = prolongation(coarse, mesh), all = prolongation(coarse, even);
    EXPECT_LE((P.rowwise().sum().array() - 1).abs().maxCoeff(), kRounding) << seed;
    EXPECT_LE((P * Q - all).norm(), kRounding * all.norm()) << seed;
    EXPECT_LE((P.transpose() * MatrixXd(even.mass_um2) * P - MatrixXd(mesh.mass_um2)).norm(),
              kRounding * mesh.mass_um2.norm());
    const VectorXd areas = P.transpose() * Eigen::Map<const VectorXd>(even.areas_um2.data(), even.n_vertices());
    EXPECT_LE((areas - Eigen::Map<const VectorXd>(mesh.areas_um2.data(), mesh.n_vertices())).norm(),
              kRounding * areas.norm());
    EXPECT_NEAR(areas.sum(), Eigen::Map<const VectorXd>(coarse.areas_um2.data(), coarse.n_vertices()).sum(), 1e-9);
  }
}

TEST(TractionMeshes, have_tractions_that_do_not_jump_from_face_to_face) {
  const Ground ground(nullptr);
  const TractionMesh mesh = split_at_random(ground, 7);
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> any(-1, 1), across(0.5, 19.5), down(3.5, 11.5);
  const VectorXd t = VectorXd::NullaryExpr(mesh.n_vertices(), [&]() { return any(random); });
  const auto value = [&](Vec2 at) {
    double sum = 0;
    for (const auto& [vertex, share] : shares_at(mesh, at)) sum += share * t[vertex];
    return sum;
  };
  constexpr double kStep = 1e-7;
  const double steepest = 2 / std::ldexp(mesh.spacing_um.x, -mesh.finest_level());  // from -1 to 1 over a side
  for (const Leaf& leaf : mesh.leaves) {
    const Vec2 low = mesh.low_corner_um(leaf);
    const double y = low.y + 0.3 * mesh.size_um(leaf).y;
    if (shares_at(mesh, {low.x - kStep, y}).empty()) continue;
    EXPECT_LE(std::abs(value({low.x + kStep, y}) - value({low.x - kStep, y})), 2 * 2 * kStep * steepest);
  }
}

TEST(Bases, an_orthonormal_one_has_the_integral_of_squares_for_its_norm) {
  const Ground ground(nullptr);
  const TractionMesh mesh = split_at_random(ground, 3);
  const auto amplitude = [](Vec2 p) { return p.x < 10 ? 1.0 : 0.5; };
  const MatrixXd norm = norm_of(mesh, ground, amplitude);
  const Basis basis = orthonormal_basis(norm);
  const VectorXd x = VectorXd::LinSpaced(3 * basis.size(), -1, 2), t = basis.tractions(x);
  double square = 0;
  for (Eigen::Index v = 0; v < norm.rows(); ++v)
    for (Eigen::Index w = 0; w < norm.rows(); ++w) square += norm(v, w) * t.segment<3>(3 * v).dot(t.segment<3>(3 * w));
  EXPECT_NEAR(square, x.squaredNorm(), 1e-9 * square);
  const MatrixXd covariance = basis.covariance(MatrixXd(x * x.transpose()), 1);
  EXPECT_LE((covariance - t * t.transpose()).norm(), 1e-12 * covariance.norm());
}

class InSpace : public testing::Test {
 protected:
  HalfSpaceScene scene;
  SpatialParameters parameters;
  TractionParameters traction;

  VectorXd truth_at(const Problem& problem) const {
    const std::vector<Vec3> vertices = problem.vertices_um();
    VectorXd truth_kPa = VectorXd::Zero(problem.n_unknowns());
    for (std::size_t v = 0; v < vertices.size(); ++v)
      for (const auto& spot : scene.spots) {
        if (norm(Vec2{vertices[v].x, vertices[v].y} - spot.centre_um) > spot.radius_um) continue;
        const double area_um2 = M_PI * spot.radius_um * spot.radius_um;
        truth_kPa.segment<3>(3 * static_cast<Eigen::Index>(v)) +=
            Eigen::Vector3d(spot.force_nN.x, spot.force_nN.y, spot.force_nN.z) / area_um2;
      }
    return truth_kPa;
  }
};

TEST_F(InSpace, adjoint_and_thesis_cg_end_at_the_minimum_of_tikhonov) {
  const Problem problem = scene.problem(scene.beads(0.02), parameters);
  const auto tikhonov = reconstruct_tikhonov(problem, traction, parameters, 1);
  EXPECT_LE(apart(reconstruct_adjoint(problem, traction, parameters, 1).traction_kPa, tikhonov.traction_kPa), 1e-8);
  EXPECT_LE(apart(reconstruct_thesis_cg(problem, traction, parameters, 1).traction_kPa, tikhonov.traction_kPa), 1e-3);
}

TEST_F(InSpace, a_lambda_by_risk_that_runs_away_is_replaced_and_called_so) {
  using enum inverse::LambdaCriterion;
  const Problem right = scene.problem(scene.beads(0.02), parameters);
  const auto named = reconstruct_tikhonov(right, traction, parameters, 1);
  EXPECT_EQ(named.lambda_by, risk);
  inverse::LambdaScan scan = *named.scan;
  scan.by_evidence = 1.9 * scan.by_risk;  // the bound is two
  const auto chosen = choose_lambda(right, scan, traction, RiskCriterion::usable);
  EXPECT_EQ(chosen.by, risk);
  EXPECT_EQ(chosen.lambda, scan.by_risk);
  EXPECT_FALSE(fires("lambda-unbounded", chosen.finding));
  scan.by_evidence = 2.1 * scan.by_risk;
  const auto replaced = choose_lambda(right, scan, traction, RiskCriterion::usable);
  EXPECT_EQ(replaced.by, evidence);
  EXPECT_EQ(replaced.lambda, scan.by_evidence);
  ASSERT_TRUE(fires("lambda-unbounded", replaced.finding));
  EXPECT_NEAR(replaced.finding->number.value_or(0), 2.1, 1e-9);
  const auto unsound = choose_lambda(right, scan, traction, RiskCriterion::use_gcv);
  EXPECT_EQ(unsound.by, gcv);
  EXPECT_EQ(unsound.lambda, scan.by_gcv);
  traction.lambda_by = gcv;  // what was asked for by name is taken
  EXPECT_EQ(choose_lambda(right, scan, traction, RiskCriterion::usable).by, gcv);
  traction.lambda_um_per_kPa = 0.1;
  EXPECT_FALSE(choose_lambda(right, scan, traction, RiskCriterion::usable).by);
}

/// Of beads without noise a gel of another Poisson's ratio is all that is wrong.
TEST_F(InSpace, what_the_gel_has_wrong_is_not_followed_by_tractions) {
  Problem problem = scene.problem(scene.beads(1e-9), parameters);
  HalfSpaceScene other = scene;
  other.gel.poisson_ratio = 0.4;
  problem.observed = observe(other.beads(1e-9), scene.gel, problem.ground, parameters);
  const VectorXd truth = truth_at(problem);
  const auto found = reconstruct_tikhonov(problem, traction, parameters, 1);
  double best = 1;
  for (const auto& point : found.scan->points) {
    traction.lambda_um_per_kPa = point.lambda / lambda_per_um_per_kPa(problem);
    best = std::min(best, apart(reconstruct_tikhonov(problem, traction, parameters, 1).traction_kPa, truth));
  }
  EXPECT_LE(apart(found.traction_kPa, truth), 1.3 * best);
  // with noise that is the same everywhere
  const Basis basis = orthonormal_basis(norm_of(problem.mesh, problem.ground, [](Vec2) { return 1.0; }));
  const VectorXd even = VectorXd::Ones(problem.observed.displacement_um.size());
  const auto spectrum =
      spectrum_of(problem, basis.response(problem.response_um_per_kPa, 1), even, static_cast<double>(even.size()), 1);
  const auto scan = spectrum.scan(problem.least_variance(), inverse::SignalIn::resolved);
  EXPECT_GT(apart(basis.tractions(spectrum.solve(scan.by_risk)), truth), 2 * best);
  RecordProperty("over_best", std::to_string(apart(found.traction_kPa, truth) / best) + " by noise alone " +
                                  std::to_string(apart(basis.tractions(spectrum.solve(scan.by_risk)), truth) / best));
}

/// A sum over many places has little noise, but all of the smoothing.
TEST_F(InSpace, sums_are_smoothed_less_than_the_map_and_are_nearer_to_the_forces) {
  double off_sums = 0, off_map = 0, square_of_sums = 0, square_of_map = 0, shorter = 0;
  constexpr int kSeeds = 4;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    scene.seed = static_cast<std::uint64_t>(seed);
    const Problem problem = scene.problem(scene.beads(0.02), parameters);
    const MatrixXd areas = adhesion_areas_um2(problem.mesh, problem.ground, scene.adhesions(), 4);
    const auto r = reconstruct_tikhonov(problem, traction, parameters, 1);
    ASSERT_TRUE(r.summands);
    shorter += std::log(*r.summands->lambda / *r.lambda) / kSeeds;
    SpatialReconstruction of_map = r;
    of_map.summands.reset();
    const auto compare = [&](const std::vector<PartForce>& forces, double& off_sum, double& square) {
      for (std::size_t a = 0; a < scene.spots.size(); ++a) {
        const Vec3 off = forces[a].force_nN - scene.spots[a].force_nN, s = forces[a].sigma_nN;
        off_sum += norm(off) / norm(scene.spots[a].force_nN) / (3 * kSeeds);
        square += (std::pow(off.x / s.x, 2) + std::pow(off.y / s.y, 2) + std::pow(off.z / s.z, 2)) / (9 * kSeeds);
      }
    };
    compare(forces_on(problem, r, areas), off_sums, square_of_sums);
    compare(forces_on(problem, of_map, areas), off_map, square_of_map);
    EXPECT_EQ(balance_of(problem, r).total_force_nN, balance_of(problem, of_map).total_force_nN) << seed;
  }
  RecordProperty("sums", std::to_string(off_sums) + " " + std::to_string(std::sqrt(square_of_sums)));
  RecordProperty("map", std::to_string(off_map) + " " + std::to_string(std::sqrt(square_of_map)));
  EXPECT_LT(shorter, 0);
  EXPECT_LT(off_sums, off_map);
  EXPECT_LT(square_of_sums, square_of_map);  // nearer to what is stated, too, which is below
}

/// As the noise of some beads is less than they state by chance.
TEST_F(InSpace, errors_stated_a_tenth_too_large_smooth_group_l1_no_more) {
  const Problem problem = scene.problem(scene.beads(0.03), parameters);
  Problem overstated = problem;
  overstated.observed.sigma_um *= 1.1;
  const auto one = reconstruct_group_l1(problem, traction, parameters, 1),
             two = reconstruct_group_l1(overstated, traction, parameters, 1);
  // the minimum is left when a step is a thousandth: the rest is some dozens of them
  EXPECT_LE(apart(two.traction_kPa, one.traction_kPa), 0.05);
}

TEST_F(InSpace, twice_the_displacement_with_twice_the_errors_is_twice_the_traction) {
  std::vector<BeadInSpace> beads = scene.beads(0.02);
  const Problem problem = scene.problem(beads, parameters);
  Problem doubled = problem;
  doubled.observed.displacement_um *= 2;
  doubled.observed.sigma_um *= 2;
  for (const auto method : {tractions::TractionMethod::tikhonov, tractions::TractionMethod::group_l1}) {
    traction.method = method;
    const SpatialInputs inputs{{}, scene.gel, {}, {}};
    const auto one = reconstruct(problem, inputs, traction, parameters, 1);
    const auto two = reconstruct(doubled, inputs, traction, parameters, 1);
    EXPECT_LE(apart(two.traction_kPa, 2 * one.traction_kPa), 1e-6) << name_of(method);
    EXPECT_LE((two.covariance_kPa2 - 4 * one.covariance_kPa2).norm(), 1e-5 * two.covariance_kPa2.norm());
  }
}

/// What noise does, against what the lattice does, on the same beads.
TEST_F(InSpace, the_answer_does_not_depend_on_the_lattice) {
  const std::vector<BeadInSpace> beads = scene.beads(0.03), exact = scene.beads(1e-9);
  const auto force_map = [&](double spacing, const std::vector<BeadInSpace>& seen) {
    scene.spacing_um = spacing;
    const Problem problem = scene.problem(seen, parameters);
    traction.lambda_um_per_kPa = 0.15;  // the same for all: a length, not a number of the lattice
    const auto r = reconstruct_tikhonov(problem, traction, parameters, 1);
    // forces on eight by eight squares
    MatrixXd areas = MatrixXd::Zero(64, problem.mesh.n_vertices());
    over_faces(problem.mesh, problem.ground, 8, Places::even,
               [&](Vec2 at, std::span<const VertexShare> shares, double area) {
                 const int i = std::min(7, static_cast<int>((at.x + scene.half_um) / 6));
                 const int j = std::min(7, static_cast<int>((at.y + scene.half_um) / 6));
                 for (const auto& [vertex, share] : shares) areas(8 * j + i, vertex) += share * area;
               });
    VectorXd forces(192);
    for (Eigen::Index s = 0; s < 64; ++s) {
      forces.segment<3>(3 * s).setZero();
      for (Eigen::Index v = 0; v < areas.cols(); ++v)
        forces.segment<3>(3 * s) += areas(s, v) * r.traction_kPa.segment<3>(3 * v);
    }
    return forces;
  };
  const VectorXd middle = force_map(4, beads);
  const double by_noise = (middle - force_map(4, exact)).norm();
  EXPECT_LE((force_map(3.2, beads) - middle).norm(), 0.25 * by_noise);
  EXPECT_LE((force_map(4.8, beads) - middle).norm(), 0.25 * by_noise);
}

class SplitFaces : public InSpace {
 protected:
  Problem coarse(double noise_um, bool has_forces) {
    if (!has_forces)
      for (auto& spot : scene.spots) spot.force_nN = {};
    scene.spacing_um = 6;
    return scene.problem(scene.beads(noise_um), parameters);
  }
};

TEST_F(SplitFaces, lie_where_tractions_exceed_their_errors_and_not_where_noise_has_its_peaks) {
  const HalfSpaceScene as_it_is = scene;
  int n_split = 0;
  constexpr int kSeeds = 5;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    scene.seed = static_cast<std::uint64_t>(seed);
    const Problem problem = coarse(0.03, false);
    const auto r = reconstruct_tikhonov(problem, traction, parameters, 1);
    n_split += static_cast<int>(std::ranges::count(faces_to_split(problem, r, Refine::resolved), true));
    const auto by_size = faces_to_split(problem, r, Refine::threshold);
    // two fifths of 64 and the one at the threshold: a rule of size alone splits what noise makes
    EXPECT_NEAR(static_cast<double>(std::ranges::count(by_size, true)), 0.4 * 64, 1) << seed;
  }
  EXPECT_LE(n_split, 3);  // of 320 faces, once in a hundred
  scene = as_it_is;
  const Problem problem = coarse(0.01, true);
  const auto r = reconstruct_tikhonov(problem, traction, parameters, 1);
  const auto split = faces_to_split(problem, r, Refine::resolved);
  for (const auto& spot : scene.spots) {
    bool is_met = false;
    for (std::size_t f = 0; f < split.size(); ++f) {
      const Vec2 middle = problem.mesh.low_corner_um(problem.mesh.leaves[f]) + Vec2{3, 3};
      is_met = is_met || (split[f] && norm(middle - spot.centre_um) <= 6);
    }
    EXPECT_TRUE(is_met) << spot.centre_um.x;
  }
}

TEST_F(SplitFaces, have_the_answers_of_a_finer_lattice_with_fewer_unknowns) {
  const std::vector<BeadInSpace> beads = scene.beads(0.01);
  const Problem large = coarse(0.01, true);
  const auto again = [&](const Problem& p) { return reconstruct_tikhonov(p, traction, parameters, 1); };
  const Refined split = refined(
      large, again(large), Refine::resolved,
      [&](TractionMesh mesh) { return scene.problem_on(std::move(mesh), beads, parameters); }, again);
  scene.spacing_um = 3;
  const Problem fine = scene.problem(beads, parameters);
  const auto of_fine = again(fine), of_large = again(large);
  EXPECT_GT(split.n_split, 0);
  EXPECT_LT(split.problem.mesh.n_vertices(), fine.mesh.n_vertices());
  const MatrixXd P = prolongation(split.problem.mesh, fine.mesh), Q = prolongation(large.mesh, fine.mesh);
  const auto on_fine = [](const MatrixXd& p, const VectorXd& t) {
    return VectorXd((t.reshaped(3, p.cols()) * p.transpose()).reshaped());
  };
  const double off = apart(on_fine(P, split.reconstruction.traction_kPa), of_fine.traction_kPa),
               off_large = apart(on_fine(Q, of_large.traction_kPa), of_fine.traction_kPa);
  RecordProperty("off", std::to_string(off) + " unsplit " + std::to_string(off_large));
  EXPECT_LT(off, off_large);
}

/// Displacements by faces that are split are those of the finer lattice under the same tractions.
TEST_F(SplitFaces, displace_beads_as_the_same_tractions_on_an_even_lattice_do) {
  const std::vector<BeadInSpace> beads = scene.beads(0.01);
  const Problem large = coarse(0.01, true);
  std::vector<bool> some(large.mesh.leaves.size(), false);
  for (std::size_t f = 0; f < some.size(); f += 5) some[f] = true;
  const Problem split = scene.problem_on(with_split(large.mesh, large.ground, some), beads, parameters);
  const Problem even = scene.problem_on(evened(split.mesh, large.ground), beads, parameters);
  const MatrixXd P = prolongation(split.mesh, even.mesh);
  MatrixXd by_component = MatrixXd::Zero(3 * P.rows(), 3 * P.cols());
  for (Eigen::Index c = 0; c < 3; ++c) by_component(Eigen::seqN(c, P.rows(), 3), Eigen::seqN(c, P.cols(), 3)) = P;
  // nine Gauss points on a face, or on each quarter of it; beads are 2 um deep or more
  EXPECT_LE((even.response_um_per_kPa * by_component - split.response_um_per_kPa).norm(),
            0.02 * split.response_um_per_kPa.norm());
}

TEST_F(InSpace, forces_lie_within_their_standard_errors) {
  for (const auto method :
       {tractions::TractionMethod::tikhonov, tractions::TractionMethod::group_l1, tractions::TractionMethod::patches}) {
    double square = 0, turned = 0;
    constexpr int kSeeds = 4;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      scene.seed = static_cast<std::uint64_t>(seed);
      const Problem problem = scene.problem(scene.beads(0.03), parameters);
      traction.method = method;
      traction.grow_um = 3;
      const SpatialInputs inputs{{}, scene.gel, scene.adhesions(), {}};
      const auto r = reconstruct(problem, inputs, traction, parameters, 1);
      for (std::size_t a = 0; a < scene.spots.size(); ++a) {
        const Vec3 off = r.forces[a].force_nN - scene.spots[a].force_nN, s = r.forces[a].sigma_nN;
        square += (std::pow(off.x / s.x, 2) + std::pow(off.y / s.y, 2) + std::pow(off.z / s.z, 2)) / (9.0 * kSeeds);
        const Vec3 exact = scene.spots[a].force_nN, found = r.forces[a].force_nN;
        const double turned_deg =
            180 / M_PI * std::atan2(exact.x * found.y - exact.y * found.x, exact.x * found.x + exact.y * found.y);
        turned += std::pow(turned_deg / r.forces[a].angle_sigma_deg, 2) / (3.0 * kSeeds);
      }
    }
    // 12 angles: chance is a fifth of the root, one way
    EXPECT_LE(std::sqrt(turned), 1.5) << name_of(method);
    // 36 numbers: chance is 12 % of the root, one way; the errors have the smoothing in them, which may do less
    EXPECT_LE(std::sqrt(square), 1.3) << name_of(method);
    EXPECT_GE(std::sqrt(square), 0.4) << name_of(method);
  }
}

/// Two ways to one number: from the decomposition for every noise, and by the reconstruction of one experiment.
TEST_F(InSpace, what_is_foreseen_is_what_a_reconstruction_of_such_beads_states) {
  constexpr double kNoise_um = 0.03;
  const SpatialInputs inputs{{}, scene.gel, scene.adhesions(), {}};
  const Problem exact = scene.problem(scene.beads(1e-9), parameters),
                seen = scene.problem(scene.beads(kNoise_um), parameters);
  traction.method = tractions::TractionMethod::tikhonov;
  const auto foreseen = [&] { return Foresight(exact, traction, 1).at(kNoise_um / 1e-9); };
  const double lambda_found = *reconstruct(seen, inputs, traction, parameters, 1).lambda;
  // criteria of one experiment scatter: 80 numbers are told, and lambda follows the tenth or so of their logarithms
  EXPECT_NEAR(foreseen().lambda / lambda_found, 1, 0.2);
  traction.lambda_um_per_kPa = lambda_found / lambda_per_um_per_kPa(seen);
  const auto r = reconstruct(seen, inputs, traction, parameters, 1);
  const Foreseen f = foreseen();
  EXPECT_NEAR(f.lambda, lambda_found, 1e-9 * lambda_found);
  // 1 500 data tell their variance to 4 %, errors to 2 %: three times
  const double by_variance = std::sqrt(r.variance);
  EXPECT_NEAR(by_variance, 1, 0.06);
  for (std::size_t a = 0; a < r.forces.size(); ++a) {
    const auto at = 3 * static_cast<Eigen::Index>(a);
    const Vec3 s = r.forces[a].sigma_nN;
    for (Eigen::Index c = 0; c < 3; ++c) {
      const double stated = std::array{s.x, s.y, s.z}.at(static_cast<std::size_t>(c)) / by_variance;
      EXPECT_NEAR(std::sqrt(f.covariance_nN2(at + c, at + c)), stated, 1e-6 * stated) << a;
      EXPECT_LE(f.by_noise_nN2(at + c, at + c), f.covariance_nN2(at + c, at + c)) << a;
    }
  }
  const Balance balance = balance_of(seen, r);
  EXPECT_NEAR(std::sqrt(f.net_force_nN2(0, 0)), balance.force_sigma_nN.x / by_variance,
              1e-6 * balance.force_sigma_nN.x);
  const std::vector<double> resolution = resolution_um(seen, r);
  for (std::size_t v = 0; v < resolution.size(); ++v)
    EXPECT_NEAR(f.resolution_um[v], resolution[v], 1e-5 * resolution[v]);
}

/// Of forces found in many experiments, the scatter is the part by noise: what they have wrong alike is the rest.
TEST_F(InSpace, the_part_by_noise_is_the_scatter_of_experiments_with_the_same_beads) {
  constexpr double kNoise_um = 0.03;
  constexpr int kSeeds = 100;
  const Problem exact = scene.problem(scene.beads(1e-9), parameters);
  const Foresight foresight(exact, traction, 1);
  const Foreseen f = foresight.at(kNoise_um / 1e-9);
  Problem seen = exact;
  seen.observed.sigma_um *= kNoise_um / 1e-9;
  traction.lambda_um_per_kPa = f.lambda / lambda_per_um_per_kPa(seen);
  test::Normal normal(17);
  MatrixXd found(f.mean_nN.size(), kSeeds);
  const Basis basis = orthonormal_basis(norm_of(seen.mesh, seen.ground, [](Vec2) { return 1.0; }));
  const MatrixXd response = basis.response(seen.response_um_per_kPa, 1);
  SpatialReconstruction r;
  r.lambda = f.lambda;
  r.weighing.by_row = VectorXd::Ones(seen.observed.sigma_um.size());
  for (int k = 0; k < kSeeds; ++k) {
    seen.observed.displacement_um =
        exact.observed.displacement_um + seen.observed.sigma_um.cwiseProduct(VectorXd::NullaryExpr(
                                             seen.observed.sigma_um.size(), [&]() { return normal(); }));
    const std::vector<PartForce> forces = forces_beside_background(seen, response, r, 1);
    for (std::size_t a = 0; a < forces.size(); ++a) {
      const Vec3 force = forces[a].force_nN;
      found.col(k).segment<3>(3 * static_cast<Eigen::Index>(a)) << force.x, force.y, force.z;
    }
  }
  const VectorXd mean = found.rowwise().mean();
  const VectorXd variance = (found.colwise() - mean).rowwise().squaredNorm() / (kSeeds - 1);
  // a variance of 100 numbers has a standard error of 14 %, the mean of nine one of 5 %
  EXPECT_NEAR(variance.cwiseQuotient(f.by_noise_nN2.diagonal()).mean(), 1, 0.15);
  for (Eigen::Index c = 0; c < mean.size(); ++c)
    EXPECT_NEAR(mean[c], f.mean_nN[c], 4 * std::sqrt(f.by_noise_nN2(c, c) / kSeeds)) << c;
}

TEST_F(InSpace, noise_and_modulus_count_as_their_product_and_more_of_either_is_foreseen_as_more_error) {
  const Problem soft = scene.problem(scene.beads(1e-9), parameters);
  HalfSpaceScene stiff_scene = scene;
  stiff_scene.gel.youngs_modulus_kPa *= 2;
  const Problem stiff = stiff_scene.problem(stiff_scene.beads(1e-9), parameters);
  const Foresight of_soft(soft, traction, 1), of_stiff(stiff, traction, 1);
  const Foreseen once = of_soft.at(3e7), twice = of_soft.at(6e7), of_modulus = of_stiff.at(3e7);
  // beads of 1e-9 um have noise of their own: a part in 1e7
  EXPECT_LE((twice.covariance_nN2 - of_modulus.covariance_nN2).norm(), 1e-5 * twice.covariance_nN2.norm());
  EXPECT_NEAR(twice.degrees, of_modulus.degrees, 1e-4 * twice.degrees);
  // at the same lambda twice the noise were twice the error; more is smoothed, so that it is less
  const VectorXd ratio = twice.covariance_nN2.diagonal().cwiseQuotient(once.covariance_nN2.diagonal()).cwiseSqrt();
  EXPECT_GT(ratio.minCoeff(), 1);
  EXPECT_LE(ratio.maxCoeff(), 2);
  EXPECT_LT(twice.degrees, once.degrees);
}

/// The standard deviation of a weighted sum lies between those of its terms, added and taken off.
TEST_F(InSpace, the_error_of_a_forces_magnitude_is_that_along_it) {
  scene.spots = {{{-10, -9}, 4, {40, 0, 0}}, {{11, -6}, 4, {0, 35, 0}}};
  const Problem problem = scene.problem(scene.beads(0.01), parameters);
  const SpatialInputs inputs{{}, scene.gel, scene.adhesions(), {}};
  for (const auto method : {tractions::TractionMethod::tikhonov, tractions::TractionMethod::patches}) {
    traction.method = method;
    const auto r = reconstruct(problem, inputs, traction, parameters, 1);
    for (const PartForce& part : r.forces) {
      const Vec3 a = (1 / norm(part.force_nN)) * part.force_nN, s = part.sigma_nN;
      const double terms[] = {std::abs(a.x) * s.x, std::abs(a.y) * s.y, std::abs(a.z) * s.z};
      const double most = terms[0] + terms[1] + terms[2], largest = std::max({terms[0], terms[1], terms[2]});
      EXPECT_LE(part.magnitude_sigma_nN, most * (1 + 1e-9)) << name_of(method);
      EXPECT_GE(part.magnitude_sigma_nN, (2 * largest - most) * (1 - 1e-9)) << name_of(method);
    }
  }
}

TEST_F(InSpace, beads_that_are_wrong_do_not_pull_with_a_robust_loss) {
  std::vector<BeadInSpace> beads = scene.beads(0.03);
  const Problem good = scene.problem(beads, parameters);
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> box(-5, 5);
  for (std::size_t b = 0; b < beads.size(); b += 10) beads[b].displacement_um = {box(random), box(random), box(random)};
  const Problem bad = scene.problem(beads, parameters);
  const VectorXd truth = truth_at(good);
  const auto map_by = [&](BeadLoss loss, const Problem& problem) {
    parameters.loss = loss;
    return reconstruct_tikhonov(problem, traction, parameters, 1).traction_kPa;
  };
  const VectorXd by_squares = map_by(BeadLoss::l2, good);
  const double least = apart(by_squares, truth), astray = apart(map_by(BeadLoss::l2, bad), truth);
  RecordProperty("l2", std::to_string(least) + " " + std::to_string(astray));
  EXPECT_LE(apart(map_by(BeadLoss::mixture, good), by_squares), 1e-5) << "it leaves none out, and is least squares";
  for (const BeadLoss loss : {BeadLoss::mixture, BeadLoss::l1, BeadLoss::huber, BeadLoss::biweight}) {
    const double without = apart(map_by(loss, good), truth), with = apart(map_by(loss, bad), truth);
    RecordProperty(name_of(loss), std::to_string(without) + " " + std::to_string(with));
    EXPECT_LE(without, 1.05 * least) << name_of(loss);
    // less than half of what it costs least squares, and nearer to the truth than to no tractions at all, which are 1
    // from it
    EXPECT_LE(with - least, 0.5 * (std::min(1.0, astray) - least)) << name_of(loss);
  }
}

/// Beads under patches that pull lose weight, as what smoothing takes from them looks astray.
TEST_F(InSpace, weights_of_a_robust_loss_leave_group_l1_its_tractions) {
  const Problem problem = scene.problem(scene.beads(0.1), parameters);
  const auto by_squares = reconstruct_group_l1(problem, traction, parameters, 1);
  for (const BeadLoss loss : {BeadLoss::mixture, BeadLoss::huber, BeadLoss::biweight}) {
    parameters.loss = loss;
    const double off =
        apart(reconstruct_group_l1(problem, traction, parameters, 1).traction_kPa, by_squares.traction_kPa);
    RecordProperty(name_of(loss), std::to_string(off));
    EXPECT_LE(off, 0.4) << name_of(loss);  // no tractions at all are 1 apart
  }
}

/// As a stage that has moved and a dish that was put back a little turned do.
TEST_F(InSpace, what_all_beads_do_together_changes_nothing_and_is_found) {
  const std::vector<BeadInSpace> beads = scene.beads(0.03);
  Problem still = scene.problem(beads, parameters);
  const MatrixXd motions = common_motions(still.observed);
  const VectorXd motion = Eigen::Vector4d(0.3, -0.2, 0.25, 0.002);
  Problem moved = still;
  moved.observed.displacement_um += motions * motion;
  const auto off = reconstruct_tikhonov(still, traction, parameters, 1),
             not_found = reconstruct_tikhonov(moved, traction, parameters, 1);
  EXPECT_GT(apart(not_found.traction_kPa, off.traction_kPa), 0.5);
  still.common_um = moved.common_um = motions;
  const SpatialInputs inputs{{}, scene.gel, {}, {}};
  for (const auto method : {tractions::TractionMethod::tikhonov, tractions::TractionMethod::group_l1}) {
    traction.method = method;
    const auto one = reconstruct(still, inputs, traction, parameters, 1),
               two = reconstruct(moved, inputs, traction, parameters, 1);
    // the data of both are the same numbers to rounding; lambda is found by a search
    EXPECT_LE(apart(two.traction_kPa, one.traction_kPa), 1e-6) << name_of(method);
    EXPECT_LE((two.covariance_kPa2 - one.covariance_kPa2).norm(), 1e-6 * one.covariance_kPa2.norm());
    const auto there = common_motion_beside(still, one), added = common_motion_beside(moved, two);
    EXPECT_LE((added->values - there->values - motion).norm(), 1e-6);
    for (Eigen::Index k = 0; k < 4; ++k) EXPECT_LE(std::abs(there->values[k]), 4 * there->sigma[k]) << k;
    if (!one.lambda) continue;
    // at the minimum over tractions and motion no slope is left
    const VectorXd errors = still.observed.sigma_um.cwiseAbs2().cwiseInverse();
    const VectorXd left =
        still.displacement_um() - still.response_um_per_kPa * one.traction_kPa - motions * there->values;
    const VectorXd slope = still.response_um_per_kPa.transpose() * errors.cwiseProduct(left);
    const MatrixXd norm = norm_of(still.mesh, still.ground, [&](Vec2 at) { return still.expected.amplitude(at); });
    // by vertex, then by component
    const MatrixXd tractions = one.traction_kPa.reshaped(3, norm.rows()).transpose();
    const MatrixXd penalty = *one.lambda * *one.lambda * (norm * tractions).transpose();
    EXPECT_LE(apart(slope, penalty.reshaped()), 1e-6);
  }
  traction.method.reset();
  parameters.loss = BeadLoss::huber;
  EXPECT_LE(apart(reconstruct_tikhonov(moved, traction, parameters, 1).traction_kPa,
                  reconstruct_tikhonov(still, traction, parameters, 1).traction_kPa),
            0.05);
}

TEST_F(InSpace, beads_that_did_not_move_make_no_traction) {
  std::vector<BeadInSpace> beads = scene.beads(0.02);
  for (BeadInSpace& b : beads) b.displacement_um = {};
  const Problem problem = scene.problem(beads, parameters);
  const auto r = reconstruct_group_l1(problem, traction, parameters, 1);
  EXPECT_TRUE(r.traction_kPa.isZero(0));
  EXPECT_FALSE(r.remark.empty());
}

TEST_F(InSpace, beads_above_the_surface_are_left_out_and_too_few_are_refused) {
  std::vector<BeadInSpace> beads = scene.beads(0.02);
  beads[0].position_um.z = -3;
  beads[1].flag = "out of focus";
  beads[2].position_um.z = 1001;
  const Ground ground(nullptr);
  const Observed observed = observe(beads, scene.gel, ground, parameters);
  EXPECT_EQ(observed.n_above, 1);
  EXPECT_EQ(observed.n_flagged, 1);
  EXPECT_EQ(observed.n_below_base, 1);
  EXPECT_EQ(observed.n_beads, scene.n_beads - 3);
  beads.resize(5);
  EXPECT_THROW(observe(beads, scene.gel, ground, parameters), InvalidData);
}

TEST_F(InSpace, a_region_that_covers_no_bead_is_refused) {
  const SpatialInputs inputs{scene.beads(0.02), scene.gel, {}, {{200, 200}, {220, 200}, {220, 220}}};
  const Ground ground(nullptr);
  const Observed observed = observe(inputs.beads, scene.gel, ground, parameters);
  EXPECT_THROW(expected_tractions(inputs, observed, ground, parameters, 0), InvalidData);
}

/// Fewer data than unknowns, so that tractions can follow anything: where beads move as no traction has it, the risk
/// has no minimum but the end of the scan.
TEST_F(InSpace, lambda_runs_away_where_few_beads_are_astray_or_a_stack_grew) {
  scene.n_beads = 60;
  const auto problem_of = [&](const std::vector<BeadInSpace>& beads) {
    Problem problem = scene.problem(beads, parameters);
    problem.common_um = common_motions(problem.observed);
    return problem;
  };
  for (scene.seed = 1; scene.seed <= 4; ++scene.seed) {
    const std::vector<BeadInSpace> sound = scene.beads(0.03);
    EXPECT_FALSE(fires("lambda-unbounded", reconstruct_tikhonov(problem_of(sound), traction, parameters, 1).findings));
    std::vector<BeadInSpace> astray = sound, grown = sound;
    std::mt19937_64 random(scene.seed);
    std::uniform_real_distribution<double> in_box(-5, 5);
    for (std::size_t b = 0; b < sound.size(); b += 10)
      astray[b].displacement_um = {in_box(random), in_box(random), in_box(random)};
    for (BeadInSpace& bead : grown) bead.displacement_um += 0.05 * bead.position_um;
    for (const auto& beads : {astray, grown}) {
      const Problem problem = problem_of(beads);
      const auto r = reconstruct_tikhonov(problem, traction, parameters, 1);
      EXPECT_TRUE(fires("lambda-unbounded", r.findings)) << scene.seed;
      EXPECT_EQ(r.lambda_by, inverse::LambdaCriterion::evidence) << scene.seed;
      TractionParameters of_risk = traction;
      of_risk.lambda_um_per_kPa = r.scan->by_risk / lambda_per_um_per_kPa(problem);
      const auto followed = reconstruct_tikhonov(problem, of_risk, parameters, 1);
      const VectorXd truth_kPa = truth_at(problem);
      EXPECT_LT(apart(r.traction_kPa, truth_kPa), 0.5 * apart(followed.traction_kPa, truth_kPa)) << scene.seed;
    }
  }
}

TEST_F(InSpace, the_resolution_is_finer_with_less_noise) {
  const auto median_um = [&](double sigma_um) {
    const Problem problem = scene.problem(scene.beads(sigma_um), parameters);
    std::vector<double> lengths = resolution_um(problem, reconstruct_tikhonov(problem, traction, parameters, 1));
    std::nth_element(lengths.begin(), lengths.begin() + std::ssize(lengths) / 2, lengths.end());
    return lengths[lengths.size() / 2];
  };
  EXPECT_LT(median_um(0.005), 0.8 * median_um(0.1));
}

/// Of 60 beads one or two tell a force, and their residuals make them look astray.
TEST_F(InSpace, an_answer_that_hangs_on_the_loss_is_called_so) {
  scene.n_beads = 60;
  scene.spots[0].force_nN = {80, 50, -30};
  const SpatialInputs inputs{{}, scene.gel, {}, {}};
  Problem problem = scene.problem(scene.beads(0.05), parameters);
  const auto by = [&](BeadLoss loss) {
    parameters.loss = loss;
    auto r = reconstruct(problem, inputs, traction, parameters, 1);
    RecordProperty(name_of(loss), std::to_string(balance_of(problem, r).total_force_nN));
    return r.findings;
  };
  EXPECT_FALSE(fires("outliers", "differ by", by(BeadLoss::l2)));
  EXPECT_TRUE(fires("outliers", "differ by", by(BeadLoss::biweight)));
  scene.n_beads = 1500;  // many that are right have one answer by any loss
  problem = scene.problem(scene.beads(0.05), parameters);
  for (const BeadLoss loss : {BeadLoss::mixture, BeadLoss::huber, BeadLoss::biweight})
    EXPECT_FALSE(fires("outliers", "differ by", by(loss))) << name_of(loss);
}

/// Two patches that pull at each other, and beads with the errors that they state.
class FindingsInSpace : public InSpace {
 protected:
  void SetUp() override { scene.spots = {{{-10, 0}, 4, {40, 0, 0}}, {{10, 0}, 4, {-40, 0, 0}}}; }
  SpatialReconstruction found(const Problem& problem) const {
    return reconstruct(problem, {{}, scene.gel, {}, {}}, traction, parameters, 1);
  }
  SpatialReconstruction found(const std::vector<BeadInSpace>& beads) const {
    return found(scene.problem(beads, parameters));
  }
  static constexpr double kSigma_um = 0.03;
};

TEST_F(FindingsInSpace, are_none_of_a_sound_scene) {
  const Problem problem = scene.problem(scene.beads(kSigma_um), parameters);
  const SpatialReconstruction r = found(problem);
  test::expect_silent({"beads-off-gel", "low-resolution", "misfit", "outliers"}, r.findings);
  EXPECT_FALSE(fires("tractions-out-of-balance", noticed_imbalance(balance_of(problem, r))));
}

TEST_F(FindingsInSpace, name_beads_beside_the_gel_stated_errors_that_are_too_small_and_beads_followed_to_another) {
  const std::vector<BeadInSpace> sound = scene.beads(kSigma_um);
  std::vector<BeadInSpace> off = sound, overconfident = sound, stray = sound;
  for (int b = 0; b < 10; ++b) off[b].position_um.z = b % 2 ? -2 : scene.gel.thickness_um + 2;
  for (BeadInSpace& b : overconfident) b.sigma_um /= 1.5, b.sigma_z_um /= 1.5;
  for (std::size_t b = 0; b < stray.size(); b += 50) stray[b].displacement_um += Vec3{1.5, -1, 0.5};
  EXPECT_TRUE(fires("beads-off-gel", "gel's surface", found(off).findings));
  EXPECT_TRUE(fires("misfit", "The tractions leave", found(overconfident).findings));
  EXPECT_TRUE(fires("outliers", "noise has them", found(stray).findings));
}

TEST_F(FindingsInSpace, name_beads_that_lie_deep) {
  scene.shallowest_um = 12;
  scene.depth_um = 22;
  EXPECT_TRUE(fires("low-resolution", "from the surface", found(scene.beads(kSigma_um)).findings));
}

TEST_F(FindingsInSpace, name_few_beads_of_much_noise) {
  scene.n_beads = 80;
  EXPECT_TRUE(fires("low-resolution", "unknowns", found(scene.beads(0.3)).findings));
}

TEST_F(FindingsInSpace, name_a_force_that_nothing_balances) {
  scene.spots.pop_back();
  const Problem problem = scene.problem(scene.beads(kSigma_um), parameters);
  EXPECT_TRUE(fires("tractions-out-of-balance", noticed_imbalance(balance_of(problem, found(problem)))));
}

/// Forces that the gel's model has wrong by its error need not be wrong alike: their sum is off, and nothing is out of
/// balance.
TEST_F(FindingsInSpace, are_none_of_a_balance_that_the_error_of_the_gel_disturbs) {
  constexpr double kError = 0.01, kSmall_um = 0.0003;
  for (const bool is_balanced : {true, false}) {
    if (!is_balanced) scene.spots[1].force_nN.x *= 0.8;
    Problem problem = scene.problem(scene.beads(kSmall_um), parameters);
    const std::vector<Vec3> vertices = problem.vertices_um();
    for (std::size_t v = 0; v < vertices.size(); ++v)
      if (vertices[v].x < 0) problem.response_um_per_kPa.middleCols<3>(3 * static_cast<Eigen::Index>(v)) *= 1 + kError;
    problem.model_error = kError;
    EXPECT_EQ(fires("tractions-out-of-balance", noticed_imbalance(balance_of(problem, found(problem)))), !is_balanced);
    if (!is_balanced) continue;
    SpatialReconstruction r = found(problem);
    problem.model_error = 0;  // the same tractions: the sum is off by more than their own errors say
    EXPECT_TRUE(fires("tractions-out-of-balance", noticed_imbalance(balance_of(problem, r))));
  }
}

TEST_F(FindingsInSpace, name_a_patch_that_is_missing) {
  traction.method = tractions::TractionMethod::patches;
  scene.spots.push_back({{0, 12}, 4, {0, -40, 0}});
  const std::vector<BeadInSpace> beads = scene.beads(kSigma_um);
  for (const bool is_missing : {false, true}) {
    if (is_missing) scene.spots.pop_back();
    const SpatialInputs inputs{{}, scene.gel, scene.adhesions(), {}};
    for (const double background : {0.1, 0.0}) {
      parameters.background = background;
      const auto r = reconstruct(scene.problem(beads, parameters), inputs, traction, parameters, 1);
      EXPECT_EQ(fires("misfit-near-adhesions", "What patches leave", r.findings), is_missing) << background;
    }
  }
}

double figure_of(const SpatialReconstruction& r, const std::string& name) {
  const auto at = std::ranges::find_if(r.figures, [&](const auto& f) { return f.first == name; });
  return at == r.figures.end() ? NAN : std::get<double>(at->second);
}

/// A force that raises the squares of the misfit by less than a tenth mostly has directions in which it is seen.
TEST_F(FindingsInSpace, name_a_weak_patch_that_is_missing_by_what_its_beads_do_together) {
  traction.method = tractions::TractionMethod::patches;
  parameters.background = 0;
  constexpr int kDraws = 16;
  constexpr double kForce_nN = 20;
  std::vector<double> without;
  int n_told = 0, n_by_squares = 0;
  for (scene.seed = 1; scene.seed <= kDraws; ++scene.seed) {
    const auto found_with = [&](const std::vector<BeadInSpace>& beads) {
      return reconstruct(scene.problem(beads, parameters), {{}, scene.gel, scene.adhesions(), {}}, traction, parameters,
                         1);
    };
    const auto whole = found_with(scene.beads(kSigma_um));
    EXPECT_FALSE(fires("misfit-near-adhesions", "What patches leave", whole.findings)) << scene.seed;
    without.push_back(figure_of(whole, "tractions_beside_patches"));
    scene.spots.push_back({{12, 12}, 4, {0, -kForce_nN, 0}});
    const std::vector<BeadInSpace> beads = scene.beads(kSigma_um);
    scene.spots.pop_back();
    const auto lacks = found_with(beads);
    n_told += fires("misfit-near-adhesions", "What patches leave", lacks.findings) ? 1 : 0;
    n_by_squares += figure_of(lacks, "misfit_of_patches_alone") > 1.1 ? 1 : 0;
  }
  double mean = 0, square = 0;
  for (const double d : without) mean += d / kDraws, square += d * d / kDraws;
  // of 16 normal numbers the mean is known to 0.25, the root mean square to 18 %: three times that
  EXPECT_NEAR(mean, 0, 0.75);
  EXPECT_NEAR(std::sqrt(square), 1, 0.53);
  EXPECT_LT(2 * n_by_squares, n_told);
  EXPECT_GE(n_told, 13);  // 15 are; the deviates scatter by more than one about their mean
}

/// A gel that is wrong by a few per cent leaves what looks like tractions; as far as it says so it is none of them.
TEST_F(FindingsInSpace, are_no_tractions_beside_patches_where_the_gel_says_that_it_is_wrong) {
  traction.method = tractions::TractionMethod::patches;
  parameters.background = 0;
  constexpr double kSmall_um = 0.004;
  const std::vector<BeadInSpace> as_modelled = scene.beads(kSmall_um);
  test::HalfSpaceScene other = scene;
  other.gel.poisson_ratio = 0.4;
  const std::vector<BeadInSpace> beads = other.beads(kSmall_um);  // of the same places and noise
  double off = 0, size = 0;
  for (std::size_t b = 0; b < beads.size(); ++b) {
    const Vec3 d = beads[b].displacement_um - as_modelled[b].displacement_um, u = as_modelled[b].displacement_um;
    off += dot(d, d), size += dot(u, u);
  }
  Problem problem = scene.problem(beads, parameters);
  for (const bool is_said : {false, true}) {
    problem.model_error = is_said ? std::sqrt(off / size) : 0;
    const auto r = reconstruct(problem, {{}, scene.gel, scene.adhesions(), {}}, traction, parameters, 1);
    EXPECT_EQ(fires("misfit-near-adhesions", "What patches leave", r.findings), !is_said);
  }
}

/// Of forces at known places, which all pull inwards.
TEST_F(FindingsInSpace, the_contractile_moment_is_that_of_the_forces_within_its_error) {
  double squares = 0;
  constexpr int kDraws = 8;
  for (scene.seed = 1; scene.seed <= kDraws; ++scene.seed) {
    const Problem problem = scene.problem(scene.beads(kSigma_um), parameters);
    const SpatialReconstruction r = reconstruct_tikhonov(problem, traction, parameters, 1);
    const Balance balance = balance_of(problem, r);
    double exact = 0;
    for (const auto& spot : scene.spots) {
      const Vec3 arm = Vec3{spot.centre_um.x, spot.centre_um.y, 0} - balance.centre_um;
      exact -= dot(arm, spot.force_nN);
    }
    EXPECT_GT(balance.contractile_moment_nN_um, 0);
    squares +=
        std::pow((balance.contractile_moment_nN_um - exact) / balance.contractile_moment_sigma_nN_um, 2) / kDraws;
    SpatialReconstruction outward = r;
    outward.traction_kPa *= -1;
    outward.summands->traction_kPa *= -1;
    EXPECT_NEAR(balance_of(problem, outward).contractile_moment_nN_um, -balance.contractile_moment_nN_um,
                1e-9 * balance.contractile_moment_nN_um);
  }
  // of eight normal numbers the root mean square is known to a quarter; the prior's share of the error is not noise
  EXPECT_LT(std::sqrt(squares), 2);
  EXPECT_GT(std::sqrt(squares), 0.25);
}

TEST_F(InSpace, a_z_that_points_the_other_way_fits_worse) {
  const SpatialInputs inputs{{}, scene.gel, {}, {}};
  std::vector<BeadInSpace> beads = scene.beads(0.02);
  const auto right = reconstruct(scene.problem(beads, parameters), inputs, traction, parameters, 1);
  for (BeadInSpace& bead : beads) bead.displacement_um.z *= -1;
  const auto wrong = reconstruct(scene.problem(beads, parameters), inputs, traction, parameters, 1);
  EXPECT_GT(*right.flipped_z_chi_squared, 10);
  EXPECT_LT(*wrong.flipped_z_chi_squared, -10);
  EXPECT_TRUE(right.remark.empty()) << right.remark;
  EXPECT_TRUE(has_words(wrong.remark, "z_points"));
  EXPECT_FALSE(fires("wrong-orientation", "opposite sign", right.findings));
  EXPECT_TRUE(fires("wrong-orientation", "opposite sign", wrong.findings));
}

/// Nothing is smoothed of a few forces that the beads tell well, so that their errors are those of the noise.
TEST_F(FindingsInSpace, patches_that_are_all_there_is_have_the_errors_of_least_squares) {
  traction.method = tractions::TractionMethod::patches;
  parameters.background = 0;
  constexpr int kDraws = 12;
  double squares = 0;
  for (scene.seed = 1; scene.seed <= kDraws; ++scene.seed) {
    const Problem problem = scene.problem(scene.beads(kSigma_um), parameters);
    const auto r = reconstruct(problem, {{}, scene.gel, scene.adhesions(), {}}, traction, parameters, 1);
    EXPECT_FALSE(fires("low-resolution", "unknowns", r.findings));
    EXPECT_FALSE(fires("misfit", "The tractions leave", r.findings));
    EXPECT_FALSE(r.lambda);
    double left_nN = 0;  // of the map
    for (int v = 0; v < problem.mesh.n_vertices(); ++v)
      if (problem.mesh.quads.points_um[v].x < 0) left_nN += problem.mesh.areas_um2[v] * r.traction_kPa[3 * v];
    EXPECT_NEAR(left_nN, r.forces[0].force_nN.x, 1e-3 * left_nN);
    for (std::size_t s = 0; s < scene.spots.size(); ++s) {
      const Vec3 off = r.forces[s].force_nN - scene.spots[s].force_nN, sigma = r.forces[s].sigma_nN;
      for (const auto& [error, by] : {std::pair{off.x, sigma.x}, {off.y, sigma.y}, {off.z, sigma.z}})
        squares += error * error / (by * by) / (6 * kDraws);
    }
  }
  EXPECT_NEAR(std::sqrt(squares), 1, 0.25) << "of 72 numbers the root mean square is known to 8 %: three times that";
}

/// Whatever the axes: the squared distance in the joint errors is at least that along each direction.
TEST_F(InSpace, an_imbalance_that_one_axis_shows_is_not_hidden_by_the_errors_of_another) {
  const Problem problem = scene.problem(scene.beads(0.03), parameters);
  const auto r = reconstruct_tikhonov(problem, traction, parameters, 1);
  const Balance balance = balance_of(problem, r);
  ASSERT_TRUE(balance.imbalance);
  const auto square = [](double value, double sigma) { return value * value / (sigma * sigma); };
  const double rounding = 1 - 1e-9;
  EXPECT_GE(*balance.imbalance, rounding * square(balance.force_nN.x, balance.force_sigma_nN.x));
  EXPECT_GE(*balance.imbalance, rounding * square(balance.force_nN.y, balance.force_sigma_nN.y));
  EXPECT_GE(*balance.imbalance, rounding * square(balance.force_nN.z, balance.force_sigma_nN.z));
  EXPECT_GE(*balance.imbalance, rounding * square(norm(balance.force_nN), balance.net_force_sigma_nN));
  EXPECT_GE(*balance.imbalance, rounding * square(norm(balance.moment_nN_um), balance.net_moment_sigma_nN_um));
}

}  // namespace
