#include "segment/cells/fibres.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/stage/parameters.h"
#include "segment/cells/fibre_profile.h"
#include "segment/cells/fibre_significance.h"
#include "segment/cells/grid.h"
#include "segment/cells/padding.h"
#include "segment/cells/trace.h"
#include "segment/cells/trace_join.h"
#include "segment/cells/without_lines.h"
#include "segment/images/channels.h"

namespace mbtfm::cells {
namespace {

constexpr double kSideRatio = 0.1;  // a step (the cell's edge) falls on one side only, a fibre on both
constexpr double kAboveCortex =
    1.5;  // a line along the outline is a fibre if it is as many times as high as the cortex
/// Lines of texture in a cell that the first look may take for fibres; any number where all lines are asked for.
double most_false(const FibreParameters& p) {
  constexpr double kMost = 2;
  return p.fibre_least_probability > 0 ? kMost : std::numeric_limits<double>::infinity();
}
constexpr double kSimplify_um = 0.05;  // points are left out if the line moves less: half a pixel

/// The part of the image that holds the cell, shrunk until the narrowest filter spans no more pixels than it needs.
struct Crop {
  cv::Mat image;
  cv::Mat is_inside;  ///< CV_8U: of the cell's outline
  double pixel_um = 0;
  Vec2 origin_um;     ///< outer corner of its first pixel
  cv::Mat is_seen{};  ///< CV_8U: of the outline, where the detector was not saturated

