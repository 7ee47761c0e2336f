#include <cerrno>
#include <csetjmp>
#include <cstdio>  // jpeglib.h needs it before

#include <jpeglib.h>

#include <cstring>

#include "pipeline/contract/errors.h"
#include "segment/png.h"

namespace mbtfm::segment {
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

}  // namespace

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

}  // namespace mbtfm::segment
