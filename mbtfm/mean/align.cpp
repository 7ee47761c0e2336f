#include "mbtfm/mean/align.h"

#include <algorithm>
#include <numeric>

#include "mbtfm/mean/symmetry.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::mean {

int most_typical(const std::vector<Polygon>& outlines_um, Mirrors mirrors, int threads) {
  constexpr std::size_t kMostCandidates = 12;  // of the middle sizes: each is laid onto all
  std::vector<int> candidates(outlines_um.size());
  std::iota(candidates.begin(), candidates.end(), 0);
  std::ranges::stable_sort(candidates, {}, [&](int k) { return size_um(outlines_um[k]); });
  while (candidates.size() > kMostCandidates) {
    candidates.pop_back();
    if (candidates.size() > kMostCandidates) candidates.erase(candidates.begin());
  }
  std::vector<double> sums(candidates.size(), 0);
  numerics::parallel_for(static_cast<int>(candidates.size()), threads, [&](int k) {
    for (const Polygon& outline : outlines_um) {
      const double misfit = ways_onto(outline, outlines_um[candidates[k]], mirrors).front().misfit_um;
      sums[k] += misfit * misfit;
    }
  });
  return candidates[std::ranges::min_element(sums) - sums.begin()];
}

Mirrors mirrors_for(Switch setting, const Polygon& reference_um) {
  if (setting != Switch::automatic) return setting == Switch::on ? Mirrors::tried : Mirrors::not_tried;
  const std::vector<Way> ways = ways_onto(reference_um, reference_um, Mirrors::tried);
  const auto mirrored = std::ranges::find_if(ways, [](const Way& way) { return way.motion.is_mirrored; });
  constexpr double kOwnMirrorImage = 0.05;  // of the size: outlines of one shape differ by as much
  const bool has_mirror = mirrored != ways.end() && mirrored->misfit_um < kOwnMirrorImage * size_um(reference_um);
  return has_mirror ? Mirrors::not_tried : Mirrors::tried;
}

void expect_symmetric(const Alignment& alignment, const std::string& symmetry) {
  const double off = asymmetry_um(alignment.reference_um, alignment.motions);
  const double allowed = alignment.largest_misfit * size_um(alignment.reference_um);
  if (off > allowed)
    throw UsageError("--symmetry " + symmetry + ": expected a reference that is the same after each motion to within " +
                     brief(allowed) + " um (largest_misfit of its radius), found " + brief(off) +
                     " um: give its own symmetry, or a pattern that has this one");
}

namespace {

/// Marks a cell whose outline does not fit.
void judge(CellRow& row, const Alignment& alignment) {
  const double allowed = alignment.largest_misfit * size_um(alignment.reference_um);
  if (row.way.misfit_um <= allowed) return;
  row.is_kept = false;
  row.reason = "its outline lies " + brief(row.way.misfit_um) +
               " um from the reference (root mean square), more than " + brief(allowed) + " um";
}

}  // namespace

std::vector<CellRow> aligned(const std::vector<Cell>& cells, const Alignment& alignment, int threads,
                             const Brightness* image) {
  std::vector<CellRow> rows(cells.size());
  numerics::parallel_for(static_cast<int>(cells.size()), threads, [&](int k) {
    const Cell& cell = cells[k];
    std::vector<Way> ways = image ? ways_by_images(cell.image, *image, alignment.mirrors)
                                  : ways_onto(cell.outline_um, alignment.reference_um, alignment.mirrors);
    if (image) {
      for (Way& way : ways) way.misfit_um = misfit_um(moved(cell.outline_um, way.motion), alignment.reference_um);
    }
    CellRow& row = rows[k] = {.cell = cell.name, .way = ways.front(), .n_beads = static_cast<int>(cell.beads.size())};
    const auto second = std::ranges::find_if(
        ways, [&](const Way& way) { return !are_equivalent(way, ways.front(), alignment.motions); });
    if (second != ways.end()) {
      row.second_misfit_um = second->misfit_um;
      row.is_ambiguous = image ? correlate_equally(ways.front(), *second)
                               : fit_equally(ways.front(), *second, size_um(alignment.reference_um));
    }
    judge(row, alignment);
  });
  return rows;
}

}  // namespace mbtfm::mean