  Vec2 in_um(cv::Point2d point) const { return origin_um + to_um(point, pixel_um); }
};

cv::Rect box_of(const Polygon& outline_um, cv::Size size, double pixel_um, double margin_um) {
  const cv::Rect whole(cv::Point(0, 0), size);
  if (outline_um.empty()) return whole;
  const auto [left, right] = std::ranges::minmax(outline_um, {}, &Vec2::x);
  const auto [top, bottom] = std::ranges::minmax(outline_um, {}, &Vec2::y);
  const cv::Point first(cvFloor((left.x - margin_um) / pixel_um), cvFloor((top.y - margin_um) / pixel_um));
  const cv::Point last(cvCeil((right.x + margin_um) / pixel_um), cvCeil((bottom.y + margin_um) / pixel_um));
  const cv::Rect box = cv::Rect(first, last) & whole;
  return box.empty() ? whole : box;
}

Crop field_of(const images::Image& image, const Polygon& outline_um, double pixel_um, const FibreParameters& p) {
  constexpr double kWidest = 4;  // widths: bundles that lie side by side are no ground
  const cv::Rect box = box_of(outline_um, {image.width, image.height}, pixel_um, 2 * p.fibre_averaging_um);
  const cv::Mat pixels = without_padding(matrix_of(image))(box);
  cv::Mat is_clipped = cv::Mat::zeros(box.size(), CV_8U), is_seen;
  if (noticed(Symptom::saturated, images::share_at_brightest(image)))
    is_clipped = pixels == *std::ranges::max_element(image.pixels);
  const cv::Mat whole = without_clipping(pixels, is_clipped, kWidest * p.fibre_width_um / pixel_um);
  const int factor = grid_factor(p, pixel_um);
  Crop field{shrink(whole, factor), {}, pixel_um * factor, {box.x * pixel_um, box.y * pixel_um}};
  field.is_inside = cv::Mat(field.image.size(), CV_8U, cv::Scalar(outline_um.empty() ? 255 : 0));
  std::vector<std::vector<cv::Point>> corners(1);
  for (const Vec2 u : outline_um) corners[0].emplace_back(to_pixels(u - field.origin_um, field.pixel_um));
  if (!outline_um.empty()) cv::fillPoly(field.is_inside, corners, cv::Scalar(255));
  is_clipped.convertTo(is_seen, CV_32F);
  field.is_seen = field.is_inside & (shrink(is_seen, factor) == 0);
  return field;
}

bool falls_on_both_sides(const Profile& profile, double ratio) {
  return profile.lower_drop >= ratio * profile.upper_drop && profile.lower_drop > 3 * profile.noise;
}

/// Folds of the membrane lie within a lamellipodium's width of the edge and wind.
bool is_ruffle(const Polyline& line_um, const Polygon& outline_um, double lamellipodium_um) {
  if (outline_um.empty() || !winds(line_um)) return false;
  return distance_to_boundary_um(outline_um, line_um[line_um.size() / 2]) < lamellipodium_um;
}

/// A line of which so much has a fibre beside it lies in its bundle.
constexpr double kMostBeside = 0.5;

/// A traced line that may be a fibre.
struct Candidate {
  Trace trace;  ///< away from the cell's edge
  Polyline points_um;
  WayOn before, after;
  Profile profile;
  double significance = 0;
  double expected_false = 0;   ///< lines as significant as this one that texture would make
  double expected_beside = 0;  ///< those of them beside a fibre
};

double significance_of(const std::vector<cv::Point2d>& points, const std::vector<double>& height, const Ridges& ridges,
                       const Crop& field, const FibreParameters& p) {
  return significance(ridges, points, height, independent_px(p, field.pixel_um));
}

Polyline in_um(const std::vector<cv::Point2d>& points, const Crop& field) {
  Polyline line;
  for (const cv::Point2d& point : points) line.push_back(field.in_um(point));
  return line;
}

/// From the lines that do not lie beside fibres: those are faint fibres as often as texture.
TextureLines texture_lines_of(const std::vector<Trace>& traces, const Ridges& ridges, const Crop& field,
                              const FibreParameters& p) {
  std::vector<double> all, apart;
  for (const Trace& t : traces) all.push_back(significance_of(t.points, t.own_height(), ridges, field, p));
  Bundles bundles;
  for (std::size_t i = 0; i < traces.size(); ++i)
    if (all[i] >= kHardlyTexture) bundles.add(in_um(traces[i].points, field));
  for (std::size_t i = 0; i < traces.size(); ++i)
    if (bundles.share_beside(in_um(traces[i].points, field)) < kMostBeside) apart.push_back(all[i]);
  return texture_lines(std::move(apart));
}

/// Where the cell's texture is to be seen: inside of it, and away from lines that cannot be texture.
cv::Mat free_of_fibres(const std::vector<Trace>& traces, const Ridges& ridges, const Crop& field,
                       const FibreParameters& p) {
  const TextureLines texture = texture_lines_of(traces, ridges, field, p);
  cv::Mat is_free = field.is_seen.clone();
  const int radius = cvCeil(1.33 * p.fibre_width_um / field.pixel_um);  // the filters' side lobes end there
  for (const Trace& t : traces) {
    if (texture.expected_false(significance_of(t.points, t.own_height(), ridges, field, p)) > most_false(p)) continue;
    for (const cv::Point2d& point : t.points) cv::circle(is_free, cv::Point(point), radius, cv::Scalar(0), cv::FILLED);
  }
  return is_free;
}

/// Looks at one traced line after another.
struct Judge {
  const Crop& field;
  const Ridges& ridges;
  const TraceRule& rule;
  const Polygon& outline_um;
  TextureLines texture;
  const FibreParameters& p;

