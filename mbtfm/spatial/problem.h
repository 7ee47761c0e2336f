/// Beads in a gel as the answer to tractions on its surface, as numbers.
#pragma once

#include <memory>
#include <optional>

#include "mbtfm/inverse/rows.h"
#include "mbtfm/inverse/spectrum.h"
#include "mbtfm/spatial/observed.h"
#include "pipeline/contract/effects.h"
#include "pipeline/contract/figures.h"
#include "substrate/compliance.h"
#include "substrate/response.h"

namespace mbtfm::spatial {

/// Up to so many vertices of tractions the matrix of their answers is formed: with twice as many its decomposition
/// takes a minute and a gigabyte.
inline constexpr int kMostVertices = 1100;

/// u = G t + u_0. Tractions are three numbers a vertex; u_0 is zero but about a strained gel.
struct Problem {
  Observed observed;
  Gel gel;
  Ground ground;
  Expected expected;
  TractionMesh mesh;
  MatrixXd response_um_per_kPa = {};  ///< G by row of `observed`; empty where there is only the map
  MatrixXd surface_um_per_kPa = {};   ///< displacement of the vertices; likewise
  std::shared_ptr<const substrate::Substrate> model = {};  ///< of the map
  substrate::LazyResponse map = {};                        ///< to all_observed(); null where there are matrices
  VectorXd offset_um = {}, surface_offset_um = {};         ///< u_0 of beads and vertices; empty: zero
  // where forces on adhesions are asked for:
  MatrixXd patch_response_um_per_nN = {};   ///< to forces spread evenly over them, x, y, z of each in turn
  MatrixXd adhesion_areas_um2 = {};         ///< adhesions × vertices: the area of each, as weights of the vertices
  MatrixXd facet_response_um_per_kPa = {};  ///< to even tractions on the faces, where they are asked for
  MatrixXd common_um = {};                  ///< what all beads may do together, too; no columns: nothing
  double model_error = 0;                   ///< relative, of G, as the gel's model states it
  Figures figures = {};                     ///< of that model

  Index n_unknowns() const { return 3 * Index{mesh.n_vertices()}; }
  std::vector<Vec3> vertices_um() const;
  /// Of tractions, each over the amplitude that is expected where it is: see norm_of().
  MatrixXd norm_um2() const;
  /// What the gel answers to: the beads, then the vertices.
  substrate::Observations all_observed() const;
  /// The rows of `observed`, of those of all_observed().
  MatrixXd at_beads(const MatrixXd& of_all) const;
  /// The displacement that tractions explain: measured less u_0.
  VectorXd displacement_um() const;
  /// Of the vertices.
  VectorXd surface_displacement_um(const VectorXd& traction_kPa) const;
  /// S r, r the rows (um) less the common motion that beads of these weights see in them.
  VectorXd over_errors(const VectorXd& rows_um, const VectorXd& weights_by_row) const;
  /// The same of u − u_0 − G t.
  VectorXd residual(const VectorXd& traction_kPa, const VectorXd& weights_by_row) const;
  /// The same with other answers: G = `matrix`, and u = `displacement_um` under the tractions `about_kPa`.
  Problem with_response(const MatrixXd& matrix, const VectorXd& displaced_um, const VectorXd& about_kPa) const;
  /// The same of some of its beads. @param of_them  what observe() makes of these, in this order
  Problem with_beads(const std::vector<Index>& chosen, Observed of_them) const;
  /// Of a datum, in units of sigma²: one where errors are stated, or what the model's error leaves if that is more.
  double least_variance() const;
  double variance_of_model() const;  ///< what the model's error alone leaves of it
};

/// Of beads and vertices, to tractions at the vertices.
substrate::LazyResponse response_of_vertices(const substrate::Substrate& model, const Problem& problem);

struct Meshing {
  std::optional<double> spacing_um;  ///< unset: by the distance of the beads, or what memory takes
  Refine refine = Refine::none;
  std::optional<TractionMesh> mesh = {};  ///< instead of these
  double grow_um = 0;                     ///< of adhesions
  bool has_patches = false;               ///< forces on adhesions are asked for
  bool has_facets = false;                ///< even tractions on faces are asked for
};

/// Lattice of tractions, mesh of the gel, and the displacement of each bead under each traction.
/// @throws as observe, expected_tractions, make_traction_mesh and Substrate::response; UsageError where a lattice asked
///         for has too many vertices
Problem make_problem(const SpatialInputs& inputs, const SpatialParameters& parameters, const Meshing& meshing,
                     const substrate::SubstrateParameters& gel, int threads);

/// Least squares of the weighed beads over the unknowns of a basis, the common motion found besides.
/// @param response  of the beads to them
inverse::Spectrum spectrum_of(const Problem& problem, const MatrixXd& response, const VectorXd& weights_by_row,
                              double n_data, int threads);

struct SpatialReconstruction;

/// Shift along each axis that the beads have (um) and turn about z (rad), of unit size, as rows of `observed`. A stage
/// that moved between two stacks and a dish that was put back do this to all beads, and where a cell fills the view
/// their tracker cannot distinguish it from what the cell does.
MatrixXd common_motions(const Observed& observed);

/// The beads' rows with weights W S: over their standard errors (S) and by the roots of the loss's weights (W). The
/// common motions and these columns are its blocks.
inverse::Rows rows_of(const Problem& problem, const VectorXd& weights_by_row, const MatrixXd& columns = {});

/// The motion that was found with the tractions, in the order of common_motions().
struct CommonMotionInSpace {
  VectorXd values, sigma;
};
/// None where the problem has no common motions, or the reconstruction no standard errors.
std::optional<CommonMotionInSpace> common_motion_beside(const Problem& problem, const SpatialReconstruction& found);

/// Always on but where it is switched off, as on flat gels, or the method has no place for it.
Effect common_motion_effect(Switch setting, const Problem& problem, const std::optional<CommonMotionInSpace>& found);
Figures figures_of(const CommonMotionInSpace& found);

}  // namespace mbtfm::spatial
