#include "segment/cells/fibre_significance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/numerics/order_statistics.h"
#include "pipeline/stage/parameters.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {

double significance(const Ridges& ridges, const std::vector<cv::Point2d>& points, const std::vector<double>& height,
                    double independent_px) {
  constexpr double kMost = 2;  // of the middle one: a bright spot on the way makes no line
  if (points.empty()) return 0;
  std::vector<double> over_noise;
  for (std::size_t i = 0; i < points.size(); ++i)
    over_noise.push_back(height[i] / std::max<double>(sample(ridges.noise, points[i]), 1e-30));
  const double most = kMost * numerics::median(over_noise);
  double sum = 0;
  for (const double h : over_noise) sum += std::min(h, most);
  const auto n = static_cast<double>(points.size());
  return sum / n * std::sqrt(n / independent_px);
}

namespace {

/// Nothing is traced that is less significant.
constexpr double kLeast = 3;
/// The tail of the lines of texture falls as exp(−x^1.4): counted in simulated cells of meshwork alone
/// (docs/theory/segmentation.md, (24)).
constexpr double kShape = 1.4;
/// Of lines of texture, the share that a fibre lies beside by chance: of those that are no fibres in 9 simulated cells
/// of 20 fibres .12, in 9 of 40 fibres .22.
constexpr double kBeside = 0.15;
constexpr double kMany = 20;  // where noise alone makes such lines

}  // namespace

double TextureLines::log_false(double significance) const {
  return std::log(n) - std::pow(std::max(0.0, significance - kLeast) / scale, kShape);
}

double TextureLines::expected_false(double significance) const {
  constexpr double kBarely = 7;  // of pieces that happen to lie in a row
  const double n_false = std::exp(log_false(significance));
  return significance < kBarely ? std::max(n_false, kMany) : n_false;
}

double TextureLines::expected_beside(double significance) const {
  return significance < kLeast ? kMany : kBeside * std::exp(log_false(significance));
}

TextureLines texture_lines(std::vector<double> significances) {
  constexpr double kFewest = 10;
  constexpr double kPrior = 30, kUsual = 2;  // a few lines do not give the scale: as many of the usual one are added
  std::erase_if(significances, [](double s) { return s >= kHardlyTexture || s < kLeast; });
  const auto n = static_cast<double>(significances.size());
  if (significances.empty()) return {kFewest, kUsual};
  const double scale =
      (numerics::median_in(significances) - kLeast) / std::pow(std::numbers::ln2, 1 / kShape);  // of a median
  return {n + kFewest, (n * scale + kPrior * kUsual) / (n + kPrior)};
}

namespace {

constexpr std::size_t kEach = 3;  // point

Vec2 direction_at(const Polyline& line, std::size_t i) {
  const Vec2 d = line[std::min(i + kEach, line.size() - 1)] - line[i >= kEach ? i - kEach : 0];
  return (1 / std::max(norm(d), 1e-12)) * d;
}

}  // namespace

void Bundles::add(const Polyline& line_um) {
  for (std::size_t i = 0; i < line_um.size(); i += kEach)
    squares_.add({line_um[i].x, line_um[i].y}, {line_um[i], direction_at(line_um, i), n_lines_});
  ++n_lines_;
}

bool Bundles::has_beside(const Place& place) const {
  constexpr double kParallel = 0.9659;  // cosine of 15°
  bool is_found = false;
  squares_.each_near({place.position_um.x, place.position_um.y}, [&](const Place& other) {
    is_found = is_found || (other.line != place.line && norm(other.position_um - place.position_um) < kBeside_um &&
                            std::abs(dot(other.along, place.along)) > kParallel);
  });
  return is_found;
}

double Bundles::share_beside(const Polyline& line_um, std::optional<std::size_t> own) const {
  std::size_t n = 0, n_beside = 0;
  for (std::size_t i = 0; i < line_um.size(); i += kEach, ++n)
    n_beside += has_beside({line_um[i], direction_at(line_um, i), own});
  return static_cast<double>(n_beside) / static_cast<double>(std::max<std::size_t>(1, n));
}

bool winds(const Polyline& line_um) {
  constexpr double kStep_um =
      1;  // longer than the noise of a centreline, shorter than a ruffle's wave (1.5 um and more)
  constexpr double kWinding_per_um = 0.06;  // above nearly all bundles of a real cell
  double turning = 0, net = 0, length = 0, last_angle = 0;
  Vec2 from = line_um.front();
  bool has_angle = false;
  for (const Vec2 p : line_um) {
    const Vec2 d = p - from;
    if (norm(d) < kStep_um) continue;
    const double angle = std::atan2(d.y, d.x);
    if (has_angle) {
      const double turn = std::remainder(angle - last_angle, 2 * std::numbers::pi);
      turning += std::abs(turn);
      net += turn;
    }
    has_angle = true;
    last_angle = angle;
    from = p;
    length += norm(d);
  }
  return turning - std::abs(net) > kWinding_per_um * length;
}

