/// A network of known tensions on a gel with beads: the smallest scene for the tension fit.
#pragma once

#include <random>

#include "mbtfm/tension_problem.h"
#include "substrate/compliance.h"
#include "tests/support/reference_network.h"

namespace mbtfm::test {

struct TensionScene {
  network::CableNetwork cables;
  Eigen::VectorXd tensions_nN;
  std::vector<int> adhesion_ids;
  DisplacementField beads;
  inverse::LinearData data;
  Eigen::VectorXd forces_nN;
};

/// Reference network `name` on an 8.4 kPa layer; noise is Gaussian, in parts of the largest displacement.
inline TensionScene tension_scene(const std::string& name, int n_beads, double noise, unsigned seed) {
  ReferenceNetwork reference = reference_network(name);
  TensionScene scene{.cables = network::CableNetwork(reference.network),
                     .tensions_nN = Eigen::Map<Eigen::VectorXd>(
                         reference.tensions_nN.data(), static_cast<Eigen::Index>(reference.tensions_nN.size())),
                     .adhesion_ids = {},
                     .beads = {},
                     .data = {},
                     .forces_nN = {}};
  scene.adhesion_ids = scene.cables.adhesion_ids();
  std::vector<substrate::Ellipse> ellipses;
  Vec2 low{1e9, 1e9}, high{-1e9, -1e9};
  for (const int id : scene.adhesion_ids) {
    const Vec2 centre = reference.network.vertices_um[id - 1];
    ellipses.push_back({.centre_um = centre, .semi_major_um = 0.5, .semi_minor_um = 0.3, .angle_rad = 0.1 * id});
    low = {std::min(low.x, centre.x), std::min(low.y, centre.y)};
    high = {std::max(high.x, centre.x), std::max(high.y, centre.y)};
  }
  std::mt19937_64 random(seed);
  std::vector<Vec2> points;
  for (int i = 0; i < n_beads; ++i) {
    const double a = std::generate_canonical<double, 53>(random), b = std::generate_canonical<double, 53>(random);
    points.push_back({low.x - 15 + a * (high.x - low.x + 30), low.y - 15 + b * (high.y - low.y + 30)});
  }
  const Gel gel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 60};
  const auto greens = substrate::make_greens(gel, {.model = "layer"}, 2);
  const Eigen::MatrixXd G = greens->compliance_um_per_nN(points, ellipses);
  const network::Equilibrium equilibrium = scene.cables.equilibrium(reference.tensions_nN);
  scene.forces_nN = scene.cables.adhesion_forces_nN(reference.tensions_nN, equilibrium);
  const Eigen::VectorXd u = G * scene.forces_nN;
  double largest_um = 0;
  for (Eigen::Index i = 0; i < u.size(); i += 2) largest_um = std::max(largest_um, u.segment<2>(i).norm());
  const double sigma_um = noise * largest_um;
  std::normal_distribution<double> normal(0, 1);
  for (int i = 0; i < n_beads; ++i) {
    scene.beads.push_back(
        {.position_um = points[i],
         .displacement_um = {u[2 * i] + sigma_um * normal(random), u[2 * i + 1] + sigma_um * normal(random)},
         .sigma_um = sigma_um,
         .flag = {}});
  }
  scene.data = inverse::reduce(scene.beads, G);
  return scene;
}

}  // namespace mbtfm::test
