#include "pipeline/numerics/masked_values.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "pipeline/contract/extent.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/near.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::numerics {
namespace {

constexpr std::size_t kLeastShared = 10;  // beads: less do no harm that their neighbours do not show

/// Beads of one value, and where it lies among the values that occur.
struct Group {
  std::size_t begin = 0, end = 0;  ///< in Values::order
  int rank_x = 0, rank_y = 0;
  std::size_t size() const { return end - begin; }
};

struct Values {
  std::vector<std::size_t> order;               ///< good beads, equal ones beside each other
  std::vector<double> all_x, all_y;             ///< that occur, each once
  std::map<std::pair<int, int>, Group> groups;  ///< by rank
  std::pair<int, int> ranks(Vec2 u) const {
    const auto rank = [](const std::vector<double>& all, double value) {
      return static_cast<int>(std::ranges::lower_bound(all, value) - all.begin());
    };
    return {rank(all_x, u.x), rank(all_y, u.y)};
  }
};

bool is_less(Vec2 a, Vec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); }

Values values_of(const DisplacementField& field, std::vector<std::size_t> order) {
  Values values{.order = std::move(order), .all_x = {}, .all_y = {}, .groups = {}};
  for (const std::size_t k : values.order) {
    values.all_x.push_back(field[k].displacement_um.x);
    values.all_y.push_back(field[k].displacement_um.y);
  }
  for (std::vector<double>* all : {&values.all_x, &values.all_y}) {
    std::ranges::sort(*all);
    all->erase(std::unique(all->begin(), all->end()), all->end());
  }
  for (std::size_t begin = 0, end = 0; begin < values.order.size(); begin = end) {
    const Vec2 u = field[values.order[begin]].displacement_um;
    while (end < values.order.size() && field[values.order[end]].displacement_um == u) ++end;
    const auto [x, y] = values.ranks(u);
    values.groups[{x, y}] = {.begin = begin, .end = end, .rank_x = x, .rank_y = y};
  }
  return values;
}

/// (a) Many more than of the values beside it.
bool stands_out(const Group& group, const Values& values) {
  constexpr int kReach = 3, kBeside = (2 * kReach + 1) * (2 * kReach + 1) - 1;
  constexpr double kMore = 5;
  double beside = 0;
  for (int i = -kReach; i <= kReach; ++i)
    for (int j = -kReach; j <= kReach; ++j) {
      const auto found = values.groups.find({group.rank_x + i, group.rank_y + j});
      if ((i != 0 || j != 0) && found != values.groups.end()) beside += static_cast<double>(found->second.size());
    }
  return static_cast<double>(group.size()) > kLeastShared + kMore * beside / kBeside;
}

/// (b), (c) At the rim of the group the field jumps, and does not grow as much again one place further on.
bool is_cut_out(const Group& group, const Values& values, const DisplacementField& field,
                const Neighbours<Vec2>& neighbours, double reach_um) {
  constexpr int kAround = 12;
  constexpr double kSteps = 3, kGrowth = 0.4;
  std::vector<char> is_in(values.order.size(), 0);
  std::map<std::size_t, std::size_t> place_of;  // in the order, of a good bead
  std::fill(is_in.begin() + static_cast<std::ptrdiff_t>(group.begin),
            is_in.begin() + static_cast<std::ptrdiff_t>(group.end), 1);
  const Vec2 shared = field[values.order[group.begin]].displacement_um;
  const auto around = [&](std::size_t k) {
    std::vector<int> found = neighbours.within(field[values.order[k]].position_um, reach_um, kAround + 1);
    std::erase(found, static_cast<int>(k));
    return found;
  };
  std::vector<std::size_t> rim;
  for (std::size_t k = group.begin; k < group.end; ++k)
    for (const int other : around(k))
      if (is_in[static_cast<std::size_t>(other)] == 0) {
        is_in[static_cast<std::size_t>(other)] = 2;
        rim.push_back(static_cast<std::size_t>(other));
      }
  if (rim.empty()) return false;
  std::vector<double> steps, growths;
  for (const std::size_t k : rim) {
    const Vec2 jump = field[values.order[k]].displacement_um - shared;
    const auto [x, y] = values.ranks(field[values.order[k]].displacement_um);
    steps.push_back(std::max(std::abs(x - group.rank_x), std::abs(y - group.rank_y)));
    for (const int other : around(k)) {
      if (is_in[static_cast<std::size_t>(other)] != 0) continue;
      const Vec2 further = field[values.order[static_cast<std::size_t>(other)]].displacement_um - shared;
      growths.push_back(dot(further - jump, jump) / dot(jump, jump));
    }
  }
  if (!(quantile(std::move(steps), 0.5) > kSteps)) return false;
  return growths.empty() || quantile(std::move(growths), 0.5) < kGrowth;
}

}  // namespace

Masked flag_masked(DisplacementField& field) {
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < field.size(); ++k)
    if (field[k].flag.empty()) order.push_back(k);
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) {
    const Vec2 u = field[a].displacement_um, v = field[b].displacement_um;
    return is_less(u, v) || (u == v && a < b);
  });
  const Values values = values_of(field, std::move(order));
  std::vector<Group> groups;
  for (const auto& [ranks, group] : values.groups)
    if (group.size() >= kLeastShared && stands_out(group, values)) groups.push_back(group);
  if (groups.empty() || groups.front().size() == values.order.size()) return {};
  std::vector<Vec2> places;
  for (const std::size_t k : values.order) places.push_back(field[k].position_um);
  const double spacing_um =
      std::sqrt(std::max(1e-12, extent_of(places).area_um2()) / static_cast<double>(places.size()));
  const double reach_um = 1.6 * spacing_um;  // the eight around on a lattice
  const Neighbours neighbours(places, reach_um);
  std::erase_if(groups, [&](const Group& g) { return !is_cut_out(g, values, field, neighbours, reach_um); });
  Masked masked;
  for (const Group& group : groups) {
    const Vec2 u = field[values.order[group.begin]].displacement_um;
    masked.values_um.push_back("(" + significant(u.x, 6) + ", " + significant(u.y, 6) + ")");
    masked.n += group.size();
    for (std::size_t k = group.begin; k < group.end; ++k) {
      field[values.order[k]].displacement_um = {};
      field[values.order[k]].flag = "masked";
    }
  }
  return masked;
}

}  // namespace mbtfm::numerics
