#include "continuum/solids/revolved.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"
#include "pipeline/numerics/memory.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/numerics/quadrature.h"

namespace mbtfm::solids {
namespace {

/// The cube [0, 1]³: a square times a side.
struct Cube {
  struct Point {
    double weight;
    Eigen::MatrixX3d slopes;  ///< by node: along u, v, the angle
    Eigen::VectorXd pressures;
  };
  std::vector<Point> points;
  int n_nodes = 0, n_pressures = 0;
};

Eigen::VectorXd times(const Eigen::VectorXd& of_square, const std::vector<double>& of_side) {
  const Eigen::Map<const Eigen::RowVectorXd> side(of_side.data(), std::ssize(of_side));
  return (of_square * side).reshaped();
}

/// A basis of the polynomials of total degree below the order.
Eigen::VectorXd pressures_at(Vec2 unit, double share, int order) {
  std::vector<double> values;
  for (int i = 0; i < order; ++i) {
    for (int j = 0; i + j < order; ++j)
      for (int k = 0; i + j + k < order; ++k)
        values.push_back(std::pow(2 * unit.x - 1, i) * std::pow(2 * unit.y - 1, j) * std::pow(2 * share - 1, k));
  }
  return Eigen::Map<Eigen::VectorXd>(values.data(), std::ssize(values));
}

/// By node of the cube: along u, v and the angle.
Eigen::MatrixX3d slopes_at(const Square& square, Vec2 unit, double share) {
  const Eigen::MatrixX2d of_square = square.slopes_at(unit);
  const Square::OneSide side = square.along_side(share);
  Eigen::MatrixX3d slopes(of_square.rows() * (square.order() + 1), 3);
  slopes << times(of_square.col(0), side.values), times(of_square.col(1), side.values),
      times(square.shapes_at(unit), side.slopes);
  return slopes;
}

Cube cube_of(const Square& square) {
  const numerics::GaussRule rule = numerics::gauss_legendre(square.order() + Square::kMoreThanOrder);
  const auto at = [&](std::size_t i) { return 0.5 * (1 + rule.nodes[i]); };
  Cube cube{.points = {}, .n_nodes = square.n_nodes() * (square.order() + 1)};
  const std::size_t n = rule.nodes.size();
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t j = 0; j < n; ++j) {
      for (std::size_t i = 0; i < n; ++i)
        cube.points.push_back({rule.weights[i] * rule.weights[j] * rule.weights[k] / 8,
                               slopes_at(square, {at(i), at(j)}, at(k)),
                               pressures_at({at(i), at(j)}, at(k), square.order())});
    }
  }
  cube.n_pressures = static_cast<int>(cube.points.front().pressures.size());
  return cube;
}

/// In the middle between nodes.
struct Middle {
  Eigen::MatrixX3d slopes;
  Eigen::VectorXd pressures;
};
std::vector<Middle> middles_of(const Square& square) {
  const auto at = [&](int i) { return 0.5 * (square.nodes()[i] + square.nodes()[i + 1]); };
  std::vector<Middle> middles;
  for (int k = 0; k < square.order(); ++k) {
    for (int j = 0; j < square.order(); ++j) {
      for (int i = 0; i < square.order(); ++i)
        middles.push_back(
            {slopes_at(square, {at(i), at(j)}, at(k)), pressures_at({at(i), at(j)}, at(k), square.order())});
    }
  }
  return middles;
}

using Values = Eigen::Matrix3Xd;  ///< by node: x, y, z

/// How much wider space is than the cube. (r, z, angle) turn the other way round than (x, y, z).
double widened(const Eigen::Matrix3d& jacobian) { return -jacobian.determinant(); }

Values values_of(const RevolvedMesh& mesh, const std::vector<Vec3>& values, int element) {
  Values of(3, mesh.n_nodes());
  for (int k = 0; k < mesh.n_nodes(); ++k) {
    const Vec3 at = values[mesh.nodes_of(element)[k]];
    of.col(k) << at.x, at.y, at.z;
  }
  return of;
}

