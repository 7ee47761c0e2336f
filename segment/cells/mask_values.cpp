/// What the values of a picture mean as a mask.
#include <algorithm>
#include <cmath>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "segment/cells/mask.h"

namespace mbtfm::cells {
namespace {

/// Half of the largest value, if all values between 0 and it lie in rims: a mask that was drawn, turned or scaled has
/// grey pixels between both. None of them is a label.
std::optional<float> level_of_rims(const images::Image& image) {
  constexpr int kRim_px = 4;         // as wide as interpolation and smoothing make them
  constexpr std::size_t kGreys = 3;  // less: labels that touch
  const float largest = image.pixels.empty() ? 0 : std::ranges::max(image.pixels);
  std::set<float> greys;
  for (int j = 0; j < image.height; ++j) {
    for (int i = 0; i < image.width; ++i) {
      const float value = image.at(i, j);
      if (!(value > 0 && value < largest)) continue;
      bool is_near_none = false, is_near_mask = false;
      for (int y = std::max(0, j - kRim_px); y <= std::min(image.height - 1, j + kRim_px); ++y) {
        for (int x = std::max(0, i - kRim_px); x <= std::min(image.width - 1, i + kRim_px); ++x) {
          is_near_none |= image.at(x, y) == 0;
          is_near_mask |= image.at(x, y) == largest;
        }
      }
      if (!is_near_none || !is_near_mask) return std::nullopt;
      greys.insert(value);
    }
  }
  return greys.size() >= kGreys ? std::optional(largest / 2) : std::nullopt;
}

/// 0; if no pixel has it, what all four corners have: some programs count labels from 1, the background's among them.
float background_of(const images::Image& image) {
  if (image.pixels.empty()) return 0;
  const int right = image.width - 1, bottom = image.height - 1;
  const float corner = image.at(0, 0);
  const bool is_around =
      image.at(right, 0) == corner && image.at(0, bottom) == corner && image.at(right, bottom) == corner;
  const auto has = [&](const auto& is_it) { return std::ranges::any_of(image.pixels, is_it); };
  const bool is_other = has([&](float value) { return value != corner; });
  return is_around && is_other && !has([](float value) { return value == 0; }) ? corner : 0;
}

}  // namespace

LabelMask mask_of(const images::Image& image, const std::string& name) {
  if (image.is_lossy)
    throw InputError(name, "a mask as TIFF or PNG", "a JPEG, which changes labels and rims",
                     "save the mask as TIFF or PNG, from the program that made it");
  constexpr float kLargest = 1 << 24;  // whole numbers that a float holds
  LabelMask mask{.name = name, .width = image.width, .height = image.height, .labels = {}, .taken = image.taken};
  mask.taken = mask.taken.substr(0, mask.taken.find(" ("));  // no parameter chooses planes of masks
  const float background = background_of(image);
  const std::optional<float> rim = level_of_rims(image);
  mask.labels.reserve(image.pixels.size());
  std::set<int> values;
  for (std::size_t k = 0; k < image.pixels.size(); ++k) {
    const float value = rim                             ? (image.pixels[k] > *rim ? 1.f : 0.f)
                        : image.pixels[k] == background ? 0.f
                                                        : image.pixels[k];
    if (!(value >= 0) || value > kLargest || value != std::floor(value))
      throw InputError(name + ": pixel " + std::to_string(k % static_cast<std::size_t>(image.width)) + ", " +
                           std::to_string(k / static_cast<std::size_t>(image.width)),
                       "a whole number, 0 for the background", shortest(value),
                       "a picture or a map of probabilities is no mask: threshold it, and save labels or 0 and 255");
    mask.labels.push_back(static_cast<int>(value));
    if (values.size() < 2 && value > 0) values.insert(static_cast<int>(value));
  }
  if (values.empty())
    throw InputError(name, "pixels above 0 for what the mask covers", "0 everywhere",
                     "is this the right file? 0 is the background");
  mask.is_binary = values.size() == 1;
  return mask;
}

LabelMask read_mask(const std::filesystem::path& file) {
  const images::PlaneChoice choice{.prefix = "mask", .pixels = images::PixelsAre::labels};
  try {
    return mask_of(images::read_image(file, choice), file.string());
  } catch (const InputError& error) {
    if (!error.hint.starts_with("set mask_")) throw;  // of a file of several planes
    throw InputError(error.where, "a mask of one plane", error.found,
                     "save the one that is meant as a file of its own");
  }
}

}  // namespace mbtfm::cells
