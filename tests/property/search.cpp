#include "mbtfm/tensions/search.h"

#include "mbtfm/tensions/ensemble.h"
#include "pipeline/numerics/dense.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

using test::TensionScene;

struct FittedToFew {
  TensionScene scene = test::tension_scene("case_21", 200, 0.05, 1);
  EnsembleFit fit;
  FittedToFew() { fit = test::fit_to(test::with_motions(scene, scene.beads), scene, {.loss = Loss::squares}); }
};

TEST(Search, scores_are_those_of_generalised_least_squares_of_all_beads) {
  const FittedToFew f;
  const LinearData& data = f.fit.data;
  const MatrixXd& G = f.scene.compliance_um_per_nN;
  const double variance = 1.7;
  const VectorXd v = VectorXd::LinSpaced(G.cols(), 0.01, 0.2);
  // all beads at once: motions and tensions are free beside the columns
  MatrixXd V = numerics::weighted_outer(G, v);
  V.diagonal() += variance * data.weight_per_um.cwiseAbs2().cwiseInverse();
  const MatrixXd inverse = numerics::inverse_symmetric(V);
  MatrixXd free(G.rows(), 6 + f.fit.tensions.fibre_ids.size());
  free << data.motions.shapes, G * f.fit.meshes.front().force_derivatives;
  std::srand(1);
  const MatrixXd X = 0.1 * MatrixXd::Random(G.rows(), 3);
  const MatrixXd P =
      inverse -
      inverse * free * numerics::shortest_solution(free.transpose() * inverse * free, free.transpose() * inverse);
  const MatrixXd K = variance * X.transpose() * P * X;
  const VectorXd q = std::sqrt(variance) * X.transpose() * P * (data.displacement_um - G * f.fit.forces.nN);

  const Scores found = Left(f.fit, v, variance, 1).scores_of(pattern_of(data, X));
  EXPECT_LE((found.information - K).norm(), 1e-6 * K.norm());
  EXPECT_LE((found.scores - q).norm(), 1e-6 * q.norm());
}

TEST(Search, forces_of_the_adhesions_are_columns_as_others_are) {
  const FittedToFew f;
  const Left left(f.fit);
  const std::vector<Index> components = {4, 5, 11};
  MatrixXd columns(f.scene.compliance_um_per_nN.rows(), 3);
  for (Index k = 0; k < 3; ++k) columns.col(k) = f.scene.compliance_um_per_nN.col(components[k]);
  const Scores as_forces = left.scores_of(components), as_columns = left.scores_of(pattern_of(f.fit.data, columns));
  EXPECT_LE((as_forces.information - as_columns.information).norm(), 1e-6 * as_forces.information.norm());
  EXPECT_LE((as_forces.scores - as_columns.scores).norm(), 1e-6 * as_forces.scores.norm());
}

TEST(Search, the_shadow_of_a_cause_is_none) {
  std::srand(2);
  const MatrixXd directions = MatrixXd::Random(40, 4);
  MatrixXd X(40, 4);
  X << directions.leftCols(2), directions.col(0) + 0.3 * directions.col(2), directions.col(3);
  // the third looks much like the first, the fourth like none
  const VectorXd data = 10 * X.col(0) + 8 * X.col(1);
  const Scores scores{X.transpose() * X, X.transpose() * data};
  EXPECT_GT(log_bayes_factor(spectrum_of(at(scores, {2})), 25), 10);
  EXPECT_EQ(causes_among(scores, {{0}, {1}, {2}, {3}}, {3, 3, 3, 3}, 25), (std::vector<std::size_t>{0, 1}));
}

}  // namespace
}  // namespace mbtfm::tensions
