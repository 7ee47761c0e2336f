#include "samples/plan/adhesion_pair.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <type_traits>
#include <utility>

#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/distributions.h"
#include "pipeline/numerics/parallel.h"
#include "samples/drawing/random.h"
#include "substrate/greens/half_space.h"
#include "substrate/greens/inside.h"

namespace mbtfm::plan {

namespace {

// D = 2: beads at the surface, which move along it. D = 3: beads below it.

/// A piece of the surface, or of the gel.
struct Patch {
  Vec3 at_um;
  double measure = 0;  ///< um², um³
};

/// Squares, or boxes on squares no higher than wide, that grow with the distance to the nearer of two places: a third
/// of the radius near them.
template <int D>
void divide(const Vec3& centre, double side_um, double height_um, const std::vector<Vec2>& places, double radius_um,
            std::vector<Patch>& patches) {
  constexpr double kNear = D == 2 ? 1.0 / 3 : 0.5, kFar = D == 2 ? 0.2 : 0.35;  // boxes are many
  constexpr double kHalfDiagonal = D == 2 ? 0.71 : 0.87;
  double nearest = 1e300;
  for (const Vec2 p : places) nearest = std::min(nearest, norm(centre - Vec3{p.x, p.y, 0}));
  const double reach = std::max(0.0, nearest - kHalfDiagonal * side_um);
  if (side_um <= std::max(kNear * radius_um, kFar * reach)) {
    patches.push_back({centre, D == 2 ? side_um * side_um : side_um * side_um * height_um});
    return;
  }
  const double half_um = 0.5 * side_um;
  const int n_layers = height_um > half_um ? 2 : 1;
  for (const double dx : {-0.25, 0.25})
    for (const double dy : {-0.25, 0.25})
      for (int layer = 0; layer < n_layers; ++layer)
        divide<D>(centre + Vec3{dx * side_um, dy * side_um, height_um * ((layer + 0.5) / n_layers - 0.5)}, half_um,
                  height_um / n_layers, places, radius_um, patches);
}

substrate::Ellipse disc(Vec2 centre_um, double radius_um) {
  substrate::Ellipse e;
  e.centre_um = centre_um;
  e.semi_major_um = e.semi_minor_um = radius_um;
  return e;
}

constexpr double kFarRadii = 8;  // from a disc: it acts like its centre

/// Displacement at the surface by a unit force along x, then along y.
class SurfaceField {
 public:
  SurfaceField(const Gel& gel, const substrate::Ellipse& ellipse, const BeadVolume&)
      : field_(gel, ellipse), at_(ellipse) {}
  Eigen::Matrix2d operator()(const Vec3& place) const {
    const Vec2 point{place.x, place.y};
    const bool is_far = norm(point - at_.centre_um) > kFarRadii * at_.semi_major_um;
    const greens::Sym2 g = is_far ? field_.far_compliance_um_per_nN(point) : field_.compliance_um_per_nN(point);
    return Eigen::Matrix2d{{g.xx, g.xy}, {g.xy, g.yy}};
  }

 private:
  greens::HalfSpaceEllipse field_;
  substrate::Ellipse at_;
};

/// The same below it, along x, y and z. What moves along z counts by its own noise.
class InsideField {
 public:
  InsideField(const Gel& gel, const substrate::Ellipse& ellipse, const BeadVolume& volume)
      : gel_(gel), field_(gel, nullptr, ellipse), at_(ellipse), axial_noise_(volume.axial_noise) {}
  Eigen::Matrix3d operator()(const Vec3& place) const {
    const Vec2 point{place.x, place.y}, away = point - at_.centre_um;
    const bool is_far = norm(Vec3{away.x, away.y, place.z}) > kFarFromFour * at_.semi_major_um;
    Eigen::Matrix3d g = is_far ? of_four(away, place.z) : field_.compliance_um_per_nN(point, place.z);
    g.row(2) /= axial_noise_;
    return g;
  }

