/// Inside of the image reader: what its TIFF, PNG and JPEG parts share.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "segment/images/image.h"

namespace mbtfm::images {

/// Read a plane of a file that begins as a TIFF. @throws InputError
Image read_tiff(const std::filesystem::path& file, const PlaneChoice& choice);

/// Of its first page. @throws InputError
ImageField read_tiff_field(const std::filesystem::path& file);

/// All its slices. @throws InputError
std::vector<Image> read_tiff_slices(const std::filesystem::path& file, const PlaneChoice& choice);

/// Read a file that begins as a PNG; of RGB the mean where no channel is chosen. @throws InputError
Image read_png(const std::filesystem::path& file, const PlaneChoice& choice);

/// Read a file that begins as a JPEG, grey or RGB, of which the mean where no channel is chosen. @throws InputError
Image read_jpeg(const std::filesystem::path& file, const PlaneChoice& choice);

/// The samples of a pixel whose mean is its grey value: one channel, or red, green and blue where none is chosen.
struct Samples {
  int first = 0, n = 1;
};
/// @throws InputError
Samples chosen_samples(bool is_rgb, const PlaneChoice& choice, const std::filesystem::path& file);

/// How the samples of a pixel lie in bytes; those of 16 bits big-endian.
struct SampleLayout {
  int n_channels = 1, bits = 8;
};
Image image_of(const std::vector<unsigned char>& bytes, std::uint32_t width, std::uint32_t height,
               const SampleLayout& layout, const Samples& samples);

/// Refuse a size that a damaged header makes up, before memory is taken for it.
///
/// Up to 2^26 pixels (256 MiB as float) any file may claim, since an even image packs almost without limit. More than
/// that needs a sixteenth of the decoded bytes in the file: camera noise keeps real images from packing below a third.
/// @throws InputError
void require_plausible_size(const std::filesystem::path& file, std::uint64_t width, std::uint64_t height);

/// The same of the bytes that an image, a block of it or a stack of slices takes once decoded: up to 2^28 always, more
/// than that a sixteenth of them in the file.
/// @throws InputError
void require_plausible_bytes(const std::filesystem::path& file, std::uint64_t n_bytes);

/// The same where it is known what a byte of the file can become at most.
/// @param most_by_byte  decoded bytes
/// @throws InputError
void require_packed_bytes(const std::filesystem::path& file, std::uint64_t n_bytes, std::uint64_t most_by_byte);
inline constexpr std::uint64_t kMostByDeflate = 1032;  // 258 bytes of two bits

/// The image's calibration as its TIFF tags state it.
struct TiffCalibration {
  std::string description;                      ///< ImageDescription; empty: none
  std::optional<double> x_resolution_per_unit;  ///< XResolution
  std::optional<double> y_resolution_per_unit;  ///< YResolution
  std::optional<double> unit_um;                ///< ResolutionUnit: of an inch or a centimetre
  int width = 0, height = 0;                    ///< of the page; 0: not compared
};

/// The pixel size: OME-XML's PhysicalSizeX, ImageJ's unit with XResolution, Volocity's XCalibrationMicrons, or the
/// file's own resolution by inch or centimetre (SlideBook) if a microscope has such pixels: 72 an inch are a screen's.
/// Nothing if none of them is there, pixels are not square, or stated_of_another_size().
std::optional<double> pixel_size_um(const TiffCalibration& calibration);

/// "one of 360 x 360 pixels, and the picture has 180 x 180" if the OME-XML describes a picture of another size: this
/// one was binned or cropped since, and its pixel size may be another one. Empty if not.
std::string stated_of_another_size(const TiffCalibration& calibration);

/// "0.1 x 0.2 um" where that is what it states; else empty.
std::string stated_not_square(const TiffCalibration& calibration);

/// The distance of slices: OME-XML's PhysicalSizeZ, ImageJ's spacing in its unit, Volocity's ZCalibrationMicrons.
std::optional<double> z_step_um(const TiffCalibration& calibration);

/// The value of `key=value` at the start of a line; lines end as Unix, DOS or the old Macintosh (Volocity) ends them.
std::optional<std::string_view> line_value(std::string_view text, std::string_view key);

struct FileCloser {
  void operator()(std::FILE* stream) const { std::fclose(stream); }
};
using FileHandle = std::unique_ptr<std::FILE, FileCloser>;

}  // namespace mbtfm::images
