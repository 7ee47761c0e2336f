#include "pipeline/report/result_line.h"

#include <nlohmann/json.hpp>

#include "pipeline/contract/counted.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/json.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/report.h"
#include "pipeline/report/sheet_report.h"
#include "pipeline/report/space_report.h"

namespace mbtfm::report {

std::string result_line(const Path& cell) {
  const CellKind kind = kind_of(cell);
  if (kind == CellKind::space) return result_line_in_space(cell);
  if (kind == CellKind::sheet) return result_line_of_sheet(cell);
  const files::CellResult result = files::read_cell_result(cell);
  std::string line = "total force " + with_error(result.fit.total_force_nN, result.total_error_nN, "nN");
  std::string tensions;
  for (const auto& [type, of] : result.types)
    tensions += (tensions.empty() ? "; mean tension: " : ", ") + std::string(name_of(type)) + " " +
                readable(of.mean_nN) + " nN (" + std::to_string(of.n) + ")";
  line += tensions;
  if (result.n_fibres > 0)
    line += "; " + std::to_string(result.n_uncertain) + " of " + std::to_string(result.n_fibres) + " uncertain";
  if (const std::optional<files::ForceOverTime>& series = result.over_time)
    line += "; over " + counted(series->n_frames, "frames") + " from " + readable(series->first_nN) + " to " +
            readable(series->last_nN) + " nN";
  return line;
}

std::string result_event(const Path& cell, const Path& report) {
  const CellKind kind = kind_of(cell);
  if (kind == CellKind::space) return result_event_in_space(cell, report);
  if (kind == CellKind::sheet) return result_event_of_sheet(cell, report);
  const files::CellResult result = files::read_cell_result(cell);
  nlohmann::ordered_json event = {{"event", "result"},
                                  {"total_force_nN", result.fit.total_force_nN},
                                  {"total_force_error_nN", nullptr},
                                  {"mean_tension_nN", nlohmann::ordered_json::object()},
                                  {"fibres", result.n_fibres},
                                  {"uncertain", result.n_uncertain},
                                  {"report", report.string()}};
  if (result.total_error_nN) event["total_force_error_nN"] = *result.total_error_nN;
  for (const auto& [type, of] : result.types) event["mean_tension_nN"][name_of(type)] = of.mean_nN;
  return files::json_text(event) + "\n";
}

}  // namespace mbtfm::report