 private:
  /// Four forces have the second moments of the disc: what they lack falls with the fourth power of the distance.
  static constexpr double kFarFromFour = 2;
  Eigen::Matrix3d of_four(Vec2 away, double z) const {
    const double arm_um = at_.semi_major_um / 2;
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const Vec2 way : {Vec2{1, 1}, Vec2{1, -1}, Vec2{-1, 1}, Vec2{-1, -1}})
      sum += 0.25 * greens::half_space_inside_um_per_nN(gel_, away - arm_um * way, z);
    return sum;
  }
  Gel gel_;
  greens::EllipseInside field_;
  substrate::Ellipse at_;
  double axial_noise_;
};

template <int D>
using FieldOf = std::conditional_t<D == 2, SurfaceField, InsideField>;

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
  Eigen::MatrixXd fields;    ///< D·patches × D·places: displacement by a unit force along each axis
  Eigen::MatrixXd products;  ///< patches × what has to be summed over beads; by the constants below
};
/// |u₂|² for forces along each axis, and G₁ᵀG₂ of the two by row; then for each place of the single one GᵀG (by row,
/// above its diagonal) and Gᵀu₂ (by column).
template <int D>
constexpr Eigen::Index kOfPair = D + D* D;
template <int D>
constexpr Eigen::Index kOfSquare = D*(D + 1) / 2;
template <int D>
constexpr Eigen::Index kOfPlace = kOfSquare<D> + D* D;
template <int D>
using Square = Eigen::Matrix<double, D, D>;

double radius_of(double area_um2) { return std::sqrt(area_um2 / std::numbers::pi); }

template <int D>
std::vector<Patch> patches_around(double area_um2, double distance_um, const BeadVolume& volume) {
  const double radius_um = radius_of(area_um2);
  // far away the two less the best one are a quadrupole, whose squares beyond a radius fall with its fourth power:
  // beyond eight distances lies a thousandth, beyond five a hundredth
  const double side_um = D == 2 ? 2 * (8 * distance_um + 12 * radius_um) : 2 * (5 * distance_um + 4 * radius_um);
  const std::vector<Vec2> places = {{-0.5 * distance_um, 0}, {0.5 * distance_um, 0}};
  std::vector<Patch> patches;
  const double depth_um = D == 2 ? 0 : std::min(volume.depth_um, side_um);
  divide<D>({0, 0, 0.5 * depth_um}, side_um, depth_um, places, radius_um, patches);
  return patches;
}

template <int D>
PairFields fields_of(const Gel& given, double area_um2, double distance_um, const BeadVolume& volume) {
  Gel gel = given;
  gel.youngs_modulus_kPa = 1;
  const double radius_um = radius_of(area_um2);
  PairFields f{.patches = patches_around<D>(area_um2, distance_um, volume), .fields = {}, .products = {}};
  const auto n = static_cast<Eigen::Index>(f.patches.size());
  f.fields.resize(D * n, D * kPlaces);
  for (int k = 0; k < kPlaces; ++k) {
    const FieldOf<D> field(gel, disc(distance_um * place_of_one(k), radius_um), volume);
    for (Eigen::Index i = 0; i < n; ++i) f.fields.block<D, D>(D * i, D * k) = field(f.patches[i].at_um);
  }
  f.products.resize(n, kOfPair<D> + kPlaces * kOfPlace<D>);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto rows = f.fields.middleRows<D>(D * i);
    const Square<D> first = rows.template middleCols<D>(D * kFirst), second = rows.template middleCols<D>(D * kSecond),
                    both = first + second;
    auto of_pair = f.products.row(i).head<kOfPair<D>>();
    of_pair.template head<D>() = both.colwise().squaredNorm();
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) of_pair[D + D * a + b] = first.col(a).dot(second.col(b));
    for (int k = 0; k < kPlaces; ++k) {
      const Square<D> G = rows.template middleCols<D>(D * k);
      auto of_place = f.products.row(i).segment<kOfPlace<D>>(kOfPair<D> + k * kOfPlace<D>);
      int next = 0;
      for (int a = 0; a < D; ++a)
        for (int b = a; b < D; ++b) of_place[next++] = G.col(a).dot(G.col(b));
      for (int c = 0; c < D; ++c)
        for (int a = 0; a < D; ++a) of_place[next++] = G.col(a).dot(both.col(c));
    }
  }
  return f;
}

