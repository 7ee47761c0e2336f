#include "mbtfm/plan/adhesion_pair.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/numerics/parallel.h"
#include "substrate/greens/half_space.h"

namespace mbtfm::plan {

namespace {

/// A piece of the surface.
struct Patch {
  Vec2 at_um;
  double area_um2 = 0;
};

/// Squares that grow with the distance to the nearer of two places: a third of the radius near them.
void divide(const Vec2 centre, double side_um, const std::vector<Vec2>& places, double radius_um,
            std::vector<Patch>& patches) {
  double nearest = 1e300;
  for (const Vec2 p : places) nearest = std::min(nearest, norm(centre - p));
  const double reach = std::max(0.0, nearest - 0.71 * side_um);
  if (side_um <= std::max(radius_um / 3, 0.2 * reach)) {
    patches.push_back({centre, side_um * side_um});
    return;
  }
  for (const double dx : {-0.25, 0.25})
    for (const double dy : {-0.25, 0.25})
      divide(centre + side_um * Vec2{dx, dy}, 0.5 * side_um, places, radius_um, patches);
}

substrate::Ellipse disc(Vec2 centre_um, double radius_um) {
  substrate::Ellipse e;
  e.centre_um = centre_um;
  e.semi_major_um = e.semi_minor_um = radius_um;
  return e;
}

/// Displacement at the patches by a unit force along x, then along y, each times the root of the area.
Eigen::MatrixXd field_of(const Gel& gel, const substrate::Ellipse& ellipse, const std::vector<Patch>& patches) {
  const greens::HalfSpaceEllipse field(gel, ellipse);
  Eigen::MatrixXd G(2 * static_cast<Eigen::Index>(patches.size()), 2);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const bool is_far = norm(patches[i].at_um - ellipse.centre_um) > 8 * ellipse.semi_major_um;
    const greens::Sym2 g =
        is_far ? field.far_compliance_um_per_nN(patches[i].at_um) : field.compliance_um_per_nN(patches[i].at_um);
    G.middleRows<2>(2 * static_cast<Eigen::Index>(i)) << g.xx, g.xy, g.xy, g.yy;
    G.middleRows<2>(2 * static_cast<Eigen::Index>(i)) *= std::sqrt(patches[i].area_um2);
  }
  return G;
}

/// What a single force at this place leaves of both fields (columns), squared.
Eigen::Array2d left_by(const Eigen::MatrixXd& one, const Eigen::MatrixXd& both) {
  const Eigen::MatrixXd force = (one.transpose() * one).ldlt().solve(one.transpose() * both);
  return (both - one * force).colwise().squaredNorm().transpose();
}

}  // namespace

double squares_left_um4(const Gel& given, double area_um2, double distance_um) {
  Gel gel = given;
  gel.youngs_modulus_kPa = 1;
  const double radius_um = std::sqrt(area_um2 / std::numbers::pi);
  const std::vector<Vec2> places = {{-0.5 * distance_um, 0}, {0.5 * distance_um, 0}};
  // far away the two less the best one are a quadrupole, whose squares beyond a radius fall with its fourth power:
  // beyond eight distances lies a thousandth
  const double side_um = 2 * (8 * distance_um + 12 * radius_um);
  std::vector<Patch> patches;
  divide({0, 0}, side_um, places, radius_um, patches);
  const Eigen::MatrixXd both =
      field_of(gel, disc(places[0], radius_um), patches) + field_of(gel, disc(places[1], radius_um), patches);
  // by symmetry the best place is on the line, and on either half of it alike
  constexpr int kPlaces = 12;
  Eigen::Array2d least = Eigen::Array2d::Constant(1e300);
  for (int k = 0; k <= kPlaces; ++k) {
    const Vec2 at{0.55 * distance_um * k / kPlaces, 0};
    least = least.min(left_by(field_of(gel, disc(at, radius_um), patches), both));
  }
  return least.mean();
}

double needed_squares() {
  constexpr double kQuantile = 0.8416212335729143;  // of the normal distribution at kChance
  return std::pow(kQuantile + std::sqrt(kQuantile * kQuantile + kTold), 2);
}

PairResolution::PairResolution(const Gel& gel, double area_um2, int threads) {
  constexpr int kDistances = 16;
  const double least_um = 2 * std::sqrt(area_um2 / std::numbers::pi);
  squares_um4_.resize(kDistances);
  for (int k = 0; k < kDistances; ++k)
    distance_um_.push_back(least_um * std::pow(kFarthest_um / least_um, double(k) / (kDistances - 1)));
  numerics::parallel_for(kDistances, threads, [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    squares_um4_[i] = squares_left_um4(gel, area_um2, distance_um_[i]);
  });
}

std::optional<double> PairResolution::least_distance_um(double force_nN, double youngs_modulus_kPa,
                                                        double beads_per_um2, double noise_um) const {
  const double size = force_nN / (youngs_modulus_kPa * noise_um);
  const double wanted = needed_squares() / (beads_per_um2 * size * size);
  for (std::size_t i = 0; i < distance_um_.size(); ++i) {
    if (squares_um4_[i] < wanted) continue;
    if (i == 0) return touching_um();
    const double share = std::log(wanted / squares_um4_[i - 1]) / std::log(squares_um4_[i] / squares_um4_[i - 1]);
    return distance_um_[i - 1] * std::pow(distance_um_[i] / distance_um_[i - 1], share);
  }
  return std::nullopt;
}

}  // namespace mbtfm::plan
