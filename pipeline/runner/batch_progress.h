/// How far a batch is, and how long it will take.
#pragma once

#include <chrono>
#include <mutex>
#include <set>
#include <string>

#include "pipeline/runner/batch.h"

namespace mbtfm::runner {

/// What became of a cell as a JSON object on a line (docs/formats.md, "Events").
std::string event_of(const BatchCell& cell);

/// Threads may share one.
class BatchProgress {
 public:
  BatchProgress(int n_to_run, const BatchOptions& options) : n_to_run_(n_to_run), options_(options) {}
  void starts(const std::filesystem::path& cell);
  void ended(const BatchCell& cell);
  void put_off(const std::filesystem::path& cell);  ///< it was not started after all

 private:
  std::string time_left() const;
  void show() const;

  int n_to_run_, n_done_ = 0, n_failed_ = 0;
  const BatchOptions& options_;
  std::set<std::string> running_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::mutex mutex_;  ///< of all, and of the lines on the terminal
};

}  // namespace mbtfm::runner