/// Of one set of beads, for forces along each axis: along the line, across it, into the gel.
/// @param sums      of the products over beads
/// @param of_noise  Gᵀ times the beads' noise, by place and axis
template <int D>
std::array<Excess, D> excess_of(const Eigen::RowVectorXd& sums, const Eigen::RowVectorXd& of_noise) {
  std::array<Excess, D> all;
  for (Excess& e : all) e.resize(kPlaces, 3);
  const auto square_at = [&](int k) {
    const auto s = sums.segment<kOfSquare<D>>(kOfPair<D> + k * kOfPlace<D>);
    Square<D> square;
    int next = 0;
    for (int a = 0; a < D; ++a)
      for (int b = a; b < D; ++b) square(a, b) = square(b, a) = s[next++];
    return square;
  };
  Square<D> crossed;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) crossed(a, b) = sums[D + D * a + b];
  Square<2 * D> of_two;
  of_two << square_at(kFirst), crossed, crossed.transpose(), square_at(kSecond);
  Eigen::Matrix<double, 2 * D, 1> noise_of_two;
  noise_of_two << of_noise.segment<D>(D * kFirst).transpose(), of_noise.segment<D>(D * kSecond).transpose();
  const double explained_by_two = noise_of_two.dot(numerics::shortest_solution(of_two, noise_of_two).col(0));
  for (int k = 0; k < kPlaces; ++k) {
    const Square<D> GG = square_at(k);
    // one bead or none: no single force is found
    const bool is_found = std::abs(GG.determinant()) > 1e-12 * std::pow(GG.norm(), D);
    const Square<D> inverse = is_found ? Square<D>(GG.inverse()) : Square<D>(Square<D>::Zero());
    const Eigen::Matrix<double, D, 1> noise = of_noise.segment<D>(D * k).transpose();
    for (int c = 0; c < D; ++c) {
      const Eigen::Matrix<double, D, 1> Gu =
          sums.segment<D>(kOfPair<D> + k * kOfPlace<D> + kOfSquare<D> + D * c).transpose();
      const Eigen::Matrix<double, D, 1> found = inverse * Gu;
      all[c].row(k) << sums[c] - Gu.dot(found), noise_of_two[c] + noise_of_two[D + c] - found.dot(noise),
          explained_by_two - noise.dot(inverse * noise);
    }
  }
  return all;
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

/// Of experiments whose beads lie at random: one each for forces along each axis.
/// @param density  1/um², 1/um³
/// @param normal   a row an experiment
template <int D>
std::vector<Excess> drawn_excess(const PairFields& f, double density, const Eigen::MatrixXd& normal) {
  constexpr double kMany = 10;  // beads far off, where it hardly matters how many there are
  const auto n = static_cast<Eigen::Index>(f.patches.size());
  Eigen::MatrixXd counts(normal.rows(), n), noise(normal.rows(), D * n);
  for (Eigen::Index k = 0; k < counts.rows(); ++k) {
    drawing::Random random(1, drawing::Stream::beads, static_cast<std::uint64_t>(k));
    for (Eigen::Index i = 0; i < n; ++i) {
      const double mean = density * f.patches[i].measure;
      counts(k, i) = mean < kMany ? random.poisson(mean) : mean;
      noise.block<1, D>(k, D * i) = std::sqrt(counts(k, i)) * normal.block<1, D>(k, D * i);
    }
  }
  const Eigen::MatrixXd sums = numerics::product(counts, f.products), of_noise = numerics::product(noise, f.fields);
  std::vector<Excess> all;
  for (Eigen::Index k = 0; k < counts.rows(); ++k)
    for (Excess& e : excess_of<D>(sums.row(k), of_noise.row(k))) all.push_back(std::move(e));
  return all;
}

