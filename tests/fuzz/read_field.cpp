/// Displacement fields of other programs.
#include "segment/beads/given_field.h"
#include "tests/fuzz/target.h"
#include "tests/support/fake_tables.h"

namespace mbtfm::fuzz::field_readers {
namespace {

std::vector<std::string> samples() {
  std::string spreadsheet = "i;x_um;y_um;ux_um;uy_um\n", line = "x_um\ty_um\tux_um\tuy_um\tsigma_um\n";
  for (int i = 0; i < 25; ++i) {
    const std::string place = std::to_string(i % 5) + ";" + std::to_string(i / 5);
    spreadsheet += std::to_string(i) + ";" + place + ";0." + std::to_string(i) + (i == 7 ? ";NaN\n" : ";-0.25\n");
    line += std::to_string(10 * i) + "\t3\t1e-3\t0.5\t0.1\n";
  }
  return {bytes_of(test::write_tables(folder() / "whole").front()), spreadsheet, line};
}

void read(std::string_view bytes) {
  const auto file = fuzz::put("input.csv", bytes);
  beads::TrackParameters in_pixels;
  in_pixels.length_unit = beads::LengthUnit::px;
  in_pixels.pixel_size_um = 0.1;
  fuzz::answer([&] { beads::outwardness(beads::read_given_field(file, {})); });
  fuzz::answer([&] { beads::read_given_field(file, in_pixels); });
}

const bool is_added = add({"field", 20000, samples, read});

}  // namespace
}  // namespace mbtfm::fuzz::field_readers
