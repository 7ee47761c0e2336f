/// A contracting sheet from its outline to tractions and tensions.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "continuum/sheet/bundles.h"
#include "continuum/sheet/elements.h"
#include "continuum/sheet/large_strain.h"
#include "continuum/sheet/on_gel.h"
#include "pipeline/contract/results.h"
#include "pipeline/contract/words.h"
#include "substrate/compliance.h"

namespace mbtfm::sheet {

/// What the sheet lies on.
enum class Ground {
  gel,      ///< bonded, or through the springs of its adhesions
  springs,  ///< each place by itself
  none      ///< tractions are given
};
constexpr auto words(Ground) { return std::array{"gel", "springs", "none"}; }

/// How large strains may be.
enum class Strain { small, large };
constexpr auto words(Strain) { return std::array{"small", "large"}; }

/// Where the sheet contracts.
struct Contraction {
  double nN_per_um = 0;
  std::optional<double> edge_band_um = {};       ///< only so near to the edge; unset: everywhere
  std::function<double(Vec2 place_um)> at = {};  ///< in place of nN_per_um, where it differs
};

struct TautBundle {
  Bundle bundle;
  double tension_nN = 0;
};

struct Scene {
  Region region;
  Material material;
  Contraction contraction;
  double line_tension_nN = 0;
  std::vector<TautBundle> bundles = {};            ///< on a gel, of small strains
  std::optional<double> adhesion_nN_per_um3 = {};  ///< unset: bonded, where there is a gel
  std::vector<Polygon> adhesive_um = {};  ///< the sheet adheres where a place lies in an odd number; none: everywhere
  Strain strain = Strain::small;
  ContractionMeasure measure = ContractionMeasure::surface_tension;
  TriangleSize size;
};

struct Solution {
  std::shared_ptr<const Elements> elements;
  Sheet sheet;
  NodeVectors u;
  std::vector<Tensor> at_points, at_nodes;  ///< S
  std::vector<GroundPatch> patches;         ///< by triangle; of one that does not adhere without traction
  Report report;
  Strain strain = Strain::small;
  std::vector<TautBundle> bundles = {};
  std::vector<double> sigma_by_triangle = {};  ///< of the mean tension (nN/um); empty: not known
  std::optional<Held> gel_held = {};           ///< its compliance; unset: there is no gel
};

/// Contraction at each point of the elements.
std::vector<double> contraction_at_points(const Elements& elements, const Region& region,
                                          const Contraction& contraction);

/// Triangles whose centre lies where the sheet adheres, rising.
std::vector<int> adhering_triangles(const Elements& elements, const std::vector<Polygon>& adhesive_um);

/// @throws InvalidData, NotSolved
Solution solve_on_springs(const Scene& scene, int threads);
/// The same in two steps, to solve for several sheets on one ground.
std::shared_ptr<const Elements> elements_of(const Scene& scene);
Solution solve_on(const OnGel& ground, std::shared_ptr<const Elements> elements, const Scene& scene);
/// @throws InvalidData, NotSolved
Solution solve_on_gel(const Scene& scene, const substrate::Substrate& gel, int threads);

/// What a solution on a gel does to points of its surface.
std::vector<Vec2> displacements_um(const substrate::Substrate& gel, const Solution& solution,
                                   const std::vector<Vec2>& points_um);
/// x and y of each in turn: 2·points.
VectorXd as_vector(const std::vector<Vec2>& displacements_um);
/// A scene on triangles of a share of their size, for sheets of any stiffness and contraction. Triangles fall
/// differently on each mesh, and displacements beside the edge, where tractions are singular, change without order from
/// one to the next.
class FinerMesh {
 public:
  /// @param gel  must outlive it
  FinerMesh(const Scene& scene, double share, const substrate::Substrate& gel, int threads);
  /// 2·points. @param scene  of the same outline and adhesive area, of small strains @throws NotSolved
  VectorXd displacements_um(const Scene& scene, const std::vector<Vec2>& points_um) const;

 private:
  const substrate::Substrate& gel_;
  std::shared_ptr<const Elements> elements_;
  OnGel ground_;
};
/// What errors of the outline's place change of them (2·points × 3), on the same triangles: the rims lie further out by
/// this much, or the sheet further along x, or along y.
/// @param solution  of this scene on a gel
MatrixXd changes_by_outline_um(const Scene& scene, const Solution& solution, const substrate::Substrate& gel,
                               const std::vector<Vec2>& points_um, double error_um, int threads);

/// What must hold of any solution.
struct Balance {
  double total_force_nN = 0;  ///< sum of magnitudes over the patches
  Vec2 net_force_nN;
  double net_torque_nN_um = 0;          ///< about the centre of area
  double largest_torque_nN_um = 0;      ///< sum of distance times magnitude
  double elastic_energy_fJ = 0;         ///< of sheet and ground at small strains: half of the contraction's work
  double ground_energy_fJ = 0;          ///< of the gel, or of the springs: ½ Σ F · u over the patches
  double mean_tension_nN_per_um = 0;    ///< ½ tr S, mean over the area
  double virial_tension_nN_per_um = 0;  ///< −1/(2A) Σ x · F, less Λ × the rim / (2 A) and the same of bundles
  double area_um2 = 0;
};
Balance balance_of(const Solution& solution);

// A sheet on springs: small strains in one solve, large ones by Newton's method.

/// u of a sheet on springs, small strains. @throws NotSolved where nothing holds the sheet
NodeVectors on_springs(const Elements& elements, const Sheet& sheet, int threads);

/// The same at large strains; springs per area at rest. @throws as in_load_steps
LargeStrain on_springs_large(const Elements& elements, const Sheet& sheet, ContractionMeasure measure, int threads);

// A sheet whose outline lies elsewhere, on the same triangles: another mesh would differ by more than the outline
// does.

/// The rims lie further out by this much: the sheet grows, its holes shrink. Inside, nodes follow as those of an
/// elastic sheet whose rims are pulled there.
/// @param n_rims  curves 0 … n_rims − 1 are rims: the outer one, then holes
/// @throws InvalidData where a triangle is turned inside out
Elements with_rims_further_out(const Elements& elements, int n_rims, double outward_um);

}  // namespace mbtfm::sheet
