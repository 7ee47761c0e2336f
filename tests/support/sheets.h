/// Sheets of the reference values, and how far a solution is from them.
#pragma once

#include "continuum/sheet/forward.h"
#include "continuum/sheet/recovery.h"
#include "pipeline/files/csv.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace mbtfm::test {

inline files::CsvTable chapter4(const std::string& name) {
  return files::CsvTable(test::source_folder() / "tests/data/reference/chapter4" / (name + ".csv"));
}

/// A closed line r(t) about the origin.
inline Polygon ring(const std::function<double(double)>& radius_um, int n) {
  Polygon points;
  for (int i = 0; i < n; ++i) {
    const double t = 2 * std::numbers::pi * i / n;
    points.push_back(radius_um(t) * Vec2{std::cos(t), std::sin(t)});
  }
  return points;
}
inline Polygon circle(double radius_um, int n = 360) {
  return ring([=](double) { return radius_um; }, n);
}
inline Polygon rectangle(double length_um, double width_um) {
  const double a = length_um / 2, b = width_um / 2;
  return {{-a, -b}, {a, -b}, {a, b}, {-a, b}};
}

/// A solved sheet that can be asked anywhere.
struct SolvedSheet {
  sheet::Elements elements;
  sheet::Sheet sheet;
  sheet::NodeVectors u = {};
  std::vector<sheet::Tensor> S = {};

  SolvedSheet(const sheet::Region& region, const sheet::TriangleSize& size)
      : elements(sheet::triangulated(region, size, 200000)), sheet{} {
    sheet.n_rims = static_cast<int>(region.rims.size());
  }
  void solve() {
    u = sheet::on_springs(elements, sheet, 1);
    S = sheet::recovered(elements, sheet::tension_at_points(elements, sheet, u),
                         sheet::known_on_springs(elements, sheet, u));
  }
  struct Values {
    Vec2 u;
    sheet::Tensor S;
  };
  std::optional<Values> at(Vec2 p) const {
    const auto place = sheet::Locator(elements).find(p, 0.05);
    if (!place) return std::nullopt;
    const sheet::Shape shape = elements.shape(place->triangle, place->r, place->s);
    const auto& nodes = elements.nodes(place->triangle);
    return Values{sheet::value_of(u, nodes, shape), sheet::value_of(S, nodes, shape)};
  }
};

/// Differences over the largest value.
struct Deviation {
  double difference = 0, largest = 0;
  void add(double ours, double theirs) {
    difference = std::max(difference, std::abs(ours - theirs));
    largest = std::max(largest, std::abs(theirs));
  }
  double relative() const { return difference / largest; }
};

}  // namespace mbtfm::test
