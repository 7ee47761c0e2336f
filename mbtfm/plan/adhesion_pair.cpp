#include "mbtfm/plan/adhesion_pair.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numbers>

#include "pipeline/numerics/parallel.h"
#include "samples/drawing/random.h"
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

/// Displacement at the patches by a unit force along x, then along y.
Eigen::MatrixXd field_of(const Gel& gel, const substrate::Ellipse& ellipse, const std::vector<Patch>& patches) {
  const greens::HalfSpaceEllipse field(gel, ellipse);
  Eigen::MatrixXd G(2 * static_cast<Eigen::Index>(patches.size()), 2);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const bool is_far = norm(patches[i].at_um - ellipse.centre_um) > 8 * ellipse.semi_major_um;
    const greens::Sym2 g =
        is_far ? field.far_compliance_um_per_nN(patches[i].at_um) : field.compliance_um_per_nN(patches[i].at_um);
    G.middleRows<2>(2 * static_cast<Eigen::Index>(i)) << g.xx, g.xy, g.xy, g.yy;
  }
  return G;
}

/// Places of the single adhesion, in distances of the two: on their line to just beyond either, and beside it, where it
/// goes if no bead is near to say otherwise.
constexpr int kAlong = 19, kAcross = 5, kPlaces = kAlong * kAcross;
Vec2 place_of_one(int k) {
  constexpr double kStep = 1.0 / 16, kAside = 1.0 / 8;  // both adhesions are among the places
  return {kStep * (k % kAlong - kAlong / 2), kAside * (k / kAlong - kAcross / 2)};
}

/// Two adhesions, and all single ones, over the patches around them.
struct PairFields {
  std::vector<Patch> patches;
  /// A row a patch: |u₂|² for forces along x and along y; then for each place of the single one GᵀG (xx, xy, yy) and
  /// Gᵀu₂ (by column).
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> products;
};
constexpr Eigen::Index kOfPair = 2, kOfPlace = 7;

PairFields fields_of(const Gel& given, double area_um2, double distance_um) {
  Gel gel = given;
  gel.youngs_modulus_kPa = 1;
  const double radius_um = std::sqrt(area_um2 / std::numbers::pi);
  const std::vector<Vec2> places = {{-0.5 * distance_um, 0}, {0.5 * distance_um, 0}};
  // far away the two less the best one are a quadrupole, whose squares beyond a radius fall with its fourth power:
  // beyond eight distances lies a thousandth
  const double side_um = 2 * (8 * distance_um + 12 * radius_um);
  PairFields fields;
  divide({0, 0}, side_um, places, radius_um, fields.patches);
  const Eigen::MatrixXd both = field_of(gel, disc(places[0], radius_um), fields.patches) +
                               field_of(gel, disc(places[1], radius_um), fields.patches);
  const auto n = static_cast<Eigen::Index>(fields.patches.size());
  fields.products.resize(n, kOfPair + kPlaces * kOfPlace);
  for (Eigen::Index i = 0; i < n; ++i)
    fields.products.row(i).head<kOfPair>() = both.middleRows<2>(2 * i).colwise().squaredNorm();
  for (int k = 0; k < kPlaces; ++k) {
    const Eigen::MatrixXd one = field_of(gel, disc(distance_um * place_of_one(k), radius_um), fields.patches);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Matrix2d G = one.middleRows<2>(2 * i), GG = G.transpose() * G,
                            Gu = G.transpose() * both.middleRows<2>(2 * i);
      fields.products.row(i).segment<kOfPlace>(kOfPair + k * kOfPlace) << GG(0, 0), GG(0, 1), GG(1, 1), Gu(0, 0),
          Gu(1, 0), Gu(0, 1), Gu(1, 1);
    }
  }
  return fields;
}

/// What the best single force at each place leaves of the fields by forces along the line and across it (columns).
/// @param sums  of the products over beads
Eigen::MatrixX2d left_by_place(const Eigen::RowVectorXd& sums) {
  Eigen::MatrixX2d left(kPlaces, 2);
  for (int k = 0; k < kPlaces; ++k) {
    const Eigen::Matrix<double, 1, kOfPlace> s = sums.segment<kOfPlace>(kOfPair + k * kOfPlace);
    const Eigen::Matrix2d GG{{s[0], s[1]}, {s[1], s[2]}}, Gu{{s[3], s[5]}, {s[4], s[6]}};
    left.row(k) = sums.head<kOfPair>();
    if (GG.determinant() <= 1e-12 * GG.squaredNorm()) continue;  // one bead or none
    left.row(k) -= (Gu.array() * (GG.inverse() * Gu).array()).colwise().sum().matrix();
  }
  return left;
}

/// By how much a parabola through three values at even steps falls below the middle one, the least.
double below_middle(double before, double middle, double after) {
  const double bend = before + after - 2 * middle;
  return bend > 0 ? std::pow(after - before, 2) / (8 * bend) : 0;
}

