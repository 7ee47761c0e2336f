#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "substrate/models.h"

namespace mbtfm::substrate {

void declare(ParameterList& list, SubstrateParameters& p) {
  list.table("substrate");
  list.add("model", p.model, "elastic model of the gel", {"half-space", "layer", "split", "refined"});
  list.add("margin_thicknesses", p.margin_thicknesses, Range::between(0.5, 100),
           "split, refined: from the adhesions and beads to the sides of the block, in gel thicknesses");
  list.add("cells_per_thickness", p.cells_per_thickness, Range::between(1, 20),
           "split: cells of the correction's grid over the gel's thickness");
  list.add("element", p.element, "refined: finite element", {"q2-p1disc", "q1-p0"});
  list.add("elements_across_adhesion", p.elements_across_adhesion, Range::between(0.25, 100),
           "refined: square root of an adhesion's area over the side of the elements that carry it");
  list.add("elements_per_adhesion", p.elements_per_adhesion, Range::between(1, 10000),
           "refined: elements that touch each adhesion, at least");
  list.add("growth", p.growth, Range::between(0.1, 10),
           "refined: largest side of an element over its distance to the nearest adhesion");
  list.add("memory_limit_GB", p.memory_limit_GB, Range::not_negative(),
           "split, refined: memory the solution may take (GB); 0: four fifths of the machine's");
}

void check_forces(const std::vector<Ellipse>& ellipses, const std::vector<Vec2>& forces_nN) {
  if (forces_nN.size() != ellipses.size()) {
    throw InvalidData("forces", "one for each of " + std::to_string(ellipses.size()) + " ellipses",
                      std::to_string(forces_nN.size()));
  }
  for (std::size_t j = 0; j < forces_nN.size(); ++j) {
    if (!is_finite(forces_nN[j])) throw InvalidData("force " + std::to_string(j), "finite numbers", "others");
  }
}

std::vector<Vec2> Substrate::displacements_um(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                                              const std::vector<Vec2>& forces_nN) const {
  check_forces(ellipses, forces_nN);
  Eigen::VectorXd forces(2 * static_cast<Eigen::Index>(ellipses.size()));
  for (std::size_t j = 0; j < forces_nN.size(); ++j) {
    forces[2 * j] = forces_nN[j].x;
    forces[2 * j + 1] = forces_nN[j].y;
  }
  constexpr std::size_t kBlock = 2048;  // points at a time: some MB of matrix
  std::vector<Vec2> displacements;
  displacements.reserve(points_um.size());
  for (std::size_t begin = 0; begin < points_um.size(); begin += kBlock) {
    const std::size_t end = std::min(begin + kBlock, points_um.size());
    const std::vector<Vec2> block(points_um.begin() + begin, points_um.begin() + end);
    const Eigen::VectorXd u = compliance_um_per_nN(block, ellipses) * forces;
    for (std::size_t i = 0; i < block.size(); ++i) displacements.push_back({u[2 * i], u[2 * i + 1]});
  }
  return displacements;
}

std::unique_ptr<Substrate> make_from(const std::vector<Model>& table, const Gel& gel,
                                     const SubstrateParameters& parameters, int threads) {
  check(gel);
  std::string names;
  for (const Model& model : table) {
    if (model.name == parameters.model) return model.make(gel, parameters, threads);
    names += (names.empty() ? "" : ", ") + model.name;
  }
  throw UsageError("substrate.model: expected one of " + names + ", found '" + parameters.model + "'");
}

std::unique_ptr<Substrate> make_greens(const Gel& gel, const SubstrateParameters& parameters, int threads) {
  return make_from({{"half-space", make_half_space}, {"layer", make_layer}}, gel, parameters, threads);
}

Effect vertical_displacement_off() {
  return {.name = "vertical displacement",
          .is_on = false,
          .why = "adhesions pull along the surface and beads are seen from above; it does not couple back"};
}

}  // namespace mbtfm::substrate
