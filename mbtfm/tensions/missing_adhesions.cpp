#include "mbtfm/tensions/missing_adhesions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/search.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/extent.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/near.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/greens/models.h"

namespace mbtfm::tensions {

namespace {

constexpr double kStep_um = 1;    // of the places tried: adhesions are as long
constexpr double kDisc_um = 0.5;  // radius of an ordinary adhesion
constexpr double kReach_um = 6;   // of the beads asked: beyond, a force's field is that of many others
constexpr double kApart_um = 1;   // from an adhesion's rim: nearer, the adhesion's own force explains it

substrate::Ellipse disc_at(Vec2 place_um) {
  return {.centre_um = place_um, .semi_major_um = kDisc_um, .semi_minor_um = kDisc_um, .angle_rad = 0};
}

/// Displacement around a disc that is pulled, by distance and, in space, depth.
class DiscField {
 public:
  DiscField(const Gel& gel, Index dimension) {
    std::vector<Vec3> lattice_um;
    for (int k = 0; k <= (dimension > 2 ? kDepths : 0); ++k)
      for (int i = 0; i <= kLast; ++i) lattice_um.push_back({kReach_um * i / kLast, 0, kReach_um * k / kDepths});
    const auto half_space = greens::make_greens(gel, {.model = substrate::ModelKind::half_space}, 1);
    table_ = response_to({disc_at({})}, lattice_um, dimension, *half_space)->matrix();
  }
  ShortMatrix at(const Vec3& offset_um) const {
    const double r = std::sqrt(offset_um.x * offset_um.x + offset_um.y * offset_um.y);
    const double place = std::min(r / kReach_um * kLast, kLast - 1e-9);
    const auto nearest = static_cast<Index>(std::lround(std::min(offset_um.z / kReach_um, 1.0) * kDepths));
    const auto i = static_cast<Index>(place);
    const Index each = table_.cols(), row = each * ((kLast + 1) * nearest + i);
    const double share = place - static_cast<double>(i);
    const ShortMatrix along_x =
        (1 - share) * table_.middleRows(row, each) + share * table_.middleRows(row + each, each);
    ShortMatrix turn = ShortMatrix::Identity(each, each);
    if (r > 0) turn.topLeftCorner<2, 2>() << offset_um.x / r, -offset_um.y / r, offset_um.y / r, offset_um.x / r;
    return turn * along_x * turn.transpose();
  }

 private:
  static constexpr int kLast = 240;   // 25 nm apart
  static constexpr int kDepths = 60;  // 0.1 um: of the disc's radius a fifth
  MatrixXd table_;
};

/// The beads in use.
class UsedBeads {
 public:
  explicit UsedBeads(const LinearData& data) {
    std::vector<Vec3> places;
    for (Index b = 0; b < std::ssize(data.position_um); ++b) {
      if (!is_used(data, b)) continue;
      beads_.push_back(b);
      places.push_back(place_of_bead(data, b));
    }
    near_ = numerics::Near(std::move(places), kReach_um);
  }
  std::vector<Index> near(Vec2 place_um) const {
    std::vector<Index> found;
    for (const int k : near_.within({place_um.x, place_um.y, 0}, kReach_um, static_cast<int>(beads_.size())))
      found.push_back(beads_[k]);
    return found;
  }

