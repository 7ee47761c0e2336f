/// A network of known tensions on a gel with beads: the smallest scene for the tension fit.
#pragma once

#include <Eigen/LU>

#include "mbtfm/inverse/rows.h"
#include "mbtfm/tensions/ensemble.h"
#include "network/cables/cables.h"
#include "network/mesh/mesh.h"
#include "substrate/compliance.h"
#include "substrate/greens/models.h"
#include "tests/support/reference_network.h"

namespace mbtfm::test {

inline const Gel kGel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 60};

struct TensionScene {
  cables::CableNetwork cables;
  Eigen::VectorXd tensions_nN;
  std::vector<int> adhesion_ids;
  std::vector<substrate::Ellipse> ellipses;
  std::vector<Vec2> points_um;  ///< of the beads
  Eigen::MatrixXd compliance_um_per_nN;
  Eigen::VectorXd forces_nN, displacement_um;  ///< true
  double largest_um = 0;                       ///< displacement
  DisplacementField beads;                     ///< measured
  tensions::LinearData data;
};

/// Measure again: Gaussian noise of `noise` largest displacements, and these are stated as the beads' errors.
inline void measure(TensionScene& scene, double noise, unsigned seed) {
  test::Normal normal(seed);
  const double sigma_um = noise * scene.largest_um;
  scene.beads.clear();
  for (std::size_t i = 0; i < scene.points_um.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    const double x = normal(), y = normal();
    scene.beads.push_back(
        {.position_um = scene.points_um[i],
         .displacement_um = {scene.displacement_um[row] + sigma_um * x, scene.displacement_um[row + 1] + sigma_um * y},
         .sigma_um = sigma_um,
         .flag = {}});
  }
  scene.data = tensions::reduce(scene.beads, scene.compliance_um_per_nN);
}

/// The exact displacements for other tensions.
inline void contract(TensionScene& scene, const Eigen::VectorXd& tensions_nN) {
  scene.tensions_nN = tensions_nN;
  const std::vector<double> tensions(tensions_nN.data(), tensions_nN.data() + tensions_nN.size());
  const cables::Equilibrium equilibrium = scene.cables.equilibrium(tensions);
  const Eigen::VectorXd held = scene.cables.adhesion_forces_nN(tensions, equilibrium);
  scene.forces_nN = Eigen::VectorXd::Zero(scene.compliance_um_per_nN.cols());
  for (std::size_t i = 0; i < scene.cables.adhesion_ids().size(); ++i) {
    const auto at = std::find(scene.adhesion_ids.begin(), scene.adhesion_ids.end(), scene.cables.adhesion_ids()[i]) -
                    scene.adhesion_ids.begin();
    scene.forces_nN.segment<2>(2 * at) = held.segment<2>(2 * static_cast<Eigen::Index>(i));
  }
  scene.displacement_um = scene.compliance_um_per_nN * scene.forces_nN;
  scene.largest_um = 0;
  for (Eigen::Index i = 0; i < scene.displacement_um.size(); i += 2)
    scene.largest_um = std::max(scene.largest_um, scene.displacement_um.segment<2>(i).norm());
}

/// On an 8.4 kPa layer; beads evenly at random up to 15 um beyond the adhesions.
inline TensionScene scene_of(const Network& network, const Eigen::VectorXd& tensions_nN,
                             const std::map<int, substrate::Ellipse>& ellipses, int n_beads, unsigned seed) {
  TensionScene scene{.cables = cables::CableNetwork(network),
                     .tensions_nN = {},
                     .adhesion_ids = {},
                     .ellipses = {},
                     .points_um = {},
                     .compliance_um_per_nN = {},
                     .forces_nN = {},
                     .displacement_um = {},
                     .beads = {},
                     .data = {}};
  Vec2 low{1e9, 1e9}, high{-1e9, -1e9};
  for (const auto& [id, ellipse] : ellipses) {
    scene.adhesion_ids.push_back(id);
    scene.ellipses.push_back(ellipse);
    low = {std::min(low.x, ellipse.centre_um.x), std::min(low.y, ellipse.centre_um.y)};
    high = {std::max(high.x, ellipse.centre_um.x), std::max(high.y, ellipse.centre_um.y)};
  }
  std::mt19937_64 random(seed);
  for (int i = 0; i < n_beads; ++i) {
    const double a = std::generate_canonical<double, 53>(random), b = std::generate_canonical<double, 53>(random);
    scene.points_um.push_back({low.x - 15 + a * (high.x - low.x + 30), low.y - 15 + b * (high.y - low.y + 30)});
  }
  scene.compliance_um_per_nN = greens::make_greens(kGel, {.model = substrate::ModelKind::layer}, 2)
                                   ->compliance_um_per_nN(scene.points_um, scene.ellipses);
  contract(scene, tensions_nN);
  return scene;
}

