#include "network/cables/at_rest.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mbtfm::cables {
namespace {

class CableAnswer final : public network::GeometryAnswer {
 public:
  CableAnswer(CableNetwork cables, GeometryGradient gradient)
      : cables_(std::move(cables)), gradient_(std::move(gradient)) {}

  Eigen::VectorXd to_adhesion(int adhesion_id, const std::function<Vec2(Vec2)>& move_um) const override {
    Eigen::VectorXd change = Eigen::VectorXd::Zero(gradient_.by_held_vertex.cols());
    const std::vector<int>& held = cables_.held_vertices();
    for (std::size_t h = 0; h < held.size(); ++h) {
      const auto vertex = static_cast<std::size_t>(held[h]);
      if (cables_.network().adhesion_id[vertex] != adhesion_id) continue;
      const Vec2 moved = move_um(cables_.network().vertices_um[vertex]);
      change += gradient_.by_held_vertex.middleRows<2>(2 * static_cast<Eigen::Index>(h)).transpose() *
                Eigen::Vector2d(moved.x, moved.y);
    }
    return change;
  }

  /// An end further on is a bit more cable with the fibre's tension.
  Eigen::VectorXd variance_of_free_ends(const Eigen::VectorXd& tensions_nN, double error_um) const override {
    const Network& network = cables_.network();
    const std::vector<int>& fibre_ids = cables_.fibre_ids();
    std::vector<std::vector<std::size_t>> links_of(network.vertices_um.size());
    for (std::size_t k = 0; k < network.links.size(); ++k) {
      if (network.links[k].fibre_id == 0) continue;
      links_of[network.links[k].vertex_a].push_back(k);
      links_of[network.links[k].vertex_b].push_back(k);
    }
    Eigen::VectorXd variance = Eigen::VectorXd::Zero(gradient_.by_link.cols());
    for (std::size_t v = 0; v < links_of.size(); ++v) {
      if (links_of[v].size() != 1 || is_held(network, v)) continue;
      const Link& link = network.links[links_of[v].front()];
      const auto group = std::lower_bound(fibre_ids.begin(), fibre_ids.end(), link.fibre_id) - fibre_ids.begin();
      const double longer_by = error_um / link.rest_length_um;
      variance += (longer_by * (link.share * tensions_nN[group]) *
                   gradient_.by_link.row(static_cast<Eigen::Index>(links_of[v].front())))
                      .cwiseAbs2()
                      .transpose();
    }
    return variance;
  }

 private:
  CableNetwork cables_;
  GeometryGradient gradient_;
};

}  // namespace

CablesAtRest::CablesAtRest(CableNetwork cables, std::vector<double> tensions_nN, Equilibrium equilibrium)
    : cables_(std::move(cables)), tensions_nN_(std::move(tensions_nN)), equilibrium_(std::move(equilibrium)) {}

const Report& CablesAtRest::report() const { return equilibrium_.report; }

double CablesAtRest::imbalance_nN() const {
  return equilibrium_.report.last_change * std::sqrt(static_cast<double>(equilibrium_.positions_um.size()));
}

Eigen::VectorXd CablesAtRest::forces_nN() const { return cables_.adhesion_forces_nN(tensions_nN_, equilibrium_); }

Eigen::VectorXd CablesAtRest::network_part_nN() const { return cables_.network_part_nN(equilibrium_); }

Eigen::VectorXd CablesAtRest::torques_nN_um() const {
  const Network& network = cables_.network();
  const std::vector<int>& ids = cables_.adhesion_ids();
  const std::vector<Vec2> reactions = cables_.reactions_nN(tensions_nN_, equilibrium_);
  Eigen::VectorXd torques = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(ids.size()));
  for (std::size_t v = 0; v < reactions.size(); ++v) {
    if (network.adhesion_id[v] == 0) continue;
    torques[std::lower_bound(ids.begin(), ids.end(), network.adhesion_id[v]) - ids.begin()] +=
        cross(network.vertices_um[v], reactions[v]);
  }
  return torques;
}

network::CutReaction CablesAtRest::cut_reaction() const {
  const Network& network = cables_.network();
  network::CutReaction cut;
  if (!cables_.is_cut()) return cut;
  const std::vector<Vec2> reactions = cables_.reactions_nN(tensions_nN_, equilibrium_);
  for (std::size_t v = 0; v < reactions.size(); ++v) {
    if (!network.held_by_cut[v]) continue;
    cut.force_nN += Eigen::Vector2d(reactions[v].x, reactions[v].y);
    cut.torque_nN_um += cross(network.vertices_um[v], reactions[v]);
  }
  return cut;
}

Eigen::MatrixXd CablesAtRest::force_derivatives(int threads) const {
  return cables_.adhesion_force_derivatives(tensions_nN_, equilibrium_, threads);
}

std::unique_ptr<network::GeometryAnswer> CablesAtRest::answer_to_geometry(const Eigen::MatrixXd& weights) const {
  return std::make_unique<CableAnswer>(cables_, cables_.geometry_gradient(tensions_nN_, equilibrium_, weights));
}

std::shared_ptr<const network::AtRest> CableNetwork::at_rest(const Eigen::VectorXd& tensions_nN,
                                                             const network::AtRest* nearby,
                                                             std::optional<double> force_tolerance) const {
  const std::vector<double> tensions(tensions_nN.begin(), tensions_nN.end());
  Equilibrium at =
      equilibrium(tensions, nearby ? equilibrium_of(*nearby).positions_um : std::vector<Vec2>{}, force_tolerance);
  return std::make_shared<CablesAtRest>(*this, tensions, std::move(at));
}

const Equilibrium& equilibrium_of(const network::AtRest& cables) {
  return dynamic_cast<const CablesAtRest&>(cables).equilibrium();
}

}  // namespace mbtfm::cables
