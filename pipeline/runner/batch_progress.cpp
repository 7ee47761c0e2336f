#include "pipeline/runner/batch_progress.h"

#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "pipeline/files/json.h"
#include "pipeline/runner/batch_table.h"
#include "pipeline/stage/console.h"

namespace mbtfm::runner {

std::string event_of(const BatchCell& cell) {
  const nlohmann::ordered_json event = {
      {"event", "cell"},         {"cell", cell.cell.string()},        {"exit_code", cell.exit_code},
      {"seconds", cell.seconds}, {"failed_stage", cell.failed_stage}, {"message", cell.message}};
  return files::json_text(event) + "\n";
}

void BatchProgress::starts(const std::filesystem::path& cell) {
  const std::lock_guard guard(mutex_);
  running_.insert(cell.filename().string());
  show();
}

void BatchProgress::put_off(const std::filesystem::path& cell) {
  const std::lock_guard guard(mutex_);
  running_.erase(cell.filename().string());
}

void BatchProgress::ended(const BatchCell& cell) {
  const std::lock_guard guard(mutex_);
  running_.erase(cell.cell.filename().string());
  ++n_done_;
  if (cell.exit_code != 0) ++n_failed_;
  if (options_.ended) options_.ended(cell);
  if (options_.say) {
    std::ostringstream line;
    line << '[' << n_done_ << '/' << n_to_run_ << "] " << cell.cell.string() << ": " << std::fixed
         << std::setprecision(1) << cell.seconds << " s: ";
    if (cell.exit_code == 0)
      line << verdict_on(cell.cell, options_.run.only) << ": " << last_summary(cell.cell, options_.run.only);
    else
      line << "FAILED" << (cell.failed_stage.empty() ? "" : " in " + cell.failed_stage) << ", " << cell.how;
    line << time_left();
    options_.say(line.str());
  }
  show();
}

/// At the rate so far, jobs that run at the same time included.
std::string BatchProgress::time_left() const {
  if (n_done_ == 0 || n_done_ >= n_to_run_) return {};
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  return "; about " + stage::readable_duration(seconds / n_done_ * (n_to_run_ - n_done_)) + " left";
}

void BatchProgress::show() const {
  if (!options_.show) return;
  std::ostringstream line;
  line << n_done_ << " of " << n_to_run_ << " done";
  if (n_failed_ > 0) line << ", " << n_failed_ << " failed";
  line << time_left();
  for (const std::string& name : running_) line << (name == *running_.begin() ? "; running " : ", ") << name;
  options_.show(n_done_ < n_to_run_ ? line.str() : std::string());
}

}  // namespace mbtfm::runner
