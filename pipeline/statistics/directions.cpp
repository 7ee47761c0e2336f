#include "pipeline/statistics/directions.h"

#include <algorithm>
#include <map>
#include <numbers>

namespace mbtfm::statistics {
namespace {

double angle_deg(Vec2 a, Vec2 b) { return std::atan2(std::abs(cross(a, b)), dot(a, b)) * 180 / std::numbers::pi; }

/// From the fibre's first point to where it has run 2 um.
Vec2 initial_direction(Polyline points) {
  constexpr double kRun_um = 2;
  double run = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double step = norm(points[i] - points[i - 1]);
    if (run + step >= kRun_um)
      return points[i - 1] + ((kRun_um - run) / step) * (points[i] - points[i - 1]) - points.front();
    run += step;
  }
  return points.back() - points.front();
}

struct FibreEnd {
  int adhesion_id = 0, fibre_id = 0;
  Vec2 inwards;
};

std::vector<FibreEnd> held_ends(const Cell& cell) {
  std::vector<FibreEnd> ends;
  for (const Fibre& fibre : cell.fibres) {
    if (fibre.start_adhesion_id)
      ends.push_back({*fibre.start_adhesion_id, fibre.fibre_id, initial_direction(fibre.points_um)});
    if (fibre.end_adhesion_id) {
      ends.push_back({*fibre.end_adhesion_id, fibre.fibre_id,
                      initial_direction({fibre.points_um.rbegin(), fibre.points_um.rend()})});
    }
  }
  return ends;
}

/// Means over the beads near an adhesion that the fit used.
struct Near {
  int n = 0;
  Vec2 measured, fitted, without_fibres;
};

/// The fields of the model have the same beads in the same order.
class NearBeads {
 public:
  explicit NearBeads(const Displacements& d) : d_(d) {
    if (!d.measured || !d.fitted) return;
    for (const Bead& bead : *d.measured)
      if (bead.flag.empty()) measured_[{bead.position_um.x, bead.position_um.y}] = bead.displacement_um;
  }
  bool has_simple_model() const { return d_.without_fibres && d_.without_fibres->size() == d_.fitted->size(); }

  std::optional<Near> around(const Adhesion& adhesion) const {
    if (measured_.empty()) return std::nullopt;
    const double radius = std::max(d_.near_um, adhesion.major_axis_um / 2);
    Near near;
    for (std::size_t i = 0; i < d_.fitted->size(); ++i) {
      const Vec2 at = (*d_.fitted)[i].position_um;
      if (norm(at - adhesion.position_um) > radius) continue;
      const auto bead = measured_.find({at.x, at.y});
      if (bead == measured_.end()) continue;
      ++near.n;
      near.measured += bead->second;
      near.fitted += (*d_.fitted)[i].displacement_um;
      if (has_simple_model()) near.without_fibres += (*d_.without_fibres)[i].displacement_um;
    }
    // the direction of a sum is that of the mean; each component of the sum scatters by noise · √n
    constexpr double kStandardErrors = 2;
    if (near.n == 0 || norm(near.measured) < kStandardErrors * d_.noise_um * std::sqrt(near.n)) return std::nullopt;
    return near;
  }

 private:
  const Displacements& d_;
  std::map<std::pair<double, double>, Vec2> measured_;
};

}  // namespace

std::string_view full_name_of(Relation relation) {
  static constexpr const char* kNames[] = {"adhesion and fibre", "fibre and displacement",
                                           "displacement of the model and measured",
                                           "displacement without fibres and measured"};
  return kNames[static_cast<int>(relation)];
}

double largest_angle_deg(Relation relation) { return relation == Relation::adhesion_fibre ? 90 : 180; }

std::vector<Direction> directions_of(const Cell& cell, const Displacements& displacements) {
  std::map<int, const Adhesion*> adhesion;
  for (const Adhesion& a : cell.adhesions) adhesion[a.adhesion_id] = &a;
  const NearBeads beads(displacements);
  std::map<int, std::optional<Near>> near;
  std::vector<Direction> list;
  for (const Adhesion& a : cell.adhesions) {
    if (is_assumed(a.origin)) continue;  // a disc that was put there has no direction, and beads near it no meaning
    near[a.adhesion_id] = beads.around(a);
    const auto& n = near[a.adhesion_id];
    if (!n) continue;
    list.push_back({Relation::model_measured, a.adhesion_id, {}, angle_deg(n->fitted, n->measured)});
    if (!beads.has_simple_model()) continue;
    list.push_back({Relation::without_fibres_measured, a.adhesion_id, {}, angle_deg(n->without_fibres, n->measured)});
  }
  for (const FibreEnd& end : held_ends(cell)) {
    const Adhesion& a = *adhesion.at(end.adhesion_id);
    if (is_assumed(a.origin)) continue;
    const double between = angle_deg({std::cos(a.angle_rad), std::sin(a.angle_rad)}, end.inwards);
    list.push_back({Relation::adhesion_fibre, end.adhesion_id, end.fibre_id, std::min(between, 180 - between)});
    if (const auto& n = near.at(end.adhesion_id)) {
      list.push_back(
          {Relation::fibre_displacement, end.adhesion_id, end.fibre_id, angle_deg(end.inwards, n->measured)});
    }
  }
  return list;
}

}  // namespace mbtfm::statistics
