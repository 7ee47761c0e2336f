#include "mbtfm/tensions/beyond_cut.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/search.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/near.h"
#include "substrate/greens/models.h"

namespace mbtfm::tensions {

namespace {

struct Square {
  Vec2 low_um;
  double side_um = 0;
  Vec2 centre() const { return low_um + 0.5 * Vec2{side_um, side_um}; }
  substrate::Ellipse disc() const {  // of the same area
    const double radius_um = side_um / std::sqrt(std::numbers::pi);
    return {.centre_um = centre(), .semi_major_um = radius_um, .semi_minor_um = radius_um, .angle_rad = 0};
  }
  Square quarter(int i) const {
    const double half = 0.5 * side_um;
    return {low_um + half * Vec2{double(i % 2), double(i / 2)}, half};
  }
};

/// A side of the image where it cuts the cell, and the direction out of the image there.
struct CutSide {
  Vec2 at_um, outward;
};

class Tiling {
 public:
  Tiling(const Cell& cell, double finest_um, double growth) : cell_(cell), finest_um_(finest_um), growth_(growth) {
    const double turn = signed_area_um2(cell.outline_um) > 0 ? 1 : -1;
    for (const auto& [a, b] : cuts_of(cell)) {
      const Vec2 along = (turn / norm(b - a)) * (b - a);
      sides_.push_back({a, {along.y, -along.x}});
    }
    const auto [low, high] = extent_of(cell.outline_um);
    constexpr double kSpreadCell_um = 60;
    reach_um_ = std::max({high.x - low.x, high.y - low.y, kSpreadCell_um});
    // a corner of the squares lies on the first side, so that none of them reaches over it
    double half = finest_um;
    while (half < 2 * reach_um_) half *= 2;
    for (int i = 0; i < 4; ++i) divide(Square{sides_.front().at_um - Vec2{half, half}, 2 * half}.quarter(i));
  }
  const std::vector<Square>& squares() const { return squares_; }

 private:
  bool is_outside(Vec2 p) const {
    return std::ranges::any_of(sides_, [&](const CutSide& s) { return dot(p - s.at_um, s.outward) > 0; });
  }
  bool is_all_outside(const Square& s) const {
    constexpr double kInner = 0.4999;  // of the side: rounding apart
    for (const Vec2 corner : {Vec2{-1, -1}, Vec2{1, -1}, Vec2{1, 1}, Vec2{-1, 1}}) {
      if (!is_outside(s.centre() + kInner * s.side_um * corner)) return false;
    }
    return true;
  }
  void divide(const Square& square) {
    const double distance_um = distance_to_cut_um(cell_, square.centre());
    if (distance_um - square.side_um > reach_um_) return;
    const bool is_small = square.side_um <= std::max(finest_um_, growth_ * distance_um);
    if (is_small && is_all_outside(square)) {
      if (distance_um <= reach_um_) squares_.push_back(square);
    } else if (square.side_um > 1.5 * finest_um_) {
      for (int i = 0; i < 4; ++i) divide(square.quarter(i));
    } else if (is_outside(square.centre())) {
      squares_.push_back(square);
    }
  }

