#include "segment/images/channels.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::images {

namespace {

std::string size_of(const Image& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels";
}

}  // namespace

std::string in_um(double length_um) { return shortest(length_um) + " um"; }

void require_equal_sizes(const Channel& first, const Channel& second) {
  if (first.image.width == second.image.width && first.image.height == second.image.height) return;
  throw InputError(second.name, size_of(first.image) + " as in " + first.name, size_of(second.image),
                   "both images must show the same field at the same magnification");
}

double common_pixel_size_um(const Channel& first, const Channel& second, std::optional<double> given_um) {
  if (given_um) return *given_um;
  const std::optional<double> a = first.image.pixel_size_um, b = second.image.pixel_size_um;
  constexpr double kSame = 2e-3;  // calibrations are written with three digits or more
  if (a && b && std::abs(*a - *b) > kSame * *a) {
    throw InputError(second.name, "the pixel size of " + first.name + ", " + in_um(*a), in_um(*b),
                     "set pixel_size_um to the right one");
  }
  if (a) return *a;
  if (b) return *b;
  throw InputError(first.name, "a calibration in the file", "none",
                   "set pixel_size_um, in cell.toml or as --pixel_size_um");
}

std::optional<Finding> noticed_loss(const Channel& channel) {
  return noticed(
      FindingKind::lossy_image, channel.image.is_lossy ? 1 : 0,
      channel.name + " is a lossy image (JPEG): its intensities and the positions of its beads are changed.");
}

double share_at_brightest(const Image& image) {
  if (image.pixels.empty()) return 0;
  const float brightest = *std::max_element(image.pixels.begin(), image.pixels.end());
  const auto n = std::count(image.pixels.begin(), image.pixels.end(), brightest);
  return static_cast<double>(n) / static_cast<double>(image.pixels.size());
}

std::optional<Finding> noticed_saturation(const Channel& channel) {
  const double share = share_at_brightest(channel.image);
  return noticed(FindingKind::saturated, share,
                 channel.name + " is saturated: " + brief(100 * share) + " % of its pixels have its largest value.");
}

std::optional<Finding> noticed_unchecked(const std::vector<const Channel*>& channels, double pixel_size_um) {
  std::string names;
  for (const Channel* channel : channels) {
    if (channel->image.pixel_size_um) return std::nullopt;
    names += (names.empty() ? "" : ", ") + channel->name;
  }
  return noticed(FindingKind::pixel_size_unchecked, channels.empty() ? 0 : 1,
                 names + ": no pixel size is stated. The given " + brief(pixel_size_um) + " um cannot be checked.");
}

std::optional<stage::Doubt> doubt_about_calibration(const Channel& channel, std::optional<double> given_um) {
  if (!given_um || !channel.image.pixel_size_um) return std::nullopt;
  return stage::doubt_about_pixel_size(*given_um, *channel.image.pixel_size_um);
}

}  // namespace mbtfm::images
