/// What a long computation may take, and to whom it reports its progress.
#pragma once

#include <functional>
#include <string_view>
#include <utility>

namespace mbtfm {

/// Receives how far a long work has come (0 to 1) and with what; may throw to cancel. May be empty.
using Progress = std::function<void(double fraction, std::string_view what)>;

struct Work {
  /// Threads alone are work, too.
  Work(int n_threads = 1, Progress report_to = {}) : threads(n_threads), progress(std::move(report_to)) {}

  int threads;
  Progress progress;  ///< may be empty

  void tell(double fraction, std::string_view what) const {
    if (progress) progress(fraction, what);
  }
  /// The part of it that begins at `from` and is this share of the whole.
  Work part(double from, double share) const {
    return {threads,
            [whole = *this, from, share](double f, std::string_view what) { whole.tell(from + share * f, what); }};
  }
};

}  // namespace mbtfm
