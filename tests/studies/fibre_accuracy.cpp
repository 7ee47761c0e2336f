/// fibre_accuracy drawn FOLDER [name=value …]: fibres of shared/data/real/cell_with_drawn_fibres against the experts'.
/// fibre_accuracy single FOLDER [name=value …]: those of shared/data/actin/single_cells against the skeletons of a
/// published network's maps, within three pixels.
/// fibre_accuracy lines SCENARIO FIRST LAST: the lines of simulated cells at three image qualities, what speaks for
/// each, and whether it is a fibre. fibre_probability.py fits segment/cells/fibre_probability.cpp to them.
#include <cstdio>
#include <cstring>

#include "segment/cells/segment_cell.h"
#include "segment/images/channels.h"
#include "segment/images/image.h"
#include "tests/support/drawn_fibres.h"
#include "tests/support/segmentation_accuracy.h"
#include "tests/support/settings.h"

namespace {

using namespace mbtfm;

cells::SegmentParameters parameters_of(double pixel_um, const std::vector<std::string>& settings) {
  cells::SegmentParameters p;
  p.pixel_size_um = pixel_um;
  stage::ParameterList list;
  declare(list, p);
  test::set_all(list, settings);
  return p;
}

int drawn(const std::filesystem::path& folder, const std::vector<std::string>& settings) {
  constexpr double kPixel_um = 0.1;  // the set states none
  const images::Channel adhesion{"paxillin.tif", images::read_image(folder / "paxillin.tif")};
  const images::Channel actin{"actin.tif", images::read_image(folder / "actin.tif")};
  const Cell cell = cells::segment_cell(adhesion, actin, parameters_of(kPixel_um, settings)).cell;
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

/// Zhang & Suen, Comm ACM 27:236, 1984.
std::vector<Vec2> skeleton_of(images::Image map, float threshold) {
  const auto on = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < map.width && y < map.height && map.at(x, y) > threshold;
  };
  for (bool has_changed = true; has_changed;) {
    has_changed = false;
    for (const int step : {0, 1}) {
      std::vector<std::pair<int, int>> peeled;
      for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x) {
          if (!on(x, y)) continue;
          const bool p[8] = {on(x, y - 1), on(x + 1, y - 1), on(x + 1, y), on(x + 1, y + 1),
                             on(x, y + 1), on(x - 1, y + 1), on(x - 1, y), on(x - 1, y - 1)};
          int n = 0, n_changes = 0;
          for (int i = 0; i < 8; ++i) {
            n += p[i];
            n_changes += !p[i] && p[(i + 1) % 8];
          }
          const bool is_flank = step == 0 ? !(p[0] && p[2] && p[4]) && !(p[2] && p[4] && p[6])
                                          : !(p[0] && p[2] && p[6]) && !(p[0] && p[4] && p[6]);
          if (n >= 2 && n <= 6 && n_changes == 1 && is_flank) peeled.emplace_back(x, y);
        }
      for (const auto& [x, y] : peeled) map.at(x, y) = 0;
      has_changed |= !peeled.empty();
    }
  }
  std::vector<Vec2> points;
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x)
      if (on(x, y)) points.push_back({x + 0.5, y + 0.5});
  return points;
}

double share_near(const std::vector<Vec2>& points, const std::vector<Vec2>& others, double radius) {
  const auto is_near = [&](Vec2 p) {
    return std::ranges::any_of(others, [&](Vec2 q) { return norm(p - q) <= radius; });
  };
  return static_cast<double>(std::ranges::count_if(points, is_near)) / static_cast<double>(points.size());
}

int single(const std::filesystem::path& folder, const std::vector<std::string>& settings) {
  constexpr double kPixel_um = 0.16, kNear_px = 3;  // the set states no size
  double sum = 0;
  const std::vector<std::string> names = {"0000", "0002", "0004", "0006", "0008"};
  for (const std::string& name : names) {
    const images::Channel actin{name, images::read_image(folder / (name + ".jpg"))};
    const Cell cell = cells::segment_cell({}, actin, parameters_of(kPixel_um, settings)).cell;
    std::vector<Vec2> found;
    for (const auto& p : test::line_points(cell.fibres)) found.push_back((1 / kPixel_um) * p.position_um);
    const auto truth = skeleton_of(images::read_image(folder / (name + "_map.png")), 100);
    const double recall = share_near(truth, found, kNear_px), precision = share_near(found, truth, kNear_px);
    const double f = 2 * recall * precision / std::max(1e-9, recall + precision);
    std::printf("%s: %zu fibres, recall %.3f, precision %.3f, F %.3f\n", name.c_str(), cell.fibres.size(), recall,
                precision, f);
    sum += f / static_cast<double>(names.size());
  }
  std::printf("mean F %.3f\n", sum);
  return 0;
}

int lines(const std::string& scenario, int first, int last) {
  for (const std::string quality : {"poor", "ordinary", "good"})
    for (int seed = first; seed <= last; ++seed) {
      const test::SimulatedCell cell = test::simulated_cell(scenario, quality, static_cast<std::uint64_t>(seed));
      const cells::SegmentParameters p;
      const Cell found = segment_cell(cell.adhesion, cell.actin, p).cell;
      const double pixel_um = *cell.actin.image.pixel_size_um;
      const auto traced = cells::trace_fibres(cell.actin.image, found.outline_um, pixel_um, p.fibres);
      for (const auto* some : {&traced.fibres, &traced.rest})
        for (const cells::TracedFibre& line : *some) {
          const bool is_true = test::is_true_fibre(line.fibre, cell.truth.fibres, 0.4);
          std::printf("%s,%s,%d,%d,%.4f", scenario.c_str(), quality.c_str(), seed, is_true, line.fibre.confidence);
          for (const double term : cells::terms_of(line.evidence)) std::printf(",%.4g", term);
          std::printf("\n");
        }
    }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2 && std::strcmp(argv[1], "drawn") == 0) return drawn(argv[2], {argv + 3, argv + argc});
  if (argc > 2 && std::strcmp(argv[1], "single") == 0) return single(argv[2], {argv + 3, argv + argc});
  if (argc == 5 && std::strcmp(argv[1], "lines") == 0) return lines(argv[2], std::atoi(argv[3]), std::atoi(argv[4]));
  std::fprintf(stderr, "fibre_accuracy drawn|single FOLDER [name=value …], or lines SCENARIO FIRST LAST\n");
  return 2;
}
