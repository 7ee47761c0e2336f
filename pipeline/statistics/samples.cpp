#include "pipeline/statistics/samples.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/errors.h"

namespace mbtfm::statistics {
namespace {

using Number = std::optional<double>;

/// One value of a cell, and of which of the measure's kinds it is.
struct Value {
  std::string kind;
  double value = 0;
  Number standard_error = {};  ///< 0: exact
  int id = 0;                  ///< of the fibre or adhesion
};

/// A row of the table of measures.
struct MeasureRow {
  const char *column, *name, *unit;
  Observed each;
  std::vector<std::string> kinds;  ///< empty: as they are met; else others follow as they are met, not compared
  std::function<std::vector<Value>(const Study&, const StudyCell&)> of;
  bool is_never_negative = true;
};

enum class Sign { positive, any };

/// A number that each cell of a kind has, or lacks. @param kind  the measure's only one
MeasureRow one(Observed each, const char* kind, const char* column, const char* name, const char* unit,
               const std::function<Number(const StudyCell&)>& of, const std::function<Number(const StudyCell&)>& sigma,
               Sign sign = Sign::positive) {
  const auto values = [=](const Study&, const StudyCell& cell) -> std::vector<Value> {
    const Number value = of(cell);
    if (!value) return {};
    return {{kind, *value, sigma ? sigma(cell) : Number()}};
  };
  return {column, name, unit, each, {kind}, values, sign == Sign::positive};
}

/// Figures of cells with fibres, of sheets, and in space.
MeasureRow cell(const char* column, const char* name, const char* unit,
                const std::function<Number(const StudyCell&)>& of, Sign sign = Sign::positive) {
  return one(Observed::cells, "cell", column, name, unit, of, {}, sign);
}
MeasureRow sheet(const char* column, const char* name, const char* unit, auto figure, Sign sign = Sign::positive) {
  const auto of = [=](const StudyCell& c) -> Number { return std::invoke(figure, *c.sheet); };
  return one(Observed::sheets, kWholeSheet, column, name, unit, of, {}, sign);
}
using OfSpace = std::function<Number(const SpaceFigures&)>;
MeasureRow space(const char* column, const char* name, const char* unit, const OfSpace& figure,
                 const OfSpace& sigma = {}, Sign sign = Sign::positive) {
  const auto of = [](const OfSpace& f) { return [=](const StudyCell& c) { return f(*c.space); }; };
  return one(Observed::cells_in_space, "cell", column, name, unit, of(figure),
             sigma ? of(sigma) : std::function<Number(const StudyCell&)>(), sign);
}

/// One quantity of sheet_fit.csv; its kinds are the parts of the sheets.
MeasureRow estimate(SheetQuantity quantity) {
  const auto& [name, unit] = for_people(quantity);
  const auto values = [=](const Study&, const StudyCell& cell) {
    std::vector<Value> list;
    for (const SheetEstimate& e : cell.sheet->estimates)
      if (e.quantity == quantity && enters(e)) list.push_back({kind_of_part(e), e.value, own_error(e)});
    return list;
  };
  return {name_of(quantity),
          name,
          unit,
          quantity == SheetQuantity::bundle_tension ? Observed::bundles : Observed::sheets,
          {},
          values,
          quantity != SheetQuantity::contraction && quantity != SheetQuantity::contraction_over_stiffness};
}

std::vector<Value> tensions_of(const Study& study, const StudyCell& cell) {
  std::vector<Value> list;
  for (const MeasuredFibre& f : measured_fibres(cell))
    list.push_back({name_of(counted_type(study, f.fibre->type)), f.tension->tension_nN, standard_error_nN(*f.tension),
                    f.fibre->fibre_id});
  return list;
}

constexpr const char *kConnected = "connected", *kUnconnected = "unconnected";
std::function<std::vector<Value>(const Study&, const StudyCell&)> of_adhesions(double SeenAdhesion::*figure) {
  return [=](const Study&, const StudyCell& cell) {
    std::vector<Value> list;
    for (const SeenAdhesion& a : seen_adhesions(cell))
      list.push_back({a.is_connected ? kConnected : kUnconnected, a.*figure,
                      figure == &SeenAdhesion::force_nN ? a.sigma_nN : Number(0.0)});
    return list;
  };
}

std::vector<Value> forces_in_space(const Study&, const StudyCell& cell) {
  std::vector<Value> list;
  for (const SpaceFigures::OfAdhesion& a : cell.space->adhesions)
    list.push_back({"adhesion", a.force_nN, a.sigma_nN, a.adhesion_id});
  return list;
}

/// All that a study compares, in the order of its tables.
std::vector<MeasureRow> measure_table(int n_fibre_types) {
  const auto of_fit = [](double FitSummary::*figure) { return [=](const StudyCell& c) { return c.fit.*figure; }; };
  const auto of_network = [](double FitSummary::*figure) {
    return [=](const StudyCell& c) { return is_network_known(c) ? Number(c.fit.*figure) : Number(); };
  };
  using F = FitSummary;
  using S = SheetSummary;
  using Q = SpaceFigures;
  std::vector<std::string> types;
  for (const FibreType type : kFibreTypes)
    if (static_cast<int>(type) < n_fibre_types) types.emplace_back(name_of(type));
  std::vector<MeasureRow> table = {
      {"tension_nN", "tension", "nN", Observed::fibres, types, tensions_of},
      {"adhesion_force_nN",
       "force",
       "nN",
       Observed::adhesions,
       {kConnected, kUnconnected},
       of_adhesions(&SeenAdhesion::force_nN)},
      {"adhesion_area_um2",
       "area",
       "µm²",
       Observed::adhesions,
       {kConnected, kUnconnected},
       of_adhesions(&SeenAdhesion::area_um2)},
      cell("total_force_nN", "total force", "nN", of_fit(&F::total_force_nN)),
      cell("fibre_force_nN", "force of the fibres", "nN", of_network(&F::fibre_force_nN), Sign::any),
      cell("network_force_nN", "force of the network", "nN", of_network(&F::network_force_nN)),
      cell("network_surface_tension_nN_per_um", "surface tension of the network", "nN/µm",
           of_network(&F::network_surface_tension_nN_per_um)),
      estimate(SheetQuantity::contraction),
      sheet("mean_tension_nN_per_um", "mean tension", "nN/µm", &S::mean_tension_nN_per_um, Sign::any),
      sheet("sheet_force_nN", "total force", "nN", &S::total_force_nN),
      sheet("strain_energy_fJ", "strain energy", "fJ", &S::strain_energy_fJ),
      sheet("sheet_area_um2", "area", "µm²", &S::area_um2)};
  for (const SheetQuantity quantity : mbtfm::values_of<SheetQuantity>())
    if (quantity != SheetQuantity::contraction) table.push_back(estimate(quantity));
  table.insert(
      table.end(),
      {space("space_force_nN", "total force", "nN", &Q::total_force_nN, &Q::total_force_sigma_nN),
       space("space_strain_energy_fJ", "strain energy", "fJ", &Q::strain_energy_fJ),
       space("space_contractile_moment_nN_um", "contractile moment", "nN µm", &Q::contractile_moment_nN_um,
             &Q::contractile_moment_sigma_nN_um, Sign::any),
       space("space_normal_share", "share of the normal force", "", &Q::normal_share),
       space("space_largest_traction_kPa", "largest traction", "kPa", &Q::largest_traction_kPa),
       space(kResolution, "resolution", "µm", &Q::resolution_um),
       {"space_adhesion_force_nN", "force", "nN", Observed::adhesions_in_space, {"adhesion"}, forces_in_space}});
  return table;
}

/// An unknown error taken for zero would give its value more weight than all others: it is as large as theirs.
void fill_in_errors(std::vector<Observation>& values) {
  double sum = 0;
  int n = 0;
  for (const Observation& o : values) {
    sum += o.error_variance;
    n += o.error_variance > 0 ? 1 : 0;
  }
  for (Observation& o : values)
    if (o.error_variance == 0 && n > 0) o.error_variance = sum / n;
}

Sample sample_of(const Study& study, const MeasureRow& row) {
  Sample sample{.column = row.column,
                .name = row.name,
                .unit = row.unit,
                .each = row.each,
                .kinds = row.kinds,
                .conditions = study.conditions,
                .is_never_negative = row.is_never_negative};
  for (std::size_t i = 0; i < study.cells.size(); ++i) {
    if (study.cells[i].kind() != sample.of_cells()) continue;
    for (const Value& v : row.of(study, study.cells[i])) {
      auto kind = std::ranges::find(sample.kinds, v.kind);
      if (kind == sample.kinds.end()) kind = sample.kinds.insert(kind, v.kind);
      const double error = v.standard_error.value_or(0);
      if (error == 0) ++sample.n_without_error;
      sample.values.push_back({.value = v.value,
                               .error_variance = error * error,
                               .cell = static_cast<int>(i),
                               .kind = static_cast<int>(kind - sample.kinds.begin()),
                               .id = v.id});
    }
  }
  sample.n_compared = row.kinds.empty() ? sample.n_kinds() : static_cast<int>(row.kinds.size());
  for (Observation& o : sample.values) o.group = sample.group_of(study.cells[o.cell].condition, o.kind);
  fill_in_errors(sample.values);
  return sample;
}

}  // namespace

std::vector<Sample> samples_of(const Study& study) {
  const bool of_fibres = n_with_fibres(study) > 0;
  std::vector<Sample> samples;
  for (const MeasureRow& row : measure_table(study.n_fibre_types)) {
    Sample sample = sample_of(study, row);
    if (!sample.values.empty() || (of_fibres && has_fibres(sample.of_cells()))) samples.push_back(std::move(sample));
  }
  return samples;
}

Sample sample_of(const Study& study, const std::string& column) {
  const std::vector<MeasureRow> table = measure_table(study.n_fibre_types);
  const auto row = std::ranges::find(table, column, &MeasureRow::column);
  MBTFM_ASSERT(row != table.end());
  return sample_of(study, *row);
}

std::vector<Observation> Sample::of_group(int condition, int kind) const {
  std::vector<Observation> own;
  for (const Observation& o : values)
    if (o.group == group_of(condition, kind)) own.push_back(o);
  return own;
}

std::string Sample::amount(double value) const { return amount(charts::readable(value)); }

CellKind Sample::of_cells() const {
  using enum CellKind;
  constexpr std::array kOf = {plane, plane, plane, sheet, sheet, space, space};  // as Observed has them
  return kOf.at(static_cast<std::size_t>(each));
}

bool Sample::is_one_a_cell() const { return n_cells_of(values) == static_cast<int>(values.size()); }

std::vector<SeenAdhesion> seen_adhesions(const StudyCell& cell) {
  std::map<int, double> area;  // of those that were seen: an anchor's or a candidate's size is nobody's measurement
  for (const Adhesion& a : cell.cell.adhesions)
    if (!is_assumed(a.origin)) area[a.adhesion_id] = a.area_um2;
  std::vector<SeenAdhesion> list;
  for (const AdhesionForce& f : cell.forces)
    if (area.contains(f.adhesion_id))
      list.push_back({f.connected, area.at(f.adhesion_id), norm(f.force_nN), f.sigma_nN});
  return list;
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