/// Slopes of the shapes in space at each point of the rule, times the root of the point's volume.
struct Slopes {
  std::array<Eigen::MatrixXd, 3> along;  ///< point × node
  Eigen::MatrixXd pressures;             ///< point × pressure, times the same root
};
Slopes slopes_of(const Cube& cube, const Values& x) {
  const Eigen::Index n_points = std::ssize(cube.points);
  Slopes slopes;
  for (Eigen::MatrixXd& along : slopes.along) along.resize(n_points, cube.n_nodes);
  slopes.pressures.resize(n_points, cube.n_pressures);
  for (Eigen::Index q = 0; q < n_points; ++q) {
    const Cube::Point& point = cube.points[q];
    const Eigen::Matrix3d jacobian = x * point.slopes;
    const double root = std::sqrt(point.weight * widened(jacobian));
    const Eigen::MatrixX3d in_space = root * point.slopes * jacobian.inverse();
    for (int i = 0; i < 3; ++i) slopes.along[i].row(q) = in_space.col(i);
    slopes.pressures.row(q) = root * point.pressures;
  }
  return slopes;
}

/// The triangle that makes the pressures orthonormal.
Eigen::LLT<Eigen::MatrixXd> mass_of(const Slopes& slopes) {
  return Eigen::LLT<Eigen::MatrixXd>(slopes.pressures.transpose() * slopes.pressures);
}

/// ∫ pressure d shape / d axis, with the pressures orthonormal: n_pressures × 3 nodes.
Eigen::MatrixXd divergence_of(const Slopes& slopes) {
  Eigen::MatrixXd divergence(slopes.pressures.cols(), 3 * slopes.along[0].cols());
  for (int i = 0; i < 3; ++i)
    divergence(Eigen::all, Eigen::seqN(i, slopes.along[0].cols(), 3)) = slopes.pressures.transpose() * slopes.along[i];
  return mass_of(slopes).matrixL().solve(divergence);
}

/// Of row and column 3 k + i: node k, axis i.
Eigen::MatrixXd stiffness_of(const Cube& cube, const Values& x, const Solid& solid) {
  const Slopes slopes = slopes_of(cube, x);
  const double mu = solid.shear_modulus_kPa();
  const Eigen::MatrixXd divergence = divergence_of(slopes);
  Eigen::MatrixXd stiffness(3 * cube.n_nodes, 3 * cube.n_nodes);
  stiffness.noalias() = solid.lame_modulus_kPa() * divergence.transpose() * divergence;
  const auto along = [&](int i) { return Eigen::seqN(i, cube.n_nodes, 3); };
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j <= i; ++j) {
      // 2 mu e:e(v) = mu (grad u : grad v + grad u : (grad v)^T)
      const Eigen::MatrixXd product = mu * slopes.along[j].transpose() * slopes.along[i];
      stiffness(along(i), along(j)) += product;
      if (i != j) {
        stiffness(along(j), along(i)) += product.transpose();
        continue;
      }
      for (int k = 0; k < 3; ++k) stiffness(along(k), along(k)) += product;
    }
  }
  return stiffness;
}

struct Forces {
  Values nN;
  double energy_fJ = 0;
};
Forces forces_of(const Cube& cube, const Values& x, const Values& u, const Solid& solid) {
  const Slopes slopes = slopes_of(cube, x);
  const Eigen::MatrixXd divergence = divergence_of(slopes);
  const Eigen::VectorXd dilatation = divergence * u.reshaped();
  const double mu = solid.shear_modulus_kPa(), lambda = solid.lame_modulus_kPa();
  // the contraction is a pressure, too: the first of them is 1
  const Eigen::VectorXd ones = slopes.pressures.transpose() * slopes.pressures.col(0);
  const Eigen::VectorXd contraction = solid.contraction_kPa * mass_of(slopes).matrixL().solve(ones);
  Forces forces{.nN = (divergence.transpose() * (lambda * dilatation + contraction)).reshaped(3, cube.n_nodes),
                .energy_fJ = 0.5 * lambda * dilatation.squaredNorm() + contraction.dot(dilatation)};
  for (Eigen::Index q = 0; q < std::ssize(cube.points); ++q) {
    Eigen::MatrixX3d at(cube.n_nodes, 3);
    for (int i = 0; i < 3; ++i) at.col(i) = slopes.along[i].row(q);
    const Eigen::Matrix3d gradient = u * at;  // times the root of the volume
    const Eigen::Matrix3d strain = 0.5 * (gradient + gradient.transpose());
    forces.nN += 2 * mu * strain * at.transpose();
    forces.energy_fJ += mu * strain.squaredNorm();
  }
  return forces;
}

void expect_not_turned_over(const Cube& cube, const RevolvedMesh& mesh) {
  for (int e = 0; e < mesh.n_elements(); ++e) {
    const Values x = values_of(mesh, mesh.position_um, e);
    for (const Cube::Point& point : cube.points) {
      if (!(widened(x * point.slopes) > 0))
        throw InvalidData("the outline of the contact", "a mesh whose elements are not turned over",
                          "an element that is, at the angle " +
                              brief(180 / std::numbers::pi * mesh.sectors.angles[e % mesh.sectors.n()]) + " degrees");
    }
  }
}