/// Reference network `name`; noise in parts of the largest displacement.
inline TensionScene tension_scene(const std::string& name, int n_beads, double noise, unsigned seed) {
  const ReferenceNetwork reference = reference_network(name);
  std::map<int, substrate::Ellipse> ellipses;
  for (const int id : reference.network.adhesion_id) {
    if (id == 0) continue;
    ellipses[id] = {.centre_um = reference.network.vertices_um[static_cast<std::size_t>(id) - 1],
                    .semi_major_um = 0.5,
                    .semi_minor_um = 0.3,
                    .angle_rad = 0.1 * id};
  }
  const Eigen::VectorXd tensions = Eigen::Map<const Eigen::VectorXd>(
      reference.tensions_nN.data(), static_cast<Eigen::Index>(reference.tensions_nN.size()));
  TensionScene scene = scene_of(reference.network, tensions, ellipses, n_beads, seed);
  measure(scene, noise, seed);
  return scene;
}

/// A straight ventral fibre between two of a cell's adhesions.
inline void add_ventral(Cell& cell, int start_id, int end_id) {
  Fibre f;
  f.fibre_id = static_cast<int>(cell.fibres.size()) + 1;
  f.type = FibreType::ventral;
  f.width_um = 0.6;
  f.mean_intensity = 1;
  f.start_adhesion_id = start_id;
  f.end_adhesion_id = end_id;
  f.points_um = {cell.adhesions[static_cast<std::size_t>(start_id) - 1].position_um,
                 cell.adhesions[static_cast<std::size_t>(end_id) - 1].position_um};
  cell.fibres.push_back(f);
}

/// A round cell with a ring of adhesions at its edge, numbered from +x towards +y, and ventral fibres between them.
inline Cell round_cell(double radius_um, int n_adhesions, std::initializer_list<std::pair<int, int>> ventral = {}) {
  Cell cell;
  for (int i = 0; i < 90; ++i) {
    const double angle = 2 * std::numbers::pi * i / 90;
    cell.outline_um.push_back({30 + (radius_um + 1) * std::cos(angle), 30 + (radius_um + 1) * std::sin(angle)});
  }
  for (int i = 0; i < n_adhesions; ++i) {
    const double angle = 2 * std::numbers::pi * i / n_adhesions;
    Adhesion a;
    a.adhesion_id = i + 1;
    a.position_um = {30 + radius_um * std::cos(angle), 30 + radius_um * std::sin(angle)};
    a.major_axis_um = a.minor_axis_um = 0.8;
    a.area_um2 = std::numbers::pi * 0.16;
    a.mean_intensity = 1;
    cell.adhesions.push_back(a);
  }
  for (const auto& [start, end] : ventral) add_ventral(cell, start, end);
  return cell;
}

/// As the thesis has it: link values along edges only, adhesions at points.
inline mesh::NetworkParameters thesis_network() {
  mesh::NetworkParameters p;
  p.link_weights = mesh::LinkWeights::equal;
  p.link_reach = mesh::LinkReach::neighbours;
  p.adhesion_anchor = mesh::AdhesionAnchor::centre;
  return p;
}

/// @param tensions_nN  the network's, then the fibres'
inline TensionScene scene_of(const Cell& cell, const Eigen::VectorXd& tensions_nN, int n_beads, double noise,
                             unsigned seed, const mesh::NetworkParameters& network = {}) {
  std::map<int, substrate::Ellipse> ellipses;
  for (const Adhesion& a : cell.adhesions) ellipses[a.adhesion_id] = substrate::ellipse_of(a);
  TensionScene scene = scene_of(mesh::generate_network(cell, network).network, tensions_nN, ellipses, n_beads, seed);
  measure(scene, noise, seed);
  return scene;
}

/// Beads of the scene, which may move all alike, too.
inline tensions::LinearData with_motions(const TensionScene& scene, const DisplacementField& beads) {
  const Eigen::MatrixXd motions = inverse::affine_motions(beads);
  return tensions::reduce(beads, substrate::dense_response(scene.compliance_um_per_nN), {}, 1, motions);
}

/// The fit on the scene's own network.
inline tensions::EnsembleFit fit_to(const tensions::LinearData& data, const TensionScene& scene,
                                    const tensions::FitParameters& parameters = {}) {
  std::vector<cables::CableNetwork> networks;
  networks.emplace_back(scene.cables.network(), scene.cables.parameters());
  return tensions::fit_ensemble(networks, data, scene.adhesion_ids, parameters, 2);
}
inline tensions::EnsembleFit fit_own_network(const TensionScene& scene,
                                             const tensions::FitParameters& parameters = {}) {
  return fit_to(scene.data, scene, parameters);
}

using tensions::values_of;

/// Thesis 3.3: 0.06 nN in the network, uniform in [0, 10] nN in the fibres.
inline Eigen::VectorXd thesis_tensions_nN(std::size_t n_fibres, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Eigen::VectorXd tensions(static_cast<Eigen::Index>(n_fibres) + 1);
  tensions[0] = 0.06;
  for (Eigen::Index i = 1; i < tensions.size(); ++i) tensions[i] = 10 * std::generate_canonical<double, 53>(random);
  return tensions;
}

/// Cramér–Rao limit of each tension's standard error at the truth, for the data's noise; the bound t >= 0 aside.
inline Eigen::VectorXd cramer_rao_nN(const TensionScene& scene) {
  const tensions::TensionProblem problem(scene.cables, scene.data.reduced, scene.adhesion_ids);
  const tensions::Trial truth = problem.evaluate(scene.tensions_nN);
  const Eigen::MatrixXd J = problem.jacobian(truth);
  return (J.transpose() * J).inverse().diagonal().cwiseSqrt();
}

}  // namespace mbtfm::test
