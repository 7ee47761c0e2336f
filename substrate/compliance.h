/// Surface displacements of an elastic gel under forces spread evenly over ellipses. Linear, so one matrix a cell.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/figures.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/parameters_fwd.h"
#include "substrate/ellipse.h"

namespace mbtfm::substrate {

Ellipse ellipse_of(const Adhesion& adhesion);
std::vector<Ellipse> ellipses_of(const std::vector<Adhesion>& adhesions);

enum class ModelKind {
  half_space,  ///< neither base nor sides
  layer,       ///< the base
  split,       ///< sides, too, by finite elements of what is smooth
  refined,     ///< all, by finite elements refined at the adhesions
  curved,      ///< a surface that is not flat, by finite elements bent onto it
  automatic    ///< the cheapest that has the effects that are on
};
constexpr auto words(ModelKind) { return std::array{"half-space", "layer", "split", "refined", "curved", "auto"}; }
constexpr ModelKind kind_of(GelModel model) {
  return model == GelModel::layer ? ModelKind::layer : ModelKind::half_space;
}

struct SubstrateParameters {
  ModelKind model = ModelKind::automatic;  ///< how, not what
  double displacement_tolerance = 0.02;    ///< a third of the beads' noise in good experiments
  MaterialLaw material = MaterialLaw::linear;
  std::string modulus_profile = {};  ///< empty: youngs_modulus_kPa at every depth

  // split and refined: the block
  double margin_thicknesses = 4;  ///< from the scene to the sides: they change a column by 0.1 % at 4 h, 1 % at 2.5 h
  // split: the grid of the smooth correction
  int cells_per_thickness = 2;  ///< 0.1 % of a column at 2, 0.03 % at 3 (it is smooth over h)

  // refined
  double elements_across_adhesion = 1.4;  ///< square root of its area over their side: 2 % of a column; 1 % at 2
  /// Single: half the memory and time where the last digits do not matter. Unset: by Poisson's ratio.
  std::optional<numerics::Precision> precision = {};
  double growth = 4;  ///< their side over the distance to the adhesion: 2 costs twice and gains 5 %

  std::optional<double> side_distance_um = {};  ///< a gel is centimetres wide: its sides are far away
  double surface_tilt_deg = 0;                  ///< gels are cast level to a fraction of a degree
  double surface_roughness_um = 0;              ///< gels are smooth to tens of nanometres
  std::string cache_folder = {};                ///< empty: factors stay in memory

  bool stress = false;  ///< of the gel's inside, where it is written

  stage::EffectSwitches effects = {};  ///< declared by those who have them

  double memory_limit_GB = 0;  ///< of split and refined; 0: four fifths of what the machine has
};
void declare(stage::ParameterList& list, SubstrateParameters& parameters);

/// A solution inside the gel, on boxes.
struct VolumeField {
  std::vector<std::array<double, 3>> points_um, displacement_um;
  std::vector<int> box_corners;                   ///< 8 points a box: the upper face round, then the lower one
  std::vector<std::array<double, 6>> stress_kPa;  ///< mean over each box: xx, yy, zz, xy, yz, xz; empty: not asked
};

/// What a model of the gel takes into account or answers.
struct Capabilities {
  bool base = false;                 ///< the gel has a thickness
  bool sides = false;                ///< and an edge
  bool grading = false;              ///< its modulus may change with depth
  bool inside = false;               ///< volume()
  bool normal_displacement = false;  ///< of the surface, into the gel
  bool space = false;                ///< forces into the gel, too, and points below its surface
  bool surface = false;              ///< the gel's surface may be curved
  bool large_strain = false;         ///< a Neo-Hookean gel
  bool incompressible = false;       ///< Poisson's ratio 0.5: no formula has the bulk modulus, infinite then
  bool linear = true;                ///< a response is a matrix
};
/// Neither sides nor a shape: what a force does depends on the distance alone.
constexpr bool is_alike_everywhere(const Capabilities& gel) {
  return !gel.sides && !gel.grading && !gel.surface && gel.linear;
}

struct Loads;         // see loads.h
struct Observations;  // see loads.h
class Response;       // see response.h

/// A gel: what its loads displace.
class Substrate {
 public:
  Substrate(SubstrateParameters parameters, const Capabilities& capabilities)
      : parameters_(std::move(parameters)), capabilities_(capabilities) {}
  virtual ~Substrate() = default;

  /// How the observed points answer to the loads: nothing is computed yet. Not to outlive the model.
  /// @throws InvalidData where a point or a load is not finite, is no ellipse or lies outside the model's block;
  ///         UsageError where the model takes no such loads or points; when it computes, NotSolved where the memory
  ///         would not suffice
  virtual std::shared_ptr<const Response> response(const Loads& loads, const Observations& observations) const = 0;
  /// Displacement and, where the parameters ask for it, stress inside the gel.
  /// @throws as response, and UsageError where the model has none
  virtual VolumeField volume(const std::vector<Ellipse>& ellipses, const std::vector<Vec2>& forces_nN) const;
  virtual Capabilities capabilities() const { return capabilities_; }
  /// Relative L2 error of an ellipse's displacements, mean over ellipses, that the calls so far made: as estimated, or
  /// as the model's accuracy was measured. What it leaves out by its capabilities is not in it.
  virtual double stated_error() const { return 0; }
  /// What it took into account.
  virtual std::vector<Effect> effects() const;
  /// Its size, and what the calls so far cost.
  virtual Figures figures() const = 0;

  // For forces along the surface, on ellipses, and points of the surface:

  /// Displacement (um) of each point for a unit force (1 nN) on each ellipse: rows 2i, 2i+1 are x, y at points[i];
  /// columns 2j, 2j+1 are a force along x, y on ellipses[j]. @throws as response
  MatrixXd compliance_um_per_nN(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses) const;
  /// The same for given forces, without forming the matrix.
  /// @throws as response, and InvalidData where a force is not finite or their number differs
  std::vector<Vec2> displacements_um(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                                     const std::vector<Vec2>& forces_nN) const;
  /// Displacement (um) of each point of the surface into the gel. Computed nowhere else. @throws as displacements_um
  std::vector<double> vertical_um(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                                  const std::vector<Vec2>& forces_nN) const;
  /// Whether the parameters ask for it.
  bool has_vertical() const;

 protected:
  SubstrateParameters parameters_;

 private:
  Capabilities capabilities_;
};

}  // namespace mbtfm::substrate
