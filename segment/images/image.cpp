#include "segment/images/image.h"

#include <array>
#include <fstream>
#include <string_view>
#include <system_error>

#include "pipeline/contract/errors.h"
#include "pipeline/stage/help.h"
#include "pipeline/stage/parameters.h"
#include "segment/images/image_file.h"
#include "segment/images/stack.h"

namespace mbtfm::images {
namespace {

constexpr const char* kExpected = "a TIFF, PNG or JPEG image";

struct Signature {
  std::string_view bytes;
  std::string_view name;
  bool is_microscopes = false;  ///< which Bio-Formats reads
};
using namespace std::string_view_literals;
constexpr Signature kForeignFormats[] = {{"GIF8"sv, "a GIF image"},
                                         {"BM"sv, "a BMP image"},
                                         {"PK\x03\x04"sv, "a zip archive"},
                                         {"ZISRAWFILE"sv, "a Zeiss CZI file", true},
                                         {"\x70\x00\x00\x00"sv, "a Leica LIF file", true},
                                         {"\xDA\xCE\xBE\x0A"sv, "a Nikon ND2 file", true},
                                         {"\x00\x00\x00\x0CjP  "sv, "a JPEG 2000 image"},
                                         {"\x89HDF"sv, "an HDF5 file"},
                                         {"\x1F\x8B"sv, "a gzip archive"},
                                         {"\x93NUMPY"sv, "a NumPy array"},
                                         {"\xD0\xCF\x11\xE0"sv, "an Olympus OIB or Microsoft file", true}};

std::string microscopes_hint(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  return "in Fiji: File > Import > Bio-Formats, then File > Save As > Tiff; or on the command line: bfconvert '" +
         name + "' '" + file.stem().string() + ".ome.tif'";
}

bool begins_as_tiff(std::string_view head) {
  return head.starts_with("II\x2A\x00"sv) || head.starts_with("MM\x00\x2A"sv) || head.starts_with("II\x2B\x00"sv) ||
         head.starts_with("MM\x00\x2B"sv);
}

std::string head_of(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) throw InputError(file.string(), kExpected, "no such file");
  if (std::filesystem::is_directory(status)) throw InputError(file.string(), kExpected, "a folder");
  if (!std::filesystem::is_regular_file(status))  // to open a pipe is to wait for who writes into it
    throw InputError(file.string(), kExpected, "a pipe, a socket or a device", "save the image as a file");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file.string(), kExpected, "a file that may not be read", "check its permissions");
  std::array<char, 16> bytes{};
  stream.read(bytes.data(), bytes.size());
  return {bytes.data(), static_cast<std::size_t>(stream.gcount())};
}

}  // namespace

namespace {

constexpr std::uint64_t kAlways_bytes = 1u << 28;
constexpr std::uint64_t kPacking = 16;  // camera noise keeps real images from packing below a third
constexpr const char* kTooLarge = "an image of a size that the file's bytes can fill";
constexpr const char* kDamaged = "the file is probably damaged: copy or export it again";

bool can_fill(const std::filesystem::path& file, std::uint64_t n_bytes) {
  return n_bytes <= kAlways_bytes || n_bytes / kPacking <= std::filesystem::file_size(file);
}

std::string in_bytes_of(const std::filesystem::path& file) {
  return " in " + std::to_string(std::filesystem::file_size(file)) + " bytes";
}

}  // namespace

void require_plausible_size(const std::filesystem::path& file, std::uint64_t width, std::uint64_t height) {
  const std::string size = std::to_string(width) + " x " + std::to_string(height) + " pixels";
  if (width == 0 || height == 0) throw InputError(file.string(), "an image of at least one pixel", size);
  constexpr std::uint64_t kLongest = 1u << 30;  // so that products of two sides cannot overflow
  if (width <= kLongest && height <= kLongest && can_fill(file, width * height * sizeof(float))) return;
  throw InputError(file.string(), kTooLarge, size + in_bytes_of(file), kDamaged);
}

void require_plausible_bytes(const std::filesystem::path& file, std::uint64_t n_bytes) {
  if (can_fill(file, n_bytes)) return;
  throw InputError(file.string(), kTooLarge, std::to_string(n_bytes) + " of them" + in_bytes_of(file), kDamaged);
}

void require_packed_bytes(const std::filesystem::path& file, std::uint64_t n_bytes, std::uint64_t most_by_byte) {
  if (n_bytes / most_by_byte <= std::filesystem::file_size(file)) return;
  throw InputError(file.string(), kTooLarge, std::to_string(n_bytes) + " of them" + in_bytes_of(file), kDamaged);
}

Samples chosen_samples(bool is_rgb, const PlaneChoice& choice, const std::filesystem::path& file) {
  if (is_rgb && choice.channel.empty()) return {.first = 0, .n = 3};
  return {.first = chosen_channel(is_rgb ? kRgbNames : std::vector<std::string>{""}, choice, file.string())};
}

