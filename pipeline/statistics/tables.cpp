#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <map>

#include "pipeline/files/sheet_files.h"
#include "pipeline/files/tables.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {
namespace {

using files::Column;
using files::Table;

constexpr files::ColumnOptions kResult = {.digits = files::kForPeople};

using Number = std::optional<double>;

/// Both ends. @param access  of an optional Interval
template <class Row, class Access>
std::vector<Column<Row>> ends_of(const std::string& low, const std::string& high, const std::string& of,
                                 Access access) {
  const auto end = [access](double Interval::*which) {
    return [access, which](const Row& row) -> std::optional<double> {
      const std::optional<Interval> interval = std::invoke(access, row);
      return interval ? std::optional((*interval).*which) : std::nullopt;
    };
  };
  return {{low, "lower end of the 95 % interval of " + of, end(&Interval::low), kResult},
          {high, "upper end of the 95 % interval of " + of, end(&Interval::high), kResult}};
}

/// A row of what belongs to a cell.
template <class Of>
struct InCell {
  std::string cell, condition;
  Of of;
};
template <class Of>
std::vector<Column<InCell<Of>>> cell_columns() {
  using Row = InCell<Of>;
  return {{"cell", "its folder below the study's", &Row::cell},
          {"condition", "empty: none was asked for", &Row::condition}};
}

struct CellRow {
  std::string reason = {};          ///< why it was left out
  const StudyCell* cell = nullptr;  ///< none where it was

