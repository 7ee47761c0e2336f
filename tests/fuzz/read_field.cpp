/// Displacement fields of other programs, and tables of conditions.
#include "pipeline/contract/numbers.h"
#include "pipeline/files/foreign_table.h"
#include "segment/beads/given_field.h"
#include "tests/fuzz/target.h"
#include "tests/support/fake_tables.h"

namespace mbtfm::fuzz::field_readers {
namespace {

std::string in_utf16(const std::string& text) {
  std::string bytes = "\xFF\xFE";
  for (const char c : text) bytes += {c, '\0'};
  return bytes;
}

std::vector<std::string> samples() {
  std::string spreadsheet = "i;x_um;y_um;ux_um;uy_um\n", line = "x_um\ty_um\tux_um\tuy_um\tsigma_um\n";
  std::string commas = "sep=;\nx [mm] ; y [mm]; u [mm]; v [mm];;\n", openpiv = "# x\ty\tu\tv\tflags\tmask\n", imagej,
              quoted;
  std::string pivlab =
      "PIVlab\r\nFRAME: 1, conversion factor xy (px -> m): 1e-07, conversion factor uv (px/frame -> m/s): 2\r\n"
      "x [m],y [m],u [m/s],v [m/s],Vector type [-]\r\n";
  std::string davis = "#DaVis 8.1.2 2D-vector 16 5 5 \"\" \"mm\" \"\" \"mm\" \"displacement\" \"pixel\"\r\n";
  std::string tecplot =
      "TITLE = \"a\"\nVARIABLES = \"x [px]\", \"y [px]\"\n\"u [px]\", \"v [px]\", \"CHC\"\nZONE I=5, J=5\n";
  std::string spots = "LABEL,TRACK_ID,POSITION_X,POSITION_Y,FRAME\nLabel,Track,X,Y,Frame\n,,(micron),(micron),\n";
  for (int i = 0; i < 25; ++i) {
    const std::string x = std::to_string(i % 5), y = std::to_string(i / 5), place = x + ";" + y, n = std::to_string(i);
    spreadsheet += n + ";" + place + ";0." + n + (i == 7 ? ";NaN\n" : ";-0.25\n");
    line += std::to_string(10 * i) + "\t3\t1e-3\t0.5\t0.1\n";
    commas += x + ",5 ;" + y + ",25;0," + n + ";-0,25 ;;\n";
    openpiv += "  " + x + ".0000\t" + std::to_string(9 - i / 5) + ".0000\t 0." + n + "\t-1.5D-1\t0.0\t" +
               (i == 7 ? "1.0\n" : "0.0\n");
    imagej += x + " " + y + " 0." + n + " " + (i % 3 == 0 ? "0" : "-9999") + "\n";
    quoted += "\"" + x + ",5\",\"" + y + ",5\",\"0," + n + "\",\"#N/A\"\n";
    pivlab += "1e-7," + n + "e-7,0." + n + ",+3,1\r\n";
    davis += "-" + x + ",5\t" + std::to_string(9 - i / 5) + ",5\t0," + n + "\t-0\r\n";
    tecplot += x + " " + y + " 0." + n + " \xE2\x88\x92" + "1 1\n";
    spots += "ID" + n + "," + std::to_string(i / 2) + "," + x + ".5," + y + ".25," + std::to_string(i % 2) + "\n";
  }
  return {bytes_of(test::write_tables(folder() / "whole").front()),
          spreadsheet,
          line,
          commas,
          openpiv,
          imagej,
          quoted,
          pivlab,
          davis,
          tecplot,
          spots,
          in_utf16(line),
          in_utf16(commas)};
}

/// Numbers as they stand in the table of our own names, where there is no choice. Nothing where there may be.
std::optional<DisplacementField> strictly(const std::filesystem::path& file) {
  try {
    return files::read_displacement(file);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// In the same form, with these cells.
std::string written(const DisplacementField& field, const char* separator, bool has_commas) {
  std::string text;
  for (const char* name : {"x_um", "y_um", "ux_um", "uy_um"})
    text += (text.empty() ? "" : separator) + std::string(name);
  for (const Bead& bead : field) {
    const char* between = "\n";
    for (const double value :
         {bead.position_um.x, bead.position_um.y, bead.displacement_um.x, bead.displacement_um.y}) {
      std::string number = shortest(value);
      if (has_commas) std::ranges::replace(number, '.', ',');
      text += between + number;
      between = separator;
    }
  }
  return text + "\n";
}

void expect_same(const DisplacementField& given, const DisplacementField& strict, const char* how) {
  bool are_same = given.size() == strict.size();
  for (std::size_t k = 0; are_same && k < given.size(); ++k) {
    are_same = given[k].position_um == strict[k].position_um &&
               (!given[k].flag.empty() || given[k].displacement_um == strict[k].displacement_um);
  }
  if (!are_same) throw std::logic_error(std::string("other numbers than those that stand there: ") + how);
}

/// What the strict reader takes is taken with the same numbers or refused, and so it is in any other form.
void expect_meaning_kept(const std::filesystem::path& file) {
  const auto strict = strictly(file);
  if (!strict || strict->empty()) return;
  fuzz::answer([&] { expect_same(beads::read_given_field(file, {}).field, *strict, "as it is"); });
  const struct {
    const char* separator;
    bool has_commas;
    const char* how;
  } forms[] = {{";", true, "semicolons, decimal commas"}, {"\t", false, "tabs"}, {" ", true, "blanks, decimal commas"}};
  for (const auto& form : forms) {
    const auto other = fuzz::put("other.csv", written(*strict, form.separator, form.has_commas));
    fuzz::answer([&] { expect_same(beads::read_given_field(other, {}).field, *strict, form.how); });
  }
}

void read(std::string_view bytes) {
  const auto file = fuzz::put("input.csv", bytes);
  beads::TrackParameters in_pixels;
  in_pixels.length_unit = beads::LengthUnit::px;
  in_pixels.pixel_size_um = 0.1;
  beads::TrackParameters spots;
  spots.pixel_size_um = 0.1;
  spots.relaxed_plane.time = 1, spots.stressed_plane.time = 2;
  fuzz::answer([&] { beads::outwardness(beads::read_given_field(file, spots).field); });
  fuzz::answer([&] { beads::read_given_field(file, in_pixels); });
  fuzz::answer([&] { files::read_records(bytes, "input.csv", "cell", {"cell", "condition"}); });
  fuzz::answer([&] { files::read_records(bytes, "input.csv", "x_um", {"x_um"}); });
  expect_meaning_kept(file);
  const auto array = fuzz::put("u.npy", bytes);
  fuzz::answer([&] { beads::read_given_field(array, in_pixels, images::ImageField{10, 10, {}}); });
}

const bool is_added = add({"field", 20000, samples, read});

}  // namespace
}  // namespace mbtfm::fuzz::field_readers
