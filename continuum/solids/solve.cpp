#include "continuum/solids/solve.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"

namespace mbtfm::solids {
namespace {

/// The energy's slope, and the matrix of its second slopes where asked for.
struct Assembled {
  std::vector<double> forces_nN;
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
  Equilibrium(const Body& body, Strain strain) : body_(body), strain_(strain), factor_(body.unknowns->elimination()) {}

  Assembled assemble(const std::vector<Vec2>& u, double share, numerics::BlockMatrix<2>* matrix) const {
    const Mesh& mesh = *body_.mesh;
    const int n = mesh.square.n_nodes();
    Assembled sum;
    sum.forces_nN.assign(2 * mesh.position_um.size(), 0);
    for (int e = 0; e < mesh.n_elements(); ++e) {
      const Equations of_element = equations_of(mesh.square, mesh.positions_of(e), mesh.values_of(u, e),
                                                at_share(body_.solids[mesh.part[e]], share), strain_,
                                                matrix == nullptr ? Wanted::forces : Wanted::stiffness);
      if (!of_element.is_sound) {
        sum.is_sound = false;
        return sum;
      }
      sum.energy_fJ += of_element.energy_fJ;
      const int* nodes = mesh.nodes_of(e);
      for (int k = 0; k < 2 * n; ++k) {
        if (body_.unknowns->is_held(nodes[k / 2], k % 2)) continue;
        sum.forces_nN[2 * static_cast<std::size_t>(nodes[k / 2]) + k % 2] += of_element.forces_nN[k];
        sum.size_nN += std::abs(of_element.forces_nN[k]);
      }
      if (matrix != nullptr) add(of_element.stiffness, nodes, *matrix);
    }
    if (matrix != nullptr) hold(*matrix);
    return sum;
  }

  bool factorise(const numerics::BlockMatrix<2>& matrix) {
    return factor_.factorise(matrix, {.lost_pivot = numerics::LostPivot::fails});
  }

  std::vector<Vec2> step(const std::vector<double>& forces_nN) const {
    const std::vector<int>& place = body_.unknowns->elimination()->place;
    std::vector<double> x(forces_nN.size());
    for (std::size_t k = 0; k < place.size(); ++k)
      for (std::size_t i = 0; i < 2; ++i) x[2 * place[k] + i] = -forces_nN[2 * k + i];
    factor_.solve(x.data(), 1);
    std::vector<Vec2> u(place.size());
    for (std::size_t k = 0; k < place.size(); ++k)
      u[k] = {x[2 * static_cast<std::size_t>(place[k])], x[2 * static_cast<std::size_t>(place[k]) + 1]};
    return u;
  }

 private:
  void add(const Eigen::MatrixXd& stiffness, const int* nodes, numerics::BlockMatrix<2>& matrix) const {
    const int n = body_.mesh->square.n_nodes();
    for (int a = 0; a < n; ++a) {
      for (int b = 0; b < n; ++b) {
        if (nodes[a] < nodes[b]) continue;
        double* block = matrix.block(nodes[a], nodes[b]);
        for (int i = 0; i < 2; ++i) {
          for (int j = 0; j < 2; ++j)
            if (!body_.unknowns->is_held(nodes[a], i) && !body_.unknowns->is_held(nodes[b], j))
              block[2 * i + j] += stiffness(2 * a + i, 2 * b + j);
        }
      }
    }
  }

  /// What is held has an equation of its own: no displacement.
  void hold(numerics::BlockMatrix<2>& matrix) const {
    for (int k = 0; k < body_.unknowns->n_nodes(); ++k) {
      for (int i = 0; i < 2; ++i)
        if (body_.unknowns->is_held(k, i)) matrix.block(k, k)[3 * i] = 1;
    }
  }

