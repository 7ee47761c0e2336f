#include "segment/images/channels.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "segment/images/stage_images.h"

namespace mbtfm::images {

std::string in_um(double length_um) { return shortest(length_um) + " um"; }

namespace {

template <class Sized>
std::string size_of(const Sized& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels";
}

/// How many pixels of `fine` are one of `coarse`, if it is the same number in both directions.
std::optional<double> pixels_in_one(const ImageField& fine, const ImageField& coarse) {
  const double across = double(fine.width) / coarse.width, down = double(fine.height) / coarse.height;
  const double of_a_pixel = across / std::min(coarse.width, coarse.height);  // what fills no block is left out
  if (std::abs(across - down) > 2 * of_a_pixel) return std::nullopt;
  const double whole = std::round(across);
  return std::abs(across - whole) <= 2 * of_a_pixel ? whole : across;
}

/// "1024 x 1024 pixels of 0.1 um, 102.4 x 102.4 um".
std::string in_words(const ImageField& field) {
  if (!field.pixel_size_um) return size_of(field);
  return size_of(field) + " of " + in_um(*field.pixel_size_um) + ", " + brief(field.width * *field.pixel_size_um) +
         " x " + brief(field.height * *field.pixel_size_um) + " um";
}

std::string remedy_of(const ImageField& cell, const ImageField& beads) {
  const std::string cropped = "if they were cropped, crop all images of the cell to one field, from one corner on";
  const bool is_same_count = cell.width == beads.width && cell.height == beads.height;
  if (is_same_count) return "set pixel_size_um to the right one; " + cropped;
  const std::optional<double> times = pixels_in_one(cell, beads);
  if (!times || !cell.pixel_size_um) return cropped;
  return "if both show one field, as images that were binned do, set track.beads_pixel_size_um = " +
         shortest(*times * *cell.pixel_size_um) + " (pixel_size_um is that of the cell's images, here taken for " +
         in_um(*cell.pixel_size_um) + "); " + cropped;
}

}  // namespace

void require_equal_sizes(const Channel& first, const Channel& second) {
  if (first.image.width == second.image.width && first.image.height == second.image.height) return;
  throw InputError(second.name, size_of(first.image) + " as in " + first.name, size_of(second.image),
                   "both images must show the same field at the same magnification");
}

void require_same_field(const NamedField& cell, const NamedField& beads) {
  ImageField c = cell.field, b = beads.field;
  if (!c.pixel_size_um) c.pixel_size_um = b.pixel_size_um;
  if (!b.pixel_size_um) b.pixel_size_um = c.pixel_size_um;
  const double of_cell = c.pixel_size_um.value_or(1), of_beads = b.pixel_size_um.value_or(1);
  constexpr double kSame = 2e-3;  // calibrations are written with three digits or more
  const auto is_same = [&](int n_cell, int n_beads) {
    const double side = n_cell * of_cell;
    // of a side that is no multiple of the binning a pixel is left out
    return std::abs(side - n_beads * of_beads) <= kSame * side + 1.001 * std::max(of_cell, of_beads);
  };
  if (is_same(c.width, b.width) && is_same(c.height, b.height)) return;
  throw InputError(beads.name, "the field of " + cell.name + ", " + in_words(c), in_words(b), remedy_of(c, b));
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
  const std::string& refused = first.image.no_calibration;
  throw InputError(first.name, "a calibration in the file", refused.empty() ? "none" : refused,
                   (refused.empty() ? "" : "it was binned or cropped since: ") +
                       std::string("set pixel_size_um, in cell.toml or as --pixel_size_um"));
}

std::optional<Finding> noticed_loss(const Channel& channel) {
  return noticed(Symptom::lossy_image, channel.image.is_lossy ? 1 : 0, {.at = channel.name});
}

double share_at_brightest(const Image& image) {
  if (image.pixels.empty()) return 0;
  const float brightest = *std::max_element(image.pixels.begin(), image.pixels.end());
  const auto n = std::count(image.pixels.begin(), image.pixels.end(), brightest);
  return static_cast<double>(n) / static_cast<double>(image.pixels.size());
}

std::optional<Finding> noticed_saturation(const Channel& channel) {
  return noticed(Symptom::saturated, share_at_brightest(channel.image), {.at = channel.name});
}

namespace {

/// "301 to 419": rows between others that have one value throughout, which no other row has: they were never recorded,
/// or lost since. Empty: none.
std::string lost_rows(const Image& image) {
  constexpr int kFewest = 8;  // of a narrower picture pixels may be equal by chance
  if (image.width < kFewest) return "";
  std::vector<std::optional<float>> all_equal;
  for (int j = 0; j < image.height; ++j) {
    const auto row = image.pixels.begin() + static_cast<std::ptrdiff_t>(j) * image.width;
    const bool is_even = std::all_of(row, row + image.width, [&](float value) { return value == *row; });
    all_equal.push_back(is_even ? std::optional(*row) : std::nullopt);
  }
  const auto first = std::ranges::find_if(all_equal, [](const auto& value) { return !value; });
  const auto begin = std::find_if(first, all_equal.end(), [](const auto& value) { return value.has_value(); });
  const auto end = std::find_if(begin, all_equal.end(), [&](const auto& value) { return value != *begin; });
  if (end == all_equal.end()) return "";  // the border's are padding
  const auto top = begin - all_equal.begin(), bottom = end - all_equal.begin();
  for (int j = 0; j < image.height; ++j)
    for (int i = 0; i < image.width && (j < top || j >= bottom); ++i)
      if (image.at(i, j) == **begin) return "";
  return std::to_string(top + 1) + " to " + std::to_string(bottom);
}

/// Of the kind of images that lost something.
std::optional<Finding> noticed_lost_rows(const Channel& channel) {
  const std::string lost = lost_rows(channel.image);
  std::optional<Finding> found = noticed(Symptom::lossy_image, lost.empty() ? 0 : 1, {});
  if (found)
    found->text =
        "Rows " + lost + " of " + channel.name + " were lost: they have one value. What is there is not seen.";
  return found;
}

}  // namespace

std::vector<std::optional<Finding>> noticed_in(const Channel& channel) {
  return {noticed_loss(channel), noticed_lost_rows(channel), noticed_saturation(channel),
          noticed(Symptom::assumed_input, channel.image.taken.empty() ? 0 : 1,
                  {.at = channel.name + ": " + channel.image.taken + "."})};
}

std::optional<Finding> noticed_unchecked(const std::vector<const Channel*>& channels, double pixel_size_um) {
  std::string names;
  for (const Channel* channel : channels) {
    if (channel->image.pixel_size_um) return std::nullopt;
    names += (names.empty() ? "" : ", ") + channel->name;
  }
  return noticed(Symptom::pixel_size_unchecked, channels.empty() ? 0 : 1,
                 {.value = brief(pixel_size_um), .at = "none is stated by " + names});
}

std::optional<stage::Doubt> doubt_about_calibration(const Channel& channel, std::optional<double> given_um) {
  if (!given_um || !channel.image.pixel_size_um) return std::nullopt;
  return stage::doubt_about_pixel_size(*given_um, *channel.image.pixel_size_um);
}

Channel read_channel(const std::string& name, const std::filesystem::path& file, const PlaneChoice& plane, int binning,
                     stage::StageContext& context) {
  Channel channel{name, read_image(file, plane)};
  context.notice(take_scan_phase_off(channel));
  channel.image = binned(std::move(channel.image), binning);
  return channel;
}

void notice_image(const Channel& channel, std::optional<double> given_um, stage::StageContext& context) {
  context.doubt(doubt_about_calibration(channel, given_um), channel.name + ": pixel_size_um");
  for (const std::optional<Finding>& found : noticed_in(channel)) context.notice(found);
}

}  // namespace mbtfm::images
