/// Surface displacements of an elastic gel under forces spread evenly over ellipses. Linear, so one matrix a cell.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/contract/parameters.h"
#include "pipeline/contract/report.h"
#include "pipeline/contract/types.h"

namespace mbtfm::substrate {

/// The patch over which a force is spread evenly.
struct Ellipse {
  Vec2 centre_um;
  double semi_major_um = 0;
  double semi_minor_um = 0;
  double angle_rad = 0;  ///< of the major axis, from +x towards +y
};
Ellipse ellipse_of(const Adhesion& adhesion);

struct SubstrateParameters {
  std::string model = "split";  ///< half-space, layer, split or refined
};
void declare(ParameterList& list, SubstrateParameters& parameters);

class Substrate {
 public:
  virtual ~Substrate() = default;
  /// Displacement (um) of each point for a unit force (1 nN) on each ellipse: rows 2i, 2i+1 are x, y at points[i];
  /// columns 2j, 2j+1 are a force along x, y on ellipses[j].
  virtual Eigen::MatrixXd compliance_um_per_nN(const std::vector<Vec2>& points_um,
                                               const std::vector<Ellipse>& ellipses) const = 0;
  /// What it took into account, and its size.
  virtual std::vector<Effect> effects() const = 0;
  virtual Figures figures() const = 0;
};

/// The model named in the parameters. @throws UsageError, InvalidData
std::unique_ptr<Substrate> make_substrate(const Gel& gel, const SubstrateParameters& parameters, int threads);

}  // namespace mbtfm::substrate