namespace {

double filter_sigma_um(const FibreParameters& p) {
  constexpr double kFwhm = 2.3548;  // full width at half maximum of a Gaussian in standard deviations
  constexpr double kNarrower = 0.6;
  return kNarrower * p.fibre_width_um / kFwhm;
}

}  // namespace

int grid_factor(const FibreParameters& p, double pixel_um) {
  constexpr double kSigma_px = 1.2;
  return std::max(1, static_cast<int>(filter_sigma_um(p) / pixel_um / kSigma_px));
}

RidgeScales scales_of(const FibreParameters& p, double pixel_um) {
  constexpr double kNarrowest_px = 0.7;  // pixels carry no more
  return {.width_sigma_px = std::max(kNarrowest_px, filter_sigma_um(p) / pixel_um),
          .length_sigma_px = p.fibre_averaging_um / pixel_um,
          .noise_radius_px = std::max(6.0, 8 * p.fibre_width_um / pixel_um)};
}

TraceRule rule_of(const FibreParameters& p, double pixel_um) {
  constexpr double kHidden = 3;      // widths: so long a line that crosses at 20° hides this one
  constexpr double kStraight = 0.2;  // noise and waves of a fibre, of its radius
  constexpr double kGentle = 8;      // long fibres bend less than the smallest radius by so much
  TraceRule rule;
  rule.start_noise = p.fibre_start_noise;
  rule.follow_noise = p.fibre_follow_noise;
  const double gap_and_beyond_um = 2 * p.fibre_gap_um;
  rule.start_gain_px = gap_and_beyond_um / pixel_um;
  rule.reach_px = std::max(gap_and_beyond_um, kHidden * p.fibre_width_um) / pixel_um;
  rule.step_px = 0.5 * p.fibre_width_um / pixel_um;
  rule.through_px = 3 * p.fibre_gap_um / pixel_um;
  rule.smallest_radius_px = p.fibre_smallest_radius_um / pixel_um;
  rule.line_radius_px = 0.6 * p.fibre_width_um / pixel_um;
  rule.shortest_px = p.fibre_shortest_um / pixel_um;
  rule.end_window_px = 4 * p.fibre_averaging_um / pixel_um;
  rule.course_px = 3.4 * p.fibre_averaging_um / pixel_um;
  rule.join_gap_px = 3 * p.fibre_gap_um / pixel_um;
  rule.overlap_px = 1.92 * p.fibre_gap_um / pixel_um;
  rule.bridge_px = 6 * p.fibre_gap_um / pixel_um;
  rule.bridge_course_px = 2 * p.fibre_shortest_um / pixel_um;
  rule.bridge_misfit_px = kStraight * rule.line_radius_px;
  rule.bridge_radius_px = kGentle * rule.smallest_radius_px;
  rule.faint_px = p.fibre_faint_um / pixel_um;
  return rule;
}

double independent_px(const FibreParameters& p, double pixel_um) {
  // noise through a Gaussian of deviation s correlates over 2 sqrt(pi) s
  return 2 * std::sqrt(std::numbers::pi) * p.fibre_averaging_um / pixel_um;
}

void declare(stage::ParameterList& list, FibreParameters& p) {
  list.table("segment");
  list.add("fibre_width_um", p.fibre_width_um, Range::between(1e-3, 100));
  list.add("fibre_averaging_um", p.fibre_averaging_um, Range::between(1e-3, 10));
  list.add("fibre_start_noise", p.fibre_start_noise, Range::factor());
  list.add("fibre_follow_noise", p.fibre_follow_noise, Range::factor());
  list.add("fibre_least_probability", p.fibre_least_probability, Range::between(0, 1));
  list.add("fibre_smallest_radius_um", p.fibre_smallest_radius_um, Range::size_um());
  list.add("fibre_faintest", p.fibre_faintest, Range::between(0, 1));
  list.add("fibre_edge_um", p.fibre_edge_um, Range::zero_or_size_um());
  list.add("fibre_lamellipodium_um", p.fibre_lamellipodium_um, Range::zero_or_size_um());
  list.add("fibre_gap_um", p.fibre_gap_um, Range::zero_or_size_um());
  list.add("fibre_shortest_um", p.fibre_shortest_um, Range::size_um());
  list.add("fibre_reach_um", p.fibre_reach_um, Range::size_um());
  list.add("fibre_faint_um", p.fibre_faint_um, Range::zero_or_size_um());
}

}  // namespace mbtfm::cells