 private:
  std::vector<Index> beads_;
  numerics::Near near_;
};

/// A place, and how much less squares a force there would leave of the beads around.
struct Asked {
  Vec2 place_um;
  double gain = 0;  ///< of noise alone
};

Asked ask(Vec2 place_um, const UsedBeads& used, const DiscField& disc, const LinearData& data, const VectorXd& weight,
          const VectorXd& residual, double variance) {
  constexpr std::size_t kFewest = 10;  // beads for two or three numbers and their mean
  const std::vector<Index> beads = used.near(place_um);
  if (beads.size() < kFewest) return {place_um};
  const Index each = data.dimension;
  std::vector<ShortMatrix> fields;
  ShortMatrix mean = ShortMatrix::Zero(each, each), square = mean;
  ShortVector score = ShortVector::Zero(each), all = score;
  for (const Index b : beads) {
    const ShortVector of_bead = weight.segment(each * b, each);
    fields.push_back(disc.at(place_of_bead(data, b) - Vec3{place_um.x, place_um.y, 0}));
    mean += of_bead.asDiagonal() * fields.back();
    all += of_bead;
  }
  mean = all.cwiseInverse().asDiagonal() * mean;
  for (std::size_t k = 0; k < beads.size(); ++k) {
    const Index row = each * beads[k];
    const ShortMatrix field = fields[k] - mean, weighted = weight.segment(row, each).asDiagonal() * field;
    score += weighted.transpose().lazyProduct(residual.segment(row, each));
    square += weighted.transpose().lazyProduct(field);
  }
  return {place_um, score.dot(VectorXd(numerics::solve_symmetric(square, score))) / variance};
}

/// The best place within a step of this one.
template <class Ask>
Asked refined(Asked best, const Ask& ask_at) {
  constexpr int kFiner = 4;
  const Vec2 middle = best.place_um;
  for (int j = -kFiner; j <= kFiner; ++j) {
    for (int i = -kFiner; i <= kFiner; ++i) {
      Asked q = ask_at(middle + kStep_um / kFiner * Vec2{double(i), double(j)});
      if (q.gain > best.gain) best = std::move(q);
    }
  }
  return best;
}

/// Of fibres: many end on an adhesion.
std::vector<Vec2> free_ends(const Cell& cell) {
  std::vector<Vec2> ends;
  const auto add = [&](Vec2 end) {
    const auto is_near = [&](Vec2 other) { return norm(other - end) < kApart_um; };
    if (is_free(cell, end) && std::ranges::none_of(ends, is_near)) ends.push_back(end);
  };
  for (const Fibre& f : cell.fibres) {
    if (!f.start_adhesion_id) add(f.points_um.front());
    if (!f.end_adhesion_id) add(f.points_um.back());
  }
  return ends;
}

std::vector<Vec2> free_places(const Cell& cell) {
  const auto [low, high] = extent_of(cell.outline_um);
  std::vector<Vec2> places;
  for (double y = low.y; y <= high.y; y += kStep_um)
    for (double x = low.x; x <= high.x; x += kStep_um)
      if (is_free(cell, {x, y})) places.push_back({x, y});
  return places;
}

/// Places where what is left of the beads looks most like a force, as the beads around alone have it: besides all that
/// the adhesions exert, as these explain much of a force nearby, and besides the network's forces.
std::vector<Vec2> likely_places(const EnsembleFit& fit, const std::vector<Vec2>& places, const Gel& gel, int threads) {
  constexpr double kLeast = 10;      // of the gain: chance has it at each hundred and fiftieth place
  constexpr std::size_t kMost = 25;  // of either: where so many fail, the model is wrong as a whole
  const UsedBeads beads(fit.data);
  const DiscField disc(gel, fit.data.dimension);
  const VectorXd weight = squared_weights(fit.data);
  std::vector<Vec2> tried, likely;
  for (const VectorXd& forces_nN : {adhesion_forces_nN(fit), fit.forces.nN}) {
    const VectorXd residual = residual_um(fit.data, forces_nN);
    const auto ask_at = [&](Vec2 place_um) {
      return ask(place_um, beads, disc, fit.data, weight, residual, fit.misfit.variance);
    };
    std::vector<Asked> asked(places.size());
    numerics::parallel_for(static_cast<int>(places.size()), threads, [&](int i) { asked[i] = ask_at(places[i]); });
    std::erase_if(asked, [&](const Asked& q) { return q.gain < kLeast; });
    std::ranges::sort(asked, std::greater(), &Asked::gain);
    const std::size_t most = tried.size() + kMost;
    for (const Asked& q : asked) {
      if (tried.size() >= most) break;
      if (std::ranges::any_of(tried, [&](Vec2 p) { return norm(p - q.place_um) < 0.5 * kReach_um; })) continue;
      tried.push_back(q.place_um);
      likely.push_back(refined(q, ask_at).place_um);
    }
  }
  return likely;
}

/// Displacement of the beads by forces on discs there, components × components·places.
MatrixXd displacement_by(const std::vector<Vec2>& places, const LinearData& data, const Gel& gel) {
  std::vector<substrate::Ellipse> discs;
  for (const Vec2 place : places) discs.push_back(disc_at(place));
  const auto layer = greens::make_greens(gel, {.model = substrate::ModelKind::layer}, data.threads);
  return response_to(discs, places_of_beads(data), data.dimension, *layer)->matrix();
}

/// By how much sums of magnitudes are too small as further adhesions are missed that are too weak to be found: as large
/// a share of the weak ones as of the strong ones, n of n + n_above + 1 (Chapman, Univ. Calif. Publ. Stat. 1 (1951)
/// 131). What such a one exerts its neighbour takes over, as a vector: the sum lacks the force times 1 − cos, of the
/// angle between both.
double unfound_nN(const VectorXd& forces_nN, const std::vector<Adhesion>& adhesions,
                  const std::vector<MissingAdhesion>& found) {
  double weakest_nN = std::numeric_limits<double>::infinity(), lacking_nN = 0, n_above = 0;
  for (const MissingAdhesion& place : found) weakest_nN = std::min(weakest_nN, norm(place.force_nN));
  for (std::size_t a = 0; a < adhesions.size(); ++a) {
    if (adhesions[a].origin == AdhesionOrigin::beads) continue;
    const Index each = forces_nN.size() / std::ssize(adhesions);
    const ShortVector force = forces_nN.segment(each * static_cast<Index>(a), each);
    if (force.norm() >= weakest_nN) n_above += 1;
    if (force.norm() >= weakest_nN || force.norm() <= 0) continue;
    double nearest_um = std::numeric_limits<double>::infinity(), cosine = 1;
    for (std::size_t b = 0; b < adhesions.size(); ++b) {
      const double apart_um = norm(adhesions[b].position_um - adhesions[a].position_um);
      if (a == b || apart_um >= nearest_um) continue;
      nearest_um = apart_um;
      cosine = force.normalized().dot(forces_nN.segment(each * static_cast<Index>(b), each).normalized());
    }
    lacking_nN += (1 - cosine) * force.norm();
  }
  return static_cast<double>(found.size()) / (n_above + 1) * lacking_nN;
}

}  // namespace

bool is_free(const Cell& cell, Vec2 place_um) {
  if (!contains(cell.outline_um, place_um)) return false;
  for (const Polygon& hole : cell.holes_um)
    if (contains(hole, place_um)) return false;
  return std::ranges::none_of(cell.adhesions, [&](const Adhesion& a) {
    const Vec2 d = a.position_um - place_um;
    return dot(d, d) < std::pow(a.major_axis_um / 2 + kApart_um, 2);
  });
}

std::vector<MissingAdhesion> missing_adhesions(const EnsembleFit& fit, const Cell& cell, const Gel& gel, int threads) {
  constexpr double kExpected = 0.1;  // forces that a cell has away from its adhesions, half of them at ends of fibres
  const std::vector<Vec2> places = free_places(cell), ends = free_ends(cell);
  std::vector<Vec2> likely = ends;
  for (const Vec2 place : likely_places(fit, places, gel, threads)) {
    if (std::ranges::none_of(ends, [&](Vec2 end) { return norm(end - place) < kDisc_um + kApart_um; }))
      likely.push_back(place);
  }
  if (likely.empty()) return {};
  std::vector<double> log_odds_against;
  for (std::size_t k = 0; k < likely.size(); ++k)
    log_odds_against.push_back(
        std::log(static_cast<double>(k < ends.size() ? ends.size() : places.size()) / (0.5 * kExpected)));
  const Left left(fit);
  const Scores scores = left.scores_of(pattern_of(fit.data, displacement_by(likely, fit.data, gel)));
  const VectorXd forces_nN = adhesion_forces_nN(fit);
  const double kappa =
      std::max(1e-300, forces_nN.squaredNorm() / static_cast<double>(forces_nN.size())) / left.variance();
  const Index each = fit.data.dimension;
  std::vector<std::vector<Index>> columns(likely.size(), std::vector<Index>(each));
  for (Index k = 0; k < std::ssize(likely); ++k) std::iota(columns[k].begin(), columns[k].end(), each * k);
  const std::vector<std::size_t> causes = causes_among(scores, columns, log_odds_against, kappa);
  if (causes.empty()) return {};
  std::vector<Index> of_causes;
  for (const std::size_t k : causes) of_causes.insert(of_causes.end(), columns[k].begin(), columns[k].end());
  const Scores there = at(scores, of_causes);
  const MatrixXd covariance = numerics::inverse_symmetric(there.information);
  const VectorXd sizes = numerics::matvec(covariance, there.scores);  // over s
  std::vector<MissingAdhesion> found;
  for (std::size_t k = 0; k < causes.size(); ++k) {
    const Index row = each * static_cast<Index>(k);
    const VectorXd size = sizes.segment(row, each), force_nN = std::sqrt(left.variance()) * size;
    found.push_back(
        {.position_um = likely[causes[k]],
         .force_nN = {force_nN[0], force_nN[1]},
         .chi_squared_gain = size.dot(numerics::solve_symmetric(covariance.block(row, row, each, each), size).col(0))});
  }
  std::ranges::stable_sort(found, std::greater(), &MissingAdhesion::chi_squared_gain);
  return found;
}

bool are_assumed(const std::vector<Adhesion>& adhesions) {
  return std::ranges::all_of(adhesions, [](const Adhesion& a) { return is_assumed(a.origin); });
}

MotionsBeside find_forces_beside(EnsembleFit& fit, MatrixXd shapes, Index n_last) {
  const Index n = shapes.cols();
  LinearData data = std::move(fit.data);
  Motions motions = joined_ahead(data.motions, n_last, {.shapes = std::move(shapes)});
  fit = with_forces_by(std::move(fit), with_motions(std::move(data), std::move(motions)));
  const VectorXd sigma = motions_beside(fit.data, fit).sigma,
                 values = motion_in(fit.data,
                                    fit.data.displacement_um - fit.data.response->displace(adhesion_forces_nN(fit)));
  const Index first = values.size() - n_last - n;
  return {values.segment(first, n), sigma.segment(first, n)};
}

EnsembleFit with_their_forces(EnsembleFit fit, std::vector<MissingAdhesion>& places, const Gel& gel, Index n_last) {
  std::vector<Vec2> there;
  for (const MissingAdhesion& place : places) there.push_back(place.position_um);
  const MotionsBeside found = find_forces_beside(fit, displacement_by(there, fit.data, gel), n_last);
  fit.forces.away_nN2 = 0;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Index each = fit.data.dimension, row = each * static_cast<Index>(k);
    const VectorXd force = found.values.segment(row, each), sigma = found.sigma.segment(row, each);
    places[k].force_nN = {force[0], force[1]};
    places[k].chi_squared_gain = force.cwiseQuotient(sigma).squaredNorm();
    const double along = force.normalized().cwiseProduct(sigma).norm();
    fit.forces.away_nN2 += along * along;
    fit.total_force_nN.value += force.norm() - std::min(force.norm(), along * along / (2 * force.norm()));
  }
  fit.total_force_nN.standard_error = std::hypot(fit.total_force_nN.standard_error, std::sqrt(fit.forces.away_nN2));
  return fit;
}