  /// What is left of a line away from the cell's edge; nothing where that has not the shape of a fibre.
  std::optional<Candidate> candidate(const Trace& trace, double edge_um) const {
    auto points = smoothed(trace.points, cvRound(p.fibre_averaging_um / field.pixel_um));
    Candidate c;
    c.points_um = in_um(points, field);
    const Piece piece = without_edge(c.points_um, outline_um, edge_um);
    if (static_cast<double>(piece.n) * field.pixel_um < p.fibre_shortest_um) return std::nullopt;
    const auto cut = [&](const auto& all) {
      const auto first = all.begin() + static_cast<std::ptrdiff_t>(piece.first);
      return std::decay_t<decltype(all)>(first, first + static_cast<std::ptrdiff_t>(piece.n));
    };
    c.points_um = cut(c.points_um);
    points = cut(points);
    c.trace = trace.part(piece.first, piece.first + piece.n);
    c.significance = significance_of(points, c.trace.own_height(), ridges, field, p);
    c.expected_false = texture.expected_false(c.significance);
    c.expected_beside = texture.expected_beside(c.significance);
    c.profile = profile_across(field.image, points, 1.5 * p.fibre_width_um / field.pixel_um);
    if (!falls_on_both_sides(c.profile, kSideRatio)) return std::nullopt;
    if (is_ruffle(c.points_um, outline_um, p.fibre_lamellipodium_um)) return std::nullopt;
    if (piece.first == 0) c.before = way_on(trace, LineEnd::first);
    if (piece.first + piece.n == trace.points.size()) c.after = way_on(trace, LineEnd::last);
    return c;
  }

  WayOn way_on(const Trace& trace, LineEnd end) const {
    FaintEnd faint = faint_end(ridges, rule, trace, end);
    WayOn way{{}, std::move(faint.over_noise)};
    for (const cv::Point2d& point : faint.points) way.points_um.push_back(field.in_um(point));
    return way;
  }
};

struct Judged {
  std::vector<Candidate> fibres;
  std::vector<Candidate> rest;
};

/// Those that are more significant than texture, and those beside them that are more significant than the texture that
/// lies beside fibres by chance.
Judged significant(std::vector<Candidate> candidates, double most_false) {
  std::vector<Candidate> kept;
  Bundles bundles;
  const auto take = [&](auto is_fibre) {
    const auto first = std::stable_partition(candidates.begin(), candidates.end(), std::not_fn(is_fibre));
    const bool has_any = first != candidates.end();
    for (auto c = first; c != candidates.end(); ++c) bundles.add(c->points_um);
    std::move(first, candidates.end(), std::back_inserter(kept));
    candidates.erase(first, candidates.end());
    return has_any;
  };
  take([&](const Candidate& c) { return c.expected_false <= most_false; });
  while (take([&](const Candidate& c) {
    return c.expected_beside <= most_false && bundles.share_beside(c.points_um) >= kMostBeside;
  })) {
  }
  return {std::move(kept), std::move(candidates)};
}

/// Of the ridges along the outline: the height of the cell's cortex, seen from its side. Infinite without an outline.
double height_of_cortex(const Judge& judge) {
  const Crop& field = judge.field;
  if (judge.outline_um.empty()) return std::numeric_limits<double>::infinity();
  std::vector<double> heights;
  const Polygon& ring = judge.outline_um;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const cv::Point2d from = to_pixels(ring[i] - field.origin_um, field.pixel_um),
                      way = to_pixels(ring[(i + 1) % ring.size()] - field.origin_um, field.pixel_um) - from;
    const double length = std::hypot(way.x, way.y), angle = std::atan2(way.y, way.x);
    const int reach = cvCeil(judge.p.fibre_edge_um / field.pixel_um);
    for (double s = 0.5; s < length; ++s) {
      double height = 0;  // inside or outside: the outline lies to either side
      for (int k = -reach; k <= reach; ++k) {
        const cv::Point2d p = from + (s / length) * way + (k / length) * cv::Point2d(-way.y, way.x);
        height = std::max(height, judge.ridges.at(p, angle));
      }
      heights.push_back(height);
    }
  }
  return heights.empty() ? std::numeric_limits<double>::infinity() : numerics::quantile(std::move(heights), 0.5);
}

/// All lines that are fibres. Along the edge these are only lines that stand out of the cortex, or are as high as the
/// cell's high fibres: where bundles line most of the edge, they are what the cortex seems to be.
std::vector<Candidate> judged(const std::vector<Trace>& traces, const Judge& judge) {
  std::vector<std::optional<Candidate>> inner;
  std::vector<double> heights, ridge_heights;
  for (const Trace& trace : traces) {
    inner.push_back(judge.candidate(trace, judge.p.fibre_edge_um));
    if (!inner.back() || inner.back()->expected_false > most_false(judge.p)) continue;
    heights.push_back(inner.back()->profile.height);
    ridge_heights.push_back(numerics::quantile(trace.height, 0.5));
  }
  constexpr std::size_t kEnough = 5;  // fewer do not show what bright and faint are
  constexpr double kHigh = 0.8;       // of the second highest of ten
  double faint = 0, bright = kAboveCortex * height_of_cortex(judge);
  if (heights.size() >= kEnough) {
    faint = judge.p.fibre_faintest * numerics::quantile(heights, 0.5);
    bright = std::min(bright, kHigh * numerics::quantile(ridge_heights, 0.9));
  }
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < traces.size(); ++i) {
    std::optional<Candidate> whole;
    if (numerics::quantile(traces[i].height, 0.5) >= bright) whole = judge.candidate(traces[i], 0);
    if (whole && length_um(whole->points_um) >= 2 * judge.p.fibre_shortest_um)  // ruffles, roots of filopodia: shorter
      candidates.push_back(std::move(*whole));
    else if (inner[i])
      candidates.push_back(std::move(*inner[i]));
  }
  std::erase_if(candidates, [&](const Candidate& c) { return c.profile.height < faint; });
  return significant(std::move(candidates), most_false(judge.p)).fibres;  // the rest is judged without them
}