  const Cell& cell_;
  double finest_um_, growth_;
  std::vector<CutSide> sides_;
  double reach_um_ = 0;
  std::vector<Square> squares_;
};

/// Of a component of the adhesions' forces, as forces independent of each other have it: less their noise, each
/// weighted by the beads' information on it. @param variance  of the beads' weighted components
double mean_square_force(const LinearData& data, double variance) {
  const Index n = data.response->cols();
  const VectorXd noise = variance * solve_normal(data.reduced, MatrixXd::Identity(n, n)).diagonal();
  const VectorXd squares = free_forces_nN(data.reduced).cwiseAbs2();
  return std::max(0.0, (squares - noise).cwiseQuotient(noise).sum() / std::max(noise.cwiseInverse().sum(), 1e-300));
}

/// By an even traction along x and along y: out there the cell pulls inwards as a whole, which is no chance, so nothing
/// is expected of its size.
Motions by_even_traction(const std::vector<substrate::Ellipse>& places, Index n_beyond,
                         const MatrixXd& compliance_um_per_nN) {
  Motions even{.shapes = MatrixXd::Zero(compliance_um_per_nN.rows(), n_beyond > 0 ? 2 : 0)};
  for (Index i = 0; i < n_beyond; ++i) {
    const double area_um2 = std::numbers::pi * places[i].semi_major_um * places[i].semi_minor_um;
    even.shapes += area_um2 * compliance_um_per_nN.middleCols<2>(2 * i);
  }
  return even;
}

double length_um(const Cuts& cuts) {
  double sum = 0;
  for (const auto& [a, b] : cuts) sum += norm(b - a);
  return sum;
}

}  // namespace

std::vector<substrate::Ellipse> places_beyond(const Cell& cell, double finest_um, double growth) {
  MBTFM_ASSERT(finest_um > 0);
  std::vector<substrate::Ellipse> places;
  const Tiling tiling(cell, finest_um, growth);
  for (const Square& square : tiling.squares()) places.push_back(square.disc());
  return places;
}

namespace {

/// An adhesion at a neighbour's outline reaches beyond it.
constexpr double kReach_um = 1;

/// Squares on neighbours, each as large as the nearest bead in use is far: what varies within less does not reach it.
class NeighbourTiling {
 public:
  NeighbourTiling(const std::vector<Vec2>& beads_um, const BeyondSpacing& spacing) : growth_(spacing.growth) {
    const double density = static_cast<double>(beads_um.size()) / std::max(extent_of(beads_um).area_um2(), 1e-300);
    finest_um_ = spacing.finest / std::sqrt(density);
    std::vector<Vec3> beads;
    for (const Vec2 bead : beads_um) beads.push_back({bead.x, bead.y, 0});
    beads_ = numerics::Near(std::move(beads), finest_um_);
  }
  void tile(const Polygon& outline_um) {
    const auto [low, high] = extent_of(outline_um);
    const double side_um = std::max(high.x - low.x, high.y - low.y) + 2 * kReach_um;
    divide(outline_um, {low - Vec2{kReach_um, kReach_um}, side_um});
  }
  std::vector<substrate::Ellipse> places;

