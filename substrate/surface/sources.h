/// Surfaces of gels from what a user has of them: a formula, heights, points, a mesh, masks, beads.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/axes.h"
#include "pipeline/stage/stage.h"
#include "substrate/surface/alpha_slices.h"
#include "substrate/surface/mesh.h"
#include "substrate/surface/voxels.h"

namespace mbtfm::surface {

enum class ZeroAt { as_given, mean };
constexpr auto words(ZeroAt) { return std::array{"as-given", "mean"}; }

enum class BeadMethod { likelihood, alpha_shape };
constexpr auto words(BeadMethod) { return std::array{"likelihood", "alpha-shape"}; }

struct Parameters {
  std::string formula = {};
  std::optional<double> low_x_um, low_y_um, high_x_um, high_y_um;
  std::optional<double> spacing_um;
  std::optional<ZPoints> z_points;
  ZeroAt zero_at = ZeroAt::as_given;
  BeadMethod method = BeadMethod::likelihood;
  std::optional<double> sigma_z_um;
  std::optional<double> pixel_size_um, z_unit_um, z_step_um, length_unit_um;
  double largest_hole_um = 5;  ///< about an adhesion
  double slice_um = 0;
  double alpha_radius_um = 0;
  SlicesAlong slices_along = SlicesAlong::kX;
};

void declare(stage::ParameterList& list, Parameters& parameters);

template <class T>
const T& due(const std::optional<T>& value, const std::string& name, const std::string& source) {
  if (value) return *value;
  throw UsageError("expected --" + name + " with --" + source + ": the file does not say");
}

/// +1 where the z of the file points into the gel, else -1. @throws UsageError where nobody said it
double sign_of(const Parameters& parameters, const std::string& source);

struct Rectangle {
  Vec2 low, high;
  bool contains(double x, double y) const { return x >= low.x && x <= high.x && y >= low.y && y <= high.y; }
};
Rectangle rectangle_of(const Parameters& parameters);

/// What a source gives.
struct Made {
  HeightMap map;
  std::string from = {};          ///< "1200 beads, method likelihood"
  std::vector<Vec2> off_um = {};  ///< beads or points off the surface
  double share_off = 0, share_repaired = 0;
  double apart_um = 0;  ///< distance of the beads; 0: made of none
  std::string repaired = {};
  Figures figures = {};
};

/// In the rectangle that is asked for, z into the gel.
struct Places {
  std::vector<Vec3> at_um;
  std::vector<double> sigma_um;  ///< empty: not known
};

/// @throws UsageError where a parameter is missing; InvalidData as the fits do
Made from_formula(const Parameters& parameters);
/// Cut, as coarse as asked for, its holes filled, z into the gel. @param source  its flag. @param from  for people
Made from_heights(HeightMap map, const Parameters& parameters, const std::string& source, std::string from);
Made from_points(const Places& points, const Parameters& parameters);
Made from_mesh(const TriangleMesh& mesh, const Parameters& parameters);
/// @param stack  slices in the order of z into the gel
Made from_masks(const VoxelStack& stack, const Parameters& parameters);
Made from_beads(const Places& beads, const Parameters& parameters);

/// z = 0 where it is asked for. Figures get the mean and the scatter of the heights.
void set_level(Made& made, ZeroAt zero_at);
StageReport report_of(const Made& made, stage::StageContext& context);

}  // namespace mbtfm::surface
