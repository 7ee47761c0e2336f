#include "segment/beads/gaps.h"

#include <algorithm>
#include <cmath>

namespace mbtfm::beads {

Gaps::Gaps(const Scene& scene, const std::vector<Track>& tracks) : scene_(scene), tracks_(tracks) {
  constexpr double kUsual = 16;
  constexpr int kFewest = 4;
  const Plane& plane = scene.relaxed->image.plane;
  const double area = static_cast<double>(plane.width) * plane.height;
  const double side = std::sqrt(area * kUsual / std::max(1, n_good(tracks)));
  nx_ = std::max(1, static_cast<int>(std::lround(plane.width / side)));
  ny_ = std::max(1, static_cast<int>(std::lround(plane.height / side)));
  side_x_ = static_cast<double>(plane.width) / nx_;
  side_y_ = static_cast<double>(plane.height) / ny_;
  std::vector<int> n(static_cast<std::size_t>(nx_) * ny_, 0);
  for (int k = 0; k < scene.n_beads(); ++k)
    if (tracks[k].is_good()) ++n[square_of(scene.position(k))];
  for (const int here : n) is_gap_.push_back(here < kFewest);
  share_ = static_cast<double>(std::ranges::count(is_gap_, true)) / static_cast<double>(is_gap_.size());
}

int Gaps::square_of(Vec2 place_px) const {
  const int i = std::clamp(static_cast<int>((place_px.x + 0.5) / side_x_), 0, nx_ - 1);
  const int j = std::clamp(static_cast<int>((place_px.y + 0.5) / side_y_), 0, ny_ - 1);
  return j * nx_ + i;
}

bool Gaps::are_large() const {
  constexpr double kNoticed = 0.02;
  return share_ >= kNoticed && std::ranges::count(is_gap_, true) >= 2;
}

bool Gaps::hold(Vec2 place_px) const { return is_gap_[square_of(place_px)]; }

bool Gaps::allow(Vec2 place_px, Vec2 u_px, double sigma_px) const {
  constexpr double kStrain = 0.3;  // gels are seldom strained by more between two places
  constexpr int kMost = 200;
  const double reach = 2 * std::hypot(side_x_, side_y_);  // the next squares but one
  bool has_witness = false;
  for (const int k : scene_.relaxed->neighbours.within(place_px, reach, kMost)) {
    if (!tracks_[k].is_good()) continue;
    has_witness = true;
    const Registered& bead = tracks_[k].found;
    const double granted = kStrain * norm(scene_.position(k) - place_px) + 4 * std::hypot(sigma_px, bead.sigma_px);
    if (norm(bead.motion.u - u_px) < granted) return true;
  }
  return !has_witness;
}

}  // namespace mbtfm::beads
