#include "segment/cells/emptiness.h"

#include <algorithm>

#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/order_statistics.h"
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

std::optional<images::Image> negative_of_dark_on_bright(images::Image image) {
  constexpr double kTail = 0.01;
  const auto value = [&](double share) { return numerics::quantile(image.pixels, share); };
  const float dark = value(kTail), middle = value(0.5), bright = value(1 - kTail);
  if (middle - dark <= bright - middle) return std::nullopt;
  const auto [least, most] = std::ranges::minmax(image.pixels);
  for (float& pixel : image.pixels) pixel = least + (most - pixel);
  return image;
}

}  // namespace mbtfm::cells
