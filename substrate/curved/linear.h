/// Small strains: one solution, adapted to its load, with its error.
#pragma once

#include <memory>

#include "pipeline/contract/gel.h"
#include "substrate/curved/space.h"

namespace mbtfm::curved {

/// What acts on a gel; empty: nothing.
struct Loading {
  OfSurface traction_kPa = {};
  OfPlace held_um = {};  ///< displacement of the nodes that are held
};

/// Displacement on a mesh.
struct Field {
  std::shared_ptr<const Block> block;
  std::shared_ptr<const Space> space;
  Vectors at_nodes_um;

  Eigen::Vector3d displacement_um(const Location& location) const;
  Eigen::Matrix3d gradient(const Location& location) const;  ///< [i][j] = d u_i / d x_j
};

/// By cell of a mesh, which must outlive it.
std::function<Eigen::MatrixXd(int cell)> linear_stiffness_of(const Gel& gel, const Mesh& mesh);

/// @throws NotSolved where memory would not suffice
Field solve_linear(const Gel& gel, std::shared_ptr<const Block> block, const Loading& loading,
                   const numerics::FactorOptions& options);

/// By cell: how far the gradient lies from a continuous one made of the means at the nodes, in the L2 norm of the cell,
/// times its side squared: large where the displacement's error comes from. Source: Zienkiewicz, Zhu, IJNME 24 (1987)
/// 337. The power of the side is measured: 1, 2 and 3 leave .15, .12 and .18 % of smooth_wave, .44, .38 and .42 % of
/// sharp_wave (tests/data/reference/curved; Poisson's ratio .4999, some 48 000 unknowns).
std::vector<double> gradient_gaps(const Field& field);

/// What a mesh is adapted to.
struct Adaptivity {
  double tolerance = 0;       ///< of the estimated error, relative, at the points asked; 0: as fine as allowed
  int most_unknowns = 60000;  ///< of the last mesh
};

/// A solution whose mesh follows it.
struct Adapted {
  Field field;
  double estimated_error = 0;  ///< relative L2 error at the points asked
};

/// Solve on meshes that are finer and finer where `gradient_gaps` are large, and once on a mesh of twice the last one's
/// cells, for the error.
/// @param lines  of the first mesh
/// @throws InvalidData as Block and where a point lies outside, NotSolved as solve_linear
Adapted solve_adapted(const Gel& gel, const Shape& shape, const boxes::GridLines& lines, Sides sides,
                      const Loading& loading, const std::vector<Vec3>& points_um, const Adaptivity& adaptivity,
                      const numerics::FactorOptions& options);

/// Layers from 0 to a depth, n of them, each 1.4 times as thick as the one above: of four, the error of a field at
/// depth is a third lower than of even ones (docs/accuracy.md).
std::vector<double> layers_um(double depth_um, int n);

}  // namespace mbtfm::curved
