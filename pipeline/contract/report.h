/// What an algorithm and a stage say of their work.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "pipeline/contract/effects.h"
#include "pipeline/contract/findings.h"

namespace mbtfm {

/// How an iteration ended.
struct Report {
  bool converged = false;
  int iterations = 0;
  double last_change = 0;
  std::string reason;  ///< one sentence; where not converged: the likely cause and the numbers that tell
};

using Value =
    std::variant<bool, std::int64_t, double, std::string, std::vector<std::int64_t>, std::vector<std::string>>;
/// Named figures in the order they were added.
using Figures = std::vector<std::pair<std::string, Value>>;

/// What a stage reports: into its record and the last line on the terminal.
struct StageReport {
  bool converged = true;
  std::string summary;  ///< what was found, and what was skipped, in one line
  Figures figures;
  std::vector<Effect> effects;
  std::vector<Finding> findings;
};

/// Told how far a long work has come (0 to 1) and with what; may throw to cancel. May be empty.
using Progress = std::function<void(double fraction, std::string_view what)>;

}  // namespace mbtfm
