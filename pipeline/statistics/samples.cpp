#include "pipeline/statistics/samples.h"

#include <algorithm>
#include <map>
#include <set>

namespace mbtfm::statistics {
namespace {

Sample empty_sample(const Study& study, std::string column, std::string name, std::string unit, Observed each,
                    std::vector<std::string> kinds) {
  return {.column = std::move(column),
          .name = std::move(name),
          .unit = std::move(unit),
          .each = each,
          .kinds = std::move(kinds),
          .conditions = study.conditions,
          .values = {}};
}

void add(Sample& sample, const StudyCell& cell, int index, int kind, double value,
         const std::optional<double>& standard_error) {
  const double error = standard_error.value_or(0);
  if (error == 0) ++sample.n_without_error;
  sample.values.push_back({.value = value,
                           .error_variance = error * error,
                           .cell = index,
                           .kind = kind,
                           .group = sample.group_of(cell.condition, kind)});
}

/// An unknown error taken for zero would give its value more weight than all others: it is as large as theirs.
Sample with_typical_errors(Sample sample) {
  double sum = 0;
  int n = 0;
  for (const Observation& o : sample.values) {
    sum += o.error_variance;
    n += o.error_variance > 0 ? 1 : 0;
  }
  for (Observation& o : sample.values) {
    if (o.error_variance == 0 && n > 0) o.error_variance = sum / n;
  }
  return sample;
}

template <class Visit>
void for_each_adhesion(const Study& study, Visit&& visit) {
  for (std::size_t i = 0; i < study.cells.size(); ++i) {
    std::map<int, double> area;  // of those that were seen: an anchor's or a candidate's size is nobody's measurement
    for (const Adhesion& a : study.cells[i].cell.adhesions) {
      if (!is_assumed(a.origin)) area[a.adhesion_id] = a.area_um2;
    }
    for (const AdhesionForce& f : study.cells[i].forces) {
      if (!area.contains(f.adhesion_id)) continue;
      visit(study.cells[i], static_cast<int>(i), f, area.at(f.adhesion_id));
    }
  }
}

const std::vector<std::string> kConnection = {"connected", "unconnected"};

}  // namespace

std::vector<Observation> Sample::of_group(int condition, int kind) const {
  std::vector<Observation> own;
  for (const Observation& o : values) {
    if (o.group == group_of(condition, kind)) own.push_back(o);
  }
  return own;
}

Sample sample_tensions(const Study& study) {
  std::vector<std::string> kinds;
  for (const FibreType type : kFibreTypes) {
    if (counted_type(study, type) == type) kinds.emplace_back(name_of(type));
  }
  Sample sample = empty_sample(study, "tension_nN", "tension", "nN", Observed::fibres, kinds);
  for (const MeasuredFibre& f : measured_fibres(study)) {
    add(sample, *f.cell, static_cast<int>(f.cell - study.cells.data()),
        static_cast<int>(counted_type(study, f.fibre->type)), f.tension->tension_nN, standard_error_nN(*f.tension));
  }
  return with_typical_errors(std::move(sample));
}

Sample sample_adhesion_forces(const Study& study) {
  Sample sample = empty_sample(study, "adhesion_force_nN", "force", "nN", Observed::adhesions, kConnection);
  for_each_adhesion(study, [&](const StudyCell& cell, int i, const AdhesionForce& f, double) {
    add(sample, cell, i, f.connected ? 0 : 1, norm(f.force_nN), f.sigma_nN);
  });
  return with_typical_errors(std::move(sample));
}

Sample sample_adhesion_areas(const Study& study) {
  Sample sample = empty_sample(study, "adhesion_area_um2", "area", "µm²", Observed::adhesions, kConnection);
  for_each_adhesion(study, [&](const StudyCell& cell, int i, const AdhesionForce& f, double area_um2) {
    add(sample, cell, i, f.connected ? 0 : 1, area_um2, 0.0);
  });
  return sample;
}

std::vector<Sample> sample_cells(const Study& study) {
  struct Quantity {
    const char *column, *name, *unit;
    double FitSummary::*member;
  };
  constexpr Quantity kQuantities[] = {{"total_force_nN", "total force", "nN", &FitSummary::total_force_nN},
                                      {"fibre_force_nN", "force of the fibres", "nN", &FitSummary::fibre_force_nN},
                                      {"network_force_nN", "force of the network", "nN", &FitSummary::network_force_nN},
                                      {"network_surface_tension_nN_per_um", "surface tension of the network", "nN/µm",
                                       &FitSummary::network_surface_tension_nN_per_um}};
  std::vector<Sample> samples;
  for (const Quantity& q : kQuantities) {
    Sample sample = empty_sample(study, q.column, q.name, q.unit, Observed::cells, {"cell"});
    sample.is_never_negative = q.member != &FitSummary::fibre_force_nN;  // a difference: total less network
    for (std::size_t i = 0; i < study.cells.size(); ++i) {
      if (q.member != &FitSummary::total_force_nN && !is_network_known(study.cells[i])) continue;
      add(sample, study.cells[i], static_cast<int>(i), 0, study.cells[i].fit.*q.member, 0.0);
    }
    samples.push_back(std::move(sample));
  }
  return samples;
}

CellFigures figures_of(const StudyCell& cell) {
  CellFigures f{.n_adhesions = static_cast<double>(std::ranges::count_if(
                    cell.cell.adhesions, [](const Adhesion& a) { return !is_assumed(a.origin); })),
                .n_fibres = static_cast<double>(cell.cell.fibres.size()),
                .adhesion_area_um2 = 0,
                .cell_area_um2 = std::abs(signed_area_um2(cell.cell.outline_um))};
  for (const Adhesion& a : cell.cell.adhesions) f.adhesion_area_um2 += is_assumed(a.origin) ? 0 : a.area_um2;
  for (const Polygon& hole : cell.cell.holes_um) f.cell_area_um2 -= std::abs(signed_area_um2(hole));
  return f;
}

std::vector<double> values_of(const std::vector<Observation>& observations) {
  std::vector<double> values;
  for (const Observation& o : observations) values.push_back(o.value);
  return values;
}

int n_cells_of(const std::vector<Observation>& observations) {
  std::set<int> cells;
  for (const Observation& o : observations) cells.insert(o.cell);
  return static_cast<int>(cells.size());
}

}  // namespace mbtfm::statistics
