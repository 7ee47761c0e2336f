/// fibre_accuracy drawn FOLDER [overlay.png]: fibres of shared/data/real/cell_with_drawn_fibres against the experts'.
#include <cstdio>
#include <cstring>

#include "segment/channels.h"
#include "segment/image.h"
#include "segment/segment_cell.h"
#include "tests/support/drawn_fibres.h"

namespace {

using namespace mbtfm;

int drawn(const std::filesystem::path& folder) {
  constexpr double kPixel_um = 0.1;  // the set states none
  segment::SegmentParameters p;
  p.pixel_size_um = kPixel_um;
  const segment::Channel adhesion{"paxillin.tif", segment::read_image(folder / "paxillin.tif")};
  const segment::Channel actin{"actin.tif", segment::read_image(folder / "actin.tif")};
  const Cell cell = segment_cell(adhesion, actin, p).cell;
  const auto truth = test::read_drawn_fibres(folder / "drawn_fibres.csv", kPixel_um);
  const auto score = test::score_drawn(truth, test::line_points(cell.fibres));
  std::printf("%zu fibres\nrecall     %.3f\n", cell.fibres.size(), score.recall);
  for (const auto& [type, recall] : score.recall_of) std::printf("  %-8s %.3f\n", type.c_str(), recall);
  std::printf("precision  %.3f\nright type %.3f\n", score.precision, score.right_type);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2 && std::strcmp(argv[1], "drawn") == 0) return drawn(argv[2]);
  std::fprintf(stderr, "fibre_accuracy drawn FOLDER\n");
  return 2;
}
