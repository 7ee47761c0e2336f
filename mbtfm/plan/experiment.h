/// A simulated experiment with the cell of a plan, and what the usual method finds in it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mbtfm/plan/known_cell.h"
#include "mbtfm/plan/plan.h"
#include "mbtfm/plan/scene.h"
#include "samples/drawing/random.h"

namespace mbtfm::plan {

struct BeadsOnGel;

struct Experiment {
  Cell cell;  ///< as segmented
  DisplacementField beads;
};

Gel gel_of(const Scene& scene, const Point& point);

/// Displacements on a gel of another modulus, with noise.
DisplacementField measured(const BeadsOnGel& beads, const Eigen::VectorXd& forces_nN, const Point& point,
                           drawing::Random& random);

/// The cell as a segmentation shows it: each adhesion and each free end of a fibre is off by chance.
Cell as_segmented(Cell cell, const tensions::SegmentationErrors& errors, drawing::Random& random);

/// Beads at other places than the plan's. @param draw  each has its own
Experiment experiment_of(const Scene& scene, const KnownCell& cell, const Point& point, std::uint64_t draw,
                         int threads);

/// Tractions of FTTC, summed up over each adhesion and 1.5 um around it: 2·adhesions.
Eigen::VectorXd fttc_forces_nN(const Scene& scene, const Experiment& experiment, const Point& point, int threads);

/// Appends the magnitudes of the errors along the true forces, one an adhesion.
void add_errors_along(std::vector<double>& errors_nN, const Eigen::VectorXd& found_nN, const Eigen::VectorXd& true_nN);
/// 1.48 times the median magnitude: the standard deviation of a normal variable.
double robust_error(std::vector<double> magnitudes);

}  // namespace mbtfm::plan
