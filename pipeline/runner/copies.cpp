#include "pipeline/runner/copies.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "pipeline/contract/extent.h"

namespace mbtfm::runner {
namespace {

/// By half of the smaller one.
bool overlap(const Polygon& a, const Polygon& b) {
  if (a.empty() || b.empty()) return true;
  const auto [low, high] = extent_of(a);
  constexpr int kLines = 64;  // of the lattice over a: its area to some percent
  const Vec2 step{(high.x - low.x) / kLines, (high.y - low.y) / kLines};
  double shared_um2 = 0;
  for (int i = 0; i < kLines * kLines; ++i) {
    const Vec2 p{low.x + (i % kLines + 0.5) * step.x, low.y + (i / kLines + 0.5) * step.y};
    if (contains(a, p) && contains(b, p)) shared_um2 += step.x * step.y;
  }
  return shared_um2 > 0.5 * std::min(std::abs(signed_area_um2(a)), std::abs(signed_area_um2(b)));
}

}  // namespace

std::vector<std::optional<std::size_t>> originals_of(const std::vector<CellInField>& cells) {
  std::vector<std::optional<std::size_t>> originals(cells.size());
  std::multimap<std::string, std::size_t> by_field;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].field_sha256.empty()) continue;
    const auto [first, last] = by_field.equal_range(cells[i].field_sha256);
    const auto same = std::find_if(
        first, last, [&](const auto& other) { return overlap(cells[i].outline_um, cells[other.second].outline_um); });
    if (same == last)
      by_field.emplace(cells[i].field_sha256, i);
    else
      originals[i] = same->second;
  }
  return originals;
}

std::string why_a_copy(const std::string& original, const std::string& field, const CellInField& cell) {
  return "the same cell as " + original + ": their " + field + " are the same bytes" +
         (cell.outline_um.empty() ? "" : " and their outlines overlap");
}

}  // namespace mbtfm::runner
