#include "pipeline/statistics/relations.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/statistics/samples.h"

namespace mbtfm::statistics {
namespace {

struct Force {
  const char* column;
  double FitSummary::*member;
};
constexpr Force kForces[] = {{"total_force_nN", &FitSummary::total_force_nN},
                             {"fibre_force_nN", &FitSummary::fibre_force_nN},
                             {"network_force_nN", &FitSummary::network_force_nN}};
struct Size {
  const char *column, *unit;
  double CellFigures::*member;
};
constexpr Size kSizes[] = {{"n_adhesions", "adhesion", &CellFigures::n_adhesions},
                           {"adhesion_area_um2", "µm² of adhesion", &CellFigures::adhesion_area_um2},
                           {"cell_area_um2", "µm² of cell", &CellFigures::cell_area_um2},
                           {"n_fibres", "fibre", &CellFigures::n_fibres}};

std::optional<Correlation> correlate(const Study& study, int condition, const Force& force, const Size& size,
                                     const std::vector<CellWeights>& draws) {
  const bool is_of_total = force.member == &FitSummary::total_force_nN;
  Correlation c{.force = force.column,
                .size = size.column,
                .size_unit = size.unit,
                .is_of_total = is_of_total,
                .condition = study.conditions[condition]};
  std::map<int, std::pair<double, double>> products;
  for (std::size_t i = 0; i < study.cells.size(); ++i) {
    if (study.cells[i].condition != condition || study.cells[i].kind() != CellKind::plane) continue;
    if (!is_of_total && !is_network_known(study.cells[i])) continue;
    const int cell = static_cast<int>(i);
    c.cells.push_back(cell);
    c.x.push_back(figures_of(study.cells[i]).*size.member);
    c.y.push_back(study.cells[i].fit.*force.member);
    products[cell] = {c.x.back() * c.y.back(), c.x.back() * c.x.back()};
  }
  if (std::ranges::all_of(c.x, [](double x) { return x == 0; })) return std::nullopt;
  if (c.x.size() < kFewestForALine) return c;
  c.line = line_through_origin(c.x, c.y);
  c.slope_interval = ratio_interval(products, draws);
  return c;
}

struct SizedForce {
  int cell = 0, condition = 0;
  bool is_connected = false;
  double area_um2 = 0, force_nN = 0;
};

std::vector<SizedForce> sized_forces(const Study& study) {
  const Sample forces = sample_adhesion_forces(study), areas = sample_adhesion_areas(study);
  std::vector<SizedForce> list;
  for (std::size_t i = 0; i < forces.values.size(); ++i) {
    const Observation& o = forces.values[i];
    list.push_back({o.cell, study.cells[o.cell].condition, o.kind == 0, areas.values[i].value, o.value});
  }
  return list;
}

/// Inner edges that cut the sorted areas into parts of as many adhesions; equal ones once.
std::vector<double> bin_edges(const std::vector<SizedForce>& adhesions) {
  constexpr int kBins = 8;           // enough to see a bend
  constexpr int kFewestInABin = 20;  // five connected ones, where a quarter are: else fewer bins
  std::vector<double> areas;
  for (const SizedForce& a : adhesions) areas.push_back(a.area_um2);
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
  std::vector<Correlation> list;
  for (const Size& size : kSizes) {
    for (const Force& force : kForces) {
      for (int condition = 0; condition < static_cast<int>(study.conditions.size()); ++condition)
        if (auto c = correlate(study, condition, force, size, draws)) list.push_back(std::move(*c));
    }
  }
  return list;
}

std::vector<AreaBin> bin_by_area(const Study& study, const std::vector<CellWeights>& draws) {
  const std::vector<SizedForce> adhesions = sized_forces(study);
  if (adhesions.empty()) return {};
  const std::vector<double> edges = bin_edges(adhesions);
  std::vector<AreaBin> bins;
  for (std::size_t condition = 0; condition < study.conditions.size(); ++condition) {
    for (const bool is_connected : {true, false}) {
      for (std::size_t b = 0; b + 1 < edges.size(); ++b) {
        AreaBin bin{.condition = study.conditions[condition],
                    .is_connected = is_connected,
                    .low_um2 = edges[b],
                    .high_um2 = edges[b + 1]};
        std::map<int, std::pair<double, double>> by_cell;
        const bool is_last = b + 2 == edges.size();
        for (const SizedForce& a : adhesions) {
          const bool is_inside = a.area_um2 >= bin.low_um2 && (a.area_um2 < bin.high_um2 || is_last);
          if (a.condition != static_cast<int>(condition) || a.is_connected != is_connected || !is_inside) continue;
          ++bin.n_adhesions;
          bin.mean_area_um2 += a.area_um2;
          bin.mean_force_nN += a.force_nN;
          by_cell[a.cell].first += a.force_nN;
          by_cell[a.cell].second += 1;
        }
        if (bin.n_adhesions == 0) continue;
        bin.n_cells = static_cast<int>(by_cell.size());
        bin.mean_area_um2 /= bin.n_adhesions;
        bin.mean_force_nN /= bin.n_adhesions;
        bin.interval_nN = ratio_interval(by_cell, draws);
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
      std::map<int, std::pair<double, double>> angles, cosines;
      for (std::size_t i = 0; i < study.cells.size(); ++i) {
        if (study.cells[i].condition != static_cast<int>(condition)) continue;
        for (const Direction& d : study.cells[i].directions) {
          if (d.relation != relation) continue;
          const double cosine = std::cos(d.angle_deg * std::numbers::pi / 180);
          s.angles_deg.push_back(d.angle_deg);
          s.mean_angle_deg += d.angle_deg;
          s.mean_cosine += cosine;
          angles[static_cast<int>(i)].first += d.angle_deg;
          angles[static_cast<int>(i)].second += 1;
          cosines[static_cast<int>(i)].first += cosine;
          cosines[static_cast<int>(i)].second += 1;
        }
      }
      s.n = static_cast<int>(s.angles_deg.size());
      if (s.n == 0) continue;
      s.n_cells = static_cast<int>(angles.size());
      s.mean_angle_deg /= s.n;
      s.mean_cosine /= s.n;
      s.angle_interval_deg = ratio_interval(angles, draws);
      s.cosine_interval = ratio_interval(cosines, draws);
      list.push_back(std::move(s));
    }
  }
  return list;
}

}  // namespace mbtfm::statistics
