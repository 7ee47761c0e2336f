#include "continuum/sheet/on_springs.h"

#include "continuum/sheet/stiffness.h"
#include "pipeline/contract/errors.h"

namespace mbtfm::sheet {

NodeVectors on_springs(const Elements& elements, const Sheet& sheet, int threads) {
  Stiffness stiffness(elements, sheet.held);
  for (int t = 0; t < elements.n_triangles(); ++t)
    stiffness.add(t, elastic_stiffness(elements, t, sheet.material) +
                         spring_stiffness(elements, t, sheet.spring_nN_per_um3.data() + Elements::kPoints * t));
  if (!stiffness.factorise(0, threads))
    throw NotSolved({.reason = "nothing holds the sheet: its springs have no stiffness"});
  return stiffness.solve(forces_of_contraction_nN(elements, sheet));
}

LargeStrain on_springs_large(const Elements& elements, const Sheet& sheet, ContractionMeasure measure, int threads) {
  const LargeSheet large(elements, sheet, measure);
  Stiffness stiffness(elements, sheet.held);
  const LoadedSheet loaded{
      .energy_fJ = [&](const NodeVectors& u, double share) { return large.energy_fJ(u, share); },
      .left_nN = [&](const NodeVectors& u, double share) { return large.left_nN(u, share); },
      .move = [&](const NodeVectors& u, double share, const NodeVectors& left) -> std::optional<NodeVectors> {
        stiffness.set_zero();
        large.add_to(stiffness, u, share);
        if (!factorise_shifted(stiffness, threads)) return std::nullopt;
        return stiffness.solve(left);
      },
      .force_scale_nN = forces_of_contraction_nN(elements, sheet).norm()};
  return in_load_steps(loaded, 2 * elements.n_nodes());
}

}  // namespace mbtfm::sheet
