#include "continuum/solids/solve.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"

namespace mbtfm::solids {
namespace {

/// The energy's slope, and the matrix of its second slopes where asked for.
struct Assembled {
  Eigen::VectorXd forces_nN;
  double size_nN = 0;  ///< of the forces of single elements: what the sum is to be compared with
  double energy_fJ = 0;
  bool is_sound = true;
};

/// With a part of the contraction.
Solid at_share(Solid solid, double share) {
  solid.contraction_kPa *= share;
  return solid;
}

class Equilibrium {
 public:
  Equilibrium(const Body& body, Strain strain) : body_(body), strain_(strain), stiffness_(*body.unknowns) {}

  Assembled assemble(const std::vector<Vec2>& u, double share, Wanted wanted) {
    const Mesh& mesh = *body_.mesh;
    Assembled sum;
    sum.forces_nN = Eigen::VectorXd::Zero(2 * std::ssize(mesh.position_um));
    if (wanted == Wanted::stiffness) stiffness_.set_zero();
    for (int e = 0; e < mesh.n_elements(); ++e) {
      const Equations of_element = equations_of(mesh.square, mesh.positions_of(e), mesh.values_of(u, e),
                                                at_share(body_.solids[mesh.part[e]], share), strain_, wanted);
      if (!of_element.is_sound) {
        sum.is_sound = false;
        return sum;
      }
      sum.energy_fJ += of_element.energy_fJ;
      const int* nodes = mesh.nodes_of(e);
      for (int k = 0; k < 2 * mesh.square.n_nodes(); ++k) {
        if (stiffness_.is_held(nodes[k / 2], k % 2)) continue;
        sum.forces_nN[2 * nodes[k / 2] + k % 2] += of_element.forces_nN[k];
        sum.size_nN += std::abs(of_element.forces_nN[k]);
      }
      if (wanted == Wanted::stiffness) stiffness_.add(e, of_element.stiffness);
    }
    return sum;
  }

  bool factorise() { return stiffness_.factorise(); }
  Eigen::VectorXd step(const Eigen::VectorXd& forces_nN) const { return stiffness_.solve(-forces_nN); }

