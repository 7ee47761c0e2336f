#include "segment/cells/emptiness.h"

#include <algorithm>

#include "pipeline/contract/numbers.h"
#include "segment/images/channels.h"

namespace mbtfm::cells {

std::string emptiness_of(const images::Image& image) {
  if (image.pixels.empty()) return "no pixels";
  const auto [darkest, brightest] = std::minmax_element(image.pixels.begin(), image.pixels.end());
  if (*darkest == *brightest) return "every pixel is " + shortest(*darkest);
  const double share = images::share_at_brightest(image);
  constexpr double kMostAtOneValue = 0.1;
  if (share <= kMostAtOneValue) return {};
  return brief(100 * share) + " % of the pixels at " + shortest(*brightest) +
         ", the brightest value: the detector was saturated";
}

}  // namespace mbtfm::cells
