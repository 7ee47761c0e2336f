#include "mbtfm/plan/adhesion_pair.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <numbers>

#include "pipeline/numerics/dense.h"
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
constexpr int kMiddle = kPlaces / 2, kFirst = kMiddle - 8, kSecond = kMiddle + 8;  ///< where the two are

/// Two adhesions, and all single ones, at the patches around them.
struct PairFields {
  std::vector<Patch> patches;
  Eigen::MatrixXd fields;    ///< 2·patches × 2·places: displacement by a unit force along x, along y
  Eigen::MatrixXd products;  ///< patches × what has to be summed over beads; by the constants below
};
/// |u₂|² for forces along x and along y, and G₁ᵀG₂ of the two (xx, xy, yx, yy); then for each place of the single one
/// GᵀG (xx, xy, yy) and Gᵀu₂ (by column).
constexpr Eigen::Index kOfPair = 6, kOfPlace = 7;

double radius_of(double area_um2) { return std::sqrt(area_um2 / std::numbers::pi); }

std::vector<Patch> patches_around(double area_um2, double distance_um) {
  const double radius_um = radius_of(area_um2);
  // far away the two less the best one are a quadrupole, whose squares beyond a radius fall with its fourth power:
  // beyond eight distances lies a thousandth
  const double side_um = 2 * (8 * distance_um + 12 * radius_um);
  std::vector<Patch> patches;
  divide({0, 0}, side_um, {{-0.5 * distance_um, 0}, {0.5 * distance_um, 0}}, radius_um, patches);
  return patches;
}

PairFields fields_of(const Gel& given, double area_um2, double distance_um) {
  Gel gel = given;
  gel.youngs_modulus_kPa = 1;
  const double radius_um = radius_of(area_um2);
  PairFields f{.patches = patches_around(area_um2, distance_um), .fields = {}, .products = {}};
  const auto n = static_cast<Eigen::Index>(f.patches.size());
  f.fields.resize(2 * n, 2 * kPlaces);
  for (int k = 0; k < kPlaces; ++k)
    f.fields.middleCols<2>(2 * k) = field_of(gel, disc(distance_um * place_of_one(k), radius_um), f.patches);
  f.products.resize(n, kOfPair + kPlaces * kOfPlace);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto rows = f.fields.middleRows<2>(2 * i);
    const Eigen::Matrix2d first = rows.middleCols<2>(2 * kFirst), second = rows.middleCols<2>(2 * kSecond),
                          both = first + second, crossed = first.transpose() * second;
    f.products.row(i).head<kOfPair>() << both.col(0).squaredNorm(), both.col(1).squaredNorm(), crossed(0, 0),
        crossed(0, 1), crossed(1, 0), crossed(1, 1);
    for (int k = 0; k < kPlaces; ++k) {
      const Eigen::Matrix2d G = rows.middleCols<2>(2 * k), GG = G.transpose() * G, Gu = G.transpose() * both;
      f.products.row(i).segment<kOfPlace>(kOfPair + k * kOfPlace) << GG(0, 0), GG(0, 1), GG(1, 1), Gu(0, 0), Gu(1, 0),
          Gu(0, 1), Gu(1, 1);
    }
  }
  return f;
}

/// Of one set of beads, for forces along the line and across it.
/// @param sums      of the products over beads
/// @param of_noise  Gᵀ times the beads' noise, by place, x and y
std::array<Excess, 2> excess_of(const Eigen::RowVectorXd& sums, const Eigen::RowVectorXd& of_noise) {
  std::array<Excess, 2> both;
  for (Excess& e : both) e.resize(kPlaces, 3);
  const auto square_at = [&](int k) {
    const Eigen::Matrix<double, 1, kOfPlace> s = sums.segment<kOfPlace>(kOfPair + k * kOfPlace);
    return Eigen::Matrix2d{{s[0], s[1]}, {s[1], s[2]}};
  };
  Eigen::Matrix4d of_two;
  of_two << square_at(kFirst), Eigen::Matrix2d{{sums[2], sums[3]}, {sums[4], sums[5]}},
      Eigen::Matrix2d{{sums[2], sums[4]}, {sums[3], sums[5]}}, square_at(kSecond);
  Eigen::Vector4d noise_of_two;
  noise_of_two << of_noise.segment<2>(2 * kFirst).transpose(), of_noise.segment<2>(2 * kSecond).transpose();
  const double explained_by_two =
      noise_of_two.dot(Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix4d>(of_two).solve(noise_of_two));
  for (int k = 0; k < kPlaces; ++k) {
    const Eigen::Matrix2d GG = square_at(k);
    // one bead or none: no single force is found
    const Eigen::Matrix2d inverse = GG.determinant() > 1e-12 * GG.squaredNorm()
                                        ? Eigen::Matrix2d(GG.inverse())
                                        : Eigen::Matrix2d(Eigen::Matrix2d::Zero());
    const Eigen::Vector2d noise = of_noise.segment<2>(2 * k).transpose();
    for (int c = 0; c < 2; ++c) {
      const Eigen::Vector2d Gu = sums.segment<2>(kOfPair + k * kOfPlace + 3 + 2 * c).transpose(), found = inverse * Gu;
      both[static_cast<std::size_t>(c)].row(k) << sums[c] - Gu.dot(found),
          noise_of_two[c] + noise_of_two[2 + c] - found.dot(noise), explained_by_two - noise.dot(inverse * noise);
    }
  }
  return both;
}

/// By how much a parabola through three values at even steps falls below the middle one, the least.
double below_middle(double before, double middle, double after) {
  const double bend = before + after - 2 * middle;
  return bend > 0 ? std::pow(after - before, 2) / (8 * bend) : 0;
}

