/// The cheapest model that is right for a scene to the wanted error.
///
/// Each model leaves something out. What that costs, as a share of the field, follows from dimensionless numbers:
///
/// - `half-space` leaves out the base. Its correction s_0/(2 pi mu h) is largest, and even, near the force (theory,
///   section 2), while the field falls as 1/r. Over a disc of radius R around a force, R >> a, the correction's share
///   of the field's L2 norm is at most 2 s_0 / sqrt((2-nu)² + nu²) · R/h (the field's norm, as sqrt(2 ln(R/a)), being
///   taken as that at R = e^(1/2) a: an upper bound for a scene larger than its adhesions).
/// - `layer` leaves out the sides. Its field falls as exp(-0.739 r/h) or faster, to a side at distance d and back:
///   exp(-1.48 d/h).
/// - `split` takes even gels whose sides are no nearer than two elements of its grid, which is what quadratic elements
///   need to follow the half-space field there; its grid leaves 0.1 % with 2 elements over the thickness, falling as
///   their cube.
/// - `refined` takes all.
#include <algorithm>
#include <cmath>
#include <mutex>

#include "pipeline/contract/csv.h"
#include "substrate/layer.h"
#include "substrate/models.h"
#include "substrate/scene.h"
#include "substrate/stated_error.h"

namespace mbtfm::substrate {
namespace {

struct Choice {
  std::string model, why;
  int cells_per_thickness;
};

/// Cells of the grid of `split` over the thickness that leave no more than the tolerance.
int cells_for(double tolerance) {
  return tolerance == 0 ? 4
                        : std::max(2, static_cast<int>(std::ceil(2 * std::cbrt(kSplitErrorOfTwoCells / tolerance))));
}

double half_space_bias(const Gel& gel, double radius_um) {
  const double nu = gel.poisson_ratio;
  const double s = std::abs(LayerTable(nu).correction(0).s);
  return 2 * s / std::hypot(2 - nu, nu) * radius_um / gel.thickness_um;
}

Choice choice_for(const Gel& gel, const SubstrateParameters& p, double scene_um) {
  const int cells = cells_for(p.displacement_tolerance);
  const auto compared = [&](double bias) {
    return brief(bias) + (bias <= p.displacement_tolerance ? ", within " : ", above ") + "the tolerance of " +
           brief(p.displacement_tolerance);
  };
  if (!p.modulus_profile.empty()) return {"refined", "the modulus changes with depth", cells};
  if (p.side_distance_um) {
    const double sides = *p.side_distance_um / gel.thickness_um;
    const double bias = std::exp(-1.48 * sides);
    const std::string found = "sides at " + brief(sides) + " thicknesses change the field by " + compared(bias);
    if (bias > p.displacement_tolerance) {
      const double elements = sides * cells;
      const bool is_smooth = elements >= 2;
      return {is_smooth ? "split" : "refined",
              found + "; that is " + brief(elements) + " elements of the grid of split, " +
                  (is_smooth ? "enough" : "fewer than the 2 it needs"),
              cells};
    }
  }
  if (p.vertical) return {"split", "the vertical displacement is asked for, on a base", cells};
  const double ratio = scene_um / gel.thickness_um;
  const double bias = half_space_bias(gel, scene_um);
  const std::string found =
      "the base, with a scene " + brief(ratio) + " thicknesses wide, changes the field by " + compared(bias);
  return {bias <= p.displacement_tolerance ? "half-space" : "layer", found + "; the sides are far away", cells};
}

class Automatic final : public Substrate {
 public:
  Automatic(const Gel& gel, const SubstrateParameters& parameters, int threads)
      : gel_(gel), parameters_(parameters), threads_(threads) {}

  Eigen::MatrixXd compliance_um_per_nN(const std::vector<Vec2>& points_um,
                                       const std::vector<Ellipse>& ellipses) const override {
    return model_for(points_um, ellipses).compliance_um_per_nN(points_um, ellipses);
  }
  std::vector<Vec2> displacements_um(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                                     const std::vector<Vec2>& forces_nN) const override {
    return model_for(points_um, ellipses).displacements_um(points_um, ellipses, forces_nN);
  }
  std::vector<double> vertical_um(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                                  const std::vector<Vec2>& forces_nN) const override {
    return model_for(points_um, ellipses).vertical_um(points_um, ellipses, forces_nN);
  }
  bool has_vertical() const override { return parameters_.vertical; }
  VolumeField volume(const std::vector<Ellipse>& ellipses, const std::vector<Vec2>& forces_nN) const override {
    SubstrateParameters parameters = parameters_;
    parameters.model = "refined";  // the one that has an inside
    return make_substrate(gel_, parameters, threads_)->volume(ellipses, forces_nN);
  }
  std::vector<Effect> effects() const override {
    const std::lock_guard lock(mutex_);
    std::vector<Effect> effects = model_ ? model_->effects() : std::vector<Effect>();
    const std::string why = model_ ? choice_.model + ": " + choice_.why + "; the surface is taken as flat" : "no scene";
    effects.insert(effects.begin(), {.name = "choice of the substrate's model", .is_on = true, .why = why});
    return effects;
  }
  Figures figures() const override {
    const std::lock_guard lock(mutex_);
    return model_ ? model_->figures() : Figures{{"substrate_model", "auto"}};
  }

 private:
  /// The first scene decides: later ones of the same gel are answered by the same model.
  const Substrate& model_for(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses) const {
    const std::lock_guard lock(mutex_);
    if (model_) return *model_;
    double scene_um = 0;
    if (!points_um.empty() || !ellipses.empty()) {
      check_points(points_um);
      check(ellipses);
      const Extent extent = extent_of(points_um, ellipses);
      scene_um = norm(extent.high_um - extent.low_um);
    }
    choice_ = choice_for(gel_, parameters_, scene_um);
    SubstrateParameters parameters = parameters_;
    parameters.model = choice_.model;
    parameters.cells_per_thickness = std::max(parameters.cells_per_thickness, choice_.cells_per_thickness);
    model_ = make_substrate(gel_, parameters, threads_);
    return *model_;
  }

  Gel gel_;
  SubstrateParameters parameters_;
  int threads_;
  mutable std::mutex mutex_;  // guards the choice
  mutable Choice choice_;
  mutable std::unique_ptr<Substrate> model_;
};

}  // namespace

std::unique_ptr<Substrate> make_automatic(const Gel& gel, const SubstrateParameters& parameters, int threads) {
  return std::make_unique<Automatic>(gel, parameters, threads);
}

}  // namespace mbtfm::substrate