 private:
  double distance_to_bead_um(Vec2 place) const {
    const Vec3 at{place.x, place.y, 0};
    const std::vector<int> nearest = beads_.nearest(at, 1);
    return nearest.empty() ? 0 : norm(beads_.points()[nearest.front()] - at);
  }
  void divide(const Polygon& outline_um, const Square& square) {
    const Vec2 centre = square.centre();
    const double edge_um = distance_to_boundary_um(outline_um, centre);
    const bool is_inside = contains(outline_um, centre);
    if (!is_inside && edge_um > std::numbers::sqrt2 / 2 * square.side_um + kReach_um) return;
    if (square.side_um > std::max(finest_um_, growth_ * distance_to_bead_um(centre))) {
      for (int i = 0; i < 4; ++i) divide(outline_um, square.quarter(i));
    } else if (is_inside || edge_um <= std::max(kReach_um, square.side_um / 4)) {  // or it covers little of it
      places.push_back(square.disc());
    }
  }
  double growth_, finest_um_ = 0;
  numerics::Near beads_;
};

}  // namespace

std::vector<substrate::Ellipse> places_beneath_neighbours(const Cell& cell, const std::vector<Vec2>& beads_um,
                                                          const BeyondSpacing& spacing) {
  NeighbourTiling tiling(beads_um, spacing);
  for (const Polygon& outline : cell.neighbours_um) tiling.tile(outline);
  return std::move(tiling.places);
}

bool is_nearer_to_neighbour(const Cell& cell, Vec2 place_um) {
  if (cell.neighbours_um.empty() || contains(cell.outline_um, place_um)) return false;
  constexpr double kShare = 0.5;  // equal pulls, whose fields fall with the square of the distance: four times as much
  const double reach_um = std::max(kReach_um, kShare * distance_to_boundary_um(cell.outline_um, place_um));
  return std::ranges::any_of(cell.neighbours_um, [&](const Polygon& outline) {
    return distance_to_boundary_um(outline, place_um) <= reach_um || contains(outline, place_um);
  });
}

namespace {

/// The motions by random forces Z that exceed the noise, of unit variance.
MatrixXd motions_that_stand_out(const LinearData& data, const MatrixXd& Z, double kappa) {
  // What together exceeds the noise by a tenth of one component's changes no weight by a per cent.
  constexpr double kUnseen = 0.01;
  const MatrixXd square = kappa * numerics::transposed_product(Z, squared_weights(data).asDiagonal() * Z);
  const auto [values, vectors] = numerics::symmetric_eigen(square);
  const Index n_motions = (values.array() > kUnseen).count();
  return numerics::small_product(std::sqrt(kappa), Z, vectors.rightCols(n_motions));
}

}  // namespace

DataWithBeyond with_forces_beyond(LinearData data, const std::vector<substrate::Ellipse>& places, Index n_beyond,
                                  const MatrixXd& compliance_um_per_nN, double area_um2) {
  MBTFM_ASSERT(data.motions.precision.size() == 0);
  const MatrixXd Z = by_root_of_area(compliance_um_per_nN, places);
  const Index n_affine = data.motions.shapes.cols();
  const Motions even = by_even_traction(places, n_beyond, compliance_um_per_nN);
  Motions motions = joined(data.motions, even);
  data = with_motions(std::move(data), motions);
  const Scores scores = pattern_of(data, Z).beyond;
  const double variance = variance_beside(data, scores);
  Spectrum spectrum = spectrum_of(scores);
  spectrum.found /= variance;
  // With few beads at the cut the likelihood is flat down to zero; then what is hidden is as strong as what is seen.
  const double n_adhesions = 0.5 * static_cast<double>(data.response->cols());
  const double seen = n_adhesions / area_um2 * mean_square_force(data, variance) / variance;
  const double kappa = std::max(seen, likeliest_kappa(spectrum));
  MatrixXd random = motions_that_stand_out(data, Z, kappa);
  const Index n_random = random.cols();
  // An even traction is free, so that what these motions have of it may be left to it. Both together would be the same
  // motion twice, whose square no rounding leaves definite.
  const MatrixXd weighted = squared_weights(data).asDiagonal() * even.shapes;
  if (n_beyond > 0)
    random -= numerics::small_product(
        even.shapes, numerics::shortest_solution(numerics::small_transposed_product(even.shapes, weighted),
                                                 numerics::small_transposed_product(weighted, random)));
  motions.precision = VectorXd::Zero(motions.shapes.cols());
  if (n_affine > 0) motions.precision.segment<3>(3).setConstant(variance / (kUsualGrowth * kUsualGrowth));
  motions = joined(std::move(motions), {.shapes = std::move(random), .precision = VectorXd::Ones(n_random)});
  const ForcesBeyond beyond{.n_places = n_beyond,
                            .n_beneath_neighbours = static_cast<Index>(places.size()) - n_beyond,
                            .n_motions = n_random,
                            .intensity_nN_per_um = std::sqrt(kappa * variance)};
  return {with_motions(std::move(data), std::move(motions)), beyond};
}

/// Standard deviation that a component of an adhesion's own force is expected to have at this distance from the cut, in
/// that of the cell's adhesion forces. By unseen fibres as much as any adhesion has. By the network, whose own gave way
/// at the cut: measured as forces of the cells 1 to 8 less those of their networks held at cuts.
double expected_own(double distance_um) {
  constexpr double kUnseen_um = 3, kOfNetwork = 0.23, kFade_um = 10;
  return distance_um < kUnseen_um ? 1 : kOfNetwork * std::exp(-distance_um / kFade_um);
}

DataWithBeyond with_own_forces(DataWithBeyond given, const Cell& cell) {
  auto& [data, found] = given;
  constexpr double kLeast = 0.02;  // negligible beside the errors that forces have in whole cells, too (0.1)
  std::vector<Index> near;
  std::vector<double> expected;
  for (std::size_t a = 0; a < cell.adhesions.size(); ++a) {
    const Adhesion& adhesion = cell.adhesions[a];
    const double of_own = expected_own(distance_to_cut_um(cell, adhesion.position_um) - 0.5 * adhesion.major_axis_um);
    if (of_own < kLeast) continue;
    near.push_back(static_cast<Index>(a));
    expected.push_back(of_own);
  }
  const Index n_forces = data.response->cols();
  const double variance = noise_variance(data), mean_square = mean_square_force(data, variance);
  if (near.empty() || mean_square <= 0) return given;
  found.n_own = static_cast<Index>(near.size());
  found.own_nN = std::sqrt(mean_square);
  MatrixXd forces = MatrixXd::Zero(n_forces, 2 * found.n_own);
  for (Index k = 0; k < found.n_own; ++k)
    forces.block<2, 2>(2 * near[k], 2 * k).diagonal().setConstant(expected[k] * std::sqrt(mean_square / variance));
  Motions motions =
      joined(data.motions,
             {.shapes = data.response->displace(forces), .precision = VectorXd::Ones(forces.cols()), .forces = forces});
  data = with_motions(std::move(data), std::move(motions));
  return given;
}

DataWithBeyond with_forces_beyond(LinearData data, const Cell& cell, const Gel& gel, const BeyondSpacing& spacing) {
  DisplacementField beads;
  for (const Vec2 p : data.position_um) beads.push_back({.position_um = p, .displacement_um = {}, .flag = {}});
  const double density = beads_per_um2(beads);
  if (density <= 0) return {std::move(data), {}};
  const double finest_um = spacing.finest / std::sqrt(density);
  std::vector<substrate::Ellipse> places;
  if (!cuts_of(cell).empty()) places = places_beyond(cell, finest_um, spacing.growth);
  const auto n_beyond = static_cast<Index>(places.size());
  if (!cell.neighbours_um.empty()) {
    std::vector<Vec2> used;
    for (std::size_t b = 0; b < data.position_um.size(); ++b)
      if (data.weight_per_um[2 * static_cast<Index>(b)] > 0) used.push_back(data.position_um[b]);
    for (const substrate::Ellipse& place : places_beneath_neighbours(cell, used, spacing)) places.push_back(place);
  }
  const MatrixXd compliance = greens::make_greens(gel, {.model = substrate::ModelKind::layer}, data.threads)
                                  ->compliance_um_per_nN(data.position_um, places);
  return with_own_forces(
      with_forces_beyond(std::move(data), places, n_beyond, compliance, std::abs(signed_area_um2(cell.outline_um))),
      cell);
}

bool has_forces_beyond(const Cell& cell) { return !cuts_of(cell).empty() || !cell.neighbours_um.empty(); }

bool allows_forces_beyond(const stage::EffectSwitches& switches, const Cell& cell) {
  if (switches.beyond_cut == Switch::on && !has_forces_beyond(cell))
    throw UsageError(
        "effects.beyond_cut = \"on\": the image's border does not cut this cell (outline.csv, is_cut), and the image "
        "shows no other (neighbours.csv)");
  return has_forces_beyond(cell) && switches.beyond_cut != Switch::off;
}

Effect beyond_cut_effect(Switch setting, const Cell& cell, const std::optional<ForcesBeyond>& found) {
  const double cut_um = length_um(cuts_of(cell));
  const std::size_t n_neighbours = cell.neighbours_um.size();
  const std::vector<std::string> borders = found ? found->borders : std::vector<std::string>();
  std::string why = cut_um > 0 ? "the image cuts the cell along " + brief(cut_um) + " um" : "";
  if (n_neighbours > 0)
    why += (why.empty() ? "" : " and ") +
           ("the image shows " + std::to_string(n_neighbours) + " other cell" + (n_neighbours > 1 ? "s" : ""));
  if (!borders.empty())
    why += (why.empty() ? "" : " and ") + ("the displacements show forces beyond the border: " + listed(borders));
  if (found)
    why += "; forces at " + std::to_string(found->n_places) + " places beyond and " +
           std::to_string(found->n_beneath_neighbours) + " beneath other cells, of " +
           brief(found->intensity_nN_per_um) + " nN times the root of their area in um², and at " +
           std::to_string(found->n_own) + " adhesions near the cut";
  return stage::decided(
      EffectKind::beyond_cut, setting, has_forces_beyond(cell) || !borders.empty(),
      why.empty()
          ? "the image shows the whole cell, and no other, and the displacements show no forces beyond its border"
          : why);
}

}  // namespace mbtfm::tensions
