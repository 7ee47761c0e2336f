#include <cerrno>
#include <csetjmp>
#include <cstdio>  // jpeglib.h needs it before

#include <jpeglib.h>

#include <cstring>
#include <vector>

#include "pipeline/contract/errors.h"
#include "segment/images/image_file.h"
#include "segment/images/png.h"

namespace mbtfm::images {
namespace {

/// What libjpeg calls in place of its own exit().
struct Failure {
  jpeg_error_mgr manager;
  std::jmp_buf back;
  char message[JMSG_LENGTH_MAX] = "";
};

void fail(j_common_ptr jpeg) {
  auto* failure = reinterpret_cast<Failure*>(jpeg->err);  // its first member
  failure->manager.format_message(jpeg, failure->message);
  std::longjmp(failure->back, 1);
}

bool write_all(jpeg_compress_struct& jpeg, Failure& failure, std::FILE* stream, const Picture& picture) {
  if (setjmp(failure.back)) return false;
  jpeg_create_compress(&jpeg);
  jpeg_stdio_dest(&jpeg, stream);
  jpeg.image_width = static_cast<JDIMENSION>(picture.width);
  jpeg.image_height = static_cast<JDIMENSION>(picture.height);
  jpeg.input_components = 3;
  jpeg.in_color_space = JCS_RGB;
  jpeg_set_defaults(&jpeg);
  // the last quality at which fibres of one pixel's width show no blocks; twice the bytes at 90
  jpeg_set_quality(&jpeg, 80, TRUE);
  jpeg_start_compress(&jpeg, TRUE);
  while (jpeg.next_scanline < jpeg.image_height) {
    auto* row = const_cast<JSAMPLE*>(picture.rgb.data() + std::size_t{3} * jpeg.next_scanline * jpeg.image_width);
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  return true;
}

/// Data that end early or contradict themselves: libjpeg would go on, with grey for what it has not.
void fail_on_damage(j_common_ptr jpeg, int level) {
  if (level < 0) fail(jpeg);
}

/// A progressive image may pass over all its pixels again and again, in a file of some bytes. Encoders make some ten
/// passes.
void limit_passes(j_common_ptr jpeg) {
  constexpr int kMost = 100;
  auto* failure = reinterpret_cast<Failure*>(jpeg->err);
  if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number <= kMost) return;
  std::snprintf(failure->message, sizeof failure->message, "more than %d passes", kMost);
  std::longjmp(failure->back, 1);
}

/// libjpeg's state; everything that a longjmp must not skip lives here, outside of the functions that jump.
struct JpegReading {
  Failure failure{};
  jpeg_progress_mgr progress{};
  jpeg_decompress_struct jpeg{};
  std::vector<JSAMPLE> bytes;
  JpegReading() {
    jpeg.err = jpeg_std_error(&failure.manager);
    failure.manager.error_exit = fail;
    failure.manager.emit_message = fail_on_damage;
    progress.progress_monitor = limit_passes;
  }
  JpegReading(const JpegReading&) = delete;
  ~JpegReading() { jpeg_destroy_decompress(&jpeg); }
};

bool read_jpeg_header(JpegReading& r, std::FILE* stream) {
  if (setjmp(r.failure.back)) return false;
  jpeg_create_decompress(&r.jpeg);
  r.jpeg.progress = &r.progress;
  jpeg_stdio_src(&r.jpeg, stream);
  jpeg_read_header(&r.jpeg, TRUE);
  return true;
}

bool read_jpeg_rows(JpegReading& r) {
  if (setjmp(r.failure.back)) return false;
  jpeg_start_decompress(&r.jpeg);
  const std::size_t row_bytes = static_cast<std::size_t>(r.jpeg.output_width) * r.jpeg.output_components;
  while (r.jpeg.output_scanline < r.jpeg.output_height) {
    JSAMPLE* row = r.bytes.data() + r.jpeg.output_scanline * row_bytes;
    jpeg_read_scanlines(&r.jpeg, &row, 1);
  }
  jpeg_finish_decompress(&r.jpeg);
  return true;
}

}  // namespace

Image read_jpeg(const std::filesystem::path& file, const PlaneChoice& choice) {
  const FileHandle stream(std::fopen(file.c_str(), "rb"));
  if (!stream) throw InputError(file.string(), "a readable JPEG image", "a file that cannot be opened");
  JpegReading r;
  const auto expect = [&](bool is_read) {
    if (is_read) return;
    throw InputError(file.string(), "a whole JPEG image", r.failure.message[0] ? r.failure.message : "damaged data",
                     "the file may be truncated or damaged: copy or export it again");
  };
  expect(read_jpeg_header(r, stream.get()));
  const J_COLOR_SPACE kind = r.jpeg.jpeg_color_space;
  if (kind != JCS_GRAYSCALE && kind != JCS_YCbCr && kind != JCS_RGB) {
    throw InputError(file.string(), "a grey or RGB image", "a JPEG image in the colours of a printer",
                     "export it as 8- or 16-bit TIFF");
  }
  const bool is_rgb = kind != JCS_GRAYSCALE;
  r.jpeg.out_color_space = is_rgb ? JCS_RGB : JCS_GRAYSCALE;
  const int n_channels = is_rgb ? 3 : 1;
  require_plausible_size(file, r.jpeg.image_width, r.jpeg.image_height);
  const std::size_t n_bytes = static_cast<std::size_t>(r.jpeg.image_width) * r.jpeg.image_height * n_channels;
  require_plausible_bytes(file, n_bytes);
  constexpr std::uint64_t kMostByJpeg = 3 * 64 * 8;  // a bit at least for 8 x 8 pixels of three colours
  require_packed_bytes(file, n_bytes, kMostByJpeg);
  r.bytes.resize(n_bytes);
  const Samples samples = chosen_samples(is_rgb, choice, file);
  expect(read_jpeg_rows(r));
  Image image = image_of(r.bytes, r.jpeg.image_width, r.jpeg.image_height, {.n_channels = n_channels}, samples);
  image.is_lossy = true;
  return image;
}

void write_jpeg(const std::filesystem::path& file, const Picture& picture) {
  std::FILE* stream = std::fopen(file.c_str(), "wb");
  if (!stream) throw OutputError(file.string() + ": cannot be written: " + std::strerror(errno));
  Failure failure{};
  jpeg_compress_struct jpeg{};
  jpeg.err = jpeg_std_error(&failure.manager);
  failure.manager.error_exit = fail;
  bool is_written = write_all(jpeg, failure, stream, picture);
  jpeg_destroy_compress(&jpeg);
  is_written = std::fclose(stream) == 0 && is_written;  // a full disk shows here at the latest
  if (!is_written) throw OutputError(file.string() + ": cannot be written: " + failure.message);
}

}  // namespace mbtfm::images