  const Body& body_;
  Strain strain_;
  numerics::BlockCholesky<2, double> factor_;
};

std::vector<Vec2> moved(const std::vector<Vec2>& u, double share, const std::vector<Vec2>& step) {
  std::vector<Vec2> sum(u.size());
  for (std::size_t k = 0; k < u.size(); ++k) sum[k] = u[k] + share * step[k];
  return sum;
}

double norm_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum);
}

NotSolved failed(const std::string& reason) { return NotSolved(Report{.reason = reason}); }

void solve_small(Equilibrium& equilibrium, Deformed& deformed) {
  numerics::BlockMatrix<2> matrix = deformed.body.unknowns->matrix();
  std::vector<Vec2>& u = deformed.displacement_um;
  const Assembled at_rest = equilibrium.assemble(u, 1, &matrix);
  if (!equilibrium.factorise(matrix)) throw failed("the stiffness of the body is lost in rounding");
  u = equilibrium.step(at_rest.forces_nN);
  // near Poisson's ratio 1/2 rounding leaves 1e-9 of the forces: one refinement takes it
  const Assembled left = equilibrium.assemble(u, 1, nullptr);
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
    numerics::BlockMatrix<2> matrix = deformed.body.unknowns->matrix();
    const Assembled now = equilibrium.assemble(u, share, &matrix);
    if (!now.is_sound) return false;
    deformed.energy_fJ = now.energy_fJ;
    size_nN = std::max(size_nN, now.size_nN);
    const bool is_last = norm_of(now.forces_nN) <= kSmall * size_nN;
    if (!equilibrium.factorise(matrix)) return false;
    const std::vector<Vec2> change = equilibrium.step(now.forces_nN);
    deformed.iterations += 1;
    if (is_last) {
      u = moved(u, 1, change);
      return true;
    }
    double length = 1;
    std::vector<Vec2> next = moved(u, length, change);
    for (int halving = 0; halving < kMostHalvings; ++halving) {
      const Assembled there = equilibrium.assemble(next, share, nullptr);
      // near the end the energy changes by less than it is rounded, the forces still fall
      if (there.is_sound && (there.energy_fJ < now.energy_fJ || norm_of(there.forces_nN) < norm_of(now.forces_nN)))
        break;
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

}  // namespace

numerics::BlockPattern pattern_of(int n_nodes, const std::vector<int>& nodes, int per_element) {
  std::vector<std::vector<int>> below(n_nodes);
  for (auto of = nodes.begin(); of != nodes.end(); of += per_element)
    for (auto a = of; a != of + per_element; ++a)
      std::copy_if(of, of + per_element, std::back_inserter(below[*a]), [&](int b) { return b >= *a; });
  numerics::BlockPattern pattern{.n = n_nodes, .start = {0}, .row = {}};
  for (std::vector<int>& rows : below) {
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    pattern.row.insert(pattern.row.end(), rows.begin(), rows.end());
    pattern.start.push_back(static_cast<int>(pattern.row.size()));
  }
  return pattern;
}

Unknowns::Unknowns(const Mesh& mesh, const std::function<Held(Vec2 place_um)>& held)
    : pattern_(pattern_of(static_cast<int>(mesh.position_um.size()), mesh.nodes, mesh.square.n_nodes())) {
  double size = 0;
  for (const Vec2 at : mesh.position_um) size = std::max(size, at.x);
  constexpr double kOnAxis = 1e-9;  // of the body, as nodes are joined
  for (const Vec2 at : mesh.position_um) {
    const Held node = held(at);
    held_.push_back(node.along_r || at.x <= kOnAxis * size ? 1 : 0);
    held_.push_back(node.along_z ? 1 : 0);
  }
  elimination_ = std::make_shared<const numerics::Elimination>(pattern_, numerics::Search::quick);
}

numerics::BlockMatrix<2> Unknowns::matrix() const {
  numerics::BlockMatrix<2> matrix;
  static_cast<numerics::BlockPattern&>(matrix) = pattern_;
  matrix.value.assign(4 * pattern_.row.size(), 0);
  return matrix;
}

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