/// At the best place of the single adhesion, between those of the table, too.
/// @param force  in units of the noise times the modulus
double least_excess(const Excess& e, double force) {
  const Eigen::ArrayXd of = force * force * e.col(0) + 2 * force * e.col(1) + e.col(2);
  Eigen::Index k = 0;
  double least = of.minCoeff(&k);
  const Eigen::Index along = k % kAlong, across = k / kAlong;
  if (along > 0 && along + 1 < kAlong) least -= below_middle(of[k - 1], of[k], of[k + 1]);
  if (across > 0 && across + 1 < kAcross) least -= below_middle(of[k - kAlong], of[k], of[k + kAlong]);
  return least;
}

/// Standard normal numbers, a row an experiment: the same for every distance and density, whose errors by chance are
/// then alike.
Eigen::MatrixXd normal_numbers(int n_experiments, Eigen::Index n) {
  Eigen::MatrixXd z(n_experiments, n);
  for (int k = 0; k < n_experiments; ++k) {
    drawing::Random random(1, drawing::Stream::noise, static_cast<std::uint64_t>(k));
    for (double& component : z.row(k)) component = random.normal();
  }
  return z;
}

/// Of experiments whose beads lie at random: two each, with forces along the line and across it.
/// @param normal  a row an experiment
std::vector<Excess> drawn_excess(const PairFields& f, double beads_per_um2, const Eigen::MatrixXd& normal) {
  constexpr double kMany = 10;  // beads far off, where it hardly matters how many there are
  const auto n = static_cast<Eigen::Index>(f.patches.size());
  Eigen::MatrixXd counts(normal.rows(), n), noise(normal.rows(), 2 * n);
  for (Eigen::Index k = 0; k < counts.rows(); ++k) {
    drawing::Random random(1, drawing::Stream::beads, static_cast<std::uint64_t>(k));
    for (Eigen::Index i = 0; i < n; ++i) {
      const double mean = beads_per_um2 * f.patches[static_cast<std::size_t>(i)].area_um2;
      counts(k, i) = mean < kMany ? random.poisson(mean) : mean;
      noise.block<1, 2>(k, 2 * i) = std::sqrt(counts(k, i)) * normal.block<1, 2>(k, 2 * i);
    }
  }
  const Eigen::MatrixXd sums = numerics::product(counts, f.products), of_noise = numerics::product(noise, f.fields);
  std::vector<Excess> all;
  for (Eigen::Index k = 0; k < counts.rows(); ++k)
    for (Excess& e : excess_of(sums.row(k), of_noise.row(k))) all.push_back(std::move(e));
  return all;
}

double normal_quantile(double chance) { return boost::math::quantile(boost::math::normal(), chance); }

/// Each noise and its opposite are as likely. Neither 0 nor 1, which no number of experiments tells.
double chance_to_tell(const std::vector<Excess>& experiments, double force) {
  double n_told = 0.5;
  for (const Excess& e : experiments)
    for (const double sign : {-1, 1}) n_told += least_excess(e, sign * force) > kTold;
  return n_told / (2 * static_cast<double>(experiments.size()) + 1);
}

}  // namespace

SquaresLeft squares_left(const Gel& gel, double area_um2, double distance_um) {
  const PairFields f = fields_of(gel, area_um2, distance_um);
  Eigen::RowVectorXd sums = Eigen::RowVectorXd::Zero(f.products.cols());
  for (std::size_t i = 0; i < f.patches.size(); ++i)
    sums += f.patches[i].area_um2 * f.products.row(static_cast<Eigen::Index>(i));
  const auto [along, across] = excess_of(sums, Eigen::RowVectorXd::Zero(2 * kPlaces));
  return {.along_um4 = std::max(0.0, least_excess(along, 1)), .across_um4 = std::max(0.0, least_excess(across, 1))};
}

PairResolution::PairResolution(const Gel& gel, double area_um2, std::vector<double> beads_per_um2, int threads) {
  constexpr int kDistances = 16;
  const double least_um = 2 * radius_of(area_um2);
  excess_.resize(kDistances);
  for (int k = 0; k < kDistances; ++k)
    distance_um_.push_back(least_um * std::pow(kFarthest_um / least_um, double(k) / (kDistances - 1)));
  std::size_t n_most = 0;
  for (const double distance_um : distance_um_) n_most = std::max(n_most, patches_around(area_um2, distance_um).size());
  constexpr int kExperiments = 400;  // the distance that four in five tell is then known to some 4 %
  const Eigen::MatrixXd normal = normal_numbers(kExperiments, 2 * static_cast<Eigen::Index>(n_most));
  numerics::parallel_for(kDistances, threads, [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    const PairFields fields = fields_of(gel, area_um2, distance_um_[i]);
    for (const double density : beads_per_um2) excess_[i].push_back(drawn_excess(fields, density, normal));
  });
}

std::optional<double> PairResolution::least_distance_um(double force_nN, double youngs_modulus_kPa, std::size_t density,
                                                        double noise_um) const {
  const double force = force_nN / (youngs_modulus_kPa * noise_um);
  double before = 0;
  for (std::size_t i = 0; i < distance_um_.size(); ++i) {
    const double chance = chance_to_tell(excess_[i].at(density), force);
    if (chance >= kChance) {
      if (i == 0) return touching_um();
      // the square root of the excess is nearly linear in the distance's logarithm, and so is the chance's normal
      // variable
      const double low = normal_quantile(before), high = normal_quantile(chance);
      const double share = (normal_quantile(kChance) - low) / (high - low);
      return distance_um_[i - 1] * std::pow(distance_um_[i] / distance_um_[i - 1], share);
    }
    before = chance;
  }
  return std::nullopt;
}

}  // namespace mbtfm::plan
