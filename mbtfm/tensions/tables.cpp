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
files::Columns<FitOfFrame> of_fit(const char* name, const char* meaning, const files::ColumnOptions& options,
                                  Of... of) {
  const auto number = member(&FitOfFrame::fit, of...);
  using T = typename decltype(member(&FitOfFrame::fit, of...))::Type;
  const auto get = [number](const FitOfFrame& row) {
    return row.fit.refused.empty() ? std::optional(*static_cast<const T*>(number.way.from(&row))) : std::nullopt;
  };
  const auto put = [number](FitOfFrame& row, const std::optional<T>& value) {
    if (value) *static_cast<T*>(number.way.from(&row)) = *value;
  };
  return {name, meaning, get, put, options};
}

}  // namespace

Table<TrackRow> track_table() {
  return {.file = "4_fit/tracks.csv",
          .row = "the actin network and each fibre in each frame of a time series",
          .columns = {{"frame", "counts from 1", &TrackRow::frame, kId},
                      {"time_s", "since the first frame; empty: `frame_interval_s` is not set", &TrackRow::time_s,
                       files::kResultMayLack},
                      files::columns_of(&TrackRow::fibre, files::tension_table().columns)}};
}

Table<FitOfFrame> frame_fit_table() {
  using Row = FitOfFrame;
  constexpr files::ColumnOptions kWhole = {};  // their difference is what the next run writes again
  return {
      .file = "4_fit/frames.csv",
      .row = "each frame of a time series",
      .columns = {{"frame", "counts from 1", member(&Row::fit, &FrameFit::frame), kId},
                  {"time_s", "since the first frame; empty: `frame_interval_s` is not set", &Row::time_s,
                   files::kResultMayLack},
                  of_fit("total_force_nN", "sum of the adhesions' force magnitudes", kWhole, &FrameFit::total_force_nN,
                         &Estimate::value),
                  of_fit("total_force_sigma_nN", "its standard error", kResult, &FrameFit::total_force_nN,
                         &Estimate::standard_error),
                  of_fit("network_force_nN", "the same of the network alone", kWhole, &FrameFit::network_force_nN,
                         &Estimate::value),
                  of_fit("network_force_sigma_nN", "its standard error", kResult, &FrameFit::network_force_nN,
                         &Estimate::standard_error),
                  {"fibre_force_nN", "what the fibres add",
                   [](const Row& row) -> std::optional<double> {
                     if (!row.fit.refused.empty()) return std::nullopt;
                     return row.fit.total_force_nN.value - row.fit.network_force_nN.value;
                   },
                   kResult},
                  of_fit("relative_l2", "‖measured − model‖ / ‖measured‖", kResult, &FrameFit::relative_l2),
                  of_fit("chi_squared_per_degree", "1 if the model explains all but the noise", kResult,
                         &FrameFit::chi_squared_per_degree),
                  of_fit("converged", "the fit came to its end", kResult, &FrameFit::converged),
                  {"refused", "why the frame has no fit; empty: it has", member(&Row::fit, &FrameFit::refused)},
                  {"displacement_sha256", "of the frame's file", member(&Row::fit, &FrameFit::displacement_sha256)}}};
}

std::vector<CorrelationRow> correlation_rows(const EnsembleFit& fit) {
  const MatrixXd correlation = correlation_of(fit);
  std::vector<CorrelationRow> rows;
  for (std::size_t i = 0; i < fit.tensions.fibre_ids.size(); ++i) {
    for (std::size_t j = i + 1; j < fit.tensions.fibre_ids.size(); ++j) {
      rows.push_back({fit.tensions.fibre_ids[i], fit.tensions.fibre_ids[j],
                      correlation(static_cast<Index>(i), static_cast<Index>(j))});
    }
  }
  return rows;
}

Table<CorrelationRow> correlation_table() {
  using Row = CorrelationRow;
  return {.file = "4_fit/correlations.csv",
          .row = "each pair of tensions",
          .columns = {{"fibre_id", "one of them; 0: the actin network", &Row::fibre_id},
                      {"other_fibre_id", "the other", &Row::other_fibre_id},
                      {"correlation", "of their errors from noise", &Row::correlation, kResult}}};
}

Table<ModelScore> model_table() {
  using Row = ModelScore;
  return {.file = "4_fit/models.csv",
          .row = "each model that is compared",
          .columns = {{"model", "its name: no-fibres, full, adhesion-forces, sheet, sheet-with-bundles", &Row::name},
                      {"n_parameters", "numbers that are fitted", &Row::n_parameters},
                      {"chi_squared", "misfit in units of the noise", &Row::chi_squared, kResult},
                      {"relative_l2", "‖measured − model‖ / ‖measured‖", &Row::relative_l2, kResult},
                      {"aic", "Akaike's criterion", &Row::aic, kResult},
                      {"bic", "the Bayesian criterion", &Row::bic, kResult},
                      {"discrepancy_nN", "error of the model: standard deviation of a force's component beside it",
                       &Row::discrepancy_nN, kResult},
                      {"bic_with_discrepancy", "the Bayesian criterion if that error is allowed for",
                       &Row::bic_with_discrepancy, kResult}}};
}

Table<FibreLeftOut> fibre_left_out_table() {
  using Row = FibreLeftOut;
  return {
      .file = "4_fit/fibres_left_out.csv",
      .row = "each fibre",
      .columns = {{"fibre_id", "the fibre that is left out", &Row::fibre_id},
                  {"chi_squared_rise", "by how much the misfit rises without it", &Row::chi_squared_rise, kResult},
                  {"aic_rise", "the same of Akaike's criterion", &Row::aic_rise, kResult},
                  {"supported", "the beads call for the fibre", [](const Row& f) { return f.aic_rise > 0; }},
                  {"n_informing_beads", "number of beads, effectively, that determine this tension",
                   &Row::n_informing_beads, kResult},
                  {"existence", "probability that the line is a fibre, by image and beads", &Row::existence, kResult}}};
}

std::vector<DrawRow> draw_rows(const CrossValidation& result) {
  std::vector<DrawRow> rows;
  for (std::size_t i = 0; i < result.own.size(); ++i)
    rows.push_back({static_cast<int>(i) + 1, result.own[i], result.exchanged[i]});
  return rows;
}

Table<DrawRow> draw_table() {
  return {.file = "4_fit/cross_validation.csv",
          .row = "each draw of tensions (if draws are asked for)",
          .columns = {{"draw", "counts from 1", &DrawRow::draw},
                      {"own", "relative L2 of tensions drawn by fibre type", &DrawRow::own, kResult},
                      {"exchanged", "the same with dorsal and ventral exchanged", &DrawRow::exchanged, kResult}}};
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
          .row = "each tension and each effect that is off (`--explain`)",
          .columns = {{"effect", "its name", [](const Row& row) { return std::string(name_of(row.effect)); }},
                      {"fibre_id", "label of the fibre; 0: the actin network", &Row::fibre_id},
                      {"change_nN", "with the effect, less without", &Row::change_nN, kResult}}};
}

std::string pages_of_tables() {
  return page_of(track_table()) + page_of(frame_fit_table()) + page_of(model_table()) +
         page_of(fibre_left_out_table()) + page_of(correlation_table()) + page_of(draw_table()) +
         page_of(change_table());
}

}  // namespace mbtfm::tensions