 private:
  const Body& body_;
  Strain strain_;
  numerics::HeldMatrix<2> stiffness_;
};

std::vector<Vec2> moved(std::vector<Vec2> u, double share, const Eigen::VectorXd& step) {
  for (std::size_t k = 0; k < u.size(); ++k) {
    const auto of_node = step.segment<2>(2 * static_cast<Eigen::Index>(k));
    u[k] += share * Vec2{of_node[0], of_node[1]};
  }
  return u;
}

NotSolved failed(const std::string& reason) { return NotSolved(Report{.reason = reason}); }

void solve_small(Equilibrium& equilibrium, Deformed& deformed) {
  std::vector<Vec2>& u = deformed.displacement_um;
  const Assembled at_rest = equilibrium.assemble(u, 1, Wanted::stiffness);
  if (!equilibrium.factorise()) throw failed("the stiffness of the body is lost in rounding");
  u = moved(u, 1, equilibrium.step(at_rest.forces_nN));
  // near Poisson's ratio 1/2 rounding leaves 1e-9 of the forces: one refinement takes it
  const Assembled left = equilibrium.assemble(u, 1, Wanted::forces);
  u = moved(u, 1, equilibrium.step(left.forces_nN));
  deformed.energy_fJ = left.energy_fJ;
}

/// Newton's method with the energy as its guide: each step goes as far as the energy falls.
/// @returns whether it converged
bool converges(Equilibrium& equilibrium, Deformed& deformed, double share) {
  constexpr int kMostSteps = 25, kMostHalvings = 8;
  constexpr double kSmall = 1e-8;  // of the elements' forces on the way: the next step squares it, to rounding
  double size_nN = 0;
  std::vector<Vec2>& u = deformed.displacement_um;
  for (int step = 0; step < kMostSteps; ++step) {
    const Assembled now = equilibrium.assemble(u, share, Wanted::stiffness);
    if (!now.is_sound) return false;
    deformed.energy_fJ = now.energy_fJ;
    size_nN = std::max(size_nN, now.size_nN);
    const bool is_last = now.forces_nN.norm() <= kSmall * size_nN;
    if (!equilibrium.factorise()) return false;
    const Eigen::VectorXd change = equilibrium.step(now.forces_nN);
    deformed.iterations += 1;
    if (is_last) {
      u = moved(u, 1, change);
      return true;
    }
    double length = 1;
    std::vector<Vec2> next = moved(u, length, change);
    for (int halving = 0; halving < kMostHalvings; ++halving) {
      const Assembled there = equilibrium.assemble(next, share, Wanted::forces);
      // near the end the energy changes by less than it is rounded, the forces still fall
      if (there.is_sound && (there.energy_fJ < now.energy_fJ || there.forces_nN.norm() < now.forces_nN.norm())) break;
      length /= 2;
      next = moved(u, length, change);
    }
    u = std::move(next);
  }
  return false;
}

void solve_large(Equilibrium& equilibrium, Deformed& deformed) {
  constexpr double kLeastStep = 1.0 / 64;
  deformed.iterations = 0;
  double share = 0, step = 1;
  while (share < 1) {
    const std::vector<Vec2> before = deformed.displacement_um;
    const double next = std::min(1.0, share + step);
    if (converges(equilibrium, deformed, next)) {
      share = next;
      continue;
    }
    deformed.displacement_um = before;
    step /= 2;
    if (step < kLeastStep)
      throw failed("no equilibrium of large strains was found beyond " + brief(share) +
                   " of the contraction: the body buckles there, or an element is turned inside out");
  }
}

Unknowns::HeldMatrix::Held held_of(const Mesh& mesh, const std::function<Held(Vec2 place_um)>& held) {
  double size = 0;
  for (const Vec2 at : mesh.position_um) size = std::max(size, at.x);
  constexpr double kOnAxis = 1e-9;  // of the body, as nodes are joined
  Unknowns::HeldMatrix::Held by_node;
  for (const Vec2 at : mesh.position_um) {
    const Held node = held(at);
    by_node.push_back({node.along_r || at.x <= kOnAxis * size, node.along_z});
  }
  return by_node;
}

}  // namespace

Unknowns::Unknowns(const Mesh& mesh, const std::function<solids::Held(Vec2 place_um)>& held)
    : HeldMatrix(static_cast<int>(mesh.position_um.size()), mesh.nodes, mesh.square.n_nodes(), held_of(mesh, held)) {}

Nodes Deformed::displacement_of(int element) const { return body.mesh->values_of(displacement_um, element); }

Vec2 Deformed::displacement_um_at(const Mesh::Place& place) const {
  const Eigen::Vector2d u = displacement_of(place.element) * body.mesh->square.shapes_at(place.unit);
  return {u[0], u[1]};
}

Eigen::Vector4d Deformed::stress_kPa_at(const Mesh::Place& place) const {
  return stress_kPa(body.mesh->square, body.mesh->positions_of(place.element), displacement_of(place.element),
                    body.solids[body.mesh->part[place.element]], strain, place.unit);
}

std::vector<Vec2> Deformed::forces_nN(int part) const {
  const Mesh& mesh = *body.mesh;
  std::vector<Vec2> forces(mesh.position_um.size());
  for (int e = 0; e < mesh.n_elements(); ++e) {
    if (part >= 0 && mesh.part[e] != part) continue;
    const Equations of_element = equations_of(mesh.square, mesh.positions_of(e), displacement_of(e),
                                              body.solids[mesh.part[e]], strain, Wanted::forces);
    for (int k = 0; k < mesh.square.n_nodes(); ++k)
      forces[mesh.nodes_of(e)[k]] += {of_element.forces_nN[2 * k], of_element.forces_nN[2 * k + 1]};
  }
  return forces;
}

Deformed solve(const Body& body, Strain strain) {
  Deformed deformed{.body = body,
                    .strain = strain,
                    .displacement_um = std::vector<Vec2>(body.mesh->position_um.size()),
                    .energy_fJ = 0};
  Equilibrium equilibrium(deformed.body, strain);
  if (strain == Strain::small)
    solve_small(equilibrium, deformed);
  else
    solve_large(equilibrium, deformed);
  return deformed;
}

}  // namespace mbtfm::solids