Image image_of(const std::vector<unsigned char>& bytes, std::uint32_t width, std::uint32_t height,
               const SampleLayout& layout, const Samples& samples) {
  Image image{.width = static_cast<int>(width), .height = static_cast<int>(height), .pixels = {}, .pixel_size_um = {}};
  image.full_scale = static_cast<double>((1u << layout.bits) - 1);
  image.pixels.resize(static_cast<std::size_t>(width) * height);
  const int sample_bytes = layout.bits == 16 ? 2 : 1;
  for (std::size_t k = 0; k < image.pixels.size(); ++k) {
    const unsigned char* sample = bytes.data() + (k * layout.n_channels + samples.first) * sample_bytes;
    float sum = 0;
    for (int c = 0; c < samples.n; ++c, sample += sample_bytes)
      sum += static_cast<float>(sample_bytes == 2 ? sample[0] << 8 | sample[1] : sample[0]);
    image.pixels[k] = sum / static_cast<float>(samples.n);
  }
  return image;
}

void declare(stage::ParameterList& list, PlaneChoice& choice, const std::string& prefix) {
  choice.prefix = prefix;
  const auto meaning = [image = stage::help_on("plane", prefix)](const char* key) {
    return stage::help_on("plane", key, {image});
  };
  list.add(prefix + "_channel", choice.channel, meaning("channel"));
  list.add(prefix + "_z", choice.z, meaning("z"));
  list.add(prefix + "_time", choice.time, {.low = 1}, meaning("time"));
  list.add(prefix + "_page", choice.page, {.low = 1}, meaning("page"));
}

namespace {

void require_one_page(const std::filesystem::path& file, const PlaneChoice& choice, const std::string& kind) {
  PlaneChoice of_page = choice;
  of_page.channel.clear();
  chosen_pages(Stack{.channel_names = {""}, .pages = {0}}, of_page, file.string());
  if (choice.page.value_or(1) > 1)
    throw InputError(file.string(), "page " + std::to_string(*choice.page), kind + ", which has only one");
}

}  // namespace

Image read_image(const std::filesystem::path& file, const PlaneChoice& choice) {
  const std::string head = head_of(file);
  if (choice.page && *choice.page < 1) throw InputError(file.string(), "a page from 1", std::to_string(*choice.page));
  if (begins_as_tiff(head)) return read_tiff(file, choice);
  if (head.starts_with("\x89PNG")) {
    require_one_page(file, choice, "a PNG image");
    return read_png(file, choice);
  }
  if (head.starts_with("\xFF\xD8\xFF")) {
    require_one_page(file, choice, "a JPEG image");
    return read_jpeg(file, choice);
  }
  for (const Signature& format : kForeignFormats) {
    if (head.starts_with(format.bytes)) {
      const std::string name = file.filename().string();
      throw InputError(file.string(), kExpected, std::string(format.name),
                       format.is_microscopes ? microscopes_hint(file)
                       : format.bytes.ends_with("NUMPY")
                           ? "in Python: tifffile.imwrite('" + file.stem().string() + ".tif', numpy.load('" + name +
                                 "')); in Cellpose: File > Save masks as PNG/tif"
                           : "export it as 8- or 16-bit TIFF");
    }
  }
  throw InputError(file.string(), kExpected, head.empty() ? "an empty file" : "bytes of neither",
                   "export it as 8- or 16-bit TIFF; copy it again if it was one");
}

ImageField read_field(const std::filesystem::path& file) {
  if (is_tiff(file)) return read_tiff_field(file);
  const Image image = read_image(file);
  return {image.width, image.height, image.pixel_size_um};
}

bool is_tiff(const std::filesystem::path& file) { return begins_as_tiff(head_of(file)); }

std::vector<Image> read_slices(const std::filesystem::path& file, const PlaneChoice& choice) {
  if (!is_tiff(file)) throw InputError(file.string(), "a TIFF with a slice in each page", "another file");
  return read_tiff_slices(file, choice);
}

Image binned(Image image, int binning) {
  MBTFM_ASSERT(binning >= 1);
  if (binning == 1) return image;
  Image result{.width = image.width / binning,
               .height = image.height / binning,
               .pixels = {},
               .pixel_size_um = image.pixel_size_um,
               .full_scale = image.full_scale,
               .is_lossy = image.is_lossy};
  if (result.width == 0 || result.height == 0) {
    throw InvalidData("binning", "blocks that fit into the image",
                      std::to_string(binning) + " x " + std::to_string(binning) + " pixels of " +
                          std::to_string(image.width) + " x " + std::to_string(image.height));
  }
  if (result.pixel_size_um) *result.pixel_size_um *= binning;
  result.pixels.reserve(static_cast<std::size_t>(result.width) * result.height);
  for (int row = 0; row < result.height; ++row) {
    for (int column = 0; column < result.width; ++column) {
      double sum = 0;
      for (int j = 0; j < binning; ++j)
        for (int i = 0; i < binning; ++i) sum += image.at(column * binning + i, row * binning + j);
      result.pixels.push_back(static_cast<float>(sum / (binning * binning)));
    }
  }
  return result;
}

}  // namespace mbtfm::images
