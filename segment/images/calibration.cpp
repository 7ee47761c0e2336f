#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string_view>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/parsed.h"
#include "pipeline/contract/range.h"
#include "segment/images/image_file.h"
#include "segment/images/stack.h"

namespace mbtfm::images {
namespace {

/// Length of a unit in um, by the spellings of OME, ImageJ and its plug-ins; µ as U+00B5, U+03BC, Latin-1 or escaped.
std::optional<double> unit_um(std::string_view unit) {
  static const std::map<std::string_view, double> known = {
      {"um", 1},           {"\xC2\xB5m", 1},    {"\xCE\xBCm", 1},     {"\xB5m", 1},         {"\\u00B5m", 1},
      {"\\u00b5m", 1},     {"\\u03BCm", 1},     {"\\u03bcm", 1},      {"micron", 1},        {"microns", 1},
      {"micrometer", 1},   {"micrometers", 1},  {"micrometre", 1},    {"micrometres", 1},   {"nm", 1e-3},
      {"nanometer", 1e-3}, {"nanometre", 1e-3}, {"nanometers", 1e-3}, {"nanometres", 1e-3}, {"pm", 1e-6},
      {"mm", 1e3},         {"millimeter", 1e3}, {"millimetre", 1e3},  {"cm", 1e4},          {"m", 1e6},
      {"inch", 25400},     {"inches", 25400},   {"in", 25400},        {"\xC3\x85", 1e-4},   {"angstrom", 1e-4}};
  const auto found = known.find(unit);
  return found == known.end() ? std::nullopt : std::optional(found->second);
}

std::optional<double> positive_number(std::string_view text) {
  const auto value = parsed<double>(text);
  return value && std::isfinite(*value) && *value > 0 ? value : std::nullopt;
}

struct PixelSize {
  double x_um = 0;
  double y_um = 0;
};

std::optional<double> ome_size_um(const std::string& size, const std::string& unit) {
  const auto number = positive_number(size);
  const auto in_um = unit_um(unit.empty() ? "um" : unit);
  return number && in_um ? std::optional(*number * *in_um) : std::nullopt;
}

/// Nothing if the text is damaged.
std::optional<OmeImage> ome_in(const std::string& xml) {
  try {
    return parse_ome(xml);
  } catch (const InvalidData&) {
    return std::nullopt;
  }
}

bool is_of_another_size(const OmeImage& ome, const TiffCalibration& c) {
  return c.width > 0 && ome.width > 0 && ome.height > 0 && (ome.width != c.width || ome.height != c.height);
}

std::optional<PixelSize> ome_pixel_size(const TiffCalibration& calibration) {
  const std::optional<OmeImage> ome = ome_in(calibration.description);
  if (!ome || is_of_another_size(*ome, calibration)) return std::nullopt;
  const auto x_um = ome_size_um(ome->size_x, ome->unit_x);
  if (!x_um) return std::nullopt;
  return PixelSize{*x_um, ome_size_um(ome->size_y, ome->unit_y).value_or(*x_um)};
}

/// Programs that know of no microscope write what a screen or a printer has: 72, 96 or 300 pixels by inch.
constexpr double kInch_um = 25400;

std::optional<PixelSize> size_by_resolution(const TiffCalibration& calibration, std::optional<double> unit_um) {
  if (!unit_um || !calibration.x_resolution_per_unit) return std::nullopt;
  const double x_um = *unit_um / *calibration.x_resolution_per_unit;
  if (!std::isfinite(x_um) || x_um <= 0) return std::nullopt;
  return PixelSize{x_um, *unit_um / calibration.y_resolution_per_unit.value_or(*calibration.x_resolution_per_unit)};
}

std::optional<PixelSize> of_a_microscope(std::optional<PixelSize> size) {
  const Range range = Range::pixel_um();
  return size && size->x_um >= range.low && size->x_um <= range.high ? size : std::nullopt;
}

std::optional<PixelSize> imagej_pixel_size(const TiffCalibration& calibration) {
  const auto name = line_value(calibration.description, "unit");
  const auto unit = name ? unit_um(*name) : std::nullopt;
  const std::optional<PixelSize> size = size_by_resolution(calibration, unit);
  return unit == kInch_um ? of_a_microscope(size) : size;
}

std::optional<PixelSize> volocity_pixel_size(std::string_view description) {
  const auto x_um = positive_number(line_value(description, "XCalibrationMicrons").value_or(""));
  if (!x_um) return std::nullopt;
  return PixelSize{*x_um, positive_number(line_value(description, "YCalibrationMicrons").value_or("")).value_or(*x_um)};
}

std::optional<double> ome_z_step_um(const std::string& xml) {
  const std::optional<OmeImage> ome = ome_in(xml);
  return ome ? ome_size_um(ome->size_z, ome->unit_z) : std::nullopt;
}

std::optional<double> imagej_z_step_um(std::string_view description) {
  const auto name = line_value(description, "unit");
  const auto unit = name ? unit_um(*name) : std::nullopt;
  const auto spacing = positive_number(line_value(description, "spacing").value_or(""));
  return unit && spacing ? std::optional(*unit * *spacing) : std::nullopt;
}

/// Six significant digits: resolutions are stored as ratios (and read as float), so 0.1625 comes back as 0.16250000411.
double without_ratio_noise(double value) {
  const double scale = std::pow(10.0, 5 - std::floor(std::log10(value)));
  return std::round(value * scale) / scale;
}

}  // namespace

std::optional<std::string_view> line_value(std::string_view text, std::string_view key) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
    const std::string_view line = text.substr(at, end - at);
    if (line.size() > key.size() && line.starts_with(key) && line[key.size()] == '=')
      return line.substr(key.size() + 1);
    at = end + 1;
  }
  return std::nullopt;
}

