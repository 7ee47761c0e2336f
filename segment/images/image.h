/// Images as microscopes and ImageJ write them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::images {

/// A grey image, row by row from the top.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<float> pixels;
  std::optional<double> pixel_size_um;   ///< from the file's own calibration
  double full_scale = 0;                 ///< the value at which the detector saturates; 0: none (float)
  bool is_lossy = false;                 ///< as a JPEG is: intensities, and with them positions, are not the camera's
  std::optional<double> z_step_um = {};  ///< to the next slice of its stack, from the file's own calibration
  std::string no_calibration = {};  ///< why the calibration that the file states does not count; empty: it has none
  std::string taken = {};           ///< which plane, if the file has several and none was chosen
  float at(int column, int row) const { return pixels[static_cast<std::size_t>(row) * width + column]; }
  float& at(int column, int row) { return pixels[static_cast<std::size_t>(row) * width + column]; }
};

inline const std::string kProjection = "max";

enum class PixelsAre { intensities, labels };

/// Which plane of a file is meant.
struct PlaneChoice {
  std::string prefix = "image";  ///< of its parameters' names, for hints
  std::string channel = {};      ///< number from 1, or name; empty: the only one, and of an RGB image the mean
  std::string z = kProjection;   ///< a slice from 1, or the brightest of all: what is bright is in focus somewhere
  std::optional<int> time = {};  ///< frame from 1; unset: the only one
  std::optional<int> page = {};  ///< from 1, as it lies in the file, whatever it shows; unset: by the other three
  bool may_lack_pixels = false;  ///< NaN is a pixel without a value, and not an error
  PixelsAre pixels = PixelsAre::intensities;
};
/// PREFIX_channel, PREFIX_z, PREFIX_time and PREFIX_page.
void declare(stage::ParameterList& list, PlaneChoice& choice, const std::string& prefix);

/// Read a plane of a TIFF (8 or 16 bit, float; any libtiff compression), a PNG or a JPEG.
///
/// Dimensions: OME-XML, ImageJ; of a file that states none, page 1. Samples of a pixel that are not red, green and blue
/// are channels. Calibration: OME PhysicalSizeX, ImageJ unit + resolution, Volocity.
/// @throws InputError naming the file and what it is instead, and where several channels or frames are there and none
/// was chosen; reads no more memory than the file can fill
Image read_image(const std::filesystem::path& file, const PlaneChoice& choice = {});
/// A page, from 0, as it lies in the file.
inline Image read_image(const std::filesystem::path& file, int page) { return read_image(file, {.page = page + 1}); }

/// Size and calibration, of a file of several planes those of the first page: of a TIFF without its pixels.
struct ImageField {
  int width = 0, height = 0;
  std::optional<double> pixel_size_um;
};
/// @throws InputError as read_image
ImageField read_field(const std::filesystem::path& file);

/// By its first bytes. @throws InputError where the file cannot be read
bool is_tiff(const std::filesystem::path& file);

/// All slices of a TIFF of one channel and frame, whatever the choice says of z, from the first on; all pages of a file
/// that states no dimensions.
/// @throws InputError as read_image, and where the file is no TIFF or its slices are not of one size
std::vector<Image> read_slices(const std::filesystem::path& file, const PlaneChoice& choice);

// Of a side in one: beyond it no bead and no adhesion is left.
inline constexpr int kLargestBinning = 16;
/// The means of blocks of `binning` x `binning` pixels, with the calibration that follows; what fills no block at the
/// right and at the bottom is left out.
/// @throws InvalidData where not a single block fits
Image binned(Image image, int binning);

/// 16-bit TIFF, deflate, with ImageJ's calibration. Values are rounded and clamped to 0 … 65535.
/// @throws OutputError
void write_tiff(const std::filesystem::path& file, const Image& image);
/// The slices of a stack as ImageJ writes them, with the pixel size and z step of the first.
/// @throws OutputError
void write_tiff(const std::filesystem::path& file, const std::vector<Image>& slices);

}  // namespace mbtfm::images
