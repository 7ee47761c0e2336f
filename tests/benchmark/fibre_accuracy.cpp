/// fibre_accuracy drawn FOLDER [name=value …]: fibres of shared/data/real/cell_with_drawn_fibres against the experts'.
#include <cstdio>
#include <cstring>

#include "segment/channels.h"
#include "segment/image.h"
#include "segment/segment_cell.h"
#include "tests/support/drawn_fibres.h"

namespace {

using namespace mbtfm;

int drawn(const std::filesystem::path& folder, const std::vector<std::string>& settings) {
  constexpr double kPixel_um = 0.1;  // the set states none
  segment::SegmentParameters p;
  p.pixel_size_um = kPixel_um;
  ParameterList list;
  declare(list, p);
  for (const std::string& s : settings)
    set_from_text(parameter_named(list, s.substr(0, s.find('='))), s.substr(s.find('=') + 1));
  const segment::Channel adhesion{"paxillin.tif", segment::read_image(folder / "paxillin.tif")};
  const segment::Channel actin{"actin.tif", segment::read_image(folder / "actin.tif")};
  const Cell cell = segment_cell(adhesion, actin, p).cell;
  const auto truth = test::read_drawn_fibres(folder / "drawn_fibres.csv", kPixel_um);
  const auto score = test::score_drawn(truth, test::line_points(cell.fibres));
  const auto even = test::score_drawn(test::with_even_directions(truth), test::line_points(cell.fibres));
  std::printf("%zu fibres; directions of the drawing as they are, and their mean over 1.5 um\n", cell.fibres.size());
  std::printf("recall      %.3f  %.3f\n", score.recall, even.recall);
  for (const auto& [type, recall] : score.recall_of)
    std::printf("  %-9s %.3f  %.3f\n", type.c_str(), recall, even.recall_of.at(type));
  std::printf("precision   %.3f  %.3f\nright type  %.3f  %.3f\n", score.precision, even.precision, score.right_type,
              even.right_type);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2 && std::strcmp(argv[1], "drawn") == 0) return drawn(argv[2], {argv + 3, argv + argc});
  std::fprintf(stderr, "fibre_accuracy drawn FOLDER [name=value …]\n");
  return 2;
}
