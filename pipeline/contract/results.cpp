#include "pipeline/contract/results.h"

#include <cmath>

namespace mbtfm {

double total(const ErrorParts& parts) {
  double sum = 0;
  for_each_part(parts,
                [&](const char*, const std::optional<double>& part) { sum += part.value_or(0) * part.value_or(0); });
  return std::sqrt(sum);
}

double sigma_nN(const MissingFibre& f) { return f.tension_nN / std::sqrt(f.chi_squared_gain); }

}  // namespace mbtfm
