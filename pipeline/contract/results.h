/// What is found for a cell: tensions, forces, their errors.
#pragma once

#include <optional>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm {

struct Tension {
  int fibre_id = 0;  ///< 0: the actin network
  double tension_nN = 0;
  std::optional<double> low_nN, high_nN;  ///< 95 % interval
  std::optional<double> sigma_nN{};       ///< standard error
  bool identifiable = true;
};
/// Little more is known of it than that it is small: not identifiable, or its interval is wider than twice itself.
inline bool is_uncertain(const Tension& t) {
  return !t.identifiable || (t.low_nN && t.high_nN && *t.high_nN - *t.low_nN > 2 * t.tension_nN);
}

struct AdhesionForce {
  int adhesion_id = 0;
  Vec2 force_nN;  ///< of the cell on the substrate
  std::optional<double> sigma_nN;
  bool connected = false;                     ///< a segmented fibre ends on it
  std::optional<double> moment_nN_um;         ///< about the adhesion's centre, from +x towards +y
  std::optional<double> low_nN{}, high_nN{};  ///< 95 % interval of the magnitude
};

/// A part of the ground with its traction, or a point with its force over an area of one.
struct GroundPatch {
  Vec2 position_um;
  double area_um2 = 0;
  Vec2 traction_kPa;
  Vec2 displacement_um;  ///< as the model has it: of the gel, or of a sheet on springs
};

/// A straight fibre between two adhesions that would explain more than chance of what the model leaves.
struct MissingFibre {
  int start_adhesion_id = 0, end_adhesion_id = 0;
  double tension_nN = 0;
  double chi_squared_gain = 0;           ///< the other tensions following, in units of the noise
  std::optional<int> beside_fibre_id{};  ///< a segmented fibre that ends beside these adhesions; none: another
};
double sigma_nN(const MissingFibre& fibre);

/// A force that the beads call for away from all adhesions.
struct MissingAdhesion {
  Vec2 position_um;
  Vec2 force_nN;                ///< of the cell on the gel
  double chi_squared_gain = 0;  ///< of two numbers; noise and the model's error counted
};

/// What each source adds to a standard error. In squares they add up.
struct ErrorParts {
  double beads = 0;               ///< noise of the displacements
  double segmentation = 0;        ///< shift, area and angle of the adhesions; free ends of the fibres
  std::optional<double> mesh{};   ///< one network is not another; none: a single mesh shows nothing of it
  double substrate = 0;           ///< discretisation of the gel, or what its model leaves out
  double solver = 0;              ///< where the iterations stopped
  double model = 0;               ///< what the misfit shows besides the beads' noise and the mesh
  std::optional<double> gel{};    ///< modulus, thickness and Poisson's ratio, where their errors are stated
  std::optional<double> place{};  ///< of the cell on the beads, where it was found with the tensions
};
/// The one list of the parts. @param visit  of name and part
template <class Parts, class Visit>
void for_each_part(Parts& p, const Visit& visit) {
  visit("beads", p.beads);
  visit("segmentation", p.segmentation);
  visit("mesh", p.mesh);
  visit("substrate", p.substrate);
  visit("solver", p.solver);
  visit("model", p.model);
  visit("gel", p.gel);
  visit("place", p.place);
}
double total(const ErrorParts& parts);

struct TensionError {
  int fibre_id = 0;  ///< 0: the actin network
  double tension_nN = 0;
  ErrorParts parts_nN;
};
struct ErrorBudget {
  std::vector<TensionError> tensions;
  double total_force_nN = 0;
  ErrorParts total_force_parts_nN;
  struct CutForce {
    double force_nN = 0;
    ErrorParts parts_nN;
  };
  std::optional<CutForce> cut_force;  ///< through the image's cut; none: the image shows the whole cell
};

}  // namespace mbtfm
