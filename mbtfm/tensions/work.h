/// What a long computation may take, and whom it tells how far it has come.
#pragma once

#include <string_view>

#include "pipeline/contract/report.h"

namespace mbtfm::tensions {

struct Work {
  int threads = 1;
  Progress progress = {};  ///< may be empty

  void tell(double fraction, std::string_view what) const {
    if (progress) progress(fraction, what);
  }
  /// The part of it that begins at `from` and is this share of the whole.
  Work part(double from, double share) const {
    return {threads,
            [whole = *this, from, share](double f, std::string_view what) { whole.tell(from + share * f, what); }};
  }
};

}  // namespace mbtfm::tensions