/// Places of nodes between the sectors' angles: the last is the first again.
std::vector<double> angles_of_nodes(const std::vector<double>& angles, const std::vector<double>& nodes) {
  std::vector<double> all;
  for (std::size_t s = 0; s + 1 < angles.size(); ++s)
    for (std::size_t k = 0; k + 1 < nodes.size(); ++k)
      all.push_back((1 - nodes[k]) * angles[s] + nodes[k] * angles[s + 1]);
  return all;
}

/// Where a place of the half plane goes.
Vec3 placed(const Contact& contact, const Slab& slab, int part, Vec2 at, double angle) {
  const double a = contact.equal_radius_um(), rim = contact.radius_um_at(angle), side = slab.radius_um;
  const bool is_beside = part == kGel && at.x > a;
  const double r = is_beside ? rim + (at.x - a) * (side - rim) / (side - a) : rim / a * at.x;
  const Vec2 centre = contact.centroid_um();
  return {centre.x + r * std::cos(angle), centre.y + r * std::sin(angle), at.y};
}

/// The stiffness of the whole, factorised; the base is held.
numerics::HeldMatrix<3> factorised(const RevolvedBody& body, const Cube& cube, int threads) {
  const RevolvedMesh& mesh = body.mesh;
  numerics::HeldMatrix<3>::Held held;
  for (const Vec3 at : mesh.position_um) {
    const bool on_base = at.z >= mesh.half_plane.slab.thickness_um * (1 - 1e-12);
    held.push_back({on_base, on_base, on_base});
  }
  numerics::HeldMatrix<3> matrix(static_cast<int>(mesh.position_um.size()), mesh.nodes, mesh.n_nodes(),
                                 std::move(held));
  numerics::expect_room_for({.what = "the stiffness of the cell on its gel",
                             .count = matrix.n_numbers(),
                             .parts = "numbers",
                             .bytes_each = sizeof(double),
                             .remedy = "choose a lower indent.order or indent.towards_rim, or smooth the outline"});
  matrix.set_zero();
  const int n_sectors = mesh.sectors.n();
  for (int e = 0; e < mesh.n_elements(); e += n_sectors) {
    std::vector<Eigen::MatrixXd> around(n_sectors);
    numerics::parallel_for(n_sectors, threads, [&](int s) {
      around[s] = stiffness_of(cube, values_of(mesh, mesh.position_um, e + s), body.solids[mesh.part[e]]);
    });
    for (int s = 0; s < n_sectors; ++s) matrix.add(e + s, around[s]);
  }
  if (!matrix.factorise(0, threads)) throw NotSolved(Report{.reason = "the stiffness of the body is lost in rounding"});
  return matrix;
}

/// Of all elements, or of a part's.
struct TotalForces {
  Eigen::VectorXd nN;  ///< x, y, z of each node in turn
  double energy_fJ = 0;
};
TotalForces total_forces(const RevolvedBody& body, const Cube& cube, int threads, const std::vector<char>& parts) {
  const RevolvedMesh& mesh = body.mesh;
  std::vector<Forces> of(mesh.n_elements());
  numerics::parallel_for(mesh.n_elements(), threads, [&](int e) {
    if (parts[mesh.part[e]] != 0)
      of[e] = forces_of(cube, values_of(mesh, mesh.position_um, e), values_of(mesh, body.displacement_um, e),
                        body.solids[mesh.part[e]]);
  });
  TotalForces sum{.nN = Eigen::VectorXd::Zero(3 * std::ssize(mesh.position_um))};
  for (int e = 0; e < mesh.n_elements(); ++e) {
    sum.energy_fJ += of[e].energy_fJ;
    for (Eigen::Index k = 0; k < of[e].nN.cols(); ++k) sum.nN.segment<3>(3 * mesh.nodes_of(e)[k]) += of[e].nN.col(k);
  }
  return sum;
}

std::vector<Vec3> by_node(const Eigen::VectorXd& values) {
  std::vector<Vec3> vectors;
  for (Eigen::Index k = 0; k < values.size(); k += 3) vectors.push_back({values[k], values[k + 1], values[k + 2]});
  return vectors;
}

}  // namespace

