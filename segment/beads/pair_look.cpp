#include "segment/beads/pair_look.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/order_statistics.h"
#include "segment/beads/coarse_field.h"
#include "segment/beads/given_field.h"

namespace mbtfm::beads {
namespace {

cv::Mat small_picture(const images::Image& image, int binning) {
  constexpr double kWide_px = 8;  // wider than any bead
  Plane plane = compressed(without_background(images::binned(image, binning), kWide_px));
  return cv::Mat(plane.height, plane.width, CV_32F, plane.values.data()).clone();
}

cv::Mat oriented(const cv::Mat& picture, const Orientation& as) {
  cv::Mat flipped, turned;
  if (as.is_mirrored) cv::flip(picture, flipped, 1);
  const cv::Mat& mirrored = as.is_mirrored ? flipped : picture;
  constexpr int kTurns[] = {-1, cv::ROTATE_90_CLOCKWISE, cv::ROTATE_180, cv::ROTATE_90_COUNTERCLOCKWISE};
  if (as.quarter_turns == 0) return mirrored;
  cv::rotate(mirrored, turned, kTurns[as.quarter_turns]);
  return turned;
}

}  // namespace

PairLook look_at_pair(const images::Image& relaxed, const images::Image& stressed) {
  constexpr int kSide_px = 500;
  constexpr double kHigher = 3;
  const int binning = std::clamp(std::min(relaxed.width, relaxed.height) / kSide_px, 1, images::kLargestBinning);
  const cv::Mat from = small_picture(relaxed, binning), to = small_picture(stressed, binning);
  cv::Mat window;
  cv::createHanningWindow(window, from.size(), CV_32F);
  double height = 0;
  const cv::Point2d shift = cv::phaseCorrelate(from, to, window, &height);
  PairLook look{.shift_px = binning * Vec2{shift.x, shift.y}, .orientation = {}};
  double highest = kHigher * height;
  for (const Orientation& other : kOtherOrientations) {
    const cv::Mat turned = oriented(to, other);
    if (turned.size() != from.size()) continue;
    double of_other = 0;
    cv::phaseCorrelate(from, turned, window, &of_other);
    if (of_other <= highest) continue;
    highest = of_other;
    look.orientation = other.name;
  }
  return look;
}

namespace {

Vec2 oriented(Vec2 v, const Orientation& as) {
  if (as.is_mirrored) v.x = -v.x;
  for (int k = 0; k < as.quarter_turns; ++k) v = {-v.y, v.x};
  return v;
}

/// Between the lengths of the displacements and the picture's brightness at their places.
double correlation(const DisplacementField& field, const images::Image& picture, double pixel_um,
                   const Orientation& as) {
  const Vec2 middle = 0.5 * pixel_um * Vec2{double(picture.width), double(picture.height)};
  double n = 0, sum_u = 0, sum_b = 0, uu = 0, bb = 0, ub = 0;
  for (const Bead& bead : field) {
    const Vec2 at = 1 / pixel_um * (middle + oriented(bead.position_um - middle, as));
    if (!bead.flag.empty() || !(at.x >= 0 && at.y >= 0 && at.x < picture.width && at.y < picture.height)) continue;
    const double u = norm(bead.displacement_um), b = picture.at(static_cast<int>(at.x), static_cast<int>(at.y));
    n += 1, sum_u += u, sum_b += b, uu += u * u, bb += b * b, ub += u * b;
  }
  const double spread = (n * uu - sum_u * sum_u) * (n * bb - sum_b * sum_b);
  return spread > 0 ? (n * ub - sum_u * sum_b) / std::sqrt(spread) : 0;
}

}  // namespace

FieldLook look_at_field(const DisplacementField& field, const images::Image& cell, double pixel_um) {
  constexpr double kCoarse_um = 2, kNearer = 0.2, kInward = -0.4, kNotInward = -0.2;
  const int binning = std::clamp(static_cast<int>(kCoarse_um / pixel_um), 1, std::min(cell.width, cell.height));
  const images::Image coarse = images::binned(cell, binning);
  FieldLook look;
  double nearest = correlation(field, coarse, binning * pixel_um, {}) + kNearer, inward = kInward;
  const bool points_inward = outwardness(field) < kNotInward;
  for (const Orientation& other : kOtherOrientations) {
    const double near = correlation(field, coarse, binning * pixel_um, other);
    if (near > nearest) {
      nearest = near;
      look.places = other.name;
    }
    DisplacementField turned = field;
    for (Bead& bead : turned) bead.displacement_um = oriented(bead.displacement_um, other);
    if (const double of_turned = outwardness(turned); !points_inward && of_turned < inward) {
      inward = of_turned;
      look.vectors = other.name;
    }
  }
  return look;
}

namespace {

/// u = (1+nu) / (pi E r) [ (1-nu) F + nu (e.F) e ] of forces spread over an adhesion (Landau & Lifshitz, Theory of
/// Elasticity, §8), but for E, which the prior's width takes up.
MatrixXd response(const std::vector<Vec2>& places, const std::vector<Vec2>& sources) {
  constexpr double kPoisson = 0.49, kRadius_um = 0.7;
  MatrixXd G(2 * static_cast<Index>(places.size()), 2 * static_cast<Index>(sources.size()));
  for (Index k = 0; k < static_cast<Index>(sources.size()); ++k) {
    for (Index i = 0; i < static_cast<Index>(places.size()); ++i) {
      const Vec2 d = places[static_cast<std::size_t>(i)] - sources[static_cast<std::size_t>(k)];
      const double r = std::hypot(norm(d), kRadius_um);
      const Vec2 e = 1 / r * d;
      G(2 * i, 2 * k) = (1 - kPoisson + kPoisson * e.x * e.x) / r;
      G(2 * i + 1, 2 * k + 1) = (1 - kPoisson + kPoisson * e.y * e.y) / r;
      G(2 * i, 2 * k + 1) = G(2 * i + 1, 2 * k) = kPoisson * e.x * e.y / r;
    }
  }
  return G;
}

/// Logarithm of the evidence for forces at `sources`, up to a constant of the data: normal forces, whose width has the
/// most evidence (MacKay, Neural Comput 4 (1992) 415), and residuals of Student's t with three degrees of freedom, as
/// some adhesions are not found. Its weights are iterated.
double log_evidence(const std::vector<Vec2>& places, const VectorXd& u, const std::vector<Vec2>& sources) {
  const MatrixXd G = response(places, sources);
  const auto n = static_cast<Index>(places.size());
  VectorXd root_weights = VectorXd::Ones(2 * n);
  double evidence = 0;
  for (int iteration = 0; iteration < 3; ++iteration) {
    const MatrixXd weighted = root_weights.asDiagonal() * G;
    const VectorXd y = root_weights.cwiseProduct(u);
    const auto [values, vectors] = numerics::symmetric_eigen(numerics::gram(weighted));
    const VectorXd c = numerics::transposed_matvec(vectors, numerics::transposed_matvec(weighted, y));
    double best = -std::numeric_limits<double>::infinity(), ratio = 0, penalty = 0;
    for (double r = 1e-2 / values.mean(); r < 1e7 / values.mean(); r *= 10) {
      double squares = y.squaredNorm(), volume = 0;
      for (Index j = 0; j < c.size(); ++j) {
        const double value = std::max(0.0, values[j]);
        squares -= c[j] * c[j] * r / (1 + r * value);
        volume += 0.5 * std::log1p(r * value);
      }
      const double likelihood = -0.5 * root_weights.squaredNorm() * std::log(squares) - volume;
      if (likelihood > best) best = likelihood, ratio = r, penalty = volume;
    }
    VectorXd x(c.size());
    for (Index j = 0; j < c.size(); ++j) x[j] = c[j] * ratio / (1 + ratio * std::max(0.0, values[j]));
    const VectorXd residual = numerics::minus_matvec(u, G, numerics::matvec(vectors, x));
    std::vector<double> lengths;
    for (Index i = 0; i < n; ++i) lengths.push_back(std::hypot(residual[2 * i], residual[2 * i + 1]));
    const double sigma = std::max(1e-12, numerics::quantile(lengths, 0.5) / 1.1774);  // Rayleigh's median
    evidence = -penalty - 2 * static_cast<double>(n) * std::log(sigma);
    for (Index i = 0; i < n; ++i) {
      const double square = std::pow(lengths[static_cast<std::size_t>(i)] / sigma, 2);
      evidence -= 1.5 * std::log1p(square / 3);
      root_weights[2 * i] = root_weights[2 * i + 1] = 1 / std::sqrt(1 + square / 4);
    }
  }
  return evidence;
}

}  // namespace

std::string orientation_of_forces(const DisplacementField& field, const std::vector<Vec2>& adhesions_um,
                                  Vec2 middle_um) {
  constexpr std::size_t kVectors = 600, kFewest = 100;  // enough to distinguish eight readings in a second
  // with up to half of the adhesions missing no other reading of 36 sound fields had more than 10; of fields that were
  // turned, with all adhesions, the right one had 23 or more
  constexpr double kSure = 15;
  std::vector<const Bead*> beads;
  for (const Bead& bead : field)
    if (bead.flag.empty()) beads.push_back(&bead);
  if (beads.size() < kFewest || adhesions_um.size() < 3) return "";
  const std::size_t n = std::min(kVectors, beads.size());
  std::vector<double> along_x, along_y;
  for (const Bead* bead : beads) along_x.push_back(bead->displacement_um.x), along_y.push_back(bead->displacement_um.y);
  const Vec2 common{numerics::quantile(std::move(along_x), 0.5), numerics::quantile(std::move(along_y), 0.5)};
  const auto evidence_of = [&](const Orientation& as) {
    std::vector<Vec2> places;
    VectorXd u(2 * static_cast<Index>(n));
    for (std::size_t k = 0; k < n; ++k) {
      const Bead& bead = *beads[k * beads.size() / n];
      const Vec2 turned = oriented(bead.displacement_um - common, as);
      places.push_back(middle_um + oriented(bead.position_um - middle_um, as));
      u[2 * static_cast<Index>(k)] = turned.x;
      u[2 * static_cast<Index>(k) + 1] = turned.y;
    }
    return log_evidence(places, u, adhesions_um);
  };
  double most = evidence_of({"", 0, false}) + kSure;
  std::string name;
  for (const Orientation& other : kOtherOrientations)
    if (const double evidence = evidence_of(other); evidence > most) most = evidence, name = other.name;
  return name;
}

namespace {

constexpr double kLongSide_px = 1000;  // a page shows it 700 px wide
constexpr double kBrightest = 0.998;   // beads cover some per cent of an image

cv::Mat matrix_of(const images::Image& image) {
  return {image.height, image.width, CV_32F, const_cast<float*>(image.pixels.data())};
}

/// A picture in another's frame, and where it shows something.
using Moved = std::tuple<cv::Mat, cv::Mat>;

/// @param flags  WARP_INVERSE_MAP: the placement leads from the result to the image
Moved moved(const cv::Mat& image, const Placement& placement, int flags) {
  const Vec2 zero = placement.of({0, 0}), x = placement.of({1, 0}) - zero, y = placement.of({0, 1}) - zero;
  const cv::Matx23d matrix(x.x, y.x, zero.x, x.y, y.y, zero.y);
  const cv::Mat whole(image.size(), CV_8U, cv::Scalar(255));
  cv::Mat values, is_seen;
  cv::warpAffine(image, values, matrix, image.size(), flags | cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  cv::warpAffine(whole, is_seen, matrix, image.size(), flags | cv::INTER_NEAREST);
  return {values, is_seen};
}

cv::Mat stretched(const cv::Mat& image, const cv::Mat& is_seen, cv::Size size) {
  cv::Mat values;
  cv::resize(image, values, size, 0, 0, cv::INTER_AREA);
  std::vector<double> seen;
  for (int j = 0; j < size.height; ++j) {
    for (int i = 0; i < size.width; ++i) {
      if (is_seen.at<unsigned char>(j, i) != 0) seen.push_back(values.at<float>(j, i));
    }
  }
  const double low = numerics::quantile(seen, 0.5), high = numerics::quantile(seen, kBrightest);
  cv::Mat light = cv::min(cv::max((values - low) / std::max(high - low, 1e-12), 0.0), 1.0);
  light.setTo(0, is_seen == 0);
  return 255 * light;
}

}  // namespace

images::Picture picture_of_beads(const images::Image& relaxed, const images::Image& stressed,
                                 const Placement& placement, CellWith cell_with) {
  if (relaxed.width != stressed.width || relaxed.height != stressed.height)
    throw InvalidData("the bead images", "two of one size", "two sizes");
  cv::Mat at_rest = matrix_of(relaxed), pulled = matrix_of(stressed), is_seen;
  if (cell_with == CellWith::relaxed) {
    std::tie(pulled, is_seen) = moved(pulled, placement, cv::WARP_INVERSE_MAP);
  } else {
    std::tie(at_rest, is_seen) = moved(at_rest, placement, 0);
  }
  const double reduction = std::max(1.0, std::max(relaxed.width, relaxed.height) / kLongSide_px);
  images::Picture picture;
  picture.width = std::max(1, cvFloor(relaxed.width / reduction));
  picture.height = std::max(1, cvFloor(relaxed.height / reduction));
  picture.rgb.assign(3 * static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height), 0);
  cv::Mat rgb(picture.height, picture.width, CV_8UC3, picture.rgb.data());
  cv::resize(is_seen, is_seen, rgb.size(), 0, 0, cv::INTER_NEAREST);
  if (cv::countNonZero(is_seen) == 0) return picture;
  const cv::Mat green = stretched(at_rest, is_seen, rgb.size()), purple = stretched(pulled, is_seen, rgb.size());
  cv::Mat both;
  cv::merge(std::vector<cv::Mat>{purple, green, purple}, both);
  both.convertTo(rgb, CV_8UC3);
  return picture;
}

}  // namespace mbtfm::beads
