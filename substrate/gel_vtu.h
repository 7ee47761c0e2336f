/// The gel under given forces, for ParaView.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "substrate/compliance.h"
#include "substrate/loads.h"
#include "substrate/scene.h"

namespace mbtfm::substrate {

inline constexpr int kSurfaceLines = 160;  ///< half a micrometre for a cell of 80

/// A surface that is not flat, and where it is known.
struct SurfaceShape {
  std::function<double(Vec2)> height_um;
  Extent known;
};

/// Write quadrilaterals over the scene, finer where the adhesions are, with `displacement_um` by point and
/// `traction_kPa` by cell (forces of the adhesions that hold its centre, over their areas).
/// @param n_lines  over the longer side of the scene
/// @throws OutputError; InvalidData and NotSolved as Substrate::displacements_um
void write_substrate_vtu(const std::filesystem::path& file, const Substrate& substrate,
                         const std::vector<Ellipse>& ellipses, const std::vector<Vec2>& forces_nN,
                         int n_lines = kSurfaceLines, const std::optional<SurfaceShape>& shape = {});

/// The quads that carry tractions, with `displacement_um` and `traction_kPa` by point.
/// @param traction_kPa  three a vertex
void write_traction_vtu(const std::filesystem::path& file, const Substrate& substrate, const SurfaceMesh& mesh,
                        const VectorXd& traction_kPa, const SurfaceShape& shape);

/// Write the gel's inside: the boxes of `field`, with `displacement_um` by point and `stress_kPa` by box (xx, yy, zz,
/// xy, yz, xz) where it has one. @throws OutputError
void write_volume_vtu(const std::filesystem::path& file, const VolumeField& field);

}  // namespace mbtfm::substrate
