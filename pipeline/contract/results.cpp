#include "pipeline/contract/results.h"

#include <cmath>

namespace mbtfm {

double total(const ErrorParts& parts) {
  double sum = 0;
  for_each_part(parts,
                [&](const char*, const std::optional<double>& part) { sum += part.value_or(0) * part.value_or(0); });
  return std::sqrt(sum);
}

}  // namespace mbtfm
