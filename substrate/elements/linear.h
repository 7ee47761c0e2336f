/// Small strains: stiffness by cell.
#pragma once

#include <memory>

#include "pipeline/contract/gel.h"
#include "substrate/elements/space.h"

namespace mbtfm::elements {

/// By cell of a mesh, which must outlive it.
std::function<MatrixXd(int cell)> linear_stiffness_of(const substrate::Material& material, const Mesh& mesh);
/// The same of boxes. Similar ones of one modulus differ by length and modulus alone: each shape is computed once.
std::function<MatrixXd(int cell)> box_stiffness_of(const substrate::Material& material, const BlockMesh& mesh);

/// Layers from 0 to a depth, n of them, each 1.4 times as thick as the one above: of four, the error of a field at
/// depth is a third lower than of even ones (notes/accuracy.md).
std::vector<double> layers_um(double depth_um, int n);

}  // namespace mbtfm::elements
