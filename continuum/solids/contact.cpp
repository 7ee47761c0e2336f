#include "continuum/solids/contact.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::solids {
namespace {

constexpr double kRound = 2 * std::numbers::pi;

Vec2 centroid_um(const Polygon& outline) {
  Vec2 sum;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const Vec2 a = outline[k] - outline[0], b = outline[(k + 1) % outline.size()] - outline[0];
    sum += cross(a, b) * (a + b);
  }
  return outline[0] + 1 / (6 * signed_area_um2(outline)) * sum;
}

double turn_of(Vec2 at) {
  const double angle = std::atan2(at.y, at.x);
  return angle < 0 ? angle + kRound : angle;
}

/// Largest distance between the outline and what the element makes of it.
double deviation_um(const Contact& contact, const Square& square, double from, double to) {
  constexpr int kLooks = 16;  // some four times as many as the polynomial has tops
  const auto at = [&](double share) { return (1 - share) * from + share * to; };
  double largest = 0;
  for (int look = 1; look < kLooks; ++look) {
    const std::vector<double> shapes = square.along_side(static_cast<double>(look) / kLooks).values;
    Vec2 place;
    for (int k = 0; k <= square.order(); ++k) {
      const double angle = at(square.nodes()[k]);
      place += shapes[k] * contact.radius_um_at(angle) * Vec2{std::cos(angle), std::sin(angle)};
    }
    largest = std::max(largest, std::abs(norm(place) - contact.radius_um_at(turn_of(place))));
  }
  return largest;
}

}  // namespace

Contact::Contact(const Polygon& outline_um) {
  const double area = signed_area_um2(outline_um);
  area_um2_ = std::abs(area);
  centroid_um_ = mbtfm::solids::centroid_um(outline_um);
  const Vec2 centre = centroid_um_;
  for (std::size_t k = 0; k < outline_um.size(); ++k) {
    const std::size_t next = (k + 1) % outline_um.size();
    if (!(cross(outline_um[k] - centre, outline_um[next] - centre) * (area > 0 ? 1 : -1) > 0))
      throw InvalidData("the outline of the contact",
                        "an outline that each ray from its centroid (" + brief(centre.x) + ", " + brief(centre.y) +
                            ") um meets once (star-shaped)",
                        "a piece that turns back, from point " + std::to_string(k) + " at (" + brief(outline_um[k].x) +
                            ", " + brief(outline_um[k].y) + ") um to the next");
    from_centroid_um_.push_back(outline_um[k] - centre);
  }
  std::ranges::sort(from_centroid_um_, {}, turn_of);
  for (const Vec2 at : from_centroid_um_) angles_.push_back(turn_of(at));
}

double Contact::equal_radius_um() const { return std::sqrt(area_um2_ / std::numbers::pi); }

double Contact::largest_radius_um() const {
  return norm(*std::ranges::max_element(from_centroid_um_, {}, [](Vec2 at) { return norm(at); }));
}

double Contact::radius_um_at(double angle) const {
  const double turn = turn_of({std::cos(angle), std::sin(angle)});
  const auto above = std::ranges::upper_bound(angles_, turn) - angles_.begin();
  const std::size_t n = angles_.size(), next = above % n, before = (above + n - 1) % n;
  const Vec2 a = from_centroid_um_[before], along = from_centroid_um_[next] - a;
  return cross(a, along) / cross({std::cos(angle), std::sin(angle)}, along);
}

Section section_on(const Contact& contact, double height_um) {
  // the inverse of A = 2 V / h - pi h² / 3
  return {0.5 * height_um * (contact.area_um2() + std::numbers::pi * height_um * height_um / 3), height_um};
}

Sectors sectors_of(const Contact& contact, int order) {
  // Of 30 degrees: a cubic is within 1e-4 of the sines that turn a displacement around.
  constexpr int kFewest = 12, kMost = 32;
  constexpr double kNear = 0.01;  // of the radius: as near as outlines are drawn
  const Square square(order);
  Sectors sectors;
  std::vector<double>& angles = sectors.angles;
  for (int s = 0; s <= kFewest; ++s) angles.push_back(kRound * s / kFewest);
  for (std::size_t s = 0; s + 1 < angles.size();) {
    const double off_um = deviation_um(contact, square, angles[s], angles[s + 1]);
    if (off_um <= kNear * contact.equal_radius_um()) {
      sectors.off_um = std::max(sectors.off_um, off_um);
      ++s;
      continue;
    }
    if (sectors.n() >= kMost)
      throw InvalidData("the outline of the contact",
                        "an outline that " + std::to_string(kMost) +
                            " sectors follow within a hundredth of its mean radius; smooth it",
                        "corners or bays, the next at " + brief(360 / kRound * angles[s]) + " degrees from x to y");
    angles.insert(angles.begin() + static_cast<std::ptrdiff_t>(s) + 1, 0.5 * (angles[s] + angles[s + 1]));
  }
  return sectors;
}

void expect_on_slab(const Contact& contact, const Slab& slab) {
  if (contact.largest_radius_um() > 0.5 * slab.radius_um)
    throw InvalidData("the outline of the contact",
                      "an outline with points at most " + brief(0.5 * slab.radius_um) +
                          " um from its centroid, half the gel's radius_um",
                      "one at " + brief(contact.largest_radius_um()) + " um");
}

}  // namespace mbtfm::solids
