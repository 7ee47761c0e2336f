#include "pipeline/cost/labels.h"

#include <algorithm>
#include <cmath>

namespace mbtfm::cost {

namespace {

/// Pixels of the frame, y downwards.
struct Box {
  Vec2 low, high;
};

// Of the charts' 14 px text, and of the dots, with a rim.
constexpr double kLetter_px = 8, kLine_px = 16, kDot_px = 7, kKeyLine_px = 18;

Box box_around(Vec2 centre, double width_px, double height_px) {
  const Vec2 half = 0.5 * Vec2{width_px, height_px};
  return {centre - half, centre + half};
}

bool overlap(const Box& a, const Box& b) {
  return a.low.x < b.high.x && b.low.x < a.high.x && a.low.y < b.high.y && b.low.y < a.high.y;
}

double width_of(const std::string& text) { return kLetter_px * static_cast<double>(text.size()); }

}  // namespace

void add_names(charts::Chart& chart, const charts::Axis& x, const charts::Axis& y, double frame_height_px,
               const std::vector<NamedDot>& dots, const std::vector<std::string>& key) {
  const Vec2 frame{charts::Chart::kFrameWidth_px, frame_height_px};
  const auto in_frame = [&](Vec2 at) {
    return Vec2{frame.x * charts::share(x, at.x), frame.y * (1 - charts::share(y, at.y))};
  };
  const auto value_at = [](const charts::Axis& axis, double at) {
    return axis.low * std::pow(axis.high / axis.low, at);
  };
  std::vector<Box> taken;
  for (const NamedDot& dot : dots) taken.push_back(box_around(in_frame(dot.at), 2 * kDot_px, 2 * kDot_px));
  for (std::size_t i = 0; i < key.size(); ++i) {
    const double top = 8 + kKeyLine_px * static_cast<double>(i);
    taken.push_back({{frame.x - 10 - width_of(key[i]), top}, {frame.x, top + kKeyLine_px}});
  }
  for (const NamedDot& dot : dots) {
    const double width = width_of(dot.name), aside = 0.5 * width + kDot_px, beyond = 0.5 * kLine_px + kDot_px;
    for (const Vec2 shift : {Vec2{0, -beyond}, Vec2{0, beyond}, Vec2{aside, 0}, Vec2{-aside, 0}, Vec2{aside, -beyond},
                             Vec2{-aside, -beyond}, Vec2{aside, beyond}, Vec2{-aside, beyond}}) {
      const Vec2 centre = in_frame(dot.at) + shift;
      const Box box = box_around(centre, width, kLine_px);
      const bool is_inside = box.low.x >= 0 && box.low.y >= 0 && box.high.x <= frame.x && box.high.y <= frame.y;
      if (!is_inside || std::ranges::any_of(taken, [&](const Box& b) { return overlap(box, b); })) continue;
      chart.label({value_at(x, centre.x / frame.x), value_at(y, 1 - centre.y / frame.y)}, dot.name);
      taken.push_back(box);
      break;
    }
  }
}

}  // namespace mbtfm::cost
