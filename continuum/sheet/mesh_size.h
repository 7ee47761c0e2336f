/// How fine a sheet's triangles must be.
#pragma once

#include "continuum/sheet/forward.h"
#include "pipeline/contract/gel.h"

namespace mbtfm::sheet {

/// Twice the area over the rim: the radius of a disc, the width of a strip.
double narrow_um(const Region& region);

/// On springs: displacements fall as exp(−distance / l) from the edge.
/// @param penetration_um  l = √(M/κ)
TriangleSize size_on_springs(const Region& region, double penetration_um);

/// On a gel: tractions rise as 1/√distance towards the edge.
/// @param can  of the gel: how many patches there may be
TriangleSize size_on_gel(const Region& region, const Material& material, const Gel& gel,
                         std::optional<double> adhesion_nN_per_um3, const substrate::Capabilities& can = {},
                         Strain strain = Strain::small);

/// Of a sheet of any stiffness.
TriangleSize size_for_fit(const Region& region);

/// Of given tractions: as fine as these.
TriangleSize size_for_tractions(const Region& region, const std::vector<GroundPatch>& tractions);

/// With another size at the edge, the rest in proportion.
TriangleSize with_edge(TriangleSize size, double at_curves_um);

}  // namespace mbtfm::sheet
