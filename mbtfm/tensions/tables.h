/// The tables that the fit writes in addition to tensions.csv and adhesion_forces.csv: columns and rows.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mbtfm/tensions/effects.h"
#include "mbtfm/tensions/model_checks.h"
#include "mbtfm/tensions/series.h"
#include "pipeline/files/tables.h"

namespace mbtfm::tensions {

/// A tension in a frame of a time series.
struct TrackRow {
  int frame = 0;
  std::optional<double> time_s = {};
  files::FibreTension fibre = {};
};
files::Table<TrackRow> track_table();

struct FitOfFrame {
  FrameFit fit;
  std::optional<double> time_s = {};
};
files::Table<FitOfFrame> frame_fit_table();

struct CorrelationRow {
  int fibre_id = 0, other_fibre_id = 0;
  double correlation = 0;
};
std::vector<CorrelationRow> correlation_rows(const EnsembleFit& fit);
files::Table<CorrelationRow> correlation_table();

files::Table<ModelScore> model_table();
files::Table<FibreLeftOut> fibre_left_out_table();

struct DrawRow {
  int draw = 0;
  double own = 0, exchanged = 0;
};
std::vector<DrawRow> draw_rows(const CrossValidation& result);
files::Table<DrawRow> draw_table();

struct ChangeRow {
  EffectKind effect;
  int fibre_id = 0;
  double change_nN = 0;
};
std::vector<ChangeRow> change_rows(const std::vector<Change>& changes, const EnsembleFit& fit);
files::Table<ChangeRow> change_table();

/// Their part of docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::tensions
