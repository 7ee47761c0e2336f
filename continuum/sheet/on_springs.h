/// A sheet on springs: small strains in one solve, large ones by Newton's method.
#pragma once

#include "continuum/sheet/sheet.h"
#include "pipeline/contract/report.h"

namespace mbtfm::sheet {

/// u of a sheet on springs, small strains. @throws NotSolved where nothing holds the sheet
NodeVectors on_springs(const Elements& elements, const Sheet& sheet, int threads);

/// What contraction pulls at when strains are large.
enum class ContractionMeasure {
  surface_tension,  ///< energy s × deformed area: the pull per length of the deformed edge is s
  second_piola      ///< s is added to the second Piola–Kirchhoff stress
};
constexpr auto words(ContractionMeasure) { return std::array{"surface-tension", "second-piola"}; }

struct LargeStrain {
  NodeVectors u;
  Report report;
};
/// Green–Lagrange strain and St Venant–Kirchhoff's law; springs per area at rest. In load steps that are halved where
/// Newton's method with a line search does not find the equilibrium.
/// @throws NotSolved where the smallest step finds none: the sheet collapses
LargeStrain on_springs_large(const Elements& elements, const Sheet& sheet, ContractionMeasure measure, int threads);

/// S, of the deformed sheet, at each point of the elements.
std::vector<Tensor> large_tension_at_points(const Elements& elements, const Sheet& sheet, ContractionMeasure measure,
                                            const NodeVectors& u);

}  // namespace mbtfm::sheet
