#include <fmt/format.h>

#include <cmath>
#include <functional>

#include "pipeline/files/sheet_files.h"
#include "pipeline/files/tables.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {
namespace {

using files::Columns;
using files::columns_of;
using files::kResult;
using files::member;
using files::Table;

using Number = std::optional<double>;

/// Both ends of an interval. @param interval  as of member(), optional
template <class... To>
auto ends_of(const std::string& low, const std::string& high, To... interval) {
  using Optional = decltype(member(interval...));
  using Ends = typename Optional::Type::value_type;
  return Columns<typename Optional::Whole>{{low, member(interval..., &Ends::low), kResult},
                                           {high, member(interval..., &Ends::high), kResult}};
}

/// A row of what belongs to a cell.
template <class Of>
struct InCell {
  std::string cell = {}, condition;
  Of of;
};
template <class Of>
Columns<InCell<Of>> in_cell(const Columns<Of>& columns) {
  return {{"cell", &InCell<Of>::cell}, {"condition", &InCell<Of>::condition}, columns_of(&InCell<Of>::of, columns)};
}

/// @param of_cell  gives what a cell has several of
template <class Several>
auto rows_by_cell(const Study& study, Several of_cell) {
  std::vector<InCell<typename std::remove_cvref_t<std::invoke_result_t<Several, const StudyCell&>>::value_type>> rows;
  for (const StudyCell& c : study.cells)
    for (const auto& of : std::invoke(of_cell, c)) rows.push_back({c.name, condition_of(study, c), of});
  return rows;
}

struct CellRow {
  std::string reason = {};          ///< why it was left out
  const StudyCell* cell = nullptr;  ///< none where it was
};

/// None where a cell has no fibres.
const FitSummary* fibre_fit_of(const StudyCell& c) { return has_fibres(c.kind()) ? &c.fit : nullptr; }
/// None also where the network's tension is not known, and its figures have no meaning.
const FitSummary* network_fit_of(const StudyCell& c) {
  return fibre_fit_of(c) && is_network_known(c) ? &c.fit : nullptr;
}

/// Fibres of a type, or of all.
auto n_fibres(std::optional<FibreType> type) {
  return [type](const StudyCell& c) -> std::optional<int> {
    if (!has_fibres(c.kind())) return std::nullopt;
    const auto is_one = [&](const Fibre& f) { return !type || f.type == *type; };
    return static_cast<int>(std::ranges::count_if(c.cell.fibres, is_one));
  };
}

Number network_tension_of(const StudyCell& c) {
  const Tension* network = tension_of(c, 0);
  return network ? Number(network->tension_nN) : Number();
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

Columns<SheetSummary> sheet_columns() {
  using S = SheetSummary;
  return {{"contraction_nN_per_um", contraction_of, kResult},
          {"mean_tension_nN_per_um", &S::mean_tension_nN_per_um, kResult},
          {"sheet_force_nN", &S::total_force_nN, kResult},
          {"strain_energy_fJ", &S::strain_energy_fJ, kResult}};
}

Columns<SpaceFigures> space_columns() {
  using S = SpaceFigures;
  return {{"space_method", &S::method},
          {"space_force_nN", &S::total_force_nN},
          {"space_force_sigma_nN", &S::total_force_sigma_nN},
          {"space_strain_energy_fJ", &S::strain_energy_fJ},
          {"space_contractile_moment_nN_um", &S::contractile_moment_nN_um},
          {"space_contractile_moment_sigma_nN_um", &S::contractile_moment_sigma_nN_um},
          {"space_normal_share", [](const S& s) { return s.normal_share(); }},
          {"space_largest_traction_kPa", &S::largest_traction_kPa},
          {"space_net_force_nN", &S::net_force_nN},
          {"space_net_moment_nN_um", &S::net_moment_nN_um},
          {"space_resolution_um", &S::resolution_um}};
}

Columns<StudyCell> figure_columns() {
  using C = StudyCell;
  const auto of_fit = [](auto figure) { return member(&C::fit, figure); };
  return {{"n_adhesions",
           [](const C& c) -> std::optional<int> {
             if (!has_fibres(c.kind())) return std::nullopt;
             return static_cast<int>(figures_of(c).n_adhesions);
           }},
          {"n_fibres", n_fibres({})},
          {"n_dorsal", n_fibres(FibreType::dorsal)},
          {"n_arc", n_fibres(FibreType::arc)},
          {"n_ventral", n_fibres(FibreType::ventral)},
          {"cell_area_um2", area_of, kResult},
          {"adhesion_area_um2",
           [](const C& c) { return fibre_fit_of(c) ? Number(figures_of(c).adhesion_area_um2) : Number(); }, kResult},
          {"total_force_nN", member(fibre_fit_of, &FitSummary::total_force_nN), kResult},
          {"network_force_nN", member(network_fit_of, &FitSummary::network_force_nN), kResult},
          {"fibre_force_nN", member(network_fit_of, &FitSummary::fibre_force_nN), kResult},
          {"network_tension_nN", network_tension_of, kResult},
          {"network_surface_tension_nN_per_um", member(network_fit_of, &FitSummary::network_surface_tension_nN_per_um),
           kResult},
          {"relative_l2", of_fit(&FitSummary::relative_l2), kResult},
          {"expected_relative_l2", expected_of, kResult},
          {"noise_um", noise_of, kResult},
          {"n_meshes", member(fibre_fit_of, &FitSummary::n_meshes)},
          {"converged", of_fit(&FitSummary::converged)},
          {"findings", [](const C& c) { return open_ids(c.findings); }},
          {"n_edge", n_fibres(FibreType::edge)},
          {"n_unclassified", n_fibres(FibreType::unclassified)},
          {"model", [](const C& c) { return model_of(c); }},
          columns_of(&C::sheet, sheet_columns()),
          columns_of(&C::space, space_columns())};
}

std::string fibres_left_out(const CellRow& row) {
  return row.cell ? fmt::format("{}", fmt::join(row.cell->review.fibres_left_out, ";")) : "";
}

Table<InCell<CellRow>> cell_table() {
  return {.file = "statistics/cells.csv",
          .columns = in_cell<CellRow>({{"included", [](const CellRow& row) { return row.cell != nullptr; }},
                                       {"reason", &CellRow::reason},
                                       {"fibres_left_out", fibres_left_out},
                                       columns_of(&CellRow::cell, figure_columns())})};
}

std::vector<InCell<CellRow>> cell_rows(const Study& study) {
  std::vector<InCell<CellRow>> rows;
  for (const StudyCell& c : study.cells) rows.push_back({c.name, condition_of(study, c), {.cell = &c}});
  for (const LeftOutCell& c : study.left_out) rows.push_back({c.name, c.condition, {.reason = c.reason}});
  return rows;
}

using AdhesionRow = InCell<files::ForceOnAdhesion>;
Table<AdhesionRow> adhesion_table() {
  const auto of_adhesion = [](const std::vector<std::string>& names) {
    return columns_of(files::adhesion_of, files::adhesion_table().columns.only(names));
  };
  return {.file = "statistics/adhesions.csv",
          .columns = in_cell<files::ForceOnAdhesion>(
              {of_adhesion({"adhesion_id", "x_um", "y_um", "area_um2", "eccentricity"}),
               files::adhesion_force_table().columns.without({"adhesion_id", "x_um", "y_um", "area_um2"}),
               of_adhesion({"origin"})})};
}

struct MeasuredTension {
  const Fibre* fibre = nullptr;
  files::FibreTension tension;
};
const Fibre& fibre_of(const MeasuredTension& row) { return *row.fibre; }
std::vector<MeasuredTension> measured_tensions_of(const StudyCell& c) {
  std::vector<MeasuredTension> rows;
  for (const Fibre& fibre : c.cell.fibres)
    if (const Tension* t = tension_of(c, fibre.fibre_id)) rows.push_back({&fibre, {*t, fibre.type}});
  return rows;
}
using FibreRow = InCell<MeasuredTension>;
Table<FibreRow> fibre_table() {
  return {
      .file = "statistics/fibres.csv",
      .columns = in_cell<MeasuredTension>(
          {columns_of(fibre_of,
                      files::fibre_table().columns.only({"fibre_id", "type", "length_um", "width_um", "confidence"})),
           columns_of(&MeasuredTension::tension,
                      files::tension_table().columns.without({"fibre_id", "type", "sigma_nN"})),
           {"sigma_nN", [](const MeasuredTension& row) { return standard_error_nN(row.tension.tension); }, kResult}})};
}

using SpaceForceRow = InCell<SpaceFigures::OfAdhesion>;
Table<SpaceForceRow> space_force_table() {
  using Of = SpaceFigures::OfAdhesion;
  return {.file = "statistics/adhesions_in_space.csv",
          .columns = in_cell<Of>(
              {{"adhesion_id", &Of::adhesion_id}, {"force_nN", &Of::force_nN}, {"sigma_nN", &Of::sigma_nN}})};
}

using EstimateRow = InCell<SheetEstimate>;
Table<EstimateRow> estimate_table() {
  return {.file = "statistics/sheets.csv",
          .columns = in_cell<SheetEstimate>(
              {files::sheet_estimate_table().columns.only({"quantity", "part", "value", "low", "high", "identifiable"}),
               {"kind", [](const SheetEstimate& e) { return kind_of_part(e); }},
               {"enters", [](const SheetEstimate& e) { return enters(e); }},
               {"sigma", [](const SheetEstimate& e) { return own_error(e); }, kResult}})};
}

/// @param unit  begins with an underscore or is empty
Columns<Summary> summary_columns(const std::string& counted, const std::string& unit) {
  using S = Summary;
  const auto plain = [](auto figure) { return member(&S::plain, figure); };
  return {{"n_cells", &S::n_cells},
          {"n_" + counted, &S::n},
          {"mean" + unit, plain(&Description::mean), kResult},
          ends_of("mean_low" + unit, "mean_high" + unit, &S::mean_interval),
          {"model_mean" + unit, member(&S::model, &Contrast::estimate), kResult},
          ends_of("model_low" + unit, "model_high" + unit, &S::model),
          {"median" + unit, plain(&Description::median), kResult},
          ends_of("median_low" + unit, "median_high" + unit, &S::median_interval),
          {"sd" + unit, plain(&Description::standard_deviation), kResult},
          {"typical_error" + unit, &S::typical_error, kResult},
          {"sd_without_error" + unit, member(&S::without_error, &Deconvolved::standard_deviation), kResult}};
}

/// A share of the fibres above a tension; of a cell without its interval.
struct ShareRow {
  Number value = {}, low = {}, high = {}, without_error = {};
};
struct TypeRow {
  Summary summary;
  std::vector<ShareRow> shares;  ///< by threshold
};

Table<TypeRow> type_table(const std::vector<double>& thresholds_nN) {
  Table<TypeRow> table{
      .file = "statistics/types.csv",
      .columns = {
          {"condition", member(&TypeRow::summary, &Summary::condition)},
          {"cell", [](const TypeRow& row) { return row.summary.cell.empty() ? std::string("all") : row.summary.cell; }},
          {"type", member(&TypeRow::summary, &Summary::kind)},
          columns_of(&TypeRow::summary, summary_columns("fibres", "_nN"))}};
  for (std::size_t k = 0; k < thresholds_nN.size(); ++k) {
    const std::string name = fmt::format("fraction_above_{:g}_nN", thresholds_nN[k]);
    using Figure = std::pair<const char*, Number ShareRow::*>;
    for (const auto& [end, figure] :
         {Figure{"", &ShareRow::value}, Figure{"_low", &ShareRow::low}, Figure{"_high", &ShareRow::high},
          Figure{"_without_error", &ShareRow::without_error}})
      table.columns.push_back({name + end,
                               [k, figure = figure](const TypeRow& row) {
                                 return k < row.shares.size() ? row.shares[k].*figure : Number();
                               },
                               kResult});
  }
  return table;
}

std::vector<double> thresholds_of(const Analysis& analysis) {
  std::vector<double> thresholds;
  for (const ShareAbove& s : analysis.shares)
    if (std::find(thresholds.begin(), thresholds.end(), s.threshold_nN) == thresholds.end())
      thresholds.push_back(s.threshold_nN);
  return thresholds;
}

std::vector<TypeRow> type_rows(const Study& study, const Analysis& analysis) {
  std::vector<TypeRow> rows;
  for (const Summary& s : analysis.tensions().summaries) {
    TypeRow& row = rows.emplace_back(TypeRow{s, {}});
    for (const ShareAbove& share : analysis.shares)
      if (share.condition == s.condition && share.kind == s.kind)
        row.shares.push_back(
            {share.share.value, share.share.interval.low, share.share.interval.high, share.without_error});
  }
  const Sample& sample = analysis.tensions().sample;
  for (const Summary& s : analysis.tensions_by_cell) {
    TypeRow& row = rows.emplace_back(TypeRow{s, {}});
    for (const double threshold : thresholds_of(analysis)) {
      const auto n = std::ranges::count_if(sample.values, [&](const Observation& o) {
        return study.cells[o.cell].name == s.cell && o.value > threshold && sample.kinds[o.kind] == s.kind;
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
Table<QuantityRow> summary_table() {
  using Row = QuantityRow;
  return {.file = "statistics/summaries.csv",
          .columns = {{"quantity", &Row::quantity},
                      {"condition", member(&Row::summary, &Summary::condition)},
                      {"kind", member(&Row::summary, &Summary::kind)},
                      columns_of(&Row::summary, summary_columns("observations", ""))}};
}

struct VarianceRow {
  std::string quantity, component;
  std::optional<double> standard_deviation = {};
  std::string remark;
};
Table<VarianceRow> variance_table() {
  using Row = VarianceRow;
  return {.file = "statistics/variances.csv",
          .columns = {{"quantity", &Row::quantity},
                      {"component", &Row::component},
                      {"standard_deviation", &Row::standard_deviation, kResult},
                      {"remark", &Row::remark}}};
}

/// The scatter between cells, between the kinds of a cell and within them.
std::vector<VarianceRow> variance_rows(const Analysis& analysis) {
  std::vector<VarianceRow> rows;
  for (const Measure& m : analysis.measures) {
    const auto add = [&](const std::string& component, const std::optional<double>& variance) {
      const char* remark = m.model ? "too few values to separate it from the others" : m.obstacle.c_str();
      if (variance) remark = *variance > 0 ? "" : "no more than the errors explain";
      rows.push_back(
          {m.sample.column, component, variance ? std::optional(std::sqrt(*variance)) : std::nullopt, remark});
    };
    const MixedFit fit = m.model ? m.model->fit : MixedFit{};
    add("cell", fit.cell_variance);
    add("kind in a cell", fit.cell_kind_variance);
    for (std::size_t k = 0; k < m.sample.kinds.size(); ++k)
      add("within: " + m.sample.kinds[k], k < fit.residual_variance.size() ? fit.residual_variance[k] : std::nullopt);
  }
  return rows;
}

Table<Comparison> test_table() {
  using Row = Comparison;
  const auto pair = +[](const Row& t) { return t.group_b.empty() ? nullptr : &t; };
  const auto with_effect = +[](const Row& t) { return t.effect_name.empty() ? nullptr : &t; };
  return {.file = "statistics/tests.csv",
          .columns = {{"quantity", &Row::column},
                      {"question", &Row::question},
                      {"within", &Row::within},
                      {"test", &Row::test},
                      {"unit", &Row::unit},
                      {"group_a", &Row::group_a},
                      {"group_b", &Row::group_b},
                      {"n_a", &Row::n_a},
                      {"n_b", member(pair, &Row::n_b)},
                      {"cells_a", &Row::cells_a},
                      {"cells_b", member(pair, &Row::cells_b)},
                      {"statistic", &Row::statistic, kResult},
                      {"degrees_of_freedom", &Row::degrees, kResult},
                      {"p", &Row::p_value, kResult},
                      {"p_holm", &Row::p_holm, kResult},
                      {"effect", member(with_effect, &Row::effect), kResult},
                      {"effect_is", &Row::effect_name},
                      ends_of("effect_low", "effect_high", &Row::interval)}};
}

std::vector<Comparison> test_rows(const Analysis& analysis) {
  std::vector<Comparison> rows;
  for (const Measure& m : analysis.measures) rows.insert(rows.end(), m.comparisons.begin(), m.comparisons.end());
  return rows;
}

Table<Correlation> correlation_table() {
  using Row = Correlation;
  return {.file = "statistics/correlations.csv",
          .columns = {{"force", &Row::force},
                      {"size", &Row::size},
                      {"condition", &Row::condition},
                      {"n_cells", [](const Row& c) { return static_cast<int>(c.x.size()); }},
                      {"slope", member(&Row::line, &LineThroughOrigin::slope), kResult},
                      {"slope_error", member(&Row::line, &LineThroughOrigin::slope_error), kResult},
                      ends_of("slope_low", "slope_high", &Row::slope_interval),
                      {"r", member(&Row::line, &LineThroughOrigin::correlation), kResult}}};
}

Table<AreaBin> area_bin_table() {
  using Row = AreaBin;
  return {.file = "statistics/adhesion_bins.csv",
          .columns = {{"condition", &Row::condition},
                      {"connected", &Row::is_connected},
                      {"area_low_um2", &Row::low_um2, kResult},
                      {"area_high_um2", &Row::high_um2, kResult},
                      {"n_cells", &Row::n_cells},
                      {"n_adhesions", &Row::n_adhesions},
                      {"mean_area_um2", &Row::mean_area_um2, kResult},
                      {"mean_force_nN", &Row::mean_force_nN, kResult},
                      ends_of("low_nN", "high_nN", &Row::interval_nN)}};
}

Table<InCell<Direction>> direction_table() {
  return {.file = "statistics/directions.csv",
          .columns = in_cell<Direction>({{"relation", &Direction::relation},
                                         {"adhesion_id", &Direction::adhesion_id},
                                         {"fibre_id", &Direction::fibre_id},
                                         {"angle_deg", &Direction::angle_deg, kResult}})};
}

Table<DirectionSummary> direction_mean_table() {
  using Row = DirectionSummary;
  return {.file = "statistics/direction_means.csv",
          .columns = {{"relation", &Row::relation},
                      {"condition", &Row::condition},
                      {"n_cells", &Row::n_cells},
                      {"n", &Row::n},
                      {"mean_angle_deg", &Row::mean_angle_deg, kResult},
                      ends_of("low_deg", "high_deg", &Row::angle_interval_deg),
                      {"chance_deg", [](const Row& row) { return largest_angle_deg(row.relation) / 2; }, kResult},
                      {"mean_cosine", &Row::mean_cosine, kResult},
                      ends_of("cosine_low", "cosine_high", &Row::cosine_interval)}};
}

Table<InCell<Finding>> finding_table() {
  return {.file = "statistics/findings.csv",
          .columns = in_cell<Finding>({{"id", &Finding::id},
                                       {"severity", &Finding::severity},
                                       {"number", &Finding::number, kResult},
                                       {"threshold", &Finding::threshold, kResult},
                                       {"text", &Finding::text}})};
}

std::vector<QuantityRow> summary_rows(const Analysis& analysis) {
  std::vector<QuantityRow> rows;
  for (const Measure& m : analysis.measures)
    for (const Summary& s : m.summaries) rows.push_back({m.sample.column, s});
  return rows;
}

/// @param visit  of a table and its rows
template <class Visit>
void for_each_table(const Study& study, const Analysis& analysis, const Visit& visit) {
  visit(cell_table(), cell_rows(study));
  visit(finding_table(), rows_by_cell(study, &StudyCell::findings));
  visit(adhesion_table(),
        rows_by_cell(study, [](const StudyCell& c) { return files::forces_on(c.cell.adhesions, c.forces); }));
  visit(fibre_table(), rows_by_cell(study, measured_tensions_of));
  visit(estimate_table(),
        rows_by_cell(study, [](const StudyCell& c) { return c.sheet.value_or(SheetSummary{}).estimates; }));
  visit(space_force_table(),
        rows_by_cell(study, [](const StudyCell& c) { return c.space.value_or(SpaceFigures{}).adhesions; }));
  visit(type_table(thresholds_of(analysis)), type_rows(study, analysis));
  visit(test_table(), test_rows(analysis));
  visit(summary_table(), summary_rows(analysis));
  visit(variance_table(), variance_rows(analysis));
  visit(correlation_table(), analysis.correlations);
  visit(area_bin_table(), analysis.area_bins);
  visit(direction_table(), rows_by_cell(study, &StudyCell::directions));
  visit(direction_mean_table(), analysis.directions);
}

}  // namespace

std::string list_of_cells(const Study& study) {
  const auto columns = cell_table().columns.only({"cell", "condition", "included", "reason", "fibres_left_out"});
  return text_of(Table<InCell<CellRow>>{.columns = columns}, cell_rows(study));
}

std::vector<std::pair<std::string, std::string>> tables_of(const Study& study, const Analysis& analysis) {
  std::vector<std::pair<std::string, std::string>> tables;
  for_each_table(study, analysis, [&](const auto& table, const auto& rows) {
    tables.emplace_back(Path(table.file).filename().string(), text_of(table, rows));
  });
  return tables;
}

std::string pages_of_tables() {
  std::string pages;
  Analysis of_one_threshold;
  of_one_threshold.shares.emplace_back().threshold_nN = StudyParameters{}.weak_tension_nN;
  for_each_table({}, of_one_threshold, [&](const auto& table, const auto&) { pages += page_of(table); });
  return pages;
}

}  // namespace mbtfm::statistics
