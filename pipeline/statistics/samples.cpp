#include "pipeline/statistics/samples.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "pipeline/charts/chart.h"

namespace mbtfm::statistics {
namespace {

Sample empty_sample(const Study& study, std::string column, std::string name, std::string unit, Observed each,
                    std::vector<std::string> kinds) {
  return {.column = std::move(column),
          .name = std::move(name),
          .unit = std::move(unit),
          .each = each,
          .kinds = std::move(kinds),
          .conditions = study.conditions};
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
  for (Observation& o : sample.values)
    if (o.error_variance == 0 && n > 0) o.error_variance = sum / n;
  return sample;
}

/// Forces, or areas, of the adhesions.
Sample sample_adhesions(const Study& study, const char* column, const char* name, const char* unit,
                        double SeenAdhesion::*value) {
  Sample sample = empty_sample(study, column, name, unit, Observed::adhesions, {"connected", "unconnected"});
  for (const SeenAdhesion& a : seen_adhesions(study))
    add(sample, study.cells[a.cell], a.cell, a.is_connected ? 0 : 1, a.*value,
        value == &SeenAdhesion::force_nN ? a.sigma_nN : 0.0);
  return with_typical_errors(std::move(sample));
}

std::vector<int> cells_of(const Study& study, CellKind kind) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < study.cells.size(); ++i)
    if (study.cells[i].kind() == kind) indices.push_back(static_cast<int>(i));
  return indices;
}

using Number = std::optional<double>;
enum class MayBeNegative { no, yes };

/// A number that each cell of a kind has, or lacks.
struct Measured {
  const char *column, *name, *unit;
  std::function<Number(const StudyCell&)> of, sigma = {};  ///< sigma: none where no error is known
  MayBeNegative may_be_negative = MayBeNegative::no;
};

/// Of what cells of one kind have. @param figure  a member of it
template <class Part>
std::function<Number(const StudyCell&)> figure_of(std::optional<Part> StudyCell::*part, auto figure) {
  return [=](const StudyCell& c) -> Number { return std::invoke(figure, *(c.*part)); };
}

/// @param kind  the sample's only one
Sample sample_of(const Study& study, CellKind of, Observed each, const char* kind, const Measured& m) {
  Sample sample = empty_sample(study, m.column, m.name, m.unit, each, {kind});
  sample.is_never_negative = m.may_be_negative == MayBeNegative::no;
  for (const int i : cells_of(study, of)) {
    const StudyCell& cell = study.cells[i];
    if (const Number value = m.of(cell)) add(sample, cell, i, 0, *value, m.sigma ? m.sigma(cell) : Number());
  }
  return with_typical_errors(std::move(sample));
}

bool is_never_negative(SheetQuantity quantity) {
  return quantity != SheetQuantity::contraction && quantity != SheetQuantity::contraction_over_stiffness;
}

/// Of one quantity of sheet_fit.csv; kinds are the parts of the sheets, in the order in which they are first met.
Sample sample_estimates(const Study& study, SheetQuantity quantity) {
  const auto& [name, unit] = for_people(quantity);
  Sample sample = empty_sample(study, name_of(quantity), name, unit,
                               quantity == SheetQuantity::bundle_tension ? Observed::bundles : Observed::sheets, {});
  sample.is_never_negative = is_never_negative(quantity);
  const auto visit = [&](const auto& body) {
    for (const int i : cells_of(study, CellKind::sheet)) {
      const StudyCell& cell = study.cells[i];
      for (const SheetEstimate& e : cell.sheet->estimates)
        if (e.quantity == quantity && enters(e)) body(cell, i, e, kind_of_part(e));
    }
  };
  visit([&](const StudyCell&, int, const SheetEstimate&, const std::string& kind) {
    if (std::ranges::find(sample.kinds, kind) == sample.kinds.end()) sample.kinds.push_back(kind);
  });
  visit([&](const StudyCell& cell, int i, const SheetEstimate& e, const std::string& kind) {
    const auto at = std::ranges::find(sample.kinds, kind) - sample.kinds.begin();
    add(sample, cell, i, static_cast<int>(at), e.value, own_error(e));
  });
  return with_typical_errors(std::move(sample));
}

}  // namespace

std::vector<Observation> Sample::of_group(int condition, int kind) const {
  std::vector<Observation> own;
  for (const Observation& o : values)
    if (o.group == group_of(condition, kind)) own.push_back(o);
  return own;
}

std::string Sample::amount(double value) const { return charts::readable(value) + (unit.empty() ? "" : " " + unit); }

CellKind Sample::of_cells() const {
  if (each == Observed::sheets || each == Observed::bundles) return CellKind::sheet;
  if (each == Observed::cells_in_space || each == Observed::adhesions_in_space) return CellKind::space;
  return CellKind::plane;
}

bool Sample::is_one_a_cell() const { return n_cells_of(values) == static_cast<int>(values.size()); }

Sample sample_tensions(const Study& study) {
  std::vector<std::string> kinds;
  for (const FibreType type : kFibreTypes)
    if (counted_type(study, type) == type) kinds.emplace_back(name_of(type));
  Sample sample = empty_sample(study, "tension_nN", "tension", "nN", Observed::fibres, kinds);
  for (const MeasuredFibre& f : measured_fibres(study)) {
    add(sample, *f.cell, static_cast<int>(f.cell - study.cells.data()),
        static_cast<int>(counted_type(study, f.fibre->type)), f.tension->tension_nN, standard_error_nN(*f.tension));
  }
  return with_typical_errors(std::move(sample));
}

