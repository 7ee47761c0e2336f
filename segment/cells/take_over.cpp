#include "segment/cells/trace_join.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "segment/cells/squares.h"

namespace mbtfm::cells {
namespace {

using Points = std::vector<cv::Point2d>;

/// A point of a line.
struct PointOf {
  std::size_t line, point;
};

/// Where the course of a line's end meets another line: points of that one, and steps of the course.
struct Meeting {
  std::size_t first, last;
  std::size_t from_step;
};

/// A part of one line that belongs to the end of another one.
struct TakeOver {
  std::size_t owner;
  LineEnd end;
  std::size_t other;
  std::size_t own_points;  ///< that the owner keeps
  std::size_t back_to,
      on_from;      ///< of the other line: its own part is before or behind the one, the owner's … the other
  bool is_forward;  ///< the owner's part lies towards the other line's last point
  Parabola way;
  double gain;
};

cv::Point2d along(const Points& points, std::size_t i) {
  const cv::Point2d d = points[std::min(i + 3, points.size() - 1)] - points[i > 2 ? i - 3 : 0];
  return d / std::max(1e-9, std::hypot(d.x, d.y));
}

/// How badly two parts fit to one fibre: 1 each for the most of misfit and bend that a bridge may have.
double unlikeness(const Parabola& way, const TraceRule& rule) {
  const double misfit = way.misfit_px / rule.bridge_misfit_px, bend = way.curvature() * rule.bridge_radius_px;
  return misfit * misfit + bend * bend;
}

class Search {
 public:
  Search(const std::vector<Trace>& lines, const TraceRule& rule)
      : lines_(lines), rule_(rule), near_px_(1.33 * rule.line_radius_px), squares_(near_px_) {
    for (std::size_t i = 0; i < lines.size(); ++i)
      for (std::size_t k = 0; k < lines[i].size(); ++k) squares_.add(lines[i].points[k], {i, k});
  }

  /// All of them, the greatest gain first.
  std::vector<TakeOver> all() const {
    std::vector<TakeOver> found;
    for (std::size_t i = 0; i < lines_.size(); ++i)
      for (const LineEnd end : {LineEnd::first, LineEnd::last})
        for (const auto& [other, meeting] : meetings_of(i, end))
          if (auto t = take_over(i, end, other, meeting)) found.push_back(std::move(*t));
    std::ranges::stable_sort(found, std::greater(), &TakeOver::gain);
    return found;
  }

 private:
  /// The last part of a line and its straight extension, outwards.
  Points course_of(const Trace& line, LineEnd end) const {
    Points course = last_part(line, end, rule_.reach_px);
    std::ranges::reverse(course);
    const cv::Point2d ahead = outward(line.points, end, rule_.course_px), from = course.back();
    for (double s = 1; s <= rule_.reach_px; ++s) course.push_back(from + s * ahead);
    return course;
  }

  std::map<std::size_t, Meeting> meetings_of(std::size_t line, LineEnd end) const {
    constexpr double kLeastCosine = 0.82;  // 35°: lines hardly turn further
    const Points course = course_of(lines_[line], end);
    std::map<std::size_t, Meeting> meetings;
    for (std::size_t i = 0; i < course.size(); ++i)
      squares_.each_near(course[i], [&](const PointOf& place) {
        const Points& other = lines_[place.line].points;
        const cv::Point2d d = other[place.point] - course[i];
        if (place.line == line || std::hypot(d.x, d.y) > near_px_) return;
        if (std::abs(along(course, i).dot(along(other, place.point))) < kLeastCosine) return;
        const auto [m, is_new] = meetings.try_emplace(place.line, Meeting{place.point, place.point, i});
        m->second.first = std::min(m->second.first, place.point);
        m->second.last = std::max(m->second.last, place.point);
      });
    return meetings;
  }

  std::optional<TakeOver> take_over(std::size_t owner, LineEnd end, std::size_t other, const Meeting& m) const {
    constexpr double kWorst = 3.5;  // of what belongs together
    constexpr double kGain = 5;     // and the other two parts must fit worse by this
    const Trace &line = lines_[owner], &across = lines_[other];
    const std::size_t n_last = std::min(line.size(), static_cast<std::size_t>(rule_.reach_px));
    const std::size_t own = std::min(line.size(), line.size() - n_last + m.from_step);
    const Trace kept = end == LineEnd::last ? line.part(0, own) : line.part(line.size() - own, line.size());
    const Trace before = across.part(0, m.first), behind = across.part(m.last + 1, across.size());
    const auto is_long = [&](const Trace& t) { return static_cast<double>(t.size()) >= 0.67 * rule_.shortest_px; };
    if (!is_long(kept) || !is_long(before) || !is_long(behind)) return std::nullopt;
    const cv::Point2d ahead = outward(line.points, end, rule_.course_px);
    const bool is_forward = ahead.dot(along(across.points, (m.first + m.last) / 2)) > 0;
    const auto part = [&](const Trace& t, LineEnd e) { return last_part(t, e, rule_.bridge_course_px); };
    const Points own_part = part(kept, end), before_part = part(before, LineEnd::last),
                 behind_part = part(behind, LineEnd::first);
    const Parabola way = parabola_through(own_part, is_forward ? behind_part : before_part);
    const double unlike = unlikeness(way, rule_);
    const double gain = unlikeness(parabola_through(before_part, behind_part), rule_) - unlike;
    if (unlike > kWorst || gain < kGain) return std::nullopt;
    const std::size_t middle = (m.first + m.last) / 2;
    return TakeOver{owner, end, other, own, middle, is_forward ? m.last + 1 : m.first, is_forward, way, gain};
  }

  const std::vector<Trace>& lines_;
  const TraceRule& rule_;
  double near_px_;
  Squares<PointOf> squares_;
};

/// The owner with the part that it gets back, and what is left of the other line.
std::pair<Trace, Trace> divided(const TakeOver& t, Trace owner, Trace other, const Ridges& ridges) {
  if (t.end == LineEnd::first) owner.reverse();
  owner = owner.part(0, t.own_points);
  owner.append(bridge_of(t.way, ridges));
  Trace taken = t.is_forward ? other.part(t.on_from, other.size()) : other.part(0, t.on_from);
  if (!t.is_forward) taken.reverse();
  owner.append(taken);
  return {std::move(owner), t.is_forward ? other.part(0, t.back_to) : other.part(t.back_to, other.size())};
}

}  // namespace

std::vector<Trace> with_own_courses(std::vector<Trace> lines, const Ridges& ridges, const TraceRule& rule) {
  constexpr int kRounds = 5;  // a line may be taken over more than once; two are rare
  bool has_changed = true;
  for (int round = 0; has_changed && round < kRounds; ++round) {
    has_changed = false;
    std::vector<bool> is_touched(lines.size());
    for (const TakeOver& t : Search(lines, rule).all()) {
      if (is_touched[t.owner] || is_touched[t.other]) continue;
      std::tie(lines[t.owner], lines[t.other]) = divided(t, lines[t.owner], lines[t.other], ridges);
      is_touched[t.owner] = is_touched[t.other] = has_changed = true;
    }
    std::erase_if(lines, [&](const Trace& t) { return static_cast<double>(t.size()) < rule.shortest_px; });
  }
  return lines;
}

}  // namespace mbtfm::cells