namespace {

std::optional<PixelSize> stated_size(const TiffCalibration& calibration) {
  const std::string& text = calibration.description;
  std::optional<PixelSize> size;
  if (is_ome(text)) size = ome_pixel_size(calibration);
  if (!size && text.starts_with("ImageJ=")) size = imagej_pixel_size(calibration);
  if (!size) size = volocity_pixel_size(text);
  if (!size && !text.starts_with("ImageJ=") && !is_ome(text))
    size = of_a_microscope(size_by_resolution(calibration, calibration.unit_um));
  return size;
}

/// Half a per cent: what two roundings to three digits may differ by.
bool is_square(const PixelSize& size) { return std::abs(size.x_um - size.y_um) <= 5e-3 * size.x_um; }

}  // namespace

std::optional<double> pixel_size_um(const TiffCalibration& calibration) {
  const std::optional<PixelSize> size = stated_size(calibration);
  return size && is_square(*size) ? std::optional(without_ratio_noise(size->x_um)) : std::nullopt;
}

std::string stated_not_square(const TiffCalibration& calibration) {
  const std::optional<PixelSize> size = stated_size(calibration);
  if (!size || is_square(*size) || !of_a_microscope(size) || !of_a_microscope(PixelSize{size->y_um, size->x_um}))
    return "";
  return shortest(without_ratio_noise(size->x_um)) + " x " + shortest(without_ratio_noise(size->y_um)) + " um";
}

std::string stated_of_another_size(const TiffCalibration& calibration) {
  if (!is_ome(calibration.description)) return "";
  const std::optional<OmeImage> ome = ome_in(calibration.description);
  if (!ome || !is_of_another_size(*ome, calibration)) return "";
  return "one of " + std::to_string(ome->width) + " x " + std::to_string(ome->height) +
         " pixels, and the picture has " + std::to_string(calibration.width) + " x " +
         std::to_string(calibration.height);
}

std::optional<double> z_step_um(const TiffCalibration& calibration) {
  const std::string& text = calibration.description;
  if (is_ome(text)) return ome_z_step_um(text);
  if (text.starts_with("ImageJ=")) return imagej_z_step_um(text);
  return positive_number(line_value(text, "ZCalibrationMicrons").value_or(""));
}

}  // namespace mbtfm::images
