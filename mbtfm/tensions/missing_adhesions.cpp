#include "mbtfm/tensions/missing_adhesions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/search.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/extent.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/near.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/greens/half_space.h"
#include "substrate/greens/models.h"

namespace mbtfm::tensions {

namespace {

constexpr double kStep_um = 1;    // of the places tried: adhesions are as long
constexpr double kDisc_um = 0.5;  // radius of an ordinary adhesion
constexpr double kReach_um = 6;   // of the beads asked: beyond, a force's field is that of many others
constexpr double kApart_um = 1;   // from an adhesion's rim: nearer, the adhesion's own force explains it

/// Displacement around a disc that is pulled, by distance: along the pull's component towards the bead, and across.
class DiscField {
 public:
  explicit DiscField(const Gel& gel) {
    const greens::HalfSpaceEllipse disc(
        gel, {.centre_um = {}, .semi_major_um = kDisc_um, .semi_minor_um = kDisc_um, .angle_rad = 0});
    for (std::size_t i = 0; i < table_.size(); ++i) {
      const greens::Sym2 g = disc.compliance_um_per_nN({kReach_um * static_cast<double>(i) / kLast, 0});
      table_[i] = {g.xx, g.yy};
    }
  }
  Eigen::Matrix2d at(Vec2 offset_um) const {
    const double r = std::sqrt(dot(offset_um, offset_um)), place = std::min(r / kReach_um * kLast, kLast - 1e-9);
    const auto i = static_cast<std::size_t>(place);
    const double share = place - static_cast<double>(i);
    const Vec2 along_across = (1 - share) * table_[i] + share * table_[i + 1];
    if (r <= 0) return along_across.x * Eigen::Matrix2d::Identity();
    const Eigen::Vector2d e(offset_um.x / r, offset_um.y / r);
    return along_across.y * Eigen::Matrix2d::Identity() + (along_across.x - along_across.y) * e * e.transpose();
  }

 private:
  static constexpr double kLast = 240;  // 25 nm apart
  std::array<Vec2, 241> table_;
};

/// The beads in use.
class UsedBeads {
 public:
  explicit UsedBeads(const LinearData& data) {
    std::vector<Vec3> places;
    for (Index b = 0; b < std::ssize(data.position_um); ++b) {
      if (data.weight_per_um[2 * b] <= 0) continue;
      beads_.push_back(b);
      places.push_back({data.position_um[b].x, data.position_um[b].y, 0});
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
  constexpr std::size_t kFewest = 10;  // beads for two numbers and a mean
  const std::vector<Index> beads = used.near(place_um);
  if (beads.size() < kFewest) return {place_um};
  std::vector<Eigen::Matrix2d> fields;
  Eigen::Matrix2d mean = Eigen::Matrix2d::Zero(), square = mean;
  Eigen::Vector2d score = Eigen::Vector2d::Zero();
  double all = 0;
  for (const Index b : beads) {
    fields.push_back(disc.at(data.position_um[b] - place_um));
    mean += weight[2 * b] * fields.back();
    all += weight[2 * b];
  }
  for (std::size_t k = 0; k < beads.size(); ++k) {
    const Index row = 2 * beads[k];
    const Eigen::Matrix2d field = fields[k] - mean / all;
    score += weight[row] * field * residual.segment<2>(row);
    square += weight[row] * field * field;
  }
  return {place_um, score.dot(Eigen::Vector2d(numerics::solve_symmetric(square, score))) / variance};
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
  for (double y = low.y; y <= high.y; y += kStep_um) {
    for (double x = low.x; x <= high.x; x += kStep_um) {
      if (is_free(cell, {x, y})) places.push_back({x, y});
    }
  }
  return places;
}

/// Places where what is left of the beads looks most like a force, as the beads around alone have it: besides all that
/// the adhesions exert, as these explain much of a force nearby, and besides the network's forces.
std::vector<Vec2> likely_places(const EnsembleFit& fit, const std::vector<Vec2>& places, const Gel& gel, int threads) {
  constexpr double kLeast = 10;      // of the gain: chance has it at each hundred and fiftieth place
  constexpr std::size_t kMost = 25;  // of either: where so many fail, the model is wrong as a whole
  const UsedBeads beads(fit.data);
  const DiscField disc(gel);
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

/// Displacement of the beads by forces on discs there, 2·beads × 2·places.
MatrixXd displacement_by(const std::vector<Vec2>& places, const LinearData& data, const Gel& gel) {
  std::vector<substrate::Ellipse> discs;
  for (const Vec2 place : places)
    discs.push_back({.centre_um = place, .semi_major_um = kDisc_um, .semi_minor_um = kDisc_um, .angle_rad = 0});
  return greens::make_greens(gel, {.model = substrate::ModelKind::layer}, data.threads)
      ->compliance_um_per_nN(data.position_um, discs);
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
    const Eigen::Vector2d force = forces_nN.segment<2>(2 * static_cast<Index>(a));
    if (force.norm() >= weakest_nN) n_above += 1;
    if (force.norm() >= weakest_nN || force.norm() <= 0) continue;
    double nearest_um = std::numeric_limits<double>::infinity(), cosine = 1;
    for (std::size_t b = 0; b < adhesions.size(); ++b) {
      const double apart_um = norm(adhesions[b].position_um - adhesions[a].position_um);
      if (a == b || apart_um >= nearest_um) continue;
      nearest_um = apart_um;
      cosine = force.normalized().dot(forces_nN.segment<2>(2 * static_cast<Index>(b)).normalized());
    }
    lacking_nN += (1 - cosine) * force.norm();
  }
  return static_cast<double>(found.size()) / (n_above + 1) * lacking_nN;
}

}  // namespace

bool is_free(const Cell& cell, Vec2 place_um) {
  if (!contains(cell.outline_um, place_um)) return false;
  for (const Polygon& hole : cell.holes_um) {
    if (contains(hole, place_um)) return false;
  }
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
  std::vector<std::vector<Index>> columns;
  for (Index k = 0; k < std::ssize(likely); ++k) columns.push_back({2 * k, 2 * k + 1});
  const std::vector<std::size_t> causes = causes_among(scores, columns, log_odds_against, kappa);
  if (causes.empty()) return {};
  std::vector<Index> of_causes;
  for (const std::size_t k : causes) of_causes.insert(of_causes.end(), columns[k].begin(), columns[k].end());
  const Scores there = at(scores, of_causes);
  const MatrixXd covariance = numerics::inverse_symmetric(there.information);
  const VectorXd sizes = numerics::matvec(covariance, there.scores);  // over s
  std::vector<MissingAdhesion> found;
  for (std::size_t k = 0; k < causes.size(); ++k) {
    const auto row = 2 * static_cast<Index>(k);
    const Eigen::Vector2d size = sizes.segment<2>(row), force_nN = std::sqrt(left.variance()) * size;
    found.push_back(
        {.position_um = likely[causes[k]],
         .force_nN = {force_nN.x(), force_nN.y()},
         .chi_squared_gain = size.dot(numerics::solve_symmetric(covariance.block<2, 2>(row, row), size).col(0))});
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
    const Eigen::Vector2d force = found.values.segment<2>(2 * static_cast<Index>(k)),
                          sigma = found.sigma.segment<2>(2 * static_cast<Index>(k));
    places[k].force_nN = {force.x(), force.y()};
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
  Index at = 2 * std::ssize(cell.adhesions) - 2 * std::ssize(held);
  for (MissingAdhesion& place : held) {
    place.force_nN = {forces_nN[at], forces_nN[at + 1]};
    at += 2;
  }
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