  std::optional<int> n_fibres(std::optional<FibreType> type = {}) const {
    if (!cell || cell->kind() != CellKind::plane) return std::nullopt;
    const auto& fibres = cell->cell.fibres;
    return static_cast<int>(
        std::count_if(fibres.begin(), fibres.end(), [&](const Fibre& f) { return !type || f.type == *type; }));
  }
  /// What has no meaning where the network's tension is not known.
  std::optional<double> of_network(double FitSummary::*figure) const {
    return cell && cell->kind() == CellKind::plane && is_network_known(*cell) ? std::optional(cell->fit.*figure)
                                                                              : std::nullopt;
  }
  std::optional<double> network_tension_nN() const {
    if (!cell) return std::nullopt;
    const auto found =
        std::find_if(cell->tensions.begin(), cell->tensions.end(), [](const Tension& t) { return t.fibre_id == 0; });
    return found == cell->tensions.end() ? std::nullopt : std::optional(found->tension_nN);
  }
};

/// A figure of a cell that enters; empty of the others.
template <class Of>
auto of_cell(Of of) {
  return [of](const InCell<CellRow>& row) -> std::optional<std::remove_cvref_t<decltype(of(*row.of.cell))>> {
    if (!row.of.cell) return std::nullopt;
    return of(*row.of.cell);
  };
}
/// The same of what cells with fibres have alone.
template <class Of>
auto of_cell_with_fibres(Of of) {
  return [of](const InCell<CellRow>& row) -> std::optional<std::remove_cvref_t<decltype(of(*row.of.cell))>> {
    if (!row.of.cell || row.of.cell->kind() != CellKind::plane) return std::nullopt;
    return of(*row.of.cell);
  };
}
/// The same of what a sheet has alone.
auto of_sheet(std::function<Number(const SheetSummary&)> of) {
  return [of](const InCell<CellRow>& row) {
    return row.of.cell && row.of.cell->sheet ? of(*row.of.cell->sheet) : std::nullopt;
  };
}

/// The same of what a cell in space has alone.
auto in_space(std::function<Number(const SpaceFigures&)> of) {
  return [of](const InCell<CellRow>& row) {
    return row.of.cell && row.of.cell->space ? of(*row.of.cell->space) : std::nullopt;
  };
}

/// None where no image shows the cell's outline.
Number area_of(const StudyCell& c) {
  if (c.sheet) return c.sheet->area_um2;
  return c.cell.outline_um.empty() ? Number() : Number(figures_of(c).cell_area_um2);
}

/// A cell in space does not say what its noise alone would leave.
Number expected_of(const StudyCell& c) { return c.space ? Number() : Number(c.fit.expected_relative_l2); }
Number noise_of(const StudyCell& c) { return c.sheet ? Number() : Number(c.fit.noise_um); }

/// What a row of cells.csv is of.
enum class Model { fibres, sheet, space };
constexpr auto words(Model) { return std::array{"fibres", "sheet", "space"}; }
Model model_of(const StudyCell& c) { return c.sheet ? Model::sheet : c.space ? Model::space : Model::fibres; }

/// Of the whole sheet; none where it is not known, or where parts contract each by their own.
Number contraction_of(const SheetSummary& sheet) {
  const auto at = std::ranges::find_if(sheet.estimates, [](const SheetEstimate& e) {
    return e.quantity == SheetQuantity::contraction && enters(e) && kind_of_part(e) == kWholeSheet;
  });
  return at == sheet.estimates.end() ? std::nullopt : Number(at->value);
}

const Table<InCell<CellRow>>& cell_table() {
  using Row = InCell<CellRow>;
  const auto of_fit = [](auto member) { return [member](const StudyCell& c) { return c.fit.*member; }; };
  const auto network = [](auto member) { return [member](const Row& row) { return row.of.of_network(member); }; };
  const auto n_of = [](std::optional<FibreType> type) {
    return [type](const Row& row) { return row.of.n_fibres(type); };
  };
  static const Table<Row> table{
      .file = "statistics/cells.csv",
      .row = "each cell, also those left out",
      .columns = files::joined<Row>(
          {cell_columns<CellRow>(),
           {{"included", "it enters the statistics", [](const Row& row) { return row.of.cell != nullptr; }},
            {"reason", "why it does not", [](const Row& row) { return row.of.reason; }},
            {"n_adhesions", "without anchors and candidates",
             of_cell_with_fibres([](const StudyCell& c) { return static_cast<int>(figures_of(c).n_adhesions); })},
            {"n_fibres", "of all types", n_of({})},
            {"n_dorsal", "dorsal fibres", n_of(FibreType::dorsal)},
            {"n_arc", "transverse arcs", n_of(FibreType::arc)},
            {"n_ventral", "ventral fibres, without edge fibres", n_of(FibreType::ventral)},
            {"cell_area_um2", "inside the outline",
             [](const Row& row) { return row.of.cell ? area_of(*row.of.cell) : Number(); }, kResult},
            {"adhesion_area_um2", "of all its adhesions",
             of_cell_with_fibres([](const StudyCell& c) { return figures_of(c).adhesion_area_um2; }), kResult},
            {"total_force_nN",
             "sum of the adhesions' force magnitudes; of a sheet see sheet_force_nN, in space space_force_nN",
             of_cell_with_fibres(of_fit(&FitSummary::total_force_nN)), kResult},
            {"network_force_nN", "the same of the network alone", network(&FitSummary::network_force_nN), kResult},
            {"fibre_force_nN", "what the fibres add", network(&FitSummary::fibre_force_nN), kResult},
            {"network_tension_nN", "of a link of the actin network",
             [](const Row& row) { return row.of.network_tension_nN(); }, kResult},
            {"network_surface_tension_nN_per_um", "of the actin network as a sheet",
             network(&FitSummary::network_surface_tension_nN_per_um), kResult},
            {"relative_l2", "‖measured − model‖ / ‖measured‖", of_cell(of_fit(&FitSummary::relative_l2)), kResult},
            {"expected_relative_l2", "what the beads' noise alone would leave",
             [](const Row& row) { return row.of.cell ? expected_of(*row.of.cell) : Number(); }, kResult},
            {"noise_um", "of a component of the displacement; in space of one along the surface",
             [](const Row& row) { return row.of.cell ? noise_of(*row.of.cell) : Number(); }, kResult},
            {"n_meshes", "that the fit is the mean of", of_cell_with_fibres(of_fit(&FitSummary::n_meshes))},
            {"converged", "the fit came to its end", of_cell(of_fit(&FitSummary::converged))},
            {"findings", "that are open", of_cell([](const StudyCell& c) { return open_ids(c.findings); })},
            {"n_edge", "edge fibres", n_of(FibreType::edge)},
            {"model", "what its row is of: fibres, a sheet, or a cell in space; empty if it was left out",
             of_cell(model_of)},
            {"contraction_nN_per_um", "of a sheet, or the mean over a sheet whose contraction varies",
             of_sheet(contraction_of), kResult},
            {"mean_tension_nN_per_um", "in a sheet: half the trace, mean over its area",
             of_sheet(&SheetSummary::mean_tension_nN_per_um), kResult},
            {"sheet_force_nN", "sum of the force magnitudes under a sheet's triangles",
             of_sheet(&SheetSummary::total_force_nN), kResult},
            {"strain_energy_fJ", "of the gel under a sheet: half the sum of force times displacement",
             of_sheet(&SheetSummary::strain_energy_fJ), kResult},
            {"space_method", "that found the tractions of a cell in space",
             of_cell([](const StudyCell& c) { return c.space ? c.space->method : std::string(); })},
            {"space_force_nN", "sum of the sizes of the tractions of a cell in space",
             in_space(&SpaceFigures::total_force_nN)},
            {"space_force_sigma_nN", "standard error of space_force_nN", in_space(&SpaceFigures::total_force_sigma_nN)},
            {"space_strain_energy_fJ", "of the gel of a cell in space", in_space(&SpaceFigures::strain_energy_fJ)},
            {"space_contractile_moment_nN_um",
             "of a cell in space: minus the integral of place times traction about the cell's centre; above 0: inward",
             in_space(&SpaceFigures::contractile_moment_nN_um)},
            {"space_contractile_moment_sigma_nN_um", "standard error of space_contractile_moment_nN_um",
             in_space(&SpaceFigures::contractile_moment_sigma_nN_um)},
            {"space_normal_share", "sizes of the tractions' parts along the normal over their sizes (0 to 1)",
             in_space(&SpaceFigures::normal_share)},
            {"space_largest_traction_kPa", "of the map of a cell in space",
             in_space(&SpaceFigures::largest_traction_kPa)},
            {"space_net_force_nN", "size of the sum of the forces; of a cell that nothing else holds: errors alone",
             in_space(&SpaceFigures::net_force_nN)},
            {"space_net_moment_nN_um", "the same of the moments", in_space(&SpaceFigures::net_moment_nN_um)},
            {"space_resolution_um", "forces closer together than this look like one; median over the surface",
             in_space(&SpaceFigures::resolution_um)}}})};
  return table;
}

std::vector<InCell<CellRow>> cell_rows(const Study& study) {
  std::vector<InCell<CellRow>> rows;
  for (const StudyCell& c : study.cells) rows.push_back({c.name, condition_of(study, c), {.cell = &c}});
  for (const LeftOutCell& c : study.left_out) rows.push_back({c.name, c.condition, {.reason = c.reason}});
  return rows;
}

using AdhesionRow = InCell<files::ForceOnAdhesion>;
const Table<AdhesionRow>& adhesion_table() {
  const auto adhesion = [](const AdhesionRow& row) -> const Adhesion& { return *row.of.adhesion; };
  const auto of_adhesion = [=](std::vector<std::string> names) {
    return files::columns_of<AdhesionRow>(files::adhesion_table(), adhesion, names);
  };
  const auto force = files::adhesion_force_table().without({"adhesion_id", "x_um", "y_um", "area_um2"});
  static const Table<AdhesionRow> table{
      .file = "statistics/adhesions.csv",
      .row = "each adhesion",
      .columns = files::joined<AdhesionRow>({cell_columns<files::ForceOnAdhesion>(),
                                             of_adhesion({"adhesion_id", "x_um", "y_um", "area_um2", "eccentricity"}),
                                             files::columns_of<AdhesionRow>(force, &AdhesionRow::of),
                                             of_adhesion({"origin"})})};
  return table;
}

std::vector<AdhesionRow> adhesion_rows(const Study& study) {
  std::vector<AdhesionRow> rows;
  for (const StudyCell& c : study.cells) {
    std::map<int, const Adhesion*> by_id;
    for (const Adhesion& adhesion : c.cell.adhesions) by_id[adhesion.adhesion_id] = &adhesion;
    for (const AdhesionForce& force : c.forces)
      rows.push_back({c.name, condition_of(study, c), {force, by_id.at(force.adhesion_id)}});
  }
  return rows;
}

struct MeasuredTension {
  const Fibre* fibre = nullptr;
  files::FibreTension tension;
};
using FibreRow = InCell<MeasuredTension>;
const Table<FibreRow>& fibre_table() {
  const auto of_fibre = [](std::vector<std::string> names) {
    return files::columns_of<FibreRow>(
        files::fibre_table(), [](const FibreRow& row) -> const Fibre& { return *row.of.fibre; }, names);
  };
  const auto tension = files::tension_table().without({"fibre_id", "type", "sigma_nN"});
  const auto of_row = [](const FibreRow& row) -> const files::FibreTension& { return row.of.tension; };
  static const Table<FibreRow> table{
      .file = "statistics/fibres.csv",
      .row = "each fibre with a tension",
      .columns = files::joined<FibreRow>(
          {cell_columns<MeasuredTension>(),
           of_fibre({"fibre_id", "type", "length_um", "width_um", "confidence"}),
           files::columns_of<FibreRow>(tension, of_row),
           {{"sigma_nN",
             "standard error that the statistics take: half the interval over 1.96, the upper half if 0 cuts the "
             "lower",
             [](const FibreRow& row) { return standard_error_nN(row.of.tension.tension); }, kResult}}})};
  return table;
}

std::vector<FibreRow> fibre_rows(const Study& study) {
  std::vector<FibreRow> rows;
  for (const StudyCell& c : study.cells) {
    std::map<int, const Tension*> tension;
    for (const Tension& t : c.tensions) tension[t.fibre_id] = &t;
    for (const Fibre& fibre : c.cell.fibres) {
      const auto t = tension.find(fibre.fibre_id);
      if (t != tension.end()) rows.push_back({c.name, condition_of(study, c), {&fibre, {*t->second, fibre.type}}});
    }
  }
  return rows;
}

using SpaceForceRow = InCell<SpaceFigures::OfAdhesion>;
const Table<SpaceForceRow>& space_force_table() {
  using Of = SpaceFigures::OfAdhesion;
  const auto of = [](auto member) { return [member](const SpaceForceRow& row) { return row.of.*member; }; };
  static const Table<SpaceForceRow> table{
      .file = "statistics/adhesions_in_space.csv",
      .row = "each adhesion of a cell in space",
      .columns = files::joined<SpaceForceRow>({cell_columns<Of>(),
                                               {{"adhesion_id", "label of the adhesion", of(&Of::adhesion_id)},
                                                {"force_nN", "size of its force", of(&Of::force_nN)},
                                                {"sigma_nN", "standard error along the force", of(&Of::sigma_nN)}}})};
  return table;
}

std::vector<SpaceForceRow> space_force_rows(const Study& study) {
  std::vector<SpaceForceRow> rows;
  for (const StudyCell& c : study.cells) {
    if (!c.space) continue;
    for (const SpaceFigures::OfAdhesion& a : c.space->adhesions) rows.push_back({c.name, condition_of(study, c), a});
  }
  return rows;
}

using EstimateRow = InCell<SheetEstimate>;
const Table<EstimateRow>& estimate_table() {
  static const Table<EstimateRow> table{
      .file = "statistics/sheets.csv",
      .row = "each number of a sheet that its beads were asked for",
      .columns = files::joined<EstimateRow>(
          {cell_columns<SheetEstimate>(),
           files::columns_of<EstimateRow>(files::sheet_estimate_table(), &EstimateRow::of,
                                          {"quantity", "part", "value", "low", "high", "identifiable"}),
           {{"kind", "as which it counts: the sheet, or the kind of part, without its label",
             [](const EstimateRow& row) { return kind_of_part(row.of); }},
            {"enters", "the statistics: the beads limit it to both sides, and it was not given",
             [](const EstimateRow& row) { return enters(row.of); }},
            {"sigma",
             "standard error that the statistics take: that of the fit without what the gel's numbers and its model "
             "add, which sheets share",
             [](const EstimateRow& row) { return own_error(row.of); }, kResult}}})};
  return table;
}

std::vector<EstimateRow> estimate_rows(const Study& study) {
  std::vector<EstimateRow> rows;
  for (const StudyCell& c : study.cells) {
    if (!c.sheet) continue;
    for (const SheetEstimate& e : c.sheet->estimates) rows.push_back({c.name, condition_of(study, c), e});
  }
  return rows;
}

/// @param unit  begins with an underscore or is empty
template <class Row, class Access>
std::vector<Column<Row>> summary_columns(const std::string& counted, const std::string& unit, Access access) {
  const auto of = [access](auto get) {
    return [access, get](const Row& row) { return get(std::invoke(access, row)); };
  };
  const auto model = [](const Summary& s) {
    return s.model ? std::optional(Interval{s.model->low, s.model->high}) : std::nullopt;
  };
  return files::joined<Row>(
      {{{"n_cells", "cells", of([](const Summary& s) { return s.n_cells; })},
        {"n_" + counted, counted, of([](const Summary& s) { return s.n; })},
        {"mean" + unit, "each counts the same", of([](const Summary& s) { return s.plain.mean; }), kResult}},
       ends_of<Row>("mean_low" + unit, "mean_high" + unit, "the mean, cells resampled",
                    of([](const Summary& s) { return s.mean_interval; })),
       {{"model_mean" + unit, "mean of the mixed model",
         of([](const Summary& s) { return s.model ? Number(s.model->estimate) : Number(); }), kResult}},
       ends_of<Row>("model_low" + unit, "model_high" + unit, "that mean", of(model)),
       {{"median" + unit, "each counts the same", of([](const Summary& s) { return s.plain.median; }), kResult}},
       ends_of<Row>("median_low" + unit, "median_high" + unit, "the median, cells resampled",
                    of([](const Summary& s) { return s.median_interval; })),
       {{"sd" + unit, "standard deviation", of([](const Summary& s) { return s.plain.standard_deviation; }), kResult},
        {"typical_error" + unit, "root mean square of the standard errors",
         of([](const Summary& s) { return s.typical_error; }), kResult},
        {"sd_without_error" + unit, "what is left of the one without the other",
         of([](const Summary& s) { return s.without_error ? Number(s.without_error->standard_deviation) : Number(); }),
         kResult}}});
}

/// A share of the fibres above a tension; of a cell without its interval.
struct ShareRow {
  double value = 0;
  std::optional<Interval> interval = {};
  std::optional<double> without_error = {};
};
struct TypeRow {
  Summary summary;
  std::vector<ShareRow> shares;  ///< by threshold
};

Table<TypeRow> type_table(const std::vector<double>& thresholds_nN) {
  Table<TypeRow> table{
      .file = "statistics/types.csv",
      .row = "each condition and type, and each cell's",
      .columns = files::joined<TypeRow>(
          {{{"condition", "empty: none was asked for", [](const TypeRow& row) { return row.summary.condition; }},
            {"cell", "`all`, or the cell",
             [](const TypeRow& row) { return row.summary.cell.empty() ? std::string("all") : row.summary.cell; }},
            {"type", "of the fibres", [](const TypeRow& row) { return row.summary.kind; }}},
           summary_columns<TypeRow>("fibres", "_nN", &TypeRow::summary)})};
  for (std::size_t k = 0; k < thresholds_nN.size(); ++k) {
    const std::string name = fmt::format("fraction_above_{:g}_nN", thresholds_nN[k]);
    const auto share = [k](const TypeRow& row) -> std::optional<ShareRow> {
      return k < row.shares.size() ? std::optional(row.shares[k]) : std::nullopt;
    };
    const auto of = [share](auto member) {
      return [share, member](const TypeRow& row) {
        return std::optional<double>(share(row).value_or(ShareRow{}).*member);
      };
    };
    table.columns.emplace_back(name, "share of the fibres above this tension", of(&ShareRow::value), kResult);
    for (const auto& column :
         ends_of<TypeRow>(name + "_low", name + "_high", "the share (Wilson's, at the effective number of fibres)",
                          [share](const TypeRow& row) { return share(row).value_or(ShareRow{}).interval; }))
      table.columns.push_back(column);
    table.columns.emplace_back(name + "_without_error", "the share, the blur of the errors removed",
                               of(&ShareRow::without_error), kResult);
  }
  return table;
}

std::vector<double> thresholds_of(const Analysis& analysis) {
  std::vector<double> thresholds;
  for (const ShareAbove& s : analysis.shares) {
    if (std::find(thresholds.begin(), thresholds.end(), s.threshold_nN) == thresholds.end())
      thresholds.push_back(s.threshold_nN);
  }
  return thresholds;
}

std::vector<TypeRow> type_rows(const Study& study, const Analysis& analysis) {
  std::vector<TypeRow> rows;
  for (const Summary& s : analysis.tensions.summaries) {
    TypeRow& row = rows.emplace_back(TypeRow{s, {}});
    for (const ShareAbove& share : analysis.shares) {
      if (share.condition == s.condition && share.kind == s.kind)
        row.shares.push_back({share.share.value, share.share.interval, share.without_error});
    }
  }
  const Sample& sample = analysis.tensions.sample;
  for (const Summary& s : analysis.tensions_by_cell) {
    TypeRow& row = rows.emplace_back(TypeRow{s, {}});
    for (const double threshold : thresholds_of(analysis)) {
      const auto n = std::count_if(sample.values.begin(), sample.values.end(), [&](const Observation& o) {
        return study.cells[static_cast<std::size_t>(o.cell)].name == s.cell && o.value > threshold &&
               sample.kinds[static_cast<std::size_t>(o.kind)] == s.kind;
      });
      row.shares.push_back({.value = static_cast<double>(n) / s.n});
    }
  }
  return rows;
}

struct QuantityRow {
  std::string quantity;
  Summary summary;
};
const Table<QuantityRow>& summary_table() {
  using Row = QuantityRow;
  static const Table<Row> table{
      .file = "statistics/summaries.csv",
      .row = "each quantity, condition and kind",
      .columns = files::joined<Row>(
          {{{"quantity", "with its unit", &Row::quantity},
            {"condition", "empty: none was asked for", [](const Row& row) { return row.summary.condition; }},
            {"kind", "of fibres, adhesions, cells, sheets or bundles",
             [](const Row& row) { return row.summary.kind; }}},
           summary_columns<Row>("observations", "", &Row::summary)})};
  return table;
}

struct VarianceRow {
  std::string quantity, component;
  std::optional<double> standard_deviation;
  std::string remark;
};
const Table<VarianceRow>& variance_table() {
  using Row = VarianceRow;
  static const Table<Row> table{
      .file = "statistics/variances.csv",
      .row = "each component of the mixed model's scatter",
      .columns = {{"quantity", "with its unit", &Row::quantity},
                  {"component", "between cells, between the kinds of a cell, or within a kind", &Row::component},
                  {"standard_deviation", "of the component", &Row::standard_deviation, kResult},
                  {"remark", "why it is zero or empty", &Row::remark}}};
  return table;
}

/// The scatter between cells, between the kinds of a cell and within them.
std::vector<VarianceRow> variance_rows(const Analysis& analysis) {
  std::vector<VarianceRow> rows;
  for (const Measure* m : analysis.measures()) {
    const auto add = [&](const std::string& component, const std::optional<double>& variance) {
      const char* remark = m->model ? "too few values to tell it from the others" : m->obstacle.c_str();
      if (variance) remark = *variance > 0 ? "" : "no more than the errors explain";
      rows.push_back(
          {m->sample.column, component, variance ? std::optional(std::sqrt(*variance)) : std::nullopt, remark});
    };
    const MixedFit fit = m->model ? m->model->fit : MixedFit{};
    add("cell", fit.cell_variance);
    add("kind in a cell", fit.cell_kind_variance);
    for (std::size_t k = 0; k < m->sample.kinds.size(); ++k)
      add("within: " + m->sample.kinds[k], k < fit.residual_variance.size() ? fit.residual_variance[k] : std::nullopt);
  }
  return rows;
}

const Table<Comparison>& test_table() {
  using Row = Comparison;
  const auto of_pair = [](int Row::*member) {
    return [member](const Row& t) { return t.group_b.empty() ? std::nullopt : std::optional(t.*member); };
  };
  static const Table<Row> table{
      .file = "statistics/tests.csv",
      .row = "each test",
      .columns = files::joined<Row>(
          {{{"quantity", "what is compared, with its unit", &Row::column},
            {"question", "between kinds or between conditions", &Row::question},
            {"within", "which condition, or kind, all groups share", &Row::within},
            {"test", "its name", &Row::test},
            {"unit", "what counts as independent", &Row::unit},
            {"group_a", "the first group", &Row::group_a},
            {"group_b", "the second; empty: all groups together", &Row::group_b},
            {"n_a", "observations of the first group", &Row::n_a},
            {"n_b", "observations of the second", of_pair(&Row::n_b)},
            {"cells_a", "cells of the first group", &Row::cells_a},
            {"cells_b", "cells of the second", of_pair(&Row::cells_b)},
            {"statistic", "of the test", &Row::statistic, kResult},
            {"degrees_of_freedom", "of the statistic's denominator", &Row::degrees, kResult},
            {"p", "chance of such a difference or a larger one if there is none", &Row::p_value, kResult},
            {"p_holm", "corrected over the pairs that one question compares", &Row::p_holm, kResult},
            {"effect", "how large the difference is",
             [](const Row& t) { return t.effect_name.empty() ? std::nullopt : std::optional(t.effect); }, kResult},
            {"effect_is", "what the effect is", &Row::effect_name}},
           ends_of<Row>("effect_low", "effect_high", "the effect", &Row::interval)})};
  return table;
}

std::vector<Comparison> test_rows(const Analysis& analysis) {
  std::vector<Comparison> rows;
  for (const Measure* m : analysis.measures()) rows.insert(rows.end(), m->comparisons.begin(), m->comparisons.end());
  return rows;
}

const Table<Correlation>& correlation_table() {
  using Row = Correlation;
  static const Table<Row> table{
      .file = "statistics/correlations.csv",
      .row = "each force, size and condition",
      .columns = files::joined<Row>(
          {{{"force", "column of cells.csv", &Row::force},
            {"size", "column of cells.csv", &Row::size},
            {"condition", "empty: none was asked for", &Row::condition},
            {"n_cells", "cells", [](const Row& c) { return static_cast<int>(c.x.size()); }},
            {"slope", "of the line through the origin; empty below five cells",
             [](const Row& c) { return c.line ? Number(c.line->slope) : Number(); }, kResult},
            {"slope_error", "its standard error", [](const Row& c) { return c.line ? c.line->slope_error : Number(); },
             kResult}},
           ends_of<Row>("slope_low", "slope_high", "the slope, cells resampled", &Row::slope_interval),
           {{"r", "Pearson's correlation; empty below five cells",
             [](const Row& c) { return c.line ? c.line->correlation : Number(); }, kResult}}})};
  return table;
}

const Table<AreaBin>& area_bin_table() {
  using Row = AreaBin;
  static const Table<Row> table{
      .file = "statistics/adhesion_bins.csv",
      .row = "each condition, connected or not, and bin of area",
      .columns = files::joined<Row>(
          {{{"condition", "empty: none was asked for", &Row::condition},
            {"connected", "fibres end on the adhesions", &Row::is_connected},
            {"area_low_um2", "lower end of the bin", &Row::low_um2, kResult},
            {"area_high_um2", "upper end of the bin", &Row::high_um2, kResult},
            {"n_cells", "cells", &Row::n_cells},
            {"n_adhesions", "adhesions", &Row::n_adhesions},
            {"mean_area_um2", "of the adhesions", &Row::mean_area_um2, kResult},
            {"mean_force_nN", "of the adhesions", &Row::mean_force_nN, kResult}},
           ends_of<Row>("low_nN", "high_nN", "the mean force, cells resampled", &Row::interval_nN)})};
  return table;
}

const Table<InCell<Direction>>& direction_table() {
  using Row = InCell<Direction>;
  const auto of = [](auto member) { return [member](const Row& row) { return row.of.*member; }; };
  static const Table<Row> table{
      .file = "statistics/directions.csv",
      .row = "each angle at an adhesion",
      .columns = files::joined<Row>({cell_columns<Direction>(),
                                     {{"relation", "between what", of(&Direction::relation)},
                                      {"adhesion_id", "the adhesion", of(&Direction::adhesion_id)},
                                      {"fibre_id", "the fibre, if there is one", of(&Direction::fibre_id)},
                                      {"angle_deg", "the angle", of(&Direction::angle_deg), kResult}}})};
  return table;
}

const Table<DirectionSummary>& direction_mean_table() {
  using Row = DirectionSummary;
  static const Table<Row> table{
      .file = "statistics/direction_means.csv",
      .row = "each relation and condition",
      .columns = files::joined<Row>(
          {{{"relation", "between what", &Row::relation},
            {"condition", "empty: none was asked for", &Row::condition},
            {"n_cells", "cells", &Row::n_cells},
            {"n", "angles", &Row::n},
            {"mean_angle_deg", "their mean", &Row::mean_angle_deg, kResult}},
           ends_of<Row>("low_deg", "high_deg", "the mean, cells resampled", &Row::angle_interval_deg),
           {{"chance_deg", "what chance would give", [](const Row& row) { return largest_angle_deg(row.relation) / 2; },
             kResult},
            {"mean_cosine", "the same of the cosines", &Row::mean_cosine, kResult}},
           ends_of<Row>("cosine_low", "cosine_high", "that mean, cells resampled", &Row::cosine_interval)})};
  return table;
}

const Table<InCell<Finding>>& finding_table() {
  using Row = InCell<Finding>;
  const auto of = [](auto member) { return [member](const Row& row) { return row.of.*member; }; };
  static const Table<Row> table{
      .file = "statistics/findings.csv",
      .row = "each finding of a cell",
      .columns = files::joined<Row>({cell_columns<Finding>(),
                                     {{"id", "see findings.md", of(&Finding::id)},
                                      {"severity", "how much it weighs", of(&Finding::severity)},
                                      {"number", "what was measured", of(&Finding::number), kResult},
                                      {"threshold", "from where on it is a finding", of(&Finding::threshold), kResult},
                                      {"text", "a sentence", of(&Finding::text)}}})};
  return table;
}

/// Of what each cell has several of.
template <class Of>
std::vector<InCell<Of>> rows_by_cell(const Study& study, std::vector<Of> StudyCell::*list) {
  std::vector<InCell<Of>> rows;
  for (const StudyCell& c : study.cells) {
    for (const Of& of : c.*list) rows.push_back({c.name, condition_of(study, c), of});
  }
  return rows;
}

std::vector<QuantityRow> summary_rows(const Analysis& analysis) {
  std::vector<QuantityRow> rows;
  for (const Measure* m : analysis.measures()) {
    for (const Summary& s : m->summaries) rows.push_back({m->sample.column, s});
  }
  return rows;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> tables_of(const Study& study, const Analysis& analysis) {
  std::vector<std::pair<std::string, std::string>> tables;
  const auto add = [&](const auto& table, const auto& rows) {
    tables.emplace_back(Path(table.file).filename().string(), text_of(table, rows));
  };
  add(cell_table(), cell_rows(study));
  add(finding_table(), rows_by_cell(study, &StudyCell::findings));
  add(adhesion_table(), adhesion_rows(study));
  add(fibre_table(), fibre_rows(study));
  add(estimate_table(), estimate_rows(study));
  add(space_force_table(), space_force_rows(study));
  add(type_table(thresholds_of(analysis)), type_rows(study, analysis));
  add(test_table(), test_rows(analysis));
  add(summary_table(), summary_rows(analysis));
  add(variance_table(), variance_rows(analysis));
  add(correlation_table(), analysis.correlations);
  add(area_bin_table(), analysis.area_bins);
  add(direction_table(), rows_by_cell(study, &StudyCell::directions));
  add(direction_mean_table(), analysis.directions);
  return tables;
}

std::string pages_of_tables() {
  return page_of(cell_table()) + page_of(finding_table()) + page_of(adhesion_table()) + page_of(fibre_table()) +
         page_of(estimate_table()) + page_of(space_force_table()) +
         page_of(type_table({StudyParameters{}.weak_tension_nN})) + page_of(test_table()) + page_of(summary_table()) +
         page_of(variance_table()) + page_of(correlation_table()) + page_of(area_bin_table()) +
         page_of(direction_table()) + page_of(direction_mean_table());
}

}  // namespace mbtfm::statistics
