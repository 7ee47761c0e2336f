#include "mbtfm/tensions/tables.h"

#include "pipeline/contract/kinds_of_effects.h"

namespace mbtfm::tensions {

using files::kId;
using files::kResult;
using files::member;
using files::Table;

namespace {

/// A number of a frame that has a fit; the field is empty where it has none.
template <class... Of>
files::Columns<FitOfFrame> of_fit(const char* name, const files::ColumnOptions& options, Of... of) {
  const auto number = member(&FitOfFrame::fit, of...);
  using T = typename decltype(member(&FitOfFrame::fit, of...))::Type;
  const auto get = [number](const FitOfFrame& row) {
    return row.fit.refused.empty() ? std::optional(*static_cast<const T*>(number.way.from(&row))) : std::nullopt;
  };
  const auto put = [number](FitOfFrame& row, const std::optional<T>& value) {
    if (value) *static_cast<T*>(number.way.from(&row)) = *value;
  };
  return {name, get, put, options};
}

}  // namespace

Table<TrackRow> track_table() {
  return {.file = "4_fit/tracks.csv",
          .columns = {{"frame", &TrackRow::frame, kId},
                      {"time_s", &TrackRow::time_s, files::kResultMayLack},
                      files::columns_of(&TrackRow::fibre, files::tension_table().columns)}};
}

Table<FitOfFrame> frame_fit_table() {
  using Row = FitOfFrame;
  constexpr files::ColumnOptions kWhole = {};  // their difference is what the next run writes again
  return {.file = "4_fit/frames.csv",
          .columns = {{"frame", member(&Row::fit, &FrameFit::frame), kId},
                      {"time_s", &Row::time_s, files::kResultMayLack},
                      of_fit("total_force_nN", kWhole, &FrameFit::total_force_nN, &Estimate::value),
                      of_fit("total_force_sigma_nN", kResult, &FrameFit::total_force_nN, &Estimate::standard_error),
                      of_fit("network_force_nN", kWhole, &FrameFit::network_force_nN, &Estimate::value),
                      of_fit("network_force_sigma_nN", kResult, &FrameFit::network_force_nN, &Estimate::standard_error),
                      {"fibre_force_nN",
                       [](const Row& row) -> std::optional<double> {
                         if (!row.fit.refused.empty()) return std::nullopt;
                         return row.fit.total_force_nN.value - row.fit.network_force_nN.value;
                       },
                       kResult},
                      of_fit("relative_l2", kResult, &FrameFit::relative_l2),
                      of_fit("chi_squared_per_degree", kResult, &FrameFit::chi_squared_per_degree),
                      of_fit("converged", kResult, &FrameFit::converged),
                      {"refused", member(&Row::fit, &FrameFit::refused)},
                      {"displacement_sha256", member(&Row::fit, &FrameFit::displacement_sha256)}}};
}

std::vector<CorrelationRow> correlation_rows(const EnsembleFit& fit) {
  const MatrixXd correlation = correlation_of(fit);
  std::vector<CorrelationRow> rows;
  const std::vector<int>& ids = fit.tensions.fibre_ids;
  for (Index i = 0; i < std::ssize(ids); ++i)
    for (Index j = i + 1; j < std::ssize(ids); ++j) rows.push_back({ids[i], ids[j], correlation(i, j)});
  return rows;
}

Table<CorrelationRow> correlation_table() {
  using Row = CorrelationRow;
  return {.file = "4_fit/correlations.csv",
          .columns = {{"fibre_id", &Row::fibre_id},
                      {"other_fibre_id", &Row::other_fibre_id},
                      {"correlation", &Row::correlation, kResult}}};
}

Table<ModelScore> model_table() {
  using Row = ModelScore;
  return {.file = "4_fit/models.csv",
          .columns = {{"model", &Row::name},
                      {"n_parameters", &Row::n_parameters},
                      {"chi_squared", &Row::chi_squared, kResult},
                      {"relative_l2", &Row::relative_l2, kResult},
                      {"aic", &Row::aic, kResult},
                      {"bic", &Row::bic, kResult},
                      {"discrepancy_nN", &Row::discrepancy_nN, kResult},
                      {"bic_with_discrepancy", &Row::bic_with_discrepancy, kResult}}};
}

Table<FibreLeftOut> fibre_left_out_table() {
  using Row = FibreLeftOut;
  return {.file = "4_fit/fibres_left_out.csv",
          .columns = {{"fibre_id", &Row::fibre_id},
                      {"chi_squared_rise", &Row::chi_squared_rise, kResult},
                      {"aic_rise", &Row::aic_rise, kResult},
                      {"supported", [](const Row& f) { return f.aic_rise > 0; }},
                      {"n_informing_beads", &Row::n_informing_beads, kResult},
                      {"existence", &Row::existence, kResult}}};
}

std::vector<DrawRow> draw_rows(const CrossValidation& result) {
  std::vector<DrawRow> rows;
  for (std::size_t i = 0; i < result.own.size(); ++i)
    rows.push_back({static_cast<int>(i) + 1, result.own[i], result.exchanged[i]});
  return rows;
}

Table<DrawRow> draw_table() {
  return {.file = "4_fit/cross_validation.csv",
          .columns = {
              {"draw", &DrawRow::draw}, {"own", &DrawRow::own, kResult}, {"exchanged", &DrawRow::exchanged, kResult}}};
}

std::vector<ChangeRow> change_rows(const std::vector<Change>& changes, const EnsembleFit& fit) {
  std::vector<ChangeRow> rows;
  for (const Change& change : changes) {
    for (Index i = 0; i < change.by_tension_nN.size(); ++i)
      rows.push_back({change.effect, fit.tensions.fibre_ids[i], change.by_tension_nN[i]});
  }
  return rows;
}

Table<ChangeRow> change_table() {
  using Row = ChangeRow;
  return {.file = "4_fit/effects_left_out.csv",
          .columns = {{"effect", [](const Row& row) { return std::string(name_of(row.effect)); }},
                      {"fibre_id", &Row::fibre_id},
                      {"change_nN", &Row::change_nN, kResult}}};
}

std::string pages_of_tables() {
  return page_of(track_table()) + page_of(frame_fit_table()) + page_of(model_table()) +
         page_of(fibre_left_out_table()) + page_of(correlation_table()) + page_of(draw_table()) +
         page_of(change_table());
}

}  // namespace mbtfm::tensions