/// What is left without the fibres found so far.
struct Rest {
  Crop field;
  Ridges ridges;
};

Rest rest_of(const std::vector<Candidate>& fibres, const Judge& judge) {
  constexpr double kNarrowest = 0.5, kWidest = 1.67;  // of the usual width: beside neighbours profiles mislead
  constexpr double kLeft = 0.15;                      // of what is taken away, at most: profiles are not Gaussian
  const FibreParameters& p = judge.p;
  const double usual_px = p.fibre_width_um / judge.field.pixel_um;
  std::vector<SeenLine> seen;
  for (const Candidate& c : fibres)
    seen.push_back({c.trace.points, std::clamp(c.profile.width_px, kNarrowest * usual_px, kWidest * usual_px)});
  Rest rest{judge.field, {}};
  rest.field.image = without_lines(judge.field.image, seen, p.fibre_averaging_um / judge.field.pixel_um);
  rest.ridges = find_ridges(rest.field.image, scales_of(p, rest.field.pixel_um));
  cv::magnitude(judge.ridges.noise, kLeft * (judge.ridges.strongest - rest.ridges.strongest), rest.ridges.noise);
  return rest;
}

/// Also the fainter ones, which brighter ones beside or across them hide; and the lines that are none.
/// @param hidden  judges by the rest
Judged with_hidden(std::vector<Candidate> fibres, const Judge& hidden, const Judge& judge) {
  std::vector<Trace> known;
  std::vector<double> heights;
  for (const Candidate& c : fibres) {
    known.push_back(c.trace);
    heights.push_back(c.profile.height);
  }
  const double faint = judge.p.fibre_faintest * numerics::quantile(std::move(heights), 0.5);
  for (const Trace& trace : trace_lines(hidden.ridges, hidden.field.is_inside, judge.rule, known)) {
    auto c = hidden.candidate(trace, judge.p.fibre_edge_um);
    if (c && c->profile.height >= faint) fibres.push_back(std::move(*c));
  }
  return significant(std::move(fibres), most_false(judge.p));
}

