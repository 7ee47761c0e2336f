#include "segment/emptiness.h"

#include <algorithm>

#include "pipeline/contract/csv.h"
#include "segment/channels.h"

namespace mbtfm::segment {

std::string emptiness_of(const Image& image) {
  if (image.pixels.empty()) return "no pixels";
  const auto [darkest, brightest] = std::minmax_element(image.pixels.begin(), image.pixels.end());
  if (*darkest == *brightest) return "every pixel is " + shortest(*darkest);
  const double share = share_at_brightest(image);
  constexpr double kMostAtOneValue = 0.1;
  if (share <= kMostAtOneValue) return {};
  return brief(100 * share) + " % of the pixels at " + shortest(*brightest) +
         ", the brightest value: the detector was saturated";
}

}  // namespace mbtfm::segment