/// Each noise and its opposite are as likely. Neither 0 nor 1, which no number of experiments shows.
double chance_to_resolve(const std::vector<Excess>& experiments, double force) {
  double n_resolved = 0.5;
  for (const Excess& e : experiments)
    for (const double sign : {-1, 1}) n_resolved += least_excess(e, sign * force) > kResolved;
  return n_resolved / (2 * static_cast<double>(experiments.size()) + 1);
}

/// Of all densities, by distance.
template <int D>
std::vector<std::vector<std::vector<Excess>>> excess_by_distance(const Gel& gel, double area_um2,
                                                                 const std::vector<double>& distances_um,
                                                                 const std::vector<double>& densities,
                                                                 const BeadVolume& volume, int n_experiments,
                                                                 int threads) {
  std::size_t n_most = 0;
  for (const double distance_um : distances_um)
    n_most = std::max(n_most, patches_around<D>(area_um2, distance_um, volume).size());
  const Eigen::MatrixXd normal = normal_numbers(n_experiments / D, D * static_cast<Eigen::Index>(n_most));
  std::vector<std::vector<std::vector<Excess>>> excess(distances_um.size());
  numerics::parallel_for(static_cast<int>(distances_um.size()), threads, [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    const PairFields fields = fields_of<D>(gel, area_um2, distances_um[i], volume);
    for (const double density : densities) excess[i].push_back(drawn_excess<D>(fields, density, normal));
  });
  return excess;
}

std::vector<double> distances_um(double area_um2, double farthest_um, int n) {
  const double least_um = 2 * radius_of(area_um2);
  std::vector<double> distances;
  for (int k = 0; k < n; ++k) distances.push_back(least_um * std::pow(farthest_um / least_um, double(k) / (n - 1)));
  return distances;
}

}  // namespace

PairResolution::PairResolution(const Gel& gel, double area_um2, const std::vector<double>& beads_per_um2, int threads)
    : distance_um_(distances_um(area_um2, kFarthest_um, 2 * PairDraws{}.n_distances)),
      excess_(
          excess_by_distance<2>(gel, area_um2, distance_um_, beads_per_um2, {}, PairDraws{}.n_experiments, threads)) {}

PairResolution::PairResolution(const Gel& gel, double area_um2, const std::vector<double>& beads_per_um3,
                               const BeadVolume& volume, const PairDraws& draws, int threads)
    : distance_um_(
          distances_um(area_um2, std::max(kFarthest_um, kFarthestInSpace * radius_of(area_um2)), draws.n_distances)),
      excess_(excess_by_distance<3>(gel, area_um2, distance_um_, beads_per_um3, volume, draws.n_experiments, threads)) {
}

std::optional<double> PairResolution::least_distance_um(double force_nN, double youngs_modulus_kPa, std::size_t density,
                                                        double noise_um) const {
  const double force = force_nN / (youngs_modulus_kPa * noise_um);
  double before = 0;
  for (std::size_t i = 0; i < distance_um_.size(); ++i) {
    const double chance = chance_to_resolve(excess_[i].at(density), force);
    if (chance >= kChance) {
      if (i == 0) return touching_um();
      // the square root of the excess is nearly linear in the distance's logarithm, and so is the chance's normal
      // variable
      const double low = numerics::normal_quantile(before), high = numerics::normal_quantile(chance);
      const double share = (numerics::normal_quantile(kChance) - low) / (high - low);
      return distance_um_[i - 1] * std::pow(distance_um_[i] / distance_um_[i - 1], share);
    }
    before = chance;
  }
  return std::nullopt;
}

}  // namespace mbtfm::plan