/// What lies around a line, and speaks for it or against it.
class Surroundings {
 public:
  explicit Surroundings(const std::vector<Candidate>& fibres) {
    std::vector<double> heights;
    for (const Candidate& c : fibres) {
      bundles_.add(c.points_um);
      heights.push_back(c.profile.height);
      n_moderate_ += c.significance >= kModerate && c.significance < kHigh;
    }
    if (!heights.empty()) usual_height_ = numerics::quantile(std::move(heights), 0.5);
  }
  /// @param own  the line's place among these fibres, if it is one of them
  FibreEvidence evidence(const Candidate& c, const Judge& judge, std::optional<std::size_t> own) const {
    return {.log_false = judge.texture.log_false(c.significance),
            .length_um = length_um(c.points_um),
            .relative_height = usual_height_ > 0 ? c.profile.height / usual_height_ : 1,
            .share_beside = bundles_.share_beside(c.points_um, own),
            .cortex = cortex_along(c.points_um, judge.outline_um),
            .n_fibres = n_moderate_,
            .significance = c.significance};
  }

 private:
  static constexpr double kModerate = 8, kHigh = 20;  // above what texture makes, and not far above
  Bundles bundles_;
  double usual_height_ = 0, n_moderate_ = 0;
};

/// With those of the rest that are fibres rather than not, beside these.
Judged with_probable(Judged lines, const Judge& judge) {
  const Surroundings around(lines.fibres);
  const auto first = std::stable_partition(lines.rest.begin(), lines.rest.end(), [&](const Candidate& c) {
    return probability_of(around.evidence(c, judge, {})) < judge.p.fibre_least_probability;
  });
  std::move(first, lines.rest.end(), std::back_inserter(lines.fibres));
  lines.rest.erase(first, lines.rest.end());
  return lines;
}

/// Put right where fibres cross, and put together where their pieces lie far apart.
std::vector<Candidate> regrouped(std::vector<Candidate> fibres, const Judge& hidden, const Judge& judge) {
  std::vector<Trace> traces;
  for (const Candidate& c : fibres) traces.push_back(c.trace);
  traces = with_own_courses(std::move(traces), judge.ridges, judge.rule);
  std::vector<Candidate> result;
  const auto keep = [&](const Trace& trace) {
    auto c = judge.candidate(trace, 0);
    if (!c) c = hidden.candidate(trace, 0);  // a brighter line beside it hides it
    if (c) result.push_back(std::move(*c));
    return c.has_value();
  };
  for (const BridgedLine& line : bridged(traces, hidden.ridges, judge.rule))
    if (!keep(line.trace))
      for (const std::size_t i : line.pieces) keep(traces[i]);
  return result;
}

/// What their ends show of whether they are the fibres' own.
void look_beyond(std::vector<Candidate>& fibres, const Rest& rest, const TraceRule& rule) {
  std::vector<Trace> smooth;
  for (const Candidate& c : fibres) {
    smooth.push_back(c.trace);
    std::ranges::transform(c.points_um, smooth.back().points.begin(),
                           [&](Vec2 u) { return to_pixels(u - rest.field.origin_um, rest.field.pixel_um); });
  }
  const std::vector<double> goes_on = chances_of_going_on(smooth, rest.ridges, rule);
  for (std::size_t e = 0; e < goes_on.size(); ++e) {
    const bool is_first = e % 2 == 0;
    WayOn& way = is_first ? fibres[e / 2].before : fibres[e / 2].after;
    const auto noise =
        faint_end(rest.ridges, rule, fibres[e / 2].trace, is_first ? LineEnd::first : LineEnd::last).over_noise;
    way.beyond = std::accumulate(noise.begin(), noise.end(), 0.0) / std::max(1.0, static_cast<double>(noise.size()));
    way.goes_on = goes_on[e];
  }
}

/// Actin as bright as these fibres, away from them and from the folds at the cell's edge.
std::vector<Polyline> unexplained(const std::vector<Candidate>& fibres, const Judge& judge) {
  const Crop& field = judge.field;
  std::vector<std::vector<cv::Point2d>> points;
  for (const Candidate& c : fibres) {
    points.emplace_back();
    for (const Vec2 u : c.points_um) points.back().push_back(to_pixels(u - field.origin_um, field.pixel_um));
  }
  cv::Mat depth;
  cv::distanceTransform(field.is_inside, depth, cv::DIST_L2, 5);
  std::vector<Polyline> lines_um;
  for (const auto& crest : bright_crests_beside(judge.ridges, depth > judge.p.fibre_lamellipodium_um / field.pixel_um,
                                                points, 1.33 * judge.p.fibre_width_um / field.pixel_um,
                                                judge.p.fibre_shortest_um / field.pixel_um)) {
    lines_um.emplace_back();
    for (const cv::Point2d& p : crest) lines_um.back().push_back(field.in_um(p));
  }
  return lines_um;
}

}  // namespace