RevolvedMesh revolved_mesh(const Contact& contact, const Sectors& sectors, double height_um, const Slab& slab,
                           const Fineness& fineness) {
  expect_on_slab(contact, slab);
  RevolvedMesh mesh{.half_plane = section_mesh(section_on(contact, height_um), slab, fineness), .sectors = sectors};
  const Mesh& plane = *mesh.half_plane.mesh;
  const std::vector<double> around = angles_of_nodes(sectors.angles, plane.square.nodes());
  const int n_around = static_cast<int>(around.size()), order = plane.square.order();
  std::vector<int> node_at(plane.position_um.size() * around.size(), -1);
  const auto node_of = [&](int in_plane, int part, int turn) {
    const Vec2 at = plane.position_um[in_plane];
    constexpr double kOnAxis = 1e-9;  // of the body, as nodes are joined
    if (at.x <= kOnAxis * slab.radius_um) turn = 0;
    int& node = node_at[static_cast<std::size_t>(in_plane) * around.size() + turn];
    if (node < 0) {
      node = static_cast<int>(mesh.position_um.size());
      mesh.position_um.push_back(placed(contact, slab, part, at, around[turn]));
    }
    return node;
  };
  for (int e = 0; e < plane.n_elements(); ++e) {
    for (int s = 0; s < sectors.n(); ++s) {
      mesh.part.push_back(plane.part[e]);
      for (int w = 0; w <= order; ++w)
        for (int k = 0; k < plane.square.n_nodes(); ++k)
          mesh.nodes.push_back(node_of(plane.nodes_of(e)[k], plane.part[e], (s * order + w) % n_around));
    }
  }
  return mesh;
}

Vec3 RevolvedBody::displacement_um_at(const Mesh::Place& place, int sector, double share) const {
  const Square& square = mesh.half_plane.mesh->square;
  const Eigen::Vector3d u = values_of(mesh, displacement_um, place.element * mesh.sectors.n() + sector) *
                            times(square.shapes_at(place.unit), square.along_side(share).values);
  return {u[0], u[1], u[2]};
}

std::vector<std::array<double, 6>> RevolvedBody::stress_kPa() const {
  const Square& square = mesh.half_plane.mesh->square;
  const Cube cube = cube_of(square);
  const std::vector<Middle> middles = middles_of(square);
  std::vector<std::array<double, 6>> all;
  for (int e = 0; e < mesh.n_elements(); ++e) {
    const Values x = values_of(mesh, mesh.position_um, e), u = values_of(mesh, displacement_um, e);
    const Solid& solid = solids[mesh.part[e]];
    const Slopes slopes = slopes_of(cube, x);
    const Eigen::VectorXd dilatation = mass_of(slopes).matrixU().solve(divergence_of(slopes) * u.reshaped());
    for (const Middle& at : middles) {
      const Eigen::Matrix3d gradient = u * at.slopes * (x * at.slopes).inverse();
      Eigen::Matrix3d stress = solid.shear_modulus_kPa() * (gradient + gradient.transpose());
      stress.diagonal().array() += solid.lame_modulus_kPa() * at.pressures.dot(dilatation) + solid.contraction_kPa;
      all.push_back({stress(0, 0), stress(1, 1), stress(2, 2), stress(0, 1), stress(1, 2), stress(0, 2)});
    }
  }
  return all;
}

std::vector<Vec3> RevolvedBody::forces_nN(int part) const {
  std::vector<char> parts(solids.size(), 0);
  parts[part] = 1;
  return by_node(total_forces(*this, cube_of(mesh.half_plane.mesh->square), 1, parts).nN);
}

RevolvedBody solved(RevolvedMesh mesh, const std::vector<Solid>& solids, int threads) {
  RevolvedBody body{.mesh = std::move(mesh), .solids = solids};
  body.displacement_um.resize(body.mesh.position_um.size());
  const Cube cube = cube_of(body.mesh.half_plane.mesh->square);
  expect_not_turned_over(cube, body.mesh);
  const std::vector<char> all(solids.size(), 1);
  const numerics::HeldMatrix<3> stiffness = factorised(body, cube, threads);
  // near Poisson's ratio 1/2 rounding leaves 1e-9 of the forces: one refinement takes it
  Eigen::VectorXd u = Eigen::VectorXd::Zero(3 * std::ssize(body.displacement_um));
  for (int step = 0; step < 2; ++step) {
    u += stiffness.solve(-total_forces(body, cube, threads, all).nN);
    body.displacement_um = by_node(u);
  }
  body.energy_fJ = total_forces(body, cube, threads, all).energy_fJ;
  return body;
}

}  // namespace mbtfm::solids
