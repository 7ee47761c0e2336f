#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <string>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "segment/images/image_file.h"
#include "segment/images/stack.h"
#include "segment/images/tiff_handle.h"

namespace mbtfm::images {
namespace {

class TiffReader {
 public:
  explicit TiffReader(const std::filesystem::path& file) : file_(file), tiff_(open_tiff(file, "r", messages_)) {
    if (!tiff_ || !messages_.first_error.empty()) fail("a whole TIFF image");
    go_to(first_full_page());
    of_first_page_ = calibration();
    calibration_ = pixel_size_um(of_first_page_);
  }

  Image read(const PlaneChoice& choice) {
    if (choice.page) return read_page(*choice.page - 1, choice);
    const std::optional<Stack> stated = dimensions(choice);
    const Stack stack = stated.value_or(Stack{.channel_names = {""}, .pages = {first_full_page()}});
    // channels are pages, or else the samples of each pixel
    PlaneChoice of_stack = choice, of_page = choice;
    (stack.n_channels > 1 ? of_page : of_stack).channel.clear();
    std::vector<int> pages = chosen_pages(stack, of_stack, file_.string());
    std::ranges::sort(pages);  // the brightest of slices is the same in any order
    Image image = read_page(pages.front(), of_page);
    require_plausible_bytes(file_, pages.size() * image.pixels.size() * std::max(1, layout_.bits / 8));
    for (std::size_t i = 1; i < pages.size(); ++i) project(image, read_page(pages[i], of_page));
    if (pages.size() > 1)
      image.taken =
          "the maximum of its " + std::to_string(pages.size()) + " slices was taken (" + choice.prefix + "_z = max)";
    else if (!stated && n_pages() > 1)
      image.taken = "it does not state what its " + std::to_string(n_pages()) + " pages are, and page " +
                    std::to_string(pages.front() + 1) + " was taken (" + choice.prefix + "_page)";
    else if (stated && is_ome(of_first_page_.description) && static_cast<int>(stack.pages.size()) < n_pages() &&
             parse_ome(of_first_page_.description).n_images > 1)
      image.taken = "it holds several images, and the first was taken (" + choice.prefix + "_page)";
    if (const std::string sides = stated_not_square(of_first_page_); !sides.empty() && image.taken.empty())
      image.taken = "it states pixels of " + sides + ", which are taken for square ones";
    const auto orientation = tag<std::uint16_t>(TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
    if (orientation != ORIENTATION_TOPLEFT && orientation <= ORIENTATION_LEFTBOT && image.taken.empty())
      image.taken = "its orientation tag (" + std::to_string(orientation) +
                    ") asks for a turned or mirrored picture; it is read as it is stored, as by Fiji";
    return image;
  }

  ImageField field() {
    const Layout first = layout_of(tiff_.get(), file_);
    return {static_cast<int>(first.width), static_cast<int>(first.height), calibration_};
  }

  std::vector<Image> read_slices(PlaneChoice all) {
    all.z = kProjection;
    std::vector<int> pages(static_cast<std::size_t>(n_pages()));
    std::iota(pages.begin(), pages.end(), 0);
    std::erase_if(pages, [&](int page) { return page > 0 && !is_full_page(page); });
    if (const auto stack = dimensions(all)) pages = chosen_pages(*stack, all, file_.string());
    const std::optional<double> z_step = z_step_um(of_first_page_);
    std::vector<Image> slices;
    for (const int page : pages) {
      slices.push_back(read_page(page, all));
      const Image& first = slices.front();
      if (slices.size() == 1) require_plausible_bytes(file_, pages.size() * first.pixels.size());
      slices.back().z_step_um = z_step;
      if (slices.back().width != first.width || slices.back().height != first.height)
        refuse("slices of one size", "slices of different sizes");
    }
    return slices;
  }

 private:
  /// What the description says of channels, slices and frames; nothing of a file of one image.
  std::optional<Stack> dimensions(const PlaneChoice& choice) {
    try {
      return stack_of(of_first_page_.description, {file_.filename().string(), n_pages()});
    } catch (const InvalidData& error) {
      if (n_pages() == 1 && n_imagej_images(of_first_page_.description) == 1) return std::nullopt;
      throw InputError(file_.string() + ": " + error.element, error.expected, error.found,
                       "set " + choice.prefix + "_page to the page that is meant");
    }
  }

  /// Counted once: all pages are gone through for it.
  int n_pages() {
    if (!n_pages_) n_pages_ = static_cast<int>(TIFFNumberOfDirectories(tiff_.get()));
    messages_.first_error.clear();  // of a damaged chain of pages: it counts as far as it goes
    return *n_pages_;
  }

  /// Neither a thumbnail of another page nor a mask of it.
  bool is_full_page(int page) {
    if (!go_to(page)) return true;  // whoever reads it says what is wrong
    return (tag<std::uint32_t>(TIFFTAG_SUBFILETYPE, 0) & (FILETYPE_REDUCEDIMAGE | FILETYPE_MASK)) == 0;
  }

  /// The first of a file without dimensions; the very first if all are thumbnails.
  int first_full_page() {
    if (is_full_page(0)) return 0;
    for (int page = 1; page < n_pages(); ++page)
      if (is_full_page(page)) return page;
    return 0;
  }

  /// From one to the next without those before.
  bool go_to(int page) {
    const int current = static_cast<int>(TIFFCurrentDirectory(tiff_.get()));
    if (page == current) return true;
    if (page > 0 && current == page - 1) return TIFFReadDirectory(tiff_.get()) == 1;
    return TIFFSetDirectory(tiff_.get(), static_cast<tdir_t>(page)) == 1;
  }

  void project(Image& image, const Image& slice) const {
    if (slice.width != image.width || slice.height != image.height)
      refuse("slices of one size", "slices of different sizes");
    for (std::size_t k = 0; k < image.pixels.size(); ++k) image.pixels[k] = std::max(image.pixels[k], slice.pixels[k]);
  }

  Image read_page(int page, const PlaneChoice& choice) {
    const bool is_raw = page > 0 && n_imagej_images(of_first_page_.description) > 1 && n_pages() == 1;
    if (!go_to(is_raw ? 0 : page)) {
      messages_.first_error = std::to_string(n_pages()) + " pages";
      fail("page " + std::to_string(page + 1));
    }
    if (page > 0) {
      if (const auto own = pixel_size_um(calibration())) calibration_ = own;
    }
    layout_ = layout_of(tiff_.get(), file_);
    choose_samples(choice);
    may_lack_pixels_ = choice.may_lack_pixels;
    return is_raw ? read_raw(page) : read();
  }

  /// The samples of a pixel that the channel means: one of them, or the mean of red, green and blue.
  void choose_samples(const PlaneChoice& choice) {
    std::vector<std::string> names(layout_.n_channels);
    if (layout_.is_rgb) {
      if (choice.channel.empty()) return;
      names = kRgbNames;
    }
    layout_.first = static_cast<std::uint16_t>(chosen_channel(names, choice, file_.string()));
    layout_.colours = 1;
  }

  Image read() {
    Image image = empty_image();
    if (layout_.is_planar)
      for (int plane = layout_.first; plane < layout_.first + layout_.colours; ++plane) read_plane(image, plane);
    else
      read_plane(image, 0);
    finish(image);
    return image;
  }

  /// Decoded bytes that a byte of the file can become, at most.
  static std::uint64_t most_by_byte(std::uint16_t compression) {
    switch (compression) {
      case COMPRESSION_NONE:
        return 1;
      case COMPRESSION_PACKBITS:
        return 64;  // 128 bytes of two
      case COMPRESSION_LZW:
        return 4096;  // entries of its table, of more than a byte each
      case COMPRESSION_DEFLATE:
      case COMPRESSION_ADOBE_DEFLATE:
        return kMostByDeflate;
      default:
        return 1u << 16;
    }
  }

  Image empty_image() const {
    const auto compression = tag<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    const std::uint64_t n_samples = static_cast<std::uint64_t>(layout_.width) * layout_.height * layout_.samples;
    require_packed_bytes(file_, n_samples * layout_.bits / 8, most_by_byte(compression));
    Image image;
    image.width = static_cast<int>(layout_.width);
    image.height = static_cast<int>(layout_.height);
    image.pixel_size_um = calibration_;
    image.no_calibration = stated_of_another_size(of_first_page_);
    image.full_scale = full_scale();
    image.is_lossy = compression == COMPRESSION_JPEG || compression == COMPRESSION_OJPEG;
    image.pixels.assign(static_cast<std::size_t>(layout_.width) * layout_.height, 0.0f);
    return image;
  }

  void finish(Image& image) const {
    for (float& value : image.pixels) {
      if (layout_.colours > 1) value /= static_cast<float>(layout_.colours);
      if (layout_.is_inverted) value = static_cast<float>(image.full_scale) - value;
    }
    require_finite(image);
  }

  void require_finite(const Image& image) const {
    const auto lacks_value = [&](float value) {
      return !std::isfinite(value) && !(std::isnan(value) && may_lack_pixels_);
    };
    const auto first = std::ranges::find_if(image.pixels, lacks_value);
    if (first == image.pixels.end()) return;
    const auto at = first - image.pixels.begin(), n = std::ranges::count_if(image.pixels, lacks_value);
    refuse("finite pixel values",
           counted(n, std::isnan(*first) ? "pixel without a value (NaN)" : "infinite pixel",
                   std::isnan(*first) ? "pixels without a value (NaN)" : "infinite pixels") +
               ", the first in column " + std::to_string(at % image.width) + ", row " +
               std::to_string(at / image.width),
           "fill them with what is around, in Fiji by Process > Noise > Remove NaNs..., or crop the image to where it "
           "has values; a registration leaves them at the border");
  }

  /// ImageJ's stacks of more than 4 GB: the planes follow the first page's own without pages of theirs.
  Image read_raw(int plane) {
    const bool is_plain = tag<std::uint16_t>(TIFFTAG_COMPRESSION, COMPRESSION_NONE) == COMPRESSION_NONE &&
                          !layout_.is_planar && layout_.bits % 8 == 0 && !TIFFIsTiled(tiff_.get());
    if (!is_plain) refuse("as many pages as ImageJ says, or plain planes after the first", "one page, packed");
    const std::uint64_t row_bytes = static_cast<std::uint64_t>(layout_.width) * layout_.samples * layout_.bits / 8;
    const std::uint64_t begin = TIFFGetStrileOffset(tiff_.get(), 0) + plane * row_bytes * layout_.height;
    const std::uint64_t needed = begin + row_bytes * layout_.height, size = std::filesystem::file_size(file_);
    if (needed > size) {
      refuse(
          "plane " + std::to_string(plane + 1) + " at bytes " + std::to_string(begin) + " to " + std::to_string(needed),
          "a file of " + std::to_string(size) + " bytes", "it may be truncated: copy or export it again");
    }
    std::ifstream stream(file_, std::ios::binary);
    stream.seekg(static_cast<std::streamoff>(begin));
    Image image = empty_image();
    std::vector<unsigned char> bytes(row_bytes);
    std::vector<float> row(static_cast<std::size_t>(layout_.width) * layout_.samples);
    for (int j = 0; j < image.height; ++j) {
      stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
      if (!stream) fail("a whole image");
      if (TIFFIsByteSwapped(tiff_.get())) swap_samples(bytes);
      unpack(bytes.data(), layout_, row);
      add_row(row, &image.at(0, j), layout_.width);
    }
    finish(image);
    return image;
  }

  void swap_samples(std::vector<unsigned char>& bytes) const {
    const std::size_t n = layout_.bits / 8;
    for (std::size_t i = 0; i + n <= bytes.size(); i += n) std::reverse(&bytes[i], &bytes[i] + n);
  }

  [[noreturn]] void refuse(const std::string& expected, const std::string& found, const std::string& hint = {}) const {
    throw InputError(file_.string(), expected, found, hint);
  }
  [[noreturn]] void fail(const std::string& expected) const {
    refuse(expected, messages_.first_error.empty() ? "damaged data" : messages_.first_error,
           "the file may be truncated or damaged: copy or export it again");
  }

  template <class T>
  T tag(ttag_t name, T otherwise) const {
    return tag_of(tiff_.get(), name, otherwise);
  }

  TiffCalibration calibration() const {
    TiffCalibration result;
    const char* description = nullptr;
    if (TIFFGetField(tiff_.get(), TIFFTAG_IMAGEDESCRIPTION, &description) && description)
      result.description = description;
    float resolution = 0;
    if (TIFFGetField(tiff_.get(), TIFFTAG_XRESOLUTION, &resolution)) result.x_resolution_per_unit = resolution;
    if (TIFFGetField(tiff_.get(), TIFFTAG_YRESOLUTION, &resolution)) result.y_resolution_per_unit = resolution;
    const auto unit = tag<std::uint16_t>(TIFFTAG_RESOLUTIONUNIT, RESUNIT_NONE);
    if (unit == RESUNIT_INCH) result.unit_um = 25400;
    if (unit == RESUNIT_CENTIMETER) result.unit_um = 1e4;
    result.width = static_cast<int>(tag<std::uint32_t>(TIFFTAG_IMAGEWIDTH, 0));
    result.height = static_cast<int>(tag<std::uint32_t>(TIFFTAG_IMAGELENGTH, 0));
    return result;
  }

  double full_scale() const {
    if (layout_.format == SAMPLEFORMAT_IEEEFP) return 0;
    return std::ldexp(1.0, layout_.format == SAMPLEFORMAT_INT ? layout_.bits - 1 : layout_.bits) - 1;
  }

  /// Add the samples of a plane (of all colours, where they lie side by side) to the pixels, block by block.
  void read_plane(Image& image, int plane) {
    const bool is_tiled = TIFFIsTiled(tiff_.get());
    std::uint32_t block_width = layout_.width;
    std::uint32_t block_height = std::min(tag<std::uint32_t>(TIFFTAG_ROWSPERSTRIP, layout_.height), layout_.height);
    if (is_tiled) {
      block_width = tag<std::uint32_t>(TIFFTAG_TILEWIDTH, 0);
      block_height = tag<std::uint32_t>(TIFFTAG_TILELENGTH, 0);
      require_plausible_size(file_, block_width, block_height);
    }
    const auto row_bytes = is_tiled ? TIFFTileRowSize(tiff_.get()) : TIFFScanlineSize(tiff_.get());
    const auto block_bytes = is_tiled ? TIFFTileSize(tiff_.get()) : TIFFStripSize(tiff_.get());
    const std::uint64_t samples = layout_.is_planar ? 1 : layout_.samples;
    const std::uint64_t needed = (samples * layout_.bits * block_width + 7) / 8;
    if (row_bytes <= 0 || block_bytes <= 0 || static_cast<std::uint64_t>(row_bytes) < needed ||
        static_cast<std::uint64_t>(block_bytes) < needed * block_height || samples > 64)
      fail("a readable image");
    require_plausible_bytes(file_, static_cast<std::uint64_t>(block_bytes));
    require_plausible_bytes(file_, samples * block_width * sizeof(float));
    std::vector<unsigned char> block(static_cast<std::size_t>(block_bytes));
    std::vector<float> row(samples * block_width);
    for (std::uint32_t top = 0; top < layout_.height; top += block_height) {
      for (std::uint32_t left = 0; left < layout_.width; left += block_width) {
        const std::uint32_t n_rows = std::min(block_height, layout_.height - top);
        read_block(is_tiled, left, top, plane, block, is_tiled ? block_bytes : row_bytes * n_rows);
        const std::uint32_t n_columns = std::min(block_width, layout_.width - left);
        for (std::uint32_t j = 0; j < n_rows; ++j) {
          unpack(block.data() + static_cast<std::size_t>(j) * row_bytes, layout_, row);
          add_row(row, &image.at(static_cast<int>(left), static_cast<int>(top + j)), n_columns);
        }
      }
    }
  }

  void read_block(bool is_tiled, std::uint32_t left, std::uint32_t top, int plane, std::vector<unsigned char>& block,
                  tmsize_t n_bytes) {
    const auto sample = static_cast<std::uint16_t>(plane);
    messages_.first_error.clear();
    const tmsize_t got = is_tiled ? TIFFReadEncodedTile(tiff_.get(), TIFFComputeTile(tiff_.get(), left, top, 0, sample),
                                                        block.data(), static_cast<tmsize_t>(block.size()))
                                  : TIFFReadEncodedStrip(tiff_.get(), TIFFComputeStrip(tiff_.get(), top, sample),
                                                         block.data(), static_cast<tmsize_t>(block.size()));
    if (got < n_bytes) fail("a whole image of " + std::to_string(layout_.height) + " rows");
  }

  void add_row(const std::vector<float>& row, float* pixels, std::uint32_t n_columns) const {
    const std::size_t stride = layout_.is_planar ? 1 : layout_.samples;
    const std::size_t first = layout_.is_planar ? 0 : layout_.first;
    const std::size_t n_summed = layout_.is_planar ? 1 : layout_.colours;
    for (std::uint32_t i = 0; i < n_columns; ++i)
      for (std::size_t c = first; c < first + n_summed; ++c) pixels[i] += row[i * stride + c];
  }

  std::filesystem::path file_;
  Messages messages_;
  TiffHandle tiff_;
  TiffCalibration of_first_page_;
  std::optional<double> calibration_;
  Layout layout_;
  std::optional<int> n_pages_;
  bool may_lack_pixels_ = false;
};

}  // namespace

std::vector<Image> read_tiff_slices(const std::filesystem::path& file, const PlaneChoice& choice) {
  return TiffReader(file).read_slices(choice);
}

ImageField read_tiff_field(const std::filesystem::path& file) { return TiffReader(file).field(); }

Image read_tiff(const std::filesystem::path& file, const PlaneChoice& choice) { return TiffReader(file).read(choice); }

}  // namespace mbtfm::images
