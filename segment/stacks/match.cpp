#include "segment/stacks/track.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/near.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::stacks {
namespace {

Eigen::Vector3d as_eigen(Vec3 v) { return {v.x, v.y, v.z}; }
Vec3 as_vec(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

Eigen::Matrix3d turn_matrix(double angle_rad) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn(0, 0) = turn(1, 1) = std::cos(angle_rad);
  turn(1, 0) = std::sin(angle_rad), turn(0, 1) = -turn(1, 0);
  return turn;
}

/// The vectors from each bead to its nearest neighbours.
struct Constellations {
  int n = 0;  ///< of each
  std::vector<Eigen::Vector3f> vectors;
  const Eigen::Vector3f* of(std::size_t bead) const { return vectors.data() + bead * static_cast<std::size_t>(n); }
};

struct Cloud {
  const std::vector<PlacedBead>& beads;
  numerics::Near near;
  double spacing_um = 0;
};

Cloud cloud_of(const std::vector<PlacedBead>& beads) {
  std::vector<Vec3> points;
  Vec3 low = beads.front().position_um, high = low;
  for (const PlacedBead& bead : beads) {
    const Vec3 p = bead.position_um;
    points.push_back(p);
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const Vec3 size = high - low;
  const double spacing = std::cbrt(std::max(1e-9, size.x * size.y * size.z) / static_cast<double>(beads.size()));
  return {beads, numerics::Near(points, spacing), spacing};
}

Constellations constellations_of(const Cloud& cloud, int n, int threads) {
  const int most = std::min<int>(n, static_cast<int>(cloud.beads.size()) - 1);
  Constellations result{most, std::vector<Eigen::Vector3f>(cloud.beads.size() * static_cast<std::size_t>(most))};
  numerics::parallel_for_each(cloud.beads.size(), threads, [&](std::size_t bead) {
    const Vec3 here = cloud.beads[bead].position_um;
    std::size_t at = bead * static_cast<std::size_t>(most);
    const std::size_t end = at + static_cast<std::size_t>(most);
    for (const int other : cloud.near.nearest(here, most + 1)) {
      if (static_cast<std::size_t>(other) != bead && at < end)
        result.vectors[at++] = as_eigen(cloud.beads[other].position_um - here).cast<float>();
    }
  });
  return result;
}

/// How far a neighbour may lie from where it is expected.
struct Tolerance {
  double across_um = 0, along_z_um = 0;  ///< of places
  double strain = 0;                     ///< times the distance of the neighbour
};

/// Share of the first bead's neighbours that the second has, too, each weighed by how well.
double similarity_of(const Eigen::Vector3f* a, int n_a, const Eigen::Vector3f* b, int n_b,
                     const Eigen::Matrix3f& strain, const Tolerance& t) {
  constexpr int kFirst = 5;  // of another bead hardly one of five
  const auto xy2 = static_cast<float>(t.across_um * t.across_um), z2 = static_cast<float>(t.along_z_um * t.along_z_um);
  const auto g2 = static_cast<float>(t.strain * t.strain);
  float sum = 0;
  for (int i = 0; i < n_a; ++i) {
    if (i == kFirst && sum < 0.6f) return sum / static_cast<float>(n_a);
    const Eigen::Vector3f r = strain * a[i];
    const float slack = g2 * r.squaredNorm();
    const float wx = 1 / (xy2 + slack), wz = 1 / (z2 + slack);
    float nearest = 9;  // squared: further than three tolerances is no neighbour
    for (int j = 0; j < n_b; ++j) {
      const Eigen::Vector3f d = b[j] - r;
      nearest = std::min(nearest, wx * (d.x() * d.x() + d.y() * d.y()) + wz * d.z() * d.z());
    }
    if (nearest < 9) sum += std::exp(-0.5f * nearest);
  }
  return sum / static_cast<float>(n_a);
}

/// Of what neighbours leave.
double across_um(const Match& m) { return std::hypot(m.from_neighbours_um.x, m.from_neighbours_um.y); }

constexpr int kMostAround = 21;  // the bead itself among them

/// Displacement about a place as an affine function, by robust least squares over beads.
struct LocalMotion {
  Eigen::Vector3d at_place = Eigen::Vector3d::Zero();
  Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();
  double variance = 0, variance_z = 0;      ///< of at_place, by the standard errors
  double scatter_um = 0, scatter_z_um = 0;  ///< of the beads about it, robust standard deviations
  bool is_sound = false;
};

LocalMotion local_motion(Vec3 place, const std::vector<Moved>& samples, double scale_um) {
  LocalMotion motion;
  constexpr int kFewest = 6;  // for an affine map one knows more than four points of
  const auto n = static_cast<int>(samples.size());
  if (n < kFewest) return motion;
  constexpr int kMost = kMostAround;  // on the stack: this is called for each bead, over and over
  MBTFM_ASSERT(n <= kMost);
  Eigen::Matrix<double, Eigen::Dynamic, 4, 0, kMost, 4> x(n, 4);
  Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMost, 3> u(n, 3), left(n, 3);
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMost, 1> weight(n), certainty(n);
  for (int k = 0; k < n; ++k) {
    const Eigen::Vector3d d = as_eigen(samples[k].place_um - place) / scale_um;
    x.row(k) << 1, d.transpose();
    u.row(k) = as_eigen(samples[k].displacement_um).transpose();
    certainty[k] = 1 / (samples[k].sigma_um * samples[k].sigma_um + 1e-8 * scale_um * scale_um);
  }
  weight = certainty;
  Eigen::Matrix<double, 4, 3> solution;
  Eigen::Matrix4d normal;
  constexpr int kRounds = 6;
  std::vector<double> across(static_cast<std::size_t>(n)), along(static_cast<std::size_t>(n));
  for (int round = 0; round < kRounds; ++round) {
    normal = x.transpose() * weight.asDiagonal() * x;
    normal.diagonal() *= 1 + 1e-6;
    solution = normal.ldlt().solve(x.transpose() * weight.asDiagonal() * u);
    left = u - x * solution;
    for (int k = 0; k < n; ++k) {
      across[k] = std::hypot(left(k, 0), left(k, 1));
      along[k] = std::abs(left(k, 2));
    }
    // medians of a Rayleigh and of a folded normal variable; an affine fit of n points leaves (n - 4)/n of the variance
    const double freedom = std::sqrt(static_cast<double>(n) / (n - 4));
    const double floor = 1e-5 * scale_um;
    motion.scatter_um = std::max(floor, freedom * numerics::median(across) / 1.1774);
    motion.scatter_z_um = std::max(floor, freedom * numerics::median(along) / 0.6745);
    if (round + 1 == kRounds) break;  // the weights stay those of the solution
    for (int k = 0; k < n; ++k) {
      const double r = std::sqrt(across[k] * across[k] / (motion.scatter_um * motion.scatter_um) +
                                 along[k] * along[k] / (motion.scatter_z_um * motion.scatter_z_um)) /
                       6;  // three components: 4.685 for one
      weight[k] = r < 1 ? (1 - r * r) * (1 - r * r) * certainty[k] : 0;
    }
  }
  const Eigen::Vector4d share = normal.ldlt().solve(Eigen::Vector4d::Unit(0));
  for (int k = 0; k < n; ++k) {
    const double w = weight[k] * x.row(k).dot(share);
    motion.variance += w * w * samples[k].sigma_um * samples[k].sigma_um;
    motion.variance_z += w * w * samples[k].sigma_z_um * samples[k].sigma_z_um;
  }
  motion.at_place = solution.row(0).transpose();
  motion.gradient = solution.bottomRows<3>().transpose() / scale_um;
  motion.is_sound = motion.at_place.allFinite() && motion.gradient.allFinite();
  return motion;
}

/// The matcher's state.
class Matcher {
 public:
  Matcher(const std::vector<PlacedBead>& relaxed, const std::vector<PlacedBead>& stressed,
          const MatchParameters& parameters, int threads)
      : parameters_(parameters),
        threads_(threads),
        relaxed_(cloud_of(relaxed)),
        stressed_(cloud_of(stressed)),
        around_relaxed_(constellations_of(relaxed_, kNeighbours, threads)),
        around_stressed_(constellations_of(stressed_, 2 * kNeighbours, threads)) {
    std::vector<double> sigma, sigma_z;
    for (const auto* beads : {&relaxed, &stressed}) {
      for (const PlacedBead& bead : *beads) sigma.push_back(bead.sigma_um), sigma_z.push_back(bead.sigma_z_um);
    }
    spacing_um_ = relaxed_.spacing_um;
    // a difference of two places has the errors of both; a hundredth of the spacing is never too wide
    sigma_um_ = std::max(2 * numerics::median(sigma), 0.03 * spacing_um_);
    sigma_z_um_ = std::max(2 * numerics::median(sigma_z), 0.03 * spacing_um_);
    result_.spacing_um = spacing_um_;
    result_.matches.resize(relaxed.size());
  }

  Matching run() {
    find_first_motion();
    constexpr double kUnknownStrain = 0.12;
    const double reach =
        parameters_.largest_displacement_um > 0 ? parameters_.largest_displacement_um : 3 * spacing_um_;
    assign([&](std::size_t bead) { return look(bead, expected_of_all(bead), reach, kUnknownStrain, kLeast); });
    constexpr int kPasses = 3;
    for (int pass = 0; pass < kPasses; ++pass) {
      judge();
      measure_light();
      follow_neighbours();
    }
    judge();
    judge();  // once more, by the good ones alone
    return std::move(result_);
  }

 private:
  static constexpr int kNeighbours = 12;
  static constexpr double kLeast = 0.4;   ///< of a similarity: of wrong pairs fewer than one in 10^4 have it
  static constexpr double kMargin = 0.1;  ///< over the next best

  struct Expected {
    Vec3 place;
    Eigen::Matrix3d strain = Eigen::Matrix3d::Identity();
  };
  struct Found {
    int partner = -1;
    double score = 0, next = 0;
    double margin() const { return score - next; }
    void offer(int other, double of_other) {
      next = std::max(next, std::min(score, of_other));
      if (of_other > score) score = of_other, partner = other;
    }
  };

  double similarity(std::size_t bead, std::size_t partner, const Eigen::Matrix3d& strain, double slack) const {
    return similarity_of(around_relaxed_.of(bead), around_relaxed_.n, around_stressed_.of(partner), around_stressed_.n,
                         strain.cast<float>(), {sigma_um_, sigma_z_um_, slack});
  }

  // --- where to look first

  struct Vote {
    Vec3 from, to;
  };

  /// Beads that are met with again anywhere, under a turn.
  std::vector<Vote> votes_of(const Eigen::Matrix3d& turn, int n_asked) const {
    constexpr double kClear = 0.15, kSlack = 0.12;
    const std::size_t n = relaxed_.beads.size(), step = std::max<std::size_t>(1, n / static_cast<std::size_t>(n_asked));
    std::vector<std::size_t> asked;
    for (std::size_t k = step / 2; k < n; k += step) asked.push_back(k);
    std::vector<Found> found(asked.size());
    numerics::parallel_for(static_cast<int>(asked.size()), threads_, [&](int k) {
      for (std::size_t other = 0; other < stressed_.beads.size(); ++other)
        found[k].offer(static_cast<int>(other), similarity(asked[k], other, turn, kSlack));
    });
    std::vector<Vote> votes;
    for (std::size_t k = 0; k < asked.size(); ++k) {
      if (found[k].score > kLeast && found[k].margin() > kClear)
        votes.push_back({relaxed_.beads[asked[k]].position_um, stressed_.beads[found[k].partner].position_um});
    }
    return votes;
  }

  /// The votes that agree with the one most others agree with.
  std::vector<Vote> agreeing(const std::vector<Vote>& votes, const Eigen::Matrix3d& turn) const {
    std::vector<Vec3> shifts;
    for (const Vote& v : votes) shifts.push_back(v.to - centre_ - as_vec(turn * as_eigen(v.from - centre_)));
    std::vector<Vote> best;
    for (const Vec3& shift : shifts) {
      std::vector<Vote> with_it;
      for (std::size_t k = 0; k < votes.size(); ++k) {
        const double lever = norm(votes[k].from - centre_);
        constexpr double kTurn = 0.05;  // half of the step between turns that are tried out
        if (norm(shifts[k] - shift) < spacing_um_ + kTurn * lever) with_it.push_back(votes[k]);
      }
      if (with_it.size() > best.size()) best = std::move(with_it);
    }
    return best;
  }

  void find_first_motion() {
    Vec3 sum;
    for (const PlacedBead& bead : relaxed_.beads) sum += bead.position_um;
    centre_ = (1 / static_cast<double>(relaxed_.beads.size())) * sum;
    constexpr int kAsked = 300, kAskedOfTurn = 80;
    const auto are_enough = [](std::size_t n, int asked) { return n >= 8 && static_cast<double>(n) > 0.15 * asked; };
    const auto n_asked = [&](int most) { return std::min<int>(most, static_cast<int>(relaxed_.beads.size())); };
    double turn_rad = 0;
    std::vector<Vote> votes = agreeing(votes_of(turn_matrix(0), kAsked), turn_matrix(0));
    if (!are_enough(votes.size(), n_asked(kAsked))) {
      constexpr int kSteps = 9;  // of 5 degrees to either side
      std::size_t most = 0;
      for (int k = -kSteps; k <= kSteps; ++k) {
        const double angle = k * 5 * std::numbers::pi / 180;
        const std::size_t n = agreeing(votes_of(turn_matrix(angle), kAskedOfTurn), turn_matrix(angle)).size();
        if (n > most) most = n, turn_rad = angle;
      }
      if (most > 0) votes = agreeing(votes_of(turn_matrix(turn_rad), kAsked), turn_matrix(turn_rad));
    }
    if (!are_enough(votes.size(), n_asked(kAsked))) {
      throw beads::NotFollowed("the stressed stack", "the relaxed stack's beads, displaced",
                               "the surroundings of " + std::to_string(votes.size()) + " of " +
                                   std::to_string(n_asked(kAsked)) + " beads met with again");
    }
    fit_first_motion(votes);
  }

  /// The turn about z and the shift of the votes: in the plane the turn of least squares (Procrustes).
  void fit_first_motion(std::vector<Vote> votes) {
    for (int round = 0; round < 3; ++round) {
      Vec3 from, to;
      const double n = static_cast<double>(votes.size());
      for (const Vote& v : votes) from += (1 / n) * v.from, to += (1 / n) * v.to;
      double along = 0, across = 0;
      for (const Vote& v : votes) {
        const Vec3 a = v.from - from, b = v.to - to;
        along += a.x * b.x + a.y * b.y, across += a.x * b.y - a.y * b.x;
      }
      RigidMotion& motion = result_.first;
      motion.turn_rad = std::atan2(across, along);
      motion.centre = from;
      motion.shift_um = to - from;
      const auto off = [&](const Vote& v) { return norm(v.to - motion.at(v.from)); };
      std::vector<double> all_off;
      for (const Vote& v : votes) all_off.push_back(off(v));
      const double limit = 3 * numerics::median_in(all_off) + sigma_z_um_;
      std::erase_if(votes, [&](const Vote& v) { return !(off(v) < limit); });
    }
  }

  Expected expected_of_all(std::size_t bead) const {
    return {result_.first.at(relaxed_.beads[bead].position_um), turn_matrix(result_.first.turn_rad)};
  }

  // --- pairs

  /// The best partner near a place.
  Found look(std::size_t bead, const Expected& expected, double reach_um, double slack, double least) const {
    constexpr int kMost = 120;
    Found best;
    const double light = relaxed_.beads[bead].brightness;
    for (const int other : stressed_.near.within(expected.place, reach_um, kMost)) {
      const PlacedBead& o = stressed_.beads[other];
      double score = similarity(bead, static_cast<std::size_t>(other), expected.strain, slack);
      if (is_nearby_) {
        const Vec3 d = o.position_um - expected.place;
        const double far = std::hypot(d.x, d.y, d.z * sigma_um_ / sigma_z_um_) / (2 * sigma_um_ + 0.1 * spacing_um_);
        score += 0.5 * std::exp(-0.5 * far * far);
      }
      if (light_spread_ > 0 && light > 0 && o.brightness > 0) {
        const double off = (std::log(o.brightness / light) - light_ratio_) / light_spread_;
        score -= 0.1 * std::min(2.0, off * off / 9);
      }
      best.offer(other, score);
    }
    if (best.score < least) best.partner = -1;
    return best;
  }

  /// Look for all; of the beads that claim the same partner the best has it.
  template <class Look>
  void assign(const Look& look_for) {
    const std::size_t n = relaxed_.beads.size();
    std::vector<Found> found(n);
    numerics::parallel_for_each(n, threads_, [&](std::size_t bead) { found[bead] = look_for(bead); });
    std::vector<int> owner(stressed_.beads.size(), -1);
    for (std::size_t bead = 0; bead < n; ++bead) {
      if (found[bead].partner < 0) continue;
      int& o = owner[found[bead].partner];
      if (o < 0 || found[bead].score > found[o].score) o = static_cast<int>(bead);
    }
    for (std::size_t bead = 0; bead < n; ++bead) {
      Match& m = result_.matches[bead];
      m = {};
      if (found[bead].partner < 0) continue;
      const bool is_owner = owner[found[bead].partner] == static_cast<int>(bead);
      if (!is_owner || found[bead].margin() < kMargin) {
        m.flag = TrackFlag::ambiguous;
        continue;
      }
      m.partner = found[bead].partner, m.flag = TrackFlag::none;
    }
    gather_good();
  }

  // --- neighbours

  void gather_good() {
    good_.clear();
    std::vector<Vec3> places;
    for (std::size_t bead = 0; bead < result_.matches.size(); ++bead) {
      if (result_.matches[bead].flag != TrackFlag::none) continue;
      good_.push_back(static_cast<int>(bead));
      places.push_back(relaxed_.beads[bead].position_um);
    }
    near_good_ = numerics::Near(places, spacing_um_);
  }

  Moved sample_of(std::size_t bead) const {
    const PlacedBead &a = relaxed_.beads[bead], &b = stressed_.beads[result_.matches[bead].partner];
    return {a.position_um, b.position_um - a.position_um, std::hypot(a.sigma_um, b.sigma_um),
            std::hypot(a.sigma_z_um, b.sigma_z_um)};
  }

  /// From the good beads around one, without itself.
  LocalMotion motion_around(std::size_t bead) const {
    std::vector<Moved> samples;
    for (const int k : near_good_.nearest(relaxed_.beads[bead].position_um, kMostAround)) {
      const auto other = static_cast<std::size_t>(good_[k]);
      if (other != bead) samples.push_back(sample_of(other));
    }
    return local_motion(relaxed_.beads[bead].position_um, samples, spacing_um_);
  }

  /// Flag what is further from its neighbours' motion than standard deviations of both explain.
  void judge() {
    // of three components; one is beyond t as often as three are beyond t + 0.65, about t = 4
    const double limit = parameters_.outlier_threshold + 0.65;
    numerics::parallel_for_each(result_.matches.size(), threads_, [&](std::size_t bead) {
      Match& m = result_.matches[bead];
      if (m.partner < 0) return;
      const LocalMotion around = motion_around(bead);
      const Moved own = sample_of(bead);
      m.from_neighbours_um = own.displacement_um - as_vec(around.at_place);
      m.sigma_um = std::sqrt(own.sigma_um * own.sigma_um + around.variance);
      m.sigma_z_um = std::sqrt(own.sigma_z_um * own.sigma_z_um + around.variance_z);
      const double across = across_um(m) / std::hypot(m.sigma_um, around.scatter_um),
                   along = m.from_neighbours_um.z / std::hypot(m.sigma_z_um, around.scatter_z_um);
      const bool agrees = around.is_sound && std::hypot(across, along) <= limit;
      m.flag = agrees ? TrackFlag::none : TrackFlag::neighbours_disagree;
    });
    // places may be less exact than they claim, or claim nothing
    std::vector<double> across, along;
    for (const Match& m : result_.matches)
      if (m.partner >= 0) across.push_back(across_um(m)), along.push_back(std::abs(m.from_neighbours_um.z));
    if (!across.empty()) {
      sigma_um_ = std::max(sigma_um_, 1.5 * numerics::median_in(across));
      sigma_z_um_ = std::max(sigma_z_um_, 3 * numerics::median_in(along));
    }
    gather_good();
  }

  void measure_light() {
    std::vector<double> ratios;
    for (const int k : good_) {
      const double a = relaxed_.beads[k].brightness;
      const int partner = result_.matches[k].partner;
      const double b = stressed_.beads[partner].brightness;
      if (a > 0 && b > 0) ratios.push_back(std::log(b / a));
    }
    if (ratios.size() < 20) return;
    light_ratio_ = numerics::median(ratios);
    for (double& r : ratios) r = std::abs(r - light_ratio_);
    light_spread_ = std::max(0.05, 1.4826 * numerics::median(ratios));
  }

  void follow_neighbours() {
    is_nearby_ = true;
    constexpr double kSlack = 0.05, kReach = 0.8, kLeastNearby = 0.5;
    assign([&](std::size_t bead) {
      const LocalMotion around = motion_around(bead);
      if (!around.is_sound) return Found{};
      const Expected expected{relaxed_.beads[bead].position_um + as_vec(around.at_place),
                              Eigen::Matrix3d::Identity() + around.gradient};
      return look(bead, expected, kReach * spacing_um_ + 4 * sigma_z_um_, kSlack, kLeastNearby);
    });
  }

  MatchParameters parameters_;
  int threads_;
  Cloud relaxed_, stressed_;
  Constellations around_relaxed_, around_stressed_;
  double spacing_um_ = 0, sigma_um_ = 0, sigma_z_um_ = 0;
  Vec3 centre_;
  bool is_nearby_ = false;
  double light_ratio_ = 0, light_spread_ = 0;
  std::vector<int> good_;
  numerics::Near near_good_;
  Matching result_;
};

}  // namespace

Vec3 RigidMotion::at(Vec3 x) const { return as_vec(turn_matrix(turn_rad) * as_eigen(x - centre)) + centre + shift_um; }

Matching match(const std::vector<PlacedBead>& relaxed, const std::vector<PlacedBead>& stressed,
               const MatchParameters& parameters, int threads) {
  return Matcher(relaxed, stressed, parameters, threads).run();
}

}  // namespace mbtfm::stacks