Cell held_at(Cell cell, const std::vector<MissingAdhesion>& places) {
  const std::size_t n_before = cell.adhesions.size();
  int id = 0;
  for (const Adhesion& a : cell.adhesions) id = std::max(id, a.adhesion_id);
  for (const MissingAdhesion& place : places)
    cell.adhesions.push_back({.adhesion_id = ++id,
                              .position_um = place.position_um,
                              .area_um2 = std::numbers::pi * kDisc_um * kDisc_um,
                              .major_axis_um = 2 * kDisc_um,
                              .minor_axis_um = 2 * kDisc_um,
                              .origin = AdhesionOrigin::beads});
  const auto holder = [&](Vec2 end) -> std::optional<int> {
    for (std::size_t a = n_before; a < cell.adhesions.size(); ++a)
      if (covers(cell.adhesions[a], end, kApart_um)) return cell.adhesions[a].adhesion_id;
    return {};
  };
  for (Fibre& f : cell.fibres) {
    if (!f.start_adhesion_id) f.start_adhesion_id = holder(f.points_um.front());
    if (!f.end_adhesion_id) f.end_adhesion_id = holder(f.points_um.back());
    if (f.start_adhesion_id == f.end_adhesion_id) f.end_adhesion_id.reset();
  }
  return cell;
}

