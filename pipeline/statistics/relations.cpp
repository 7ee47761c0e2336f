/// What goes with what: forces of cells with their size, force of adhesions with their area, directions.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/statistics/analysis.h"

namespace mbtfm::statistics {
namespace {

/// A number of a cell with fibres; none: not known.
struct Quantity {
  const char *column, *label, *unit;  ///< unit: what one more of is counted
  std::optional<double> (*of)(const StudyCell&);
};
constexpr Quantity kForces[] = {
    {"total_force_nN", "total force (nN)", "nN",
     [](const StudyCell& c) { return std::optional(c.fit.total_force_nN); }},
    {"fibre_force_nN", "force of the fibres (nN)", "nN",
     [](const StudyCell& c) { return is_network_known(c) ? std::optional(c.fit.fibre_force_nN) : std::nullopt; }},
    {"network_force_nN", "force of the network (nN)", "nN",
     [](const StudyCell& c) { return is_network_known(c) ? std::optional(c.fit.network_force_nN) : std::nullopt; }},
    {"fttc_force_nN", "total force by FTTC (nN)", "nN", [](const StudyCell& c) { return c.fttc_force_nN; }}};
constexpr Quantity kSizes[] = {{"n_adhesions", "number of adhesions", "adhesion",
                                [](const StudyCell& c) { return std::optional(figures_of(c).n_adhesions); }},
                               {"adhesion_area_um2", "area of all adhesions (µm²)", "µm² of adhesion",
                                [](const StudyCell& c) { return std::optional(figures_of(c).adhesion_area_um2); }},
                               {"cell_area_um2", "area of the cell (µm²)", "µm² of cell",
                                [](const StudyCell& c) { return std::optional(figures_of(c).cell_area_um2); }},
                               {"n_fibres", "number of fibres", "fibre",
                                [](const StudyCell& c) { return std::optional(figures_of(c).n_fibres); }}};

std::optional<Correlation> correlate(const Study& study, int condition, const Quantity& force, const Quantity& size,
                                     const std::vector<CellWeights>& draws) {
  Correlation c{.force = force.column,
                .size = size.column,
                .force_label = force.label,
                .size_label = size.label,
                .size_unit = size.unit,
                .condition = study.conditions[condition]};
  std::map<int, std::pair<double, double>> products;
  for (std::size_t i = 0; i < study.cells.size(); ++i) {
    if (study.cells[i].condition != condition || !has_fibres(study.cells[i].kind())) continue;
    const std::optional<double> x = size.of(study.cells[i]), y = force.of(study.cells[i]);
    if (!x || !y) continue;
    const int cell = static_cast<int>(i);
    c.cells.push_back(cell);
    c.x.push_back(*x);
    c.y.push_back(*y);
    products[cell] = {*x * *y, *x * *x};
  }
  if (std::ranges::all_of(c.x, [](double x) { return x == 0; })) return std::nullopt;
  if (c.x.size() < kFewestForALine) return c;
  c.line = line_through_origin(c.x, c.y);
  c.slope_interval = ratio_interval(products, draws);
  return c;
}

/// Inner edges that cut the sorted areas into parts of as many adhesions; equal ones once.
std::vector<double> bin_edges(std::vector<double> areas) {
  constexpr int kBins = 8;           // enough to see a bend
  constexpr int kFewestInABin = 20;  // five connected ones, where a quarter are: else fewer bins
  std::ranges::sort(areas);
  const int n_bins = std::clamp(static_cast<int>(areas.size()) / kFewestInABin, 1, kBins);
  std::set<double> edges = {areas.front(), areas.back()};
  for (int b = 1; b < n_bins; ++b)
    edges.insert(areas[areas.size() * static_cast<std::size_t>(b) / static_cast<std::size_t>(n_bins)]);
  std::vector<double> list(edges.begin(), edges.end());
  if (list.size() == 1) list.push_back(list.front());  // all areas equal: one bin of no width
  return list;
}

}  // namespace

std::vector<Correlation> correlate_forces(const Study& study, const std::vector<CellWeights>& draws) {
  std::vector<std::pair<const Quantity*, const Quantity*>> pairs;  // force and size, thesis figs. 3.12, A.1, A.2
  for (const Quantity& size : kSizes)
    for (const Quantity& force : kForces) pairs.emplace_back(&force, &size);
  for (const Quantity* size : {&kSizes[0], &kSizes[1], &kSizes[3]}) pairs.emplace_back(size, &kSizes[2]);  // fig. 3.11
  std::vector<Correlation> list;
  for (const auto& [y, x] : pairs)
    for (int condition = 0; condition < static_cast<int>(study.conditions.size()); ++condition)
      if (auto c = correlate(study, condition, *y, *x, draws)) list.push_back(std::move(*c));
  return list;
}

std::vector<AreaBin> bin_by_area(const Study& study, const std::vector<CellWeights>& draws) {
  std::vector<double> areas;
  for (const StudyCell& cell : study.cells)
    for (const SeenAdhesion& a : seen_adhesions(cell)) areas.push_back(a.area_um2);
  if (areas.empty()) return {};
  const std::vector<double> edges = bin_edges(areas);
  std::vector<AreaBin> bins;
  for (std::size_t condition = 0; condition < study.conditions.size(); ++condition) {
    for (const bool is_connected : {true, false}) {
      for (std::size_t b = 0; b + 1 < edges.size(); ++b) {
        AreaBin bin{.condition = study.conditions[condition],
                    .is_connected = is_connected,
                    .low_um2 = edges[b],
                    .high_um2 = edges[b + 1]};
        CellMean area, force;
        const bool is_last = b + 2 == edges.size();
        for (std::size_t i = 0; i < study.cells.size(); ++i) {
          if (study.cells[i].condition != static_cast<int>(condition)) continue;
          for (const SeenAdhesion& a : seen_adhesions(study.cells[i])) {
            const bool is_inside = a.area_um2 >= bin.low_um2 && (a.area_um2 < bin.high_um2 || is_last);
            if (a.is_connected != is_connected || !is_inside) continue;
            area.add(static_cast<int>(i), a.area_um2);
            force.add(static_cast<int>(i), a.force_nN);
          }
        }
        if (force.n() == 0) continue;
        bin.n_cells = force.n_cells();
        bin.n_adhesions = force.n();
        bin.mean_area_um2 = area.mean();
        bin.mean_force_nN = force.mean();
        bin.interval_nN = force.interval(draws);
        bins.push_back(bin);
      }
    }
  }
  return bins;
}

std::vector<DirectionSummary> summarise_directions(const Study& study, const std::vector<CellWeights>& draws) {
  std::vector<DirectionSummary> list;
  for (const Relation relation : kRelations) {
    for (std::size_t condition = 0; condition < study.conditions.size(); ++condition) {
      DirectionSummary s{.relation = relation, .condition = study.conditions[condition]};
      CellMean angle, cosine;
      for (std::size_t i = 0; i < study.cells.size(); ++i) {
        if (study.cells[i].condition != static_cast<int>(condition)) continue;
        for (const Direction& d : study.cells[i].directions) {
          if (d.relation != relation) continue;
          s.angles_deg.push_back(d.angle_deg);
          angle.add(static_cast<int>(i), d.angle_deg);
          cosine.add(static_cast<int>(i), std::cos(d.angle_deg * std::numbers::pi / 180));
        }
      }
      if (angle.n() == 0) continue;
      s.n = angle.n();
      s.n_cells = angle.n_cells();
      s.mean_angle_deg = angle.mean();
      s.mean_cosine = cosine.mean();
      s.angle_interval_deg = angle.interval(draws);
      s.cosine_interval = cosine.interval(draws);
      list.push_back(std::move(s));
    }
  }
  return list;
}

}  // namespace mbtfm::statistics
