/// The active cable network (thesis 3.2.3): its equilibrium, the forces on what holds it, and their derivatives.
///
///   U(x) = sum_k share_k [ t_g(k) l_k + EA / (2 l0_k) max(0, l_k − l0_k)² ],   l_k = sqrt(|x_a − x_b|² + eps²)
///
/// Convex in x, so the equilibrium for given tensions is the minimiser of U over the free vertices. (In the code the
/// rest length is smoothed like the length, so that the stretch begins at |x_a − x_b| = l0 exactly.)
/// A tension of zero means its limit from above: if others pull, it counts as 1e-7 of the largest.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "network/contractile.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/contract/network.h"
#include "pipeline/contract/report.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::cables {

enum class Contraction { newton, conjugate_gradient };
constexpr auto words(Contraction) { return std::array{"newton", "conjugate-gradient"}; }

struct CableParameters {
  static constexpr int kNewtonSteps = 500;           ///< ordinary cells take 20 to 40, only fibres pulling some 70
  static constexpr int kConjugateSteps = 1'000'000;  ///< ordinary cells take 7 000 to 200 000
  /// EA: force at 100 % strain beyond the rest length (thesis 3.2.3); 0: cables are never longer than they like
  double axial_stiffness_nN = 50;
  double smoothing = 1e-5;              ///< eps in mean rest lengths: far below what the forces can resolve
  double force_tolerance = 1e-9;        ///< largest net force on a free vertex, relative to the largest tension
  std::optional<int> max_iterations{};  ///< or kNewtonSteps, kConjugateSteps
  Contraction contraction = Contraction::newton;
};
void declare(stage::ParameterList& list, CableParameters& parameters);

struct Equilibrium {
  std::vector<Vec2> positions_um;
  std::vector<Vec2> spans_um;  ///< by link, x_b − x_a: to the last digit even where the cable has collapsed, which the
                               ///< difference of the rounded positions is not; the forces follow from these
  std::vector<double> link_force_nN;  ///< by link; of a collapsed cable anything up to its tension
  std::vector<CableState> link_states;
  double energy_fJ = 0;  ///< nN·um
  Report report;         ///< last_change: the largest net force on a free vertex (nN)
};

/// How sums of the adhesion forces answer to the scene, the tensions held.
struct GeometryGradient {
  Eigen::MatrixXd
      by_held_vertex;       ///< rows 2i, 2i+1: as held_vertices()[i] lies elsewhere, its cables as strained as ever
  Eigen::MatrixXd by_link;  ///< as the link's own tension grows
};

/// A network prepared for many equilibria: numbering of the unknowns and the pattern of the stiffness matrix. Copies
/// share it.
class CableNetwork final : public network::Contractile {
 public:
  /// @throws InvalidData where fewer than two adhesions hold the network, or none besides a cut: its equilibrium is a
  /// point, or pulls on no substrate
  explicit CableNetwork(Network network, CableParameters parameters = {});

  const Network& network() const;
  const CableParameters& parameters() const;
  const std::vector<int>& fibre_ids() const override;
  const std::vector<int>& adhesion_ids() const override;
  bool is_cut() const override;
  /// Vertices that adhesions or the cut hold, in rising order.
  const std::vector<int>& held_vertices() const;

  /// @param tensions_nN  by group, >= 0
  /// Not converged: the report says so, nothing is thrown. A part of the network that nothing holds collapses to a
  /// point; without any tension nothing moves. May be called from several threads at once.
  /// @param start  vertex positions to start from (a previous equilibrium), or empty: the network's own
  /// @param force_tolerance  instead of the parameters'; and without the last step, which leaves nothing but rounding
  /// @throws InvalidData where a tension is negative, not finite or missing
  Equilibrium equilibrium(const std::vector<double>& tensions_nN, const std::vector<Vec2>& start = {},
                          std::optional<double> force_tolerance = {}) const;
  std::shared_ptr<const network::AtRest> at_rest(const Eigen::VectorXd& tensions_nN,
                                                 const network::AtRest* nearby = nullptr,
                                                 std::optional<double> force_tolerance = {}) const override;

  /// Force of the network on each held vertex, by vertex (zero for the free ones).
  std::vector<Vec2> reactions_nN(const std::vector<double>& tensions_nN, const Equilibrium& equilibrium) const;
  /// Force on the substrate by adhesion: (fx, fy) of adhesion_ids()[i] at 2i, 2i+1.
  Eigen::VectorXd adhesion_forces_nN(const std::vector<double>& tensions_nN, const Equilibrium& equilibrium) const;
  /// The part of them that the links of the actin network bring, fibres left out.
  Eigen::VectorXd network_part_nN(const Equilibrium& equilibrium) const;
  /// dR/dt of the adhesion forces: 2·adhesions × groups, by the implicit function theorem (thesis has none):
  /// dR/dt = −(B_x − H_xf H_ff⁻¹ B_f), H = d²U/dx², B = d²U/dx dt. At a tension of zero: the derivative from above;
  /// with all tensions zero: the elastic response of the network at rest.
  /// A column without entries belongs to a group whose tension only takes the place of its cables' stretch.
  Eigen::MatrixXd adhesion_force_derivatives(const std::vector<double>& tensions_nN, const Equilibrium& equilibrium,
                                             int threads = 1) const;
  /// The same by held vertex: rows 2i, 2i+1 are the force on held_vertices()[i]. Moments of an adhesion follow from it.
  Eigen::MatrixXd reaction_derivatives(const std::vector<double>& tensions_nN, const Equilibrium& equilibrium,
                                       int threads = 1) const;

  /// Gradients of the sums weightsᵀ R with respect to what the network was spanned over. @param weights  2·adhesions ×
  /// sums
  GeometryGradient geometry_gradient(const std::vector<double>& tensions_nN, const Equilibrium& equilibrium,
                                     const Eigen::MatrixXd& weights) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// Surface tension of a network whose cables have this tension.
double surface_tension_nN_per_um(const Network& network, const Polygon& outline_um, double tension_nN);

/// Of cables at rest; of another model: std::bad_cast.
const Equilibrium& equilibrium_of(const network::AtRest& cables);

}  // namespace mbtfm::cables