std::vector<SeenAdhesion> seen_adhesions(const Study& study) {
  std::vector<SeenAdhesion> list;
  for (std::size_t i = 0; i < study.cells.size(); ++i) {
    std::map<int, double> area;  // of those that were seen: an anchor's or a candidate's size is nobody's measurement
    for (const Adhesion& a : study.cells[i].cell.adhesions)
      if (!is_assumed(a.origin)) area[a.adhesion_id] = a.area_um2;
    for (const AdhesionForce& f : study.cells[i].forces)
      if (area.contains(f.adhesion_id))
        list.push_back({static_cast<int>(i), f.connected, area.at(f.adhesion_id), norm(f.force_nN), f.sigma_nN});
  }
  return list;
}

Sample sample_adhesion_forces(const Study& study) {
  return sample_adhesions(study, "adhesion_force_nN", "force", "nN", &SeenAdhesion::force_nN);
}

Sample sample_adhesion_areas(const Study& study) {
  return sample_adhesions(study, "adhesion_area_um2", "area", "µm²", &SeenAdhesion::area_um2);
}

std::vector<Sample> sample_cells(const Study& study) {
  const auto of_network = [](double FitSummary::*figure) {
    return [=](const StudyCell& c) { return is_network_known(c) ? Number(c.fit.*figure) : Number(); };
  };
  const Measured figures[] = {
      {"total_force_nN", "total force", "nN", [](const StudyCell& c) { return c.fit.total_force_nN; }},
      {"fibre_force_nN", "force of the fibres", "nN", of_network(&FitSummary::fibre_force_nN), {}, MayBeNegative::yes},
      {"network_force_nN", "force of the network", "nN", of_network(&FitSummary::network_force_nN)},
      {"network_surface_tension_nN_per_um", "surface tension of the network", "nN/µm",
       of_network(&FitSummary::network_surface_tension_nN_per_um)}};
  std::vector<Sample> samples;
  for (const Measured& figure : figures)
    samples.push_back(sample_of(study, CellKind::plane, Observed::cells, "cell", figure));
  return samples;
}

std::vector<Sample> sample_sheets(const Study& study) {
  using S = SheetSummary;
  constexpr auto kSheet = &StudyCell::sheet;
  const Measured figures[] = {{"mean_tension_nN_per_um",
                               "mean tension",
                               "nN/µm",
                               figure_of(kSheet, &S::mean_tension_nN_per_um),
                               {},
                               MayBeNegative::yes},
                              {"sheet_force_nN", "total force", "nN", figure_of(kSheet, &S::total_force_nN)},
                              {"strain_energy_fJ", "strain energy", "fJ", figure_of(kSheet, &S::strain_energy_fJ)},
                              {"sheet_area_um2", "area", "µm²", figure_of(kSheet, &S::area_um2)}};
  std::vector<Sample> samples = {sample_estimates(study, SheetQuantity::contraction)};
  for (const Measured& figure : figures)
    samples.push_back(sample_of(study, CellKind::sheet, Observed::sheets, kWholeSheet, figure));
  for (const SheetQuantity quantity : mbtfm::values_of<SheetQuantity>())
    if (quantity != SheetQuantity::contraction) samples.push_back(sample_estimates(study, quantity));
  std::erase_if(samples, [](const Sample& s) { return s.values.empty(); });
  return samples;
}

std::vector<Sample> sample_in_space(const Study& study) {
  using S = SpaceFigures;
  const auto of = [](auto figure) { return figure_of(&StudyCell::space, figure); };
  const Measured figures[] = {
      {"space_force_nN", "total force", "nN", of(&S::total_force_nN), of(&S::total_force_sigma_nN)},
      {"space_strain_energy_fJ", "strain energy", "fJ", of(&S::strain_energy_fJ)},
      {"space_contractile_moment_nN_um", "contractile moment", "nN µm", of(&S::contractile_moment_nN_um),
       of(&S::contractile_moment_sigma_nN_um), MayBeNegative::yes},
      {"space_normal_share", "share of the normal force", "", of(&S::normal_share)},
      {"space_largest_traction_kPa", "largest traction", "kPa", of(&S::largest_traction_kPa)},
      {kResolution, "resolution", "µm", of(&S::resolution_um)}};
  std::vector<Sample> samples;
  for (const Measured& figure : figures)
    samples.push_back(sample_of(study, CellKind::space, Observed::cells_in_space, "cell", figure));
  Sample forces =
      empty_sample(study, "space_adhesion_force_nN", "force", "nN", Observed::adhesions_in_space, {"adhesion"});
  for (const int i : cells_of(study, CellKind::space))
    for (const S::OfAdhesion& a : study.cells[i].space->adhesions)
      add(forces, study.cells[i], i, 0, a.force_nN, a.sigma_nN);
  samples.push_back(with_typical_errors(std::move(forces)));
  std::erase_if(samples, [](const Sample& s) { return s.values.empty(); });
  return samples;
}

bool enters(const SheetEstimate& e) { return e.identifiable && !is_given(e); }

std::optional<double> own_error(const SheetEstimate& e) {
  if (!e.sigma) return std::nullopt;
  const SheetErrorParts& p = e.parts;
  const double shared = std::hypot(p.gel.value_or(0), p.substrate.value_or(0), p.variation.value_or(0));
  return std::sqrt(std::max(0.0, *e.sigma * *e.sigma - shared * shared));
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