std::vector<MissingAdhesion> with_forces_of(const Cell& cell, const VectorXd& forces_nN,
                                            std::vector<MissingAdhesion> held,
                                            const std::vector<MissingAdhesion>& further) {
  const Index each = forces_nN.size() / std::max<Index>(1, std::ssize(cell.adhesions));
  for (Index k = 0, at = forces_nN.size() - each * std::ssize(held); k < std::ssize(held); ++k, at += each)
    held[k].force_nN = {forces_nN[at], forces_nN[at + 1]};
  held.insert(held.end(), further.begin(), further.end());
  std::ranges::stable_sort(held, std::greater(), &MissingAdhesion::chi_squared_gain);
  return held;
}

EnsembleFit with_unfound(EnsembleFit fit, const Cell& cell, const std::vector<MissingAdhesion>& found) {
  if (found.empty() || are_assumed(cell.adhesions)) return fit;  // nobody looked for assumed ones, so none was missed
  const double unfound = unfound_nN(adhesion_forces_nN(fit), cell.adhesions, found);
  fit.forces.away_nN2 += unfound * unfound;
  fit.total_force_nN.value += unfound;
  fit.total_force_nN.standard_error = std::hypot(fit.total_force_nN.standard_error, unfound);
  return fit;
}

}  // namespace mbtfm::tensions
