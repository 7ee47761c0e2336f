/// A sheet at large strains: Green–Lagrange strain and St Venant–Kirchhoff's law, whatever it lies on.
#pragma once

#include <functional>
#include <optional>

#include "continuum/sheet/sheet.h"
#include "pipeline/contract/report.h"

namespace mbtfm::sheet {

struct Stiffness;

/// What contraction pulls at when strains are large.
enum class ContractionMeasure {
  surface_tension,  ///< energy s × deformed area: the pull per length of the deformed edge is s
  second_piola      ///< s is added to the second Piola–Kirchhoff stress
};
constexpr auto words(ContractionMeasure) { return std::array{"surface-tension", "second-piola"}; }

/// Energy, forces and stiffness, with its contraction times a share; springs per area at rest are its own, if any.
class LargeSheet {
 public:
  /// @throws UsageError where the sheet has a line tension: the line's own turn is not followed
  LargeSheet(const Elements& elements, const Sheet& sheet, ContractionMeasure measure);

  /// Infinite where a triangle is turned inside out.
  double energy_fJ(const NodeVectors& u, double share) const;
  /// On the nodes; 0 of what is held.
  NodeVectors left_nN(const NodeVectors& u, double share) const;
  /// Adds the derivative of the forces.
  void add_to(Stiffness& stiffness, const NodeVectors& u, double share) const;
  /// That derivative times a change of u.
  NodeVectors change_nN(const NodeVectors& u, double share, const NodeVectors& change) const;

 private:
  const Elements& elements_;
  const Sheet& sheet_;
  ContractionMeasure measure_;
};

/// A sheet on its ground, with its contraction times a share.
struct LoadedSheet {
  std::function<double(const NodeVectors& u, double share)> energy_fJ;
  std::function<NodeVectors(const NodeVectors& u, double share)> left_nN;
  /// Downhill from u; none where no such direction is found.
  std::function<std::optional<NodeVectors>(const NodeVectors& u, double share, const NodeVectors& left_nN)> move;
  double force_scale_nN = 1;  ///< of the contraction's
};
struct LargeStrain {
  NodeVectors u;
  Report report;
};
/// In load steps that are halved where Newton's method with a line search does not find the equilibrium.
/// @throws NotSolved where the smallest step finds none: the sheet collapses
LargeStrain in_load_steps(const LoadedSheet& sheet, Index n_unknowns);

/// A direction by the factor of a tangent, made definite by shifts. @returns whether it is
bool factorise_shifted(Stiffness& stiffness, int threads);

/// S, of the deformed sheet, at each point of the elements.
std::vector<Tensor> large_tension_at_points(const Elements& elements, const Sheet& sheet, ContractionMeasure measure,
                                            const NodeVectors& u);

}  // namespace mbtfm::sheet
