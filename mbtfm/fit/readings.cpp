#include "mbtfm/fit/readings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "mbtfm/fit/ready_cell.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/fit_results.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/neighbour_bins.h"
#include "substrate/response.h"

namespace mbtfm::fit {

using namespace tensions;

namespace {

/// What the model leaves of the beads.
struct Unexplained {
  double squares = 0;
  double share = 1;  ///< of what the beads do, both beyond noise
};

/// @param noise_um  of a component, as far beads show it: of a field that was smoothed it is far below what is stated
Unexplained unexplained_of(const LinearData& data, double noise_um) {
  const VectorXd all = data.weight_per_um.cwiseProduct(less_motion(data, data.displacement_um));
  const double shown = noise_um * noise_um * data.weight_per_um.squaredNorm() / static_cast<double>(all.size());
  const double variance = data.has_errors ? std::min(1.0, shown) : shown;
  const auto n_free = static_cast<double>(std::max<Index>(1, data.n_used - data.reduced.n_felt));
  const double left = data.reduced.floor_squared - variance * n_free;
  const double moved = all.squaredNorm() - variance * static_cast<double>(data.n_used);
  // below its own scatter the difference from noise shows nothing
  const double scatter = std::max(variance * std::sqrt(2 * n_free), 1e-300);
  return {data.reduced.floor_squared, std::max(left, scatter) / std::max(moved, scatter)};
}

/// The reading that leaves the fewest squares.
struct Best {
  double squares = 0;
  Reading reading;
  explicit Best(Unexplained as_is)
      : squares(as_is.squares),
        reading{.what = {}, .unexplained_share = as_is.share, .unexplained_as_is = as_is.share} {}
  /// Whether it is better than all before.
  bool consider(const std::string& what, Unexplained left) {
    if (left.squares >= squares) return false;
    squares = left.squares;
    reading.what = what;
    reading.unexplained_share = left.share;
    return true;
  }
};

struct Linear {
  double xx = 1, xy = 0, yx = 0, yy = 1;
  Vec2 of(Vec2 v) const { return {xx * v.x + xy * v.y, yx * v.x + yy * v.y}; }
};

struct Change {
  std::string what;
  Linear places, components;
};

/// The seven ways in which a picture lies wrong, and tables with a component of the other sign, or both exchanged.
std::vector<Change> changes() {
  constexpr Linear kSame{}, kLeftRight{-1, 0, 0, 1}, kUpDown{1, 0, 0, -1}, kHalfTurn{-1, 0, 0, -1},
      kTransposed{0, 1, 1, 0}, kRight{0, -1, 1, 0}, kLeft{0, 1, -1, 0}, kOther{0, -1, -1, 0};
  const auto images = [](const std::string& how, Linear by) {
    return Change{"once the bead images are " + how, by, by};
  };
  const auto table = [](const std::string& how, Linear by) { return Change{"once " + how, kSame, by}; };
  return {images("mirrored from left to right", kLeftRight), images("mirrored from top to bottom", kUpDown),
          images("turned by 180 degrees", kHalfTurn), images("turned by 90 degrees to the right", kRight),
          images("turned by 90 degrees to the left", kLeft),
          images("transposed (rows exchanged with columns)", kTransposed),
          images("transposed and turned by 180 degrees", kOther),
          // forces may pull or push: they do not show which of the two has the wrong sign
          table("uy (or ux) gets the other sign", kUpDown), table("ux and uy are exchanged", kTransposed)};
}

/// Each k-th, so that some hundred are left: enough to distinguish the readings.
DisplacementField some_of(const DisplacementField& beads) {
  constexpr std::size_t kEnough = 400;
  const std::size_t step = 1 + beads.size() / kEnough;
  DisplacementField some;
  for (std::size_t i = 0; i < beads.size(); i += step) some.push_back(beads[i]);
  return some;
}

DisplacementField changed(DisplacementField beads, const Change& by, Vec2 middle) {
  for (Bead& b : beads) {
    b.position_um = middle + by.places.of(b.position_um - middle);
    b.displacement_um = by.components.of(b.displacement_um);
  }
  return beads;
}

DisplacementField scaled(DisplacementField beads, double factor) {
  for (Bead& b : beads) b.position_um = factor * b.position_um;
  return beads;
}

/// The scale that brings what moves to where the cell is, both seen from the images' common corner.
double rough_scale(const Cell& cell, const DisplacementField& beads) {
  Vec2 moved, held;
  double squares = 0;
  for (const Bead& b : beads) {
    const double square = dot(b.displacement_um, b.displacement_um);
    moved += square * b.position_um;
    squares += square;
  }
  for (const Adhesion& a : cell.adhesions) held += (1.0 / static_cast<double>(cell.adhesions.size())) * a.position_um;
  return norm(held) * squares / std::max(norm(moved), 1e-300);
}

struct Scale {
  double factor = 1;
  Unexplained unexplained;
};

/// The best one about the rough one, in steps of 4 % and then of 2 %: of a field whose middle is 50 um from the corner
/// that is a micrometre, an adhesion. What moves and the adhesions have middles that differ by some tenths.
template <class UnexplainedAt>
Scale best_scale(double rough, const UnexplainedAt& unexplained_at) {
  constexpr double kStep = 0.04;
  constexpr int kSteps = 8;
  Scale best{.factor = 1, .unexplained = {std::numeric_limits<double>::infinity(), 1}};
  const auto consider = [&](double factor) {
    constexpr double kSame = 0.1;  // the reading as it is
    if (std::abs(std::log(factor)) < kSame) return;
    const Unexplained left = unexplained_at(factor);
    if (left.squares < best.unexplained.squares) best = {factor, left};
  };
  for (int k = -kSteps; k <= kSteps; ++k) consider(rough * std::exp(kStep * k));
  const double coarse = best.factor;
  for (const double step : {-0.5 * kStep, 0.5 * kStep}) consider(coarse * std::exp(step));
  return best;
}

/// What a program shows of these fields that smooths them with a Gaussian of this standard deviation.
/// @param fields  2·beads × any number
MatrixXd smoothed(const MatrixXd& fields, const std::vector<Vec2>& beads_um, double sigma_um) {
  const double reach_um = 3 * sigma_um;
  numerics::Grid grid(beads_um, reach_um);
  for (std::size_t i = 0; i < beads_um.size(); ++i) grid.add(static_cast<int>(i), beads_um[i], beads_um[i]);
  MatrixXd result = MatrixXd::Zero(fields.rows(), fields.cols());
  for (std::size_t i = 0; i < beads_um.size(); ++i) {
    double sum = 0;
    const auto row = 2 * static_cast<Index>(i);
    grid.for_each_near(beads_um[i], beads_um[i], reach_um, [&](int j) {
      const Vec2 d = beads_um[j] - beads_um[i];
      if (dot(d, d) > reach_um * reach_um) return;
      const double weight = std::exp(-0.5 * dot(d, d) / (sigma_um * sigma_um));
      result.middleRows<2>(row) += weight * fields.middleRows<2>(2 * static_cast<Index>(j));
      sum += weight;
    });
    result.middleRows<2>(row) /= sum;
  }
  return result;
}

/// The displacements that the data are of, with the errors that weigh them.
DisplacementField beads_of(const LinearData& data) {
  DisplacementField beads(data.position_um.size());
  for (std::size_t i = 0; i < beads.size(); ++i) {
    const auto row = 2 * static_cast<Index>(i);
    const double weight = data.weight_per_um[row];
    beads[i] = {.position_um = data.position_um[i],
                .displacement_um = {data.displacement_um[row], data.displacement_um[row + 1]},
                .sigma_um = weight > 0 ? 1 / weight : 1,  // one that is not used counts nothing
                .flag = {}};
  }
  return beads;
}

}  // namespace

Reading best_smoothing(const LinearData& data, const MatrixXd& force_derivatives, double noise_um) {
  const MatrixXd fields = data.response->displace(force_derivatives);
  const DisplacementField beads = beads_of(data);
  const MatrixXd motions = affine_motions(beads);
  std::vector<bool> is_used;
  for (Index row = 0; row < data.weight_per_um.size(); row += 2) is_used.push_back(data.weight_per_um[row] > 0);
  const auto left_by = [&](MatrixXd of) {
    return unexplained_of(reduce(beads, substrate::dense_response(std::move(of)), is_used, data.threads, motions),
                          noise_um);
  };
  Best best(left_by(fields));
  // a field that was smoothed widely is nearer to one smoothed a little than to none
  for (const double sigma_um : {0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0})
    if (!best.consider("once it is smoothed, too, over " + brief(2 * sigma_um) + " um",
                       left_by(smoothed(fields, data.position_um, sigma_um))))
      break;
  return best.reading;
}

Reading best_reading(const GelUnderCell& on, const DisplacementField& given, const MatrixXd& force_derivatives,
                     double noise_um) {
  const DisplacementField beads = some_of(given);
  const auto left_of = [&](const DisplacementField& as) {
    MatrixXd fields = response_of(on, as)->displace(force_derivatives);
    return unexplained_of(reduce(as, substrate::dense_response(std::move(fields)), {}, on.threads, affine_motions(as)),
                          noise_um);
  };
  Best best(left_of(beads));
  const Vec2 middle = extent_of(points_of(given)).middle_um();  // of the images, which the beads fill
  for (const Change& change : changes()) best.consider(change.what, left_of(changed(beads, change, middle)));
  if (best.reading.unexplained_share < 0.5 * best.reading.unexplained_as_is) return best.reading;
  const Scale scale = best_scale(rough_scale(on.cell, beads), [&](double s) { return left_of(scaled(beads, s)); });
  best.consider("once the places of the beads are multiplied by " + brief(scale.factor), scale.unexplained);
  return best.reading;
}

std::optional<Finding> noticed_reading(Symptom symptom, const Reading& reading) {
  return noticed(symptom, reading.unexplained_as_is / reading.unexplained_share, {.at = reading.what});
}

bool is_read_wrongly(const Readings& readings) {
  return (readings.other && noticed_reading(Symptom::read_otherwise, *readings.other)) ||
         (readings.smoothed && noticed_reading(Symptom::field_smoothed, *readings.smoothed));
}

}  // namespace mbtfm::fit