TracedLines trace_fibres(const images::Image& image, const Polygon& outline_um, double pixel_size_um,
                         const FibreParameters& p) {
  const Crop field = field_of(image, outline_um, pixel_size_um, p);
  const RidgeScales scales = scales_of(p, field.pixel_um);
  const TraceRule rule = rule_of(p, field.pixel_um);
  Ridges ridges = find_ridges(field.image, field.is_seen, scales);
  // what is bright enough in any texture is a fibre; the texture beside it shows what else is
  const cv::Mat is_free = free_of_fibres(trace_lines(ridges, field.is_inside, rule), ridges, field, p);
  set_noise(ridges, is_free, scales.noise_radius_px);
  const auto traces = trace_lines(ridges, field.is_inside, rule);
  const Judge judge{field, ridges, rule, outline_um, texture_lines_of(traces, ridges, field, p), p};
  Judged lines{judged(traces, judge), {}};
  if (!lines.fibres.empty()) {
    const Rest rest = rest_of(lines.fibres, judge);
    const Judge hidden{rest.field, rest.ridges, rule, outline_um, judge.texture, p};
    lines = with_probable(with_hidden(std::move(lines.fibres), hidden, judge), judge);
    lines.fibres = regrouped(std::move(lines.fibres), hidden, judge);
    lines = with_probable(std::move(lines), judge);
    look_beyond(lines.fibres, rest, rule);
  }
  TracedLines traced{{}, {}, unexplained(lines.fibres, judge)};
  const Surroundings around(lines.fibres);
  for (const bool is_one : {true, false}) {
    std::vector<Candidate>& some = is_one ? lines.fibres : lines.rest;
    for (std::size_t i = 0; i < some.size(); ++i) {
      Candidate& c = some[i];
      const FibreEvidence evidence = around.evidence(c, judge, is_one ? std::optional(i) : std::nullopt);
      Fibre fibre;
      fibre.points_um = simplified(c.points_um, kSimplify_um);
      fibre.width_um = c.profile.width_px * field.pixel_um;
      fibre.mean_intensity = c.profile.height;
      fibre.confidence = probability_of(evidence);
      (fibre.confidence < p.fibre_least_probability ? traced.rest : traced.fibres)
          .push_back({std::move(fibre), std::move(c.before), std::move(c.after), evidence});
    }
  }
  return traced;
}

std::vector<Fibre> tied(std::vector<TracedFibre> traced, const std::vector<Adhesion>& adhesions,
                        const Polygon& outline_um, const FibreParameters& p, const Cuts& cuts) {
  std::vector<Fibre> fibres;
  for (TracedFibre& t : traced) {
    lead_on(t, adhesions, outline_um, p.fibre_reach_um);
    tie_ends(t.fibre, adhesions, outline_um, p.fibre_reach_um);
    weigh_free_end(t, outline_um);
    lead_to_cut(t.fibre, cuts, p.fibre_reach_um);
    fibres.push_back(std::move(t.fibre));
  }
  std::erase_if(fibres, [&](const Fibre& f) { return length_um(f.points_um) < p.fibre_shortest_um; });
  std::stable_sort(fibres.begin(), fibres.end(),
                   [](const Fibre& a, const Fibre& b) { return length_um(a.points_um) > length_um(b.points_um); });
  for (std::size_t i = 0; i < fibres.size(); ++i) fibres[i].fibre_id = static_cast<int>(i) + 1;
  return fibres;
}

}  // namespace mbtfm::cells
