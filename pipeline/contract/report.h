/// How an algorithm came to its end.
#pragma once

#include <string>

namespace mbtfm {

/// How an iteration ended.
struct Report {
  bool converged = false;
  int iterations = 0;
  double last_change = 0;
  std::string reason;  ///< one sentence; where not converged: the likely cause and the numbers that show it
};

}  // namespace mbtfm
