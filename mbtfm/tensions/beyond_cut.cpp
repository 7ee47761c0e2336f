#include "mbtfm/tensions/beyond_cut.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/tensions/common_motion.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/dense.h"
#include "substrate/greens/models.h"

namespace mbtfm::tensions {

namespace {

struct Square {
  Vec2 low_um;
  double side_um = 0;
  Vec2 centre() const { return low_um + 0.5 * Vec2{side_um, side_um}; }
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

/// Of data with noise of variance s² and random effects of variance κ s²: those along which they do not mix.
struct Spectrum {
  VectorXd information;  ///< d: signal over noise, in squares, at κ = 1
  VectorXd found;        ///< c² / s²: its mean is d (1 + κ d)
  double variance = 0;   ///< s²
};

/// −2 log likelihood of κ, but for a constant.
double surprise(const Spectrum& s, double kappa) {
  double sum = 0;
  for (Index i = 0; i < s.information.size(); ++i) {
    const double total = 1 + kappa * s.information[i];
    sum += std::log(total) - kappa * s.found[i] / total;
  }
  return sum;
}

/// Of least surprise, to a quarter: what is allowed for hangs on it weakly.
double likeliest_kappa(const Spectrum& s) {
  constexpr double kStep = 1.25, kLeast = 1e-6, kMost = 1e12;  // relative to what stands out of the noise just so
  const double unit = 1 / std::max(s.information.maxCoeff(), 1e-300);
  double best = 0, least = 0;
  for (double kappa = kLeast; kappa < kMost; kappa *= kStep) {
    const double here = surprise(s, kappa * unit);
    if (here >= least) continue;
    least = here;
    best = kappa * unit;
  }
  return best;
}

/// What the forces inside and the motions leave of the data tells of the random effects Z.
Spectrum spectrum_of(const LinearData& data, const MatrixXd& Z) {
  const VectorXd weight = squared_weights(data);
  const MatrixXd weighted = weight.asDiagonal() * less_motion(data, Z);
  const MatrixXd pulled = data.response->pull_back(weighted);  // Gᵀ W² P Z
  const MatrixXd left = numerics::transposed_product(Z, weighted) -
                        numerics::transposed_product(pulled, solve_normal(data.reduced, pulled));
  const VectorXd residual = residual_um(data, free_forces_nN(data.reduced));
  const VectorXd b = numerics::transposed_matvec(Z, weight.cwiseProduct(residual));
  const auto [values, vectors] = numerics::symmetric_eigen(0.5 * (left + left.transpose()));
  const double rounding = 1e-10 * std::max(values.maxCoeff(), 1e-300);
  Spectrum s{values, numerics::transposed_matvec(vectors, b).cwiseAbs2(), 0};
  double explained = 0;
  auto n_left = static_cast<double>(data.n_used - data.reduced.n_felt);
  for (Index i = 0; i < s.information.size(); ++i) {
    if (s.information[i] <= rounding) {
      s.information[i] = s.found[i] = 0;
    } else {
      explained += s.found[i] / s.information[i];
      n_left -= 1;
    }
  }
  s.variance = std::max((data.reduced.floor_squared - explained) / std::max(1.0, n_left),
                        data.has_errors ? 1.0 : 1e-300);  // not below the stated errors'
  s.found /= s.variance;
  return s;
}

/// Of a component of the adhesions' forces, as forces independent of each other have it: less their noise, and each by
/// what the beads tell of it. @param variance  of the beads' weighted components
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
  for (const Square& square : tiling.squares()) {
    const double radius_um = square.side_um / std::sqrt(std::numbers::pi);
    places.push_back(
        {.centre_um = square.centre(), .semi_major_um = radius_um, .semi_minor_um = radius_um, .angle_rad = 0});
  }
  return places;
}

namespace {

/// An adhesion at a neighbour's outline reaches beyond it.
constexpr double kReach_um = 1;

void tile_neighbour(const Polygon& outline_um, const Square& square, double finest_um, double growth,
                    std::vector<substrate::Ellipse>& places) {
  const Vec2 centre = square.centre();
  const double edge_um = distance_to_boundary_um(outline_um, centre);
  const bool is_inside = contains(outline_um, centre);
  if (!is_inside && edge_um > std::numbers::sqrt2 / 2 * square.side_um + kReach_um) return;
  const double largest_um = std::max(finest_um, is_inside ? growth * edge_um : 0);
  if (square.side_um > largest_um) {
    for (int i = 0; i < 4; ++i) tile_neighbour(outline_um, square.quarter(i), finest_um, growth, places);
  } else if (is_inside || edge_um <= kReach_um) {
    const double radius_um = square.side_um / std::sqrt(std::numbers::pi);
    places.push_back({.centre_um = centre, .semi_major_um = radius_um, .semi_minor_um = radius_um, .angle_rad = 0});
  }
}

}  // namespace

std::vector<substrate::Ellipse> places_beneath_neighbours(const Cell& cell, double finest_um, double growth) {
  MBTFM_ASSERT(finest_um > 0);
  std::vector<substrate::Ellipse> places;
  for (const Polygon& outline : cell.neighbours_um) {
    const auto [low, high] = extent_of(outline);
    const double side_um = std::max(high.x - low.x, high.y - low.y) + 2 * kReach_um;
    tile_neighbour(outline, {low - Vec2{kReach_um, kReach_um}, side_um}, finest_um, growth, places);
  }
  return places;
}

bool is_beneath_neighbour(const Cell& cell, Vec2 place_um) {
  if (contains(cell.outline_um, place_um)) return false;
  return std::ranges::any_of(cell.neighbours_um, [&](const Polygon& outline) {
    return contains(outline, place_um) || distance_to_boundary_um(outline, place_um) <= kReach_um;
  });
}

namespace {

/// Of each place the displacement by forces of 1 nN/um times the root of its area.
MatrixXd by_root_of_area(MatrixXd compliance_um_per_nN, const std::vector<substrate::Ellipse>& places) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double side_um = std::sqrt(std::numbers::pi) * places[i].semi_major_um;
    compliance_um_per_nN.middleCols<2>(2 * static_cast<Index>(i)) *= side_um;
  }
  return compliance_um_per_nN;
}

/// The motions by random forces Z that stand out of the noise, of unit variance.
MatrixXd motions_that_stand_out(const LinearData& data, const MatrixXd& Z, double kappa) {
  // What together stands out by a tenth of the noise of one component changes no weight by a per cent.
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
  const Spectrum spectrum = spectrum_of(data, Z);
  // With few beads at the cut the likelihood is flat down to zero; then what is hidden is as strong as what is seen.
  const double n_adhesions = 0.5 * static_cast<double>(data.response->cols());
  const double seen = n_adhesions / area_um2 * mean_square_force(data, spectrum.variance) / spectrum.variance;
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
  if (n_affine > 0) motions.precision.segment<3>(3).setConstant(spectrum.variance / (kUsualGrowth * kUsualGrowth));
  motions = joined(std::move(motions), {.shapes = std::move(random), .precision = VectorXd::Ones(n_random)});
  const ForcesBeyond beyond{.n_places = n_beyond,
                            .n_beneath_neighbours = static_cast<Index>(places.size()) - n_beyond,
                            .n_motions = n_random,
                            .intensity_nN_per_um = std::sqrt(kappa * spectrum.variance)};
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
  constexpr double kLeast = 0.02;  // nothing beside the errors that forces have in whole cells, too (0.1)
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
  for (const substrate::Ellipse& place : places_beneath_neighbours(cell, finest_um, spacing.growth))
    places.push_back(place);
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
  std::string why = cut_um > 0 ? "the image cuts the cell along " + brief(cut_um) + " um" : "";
  if (n_neighbours > 0)
    why += (why.empty() ? "" : " and ") +
           ("the image shows " + std::to_string(n_neighbours) + " other cell" + (n_neighbours > 1 ? "s" : ""));
  if (found)
    why += "; forces at " + std::to_string(found->n_places) + " places beyond and " +
           std::to_string(found->n_beneath_neighbours) + " beneath other cells, of " +
           brief(found->intensity_nN_per_um) + " nN times the root of their area in um², and at " +
           std::to_string(found->n_own) + " adhesions near the cut";
  return stage::decided(EffectKind::beyond_cut, setting, has_forces_beyond(cell),
                        why.empty() ? "the image shows the whole cell, and no other" : why);
}

}  // namespace mbtfm::tensions