/// The least of them, between the places, too.
Eigen::Array2d least_left(const Eigen::RowVectorXd& sums) {
  const Eigen::MatrixX2d left = left_by_place(sums);
  Eigen::Array2d least;
  for (int c = 0; c < 2; ++c) {
    Eigen::Index k = 0;
    least[c] = left.col(c).minCoeff(&k);
    const Eigen::Index along = k % kAlong, across = k / kAlong;
    if (along > 0 && along + 1 < kAlong) least[c] -= below_middle(left(k - 1, c), left(k, c), left(k + 1, c));
    if (across > 0 && across + 1 < kAcross)
      least[c] -= below_middle(left(k - kAlong, c), left(k, c), left(k + kAlong, c));
  }
  return least.max(0);
}

/// Of experiments whose beads lie at random: two each, with forces along the line and across it.
std::vector<double> drawn_squares(const PairFields& fields, double beads_per_um2) {
  constexpr int kExperiments = 150;  // the distance that four in five tell is then known to some 4 %
  constexpr double kMany = 10;       // beads far off, where it hardly matters how many there are
  Eigen::RowVectorXd by_many = Eigen::RowVectorXd::Zero(fields.products.cols());
  std::vector<Eigen::Index> few;
  for (std::size_t i = 0; i < fields.patches.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double mean = beads_per_um2 * fields.patches[i].area_um2;
    if (mean < kMany) few.push_back(row);
    if (mean >= kMany) by_many += mean * fields.products.row(row);
  }
  std::vector<double> squares;
  for (std::uint64_t draw = 0; draw < kExperiments; ++draw) {
    drawing::Random random(1, drawing::Stream::beads, draw);
    Eigen::RowVectorXd sums = by_many;
    for (const Eigen::Index row : few) {
      const int n = random.poisson(beads_per_um2 * fields.patches[static_cast<std::size_t>(row)].area_um2);
      if (n > 0) sums += n * fields.products.row(row);
    }
    for (const double left : least_left(sums)) squares.push_back(left);
  }
  return squares;
}

/// Of the standard normal distribution.
double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

double normal_quantile(double chance) {
  return boost::math::quantile(boost::math::normal(), std::clamp(chance, 1e-6, 1 - 1e-6));
}

double chance_to_tell(const std::vector<double>& squares, double factor) {
  double sum = 0;
  for (const double s : squares)
    if (s > 0) sum += normal_cdf((factor * s - kTold) / (2 * std::sqrt(factor * s)));
  return sum / static_cast<double>(squares.size());
}

}  // namespace

SquaresLeft squares_left(const Gel& gel, double area_um2, double distance_um) {
  const PairFields fields = fields_of(gel, area_um2, distance_um);
  Eigen::RowVectorXd sums = Eigen::RowVectorXd::Zero(fields.products.cols());
  for (std::size_t i = 0; i < fields.patches.size(); ++i)
    sums += fields.patches[i].area_um2 * fields.products.row(static_cast<Eigen::Index>(i));
  const Eigen::Array2d left = least_left(sums);
  return {.along_um4 = left[0], .across_um4 = left[1]};
}

PairResolution::PairResolution(const Gel& gel, double area_um2, std::vector<double> beads_per_um2, int threads) {
  constexpr int kDistances = 16;
  const double least_um = 2 * std::sqrt(area_um2 / std::numbers::pi);
  squares_um2_.resize(kDistances);
  for (int k = 0; k < kDistances; ++k)
    distance_um_.push_back(least_um * std::pow(kFarthest_um / least_um, double(k) / (kDistances - 1)));
  numerics::parallel_for(kDistances, threads, [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    const PairFields fields = fields_of(gel, area_um2, distance_um_[i]);
    for (const double density : beads_per_um2) squares_um2_[i].push_back(drawn_squares(fields, density));
  });
}

std::optional<double> PairResolution::least_distance_um(double force_nN, double youngs_modulus_kPa, std::size_t density,
                                                        double noise_um) const {
  const double factor = std::pow(force_nN / (youngs_modulus_kPa * noise_um), 2);
  double before = 0;
  for (std::size_t i = 0; i < distance_um_.size(); ++i) {
    const double chance = chance_to_tell(squares_um2_[i].at(density), factor);
    if (chance >= kChance) {
      if (i == 0) return touching_um();
      // sqrt(lambda') is nearly linear in the distance's logarithm, and so is the normal variable with this chance
      const double low = normal_quantile(before), high = normal_quantile(chance);
      const double share = (normal_quantile(kChance) - low) / (high - low);
      return distance_um_[i - 1] * std::pow(distance_um_[i] / distance_um_[i - 1], share);
    }
    before = chance;
  }
  return std::nullopt;
}

}  // namespace mbtfm::plan
