/// Cells that pull at the gel beside the one that is fitted, in the picture and beyond its border.
#include "mbtfm/fit/ready_cell.h"
#include "mbtfm/tensions/beyond_cut.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/search.h"
#include "samples/drawing/scenario.h"
#include "samples/experiment/experiment.h"
#include "substrate/greens/models.h"
#include "substrate/loads.h"
#include "tests/support/test.h"

namespace mbtfm {
namespace {

using namespace tensions;

drawing::ScenarioParameters small_cell(std::uint64_t seed) {
  drawing::ScenarioParameters p;
  p.seed = seed;
  p.cell.diameter_um = 44, p.cell.n_adhesions = 60;
  p.cell.n_ventral = 4, p.cell.n_dorsal = 2, p.cell.n_arc = 1;
  p.microscope.image_size_px = 580;
  p.beads = 1600;
  p.noise_um = 0.03;
  return p;
}

struct Scene {
  experiment::Experiment experiment;
  Gel gel;
  DisplacementField beads;
  explicit Scene(const drawing::ScenarioParameters& p) : experiment(experiment::simulate(p, 2)), gel(p.gel) {
    beads = experiment.measured;
  }
  LinearData data() const {
    return reduce(beads,
                  greens::make_greens(gel, {.model = substrate::ModelKind::layer}, 2)
                      ->response({substrate::ellipses_of(experiment.cell.adhesions)}, {points_of(beads)})
                      ->kept(),
                  fit::beads_in_region(beads, experiment.cell, {}), 2, affine_motions(beads));
  }
};

/// Of the adhesions' forces, each free, what the beads show of their sum of magnitudes along the true ones.
double along_truth_nN(const Scene& s, const LinearData& data) {
  const VectorXd found = free_forces_nN(data.reduced);
  double sum = 0, length = 0;
  for (std::size_t a = 0; a < s.experiment.forces.size(); ++a) {
    const Vec2 truth = s.experiment.forces[a].force_nN;
    sum += truth.x * found[2 * static_cast<Index>(a)] + truth.y * found[2 * static_cast<Index>(a) + 1];
    length += dot(truth, truth);
  }
  return sum / std::sqrt(length);
}

/// One of four cells that are alone is named by chance in one of 2 500 such tests. Of a cell beyond the border the
/// program asks for a likelihood ratio of 24, whose mean is what no force in view explains of that cell's field, in
/// squares of the noise, less what a field of unknown shape costs: 100 are enough.
TEST(Neighbours, beyond_the_border_are_named_where_they_are_and_not_where_none_is) {
  int n_strong = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    drawing::ScenarioParameters p = small_cell(seed);
    p.noise_um = 0.01;
    const Scene alone(p);
    EXPECT_TRUE(neighbours_beyond_border(alone.data(), alone.experiment.cell, alone.gel).empty()) << seed;
    p.neighbour_x_um = 2, p.neighbour_y_um = -54;
    const Scene beside(p);
    const LinearData data = beside.data();
    VectorXd field(data.displacement_um.size());
    for (std::size_t b = 0; b < beside.beads.size(); ++b) {
      const Vec2 u =
          beside.experiment.displacement[b].displacement_um - alone.experiment.displacement[b].displacement_um;
      field.segment<2>(2 * static_cast<Index>(b)) << u.x, u.y;
    }
    const double stands_out = explained(data, field).floor_squared;
    n_strong += stands_out > 100;
    const auto borders =
        borders_of(neighbours_beyond_border(data, beside.experiment.cell, beside.gel), data.position_um);
    const auto is_named = [&](const char* side) { return std::ranges::find(borders, side) != borders.end(); };
    EXPECT_TRUE(is_named("upper") || stands_out <= 100) << seed << ": " << stands_out;
    EXPECT_FALSE(is_named("lower")) << seed;
  }
  EXPECT_GE(n_strong, 2);
}

/// The places grow with their distance from the beads, and finer ones change nothing: both ways differ by less than a
/// tenth of what the beads' noise makes of the sum.
TEST(Neighbours, far_away_have_few_places_and_more_of_them_change_nothing) {
  drawing::ScenarioParameters p = small_cell(5);
  p.microscope.image_size_px = 900, p.beads = 4000, p.neighbour_x_um = 54;
  Scene s(p);
  s.experiment.cell.neighbours_um = {s.experiment.neighbour->outline_um};
  const DataWithBeyond coarse = with_forces_beyond(s.data(), s.experiment.cell, s.gel);
  const DataWithBeyond fine = with_forces_beyond(s.data(), s.experiment.cell, s.gel, {.finest = 0.5, .growth = 0.5});
  EXPECT_LT(coarse.beyond.n_beneath_neighbours, 100);
  EXPECT_GT(fine.beyond.n_beneath_neighbours, 2 * coarse.beyond.n_beneath_neighbours);
  VectorXd truth(2 * std::ssize(s.experiment.forces));
  for (std::size_t a = 0; a < s.experiment.forces.size(); ++a)
    truth.segment<2>(2 * static_cast<Index>(a)) << s.experiment.forces[a].force_nN.x, s.experiment.forces[a].force_nN.y;
  truth.normalize();
  const double sigma_nN = std::sqrt(truth.dot(solve_normal(coarse.data.reduced, truth).col(0)));
  EXPECT_NEAR(along_truth_nN(s, coarse.data), along_truth_nN(s, fine.data), 0.1 * sigma_nN);
}

TEST(Neighbours, beads_beside_them_are_no_witness_of_rest) {
  drawing::ScenarioParameters p = small_cell(6);
  p.microscope.image_size_px = 900, p.beads = 4000;
  Scene s(p);
  Cell& cell = s.experiment.cell;
  const Vec2 corner{80, 80};
  cell.neighbours_um = {{corner, {90, 80}, {90, 90}, {80, 90}}};
  for (Bead& bead : s.beads)
    if (is_nearer_to_neighbour(cell, bead.position_um)) bead.displacement_um += Vec2{5, 5};
  const LinearData data = s.data();
  const NoiseLevel noise = noise_level(data, free_forces_nN(data.reduced), cell.outline_um, 0);
  // of some 2 000 components a median is known to 2 %, and the forces take 80 of them
  EXPECT_NEAR(noise.sigma_um, s.experiment.noise_um, 0.1 * s.experiment.noise_um);
}

}  // namespace
}  // namespace mbtfm
