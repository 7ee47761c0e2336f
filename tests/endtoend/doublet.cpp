/// Real beads and actin of two cells on an H-shaped adhesive pattern, without an adhesion image: forces on candidates
/// all over the pattern, beside what optical flow and Fourier tractions give of the same images.
#include <iostream>

#include "pipeline/contract/numbers.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/report/results.h"
#include "segment/images/image.h"
#include "segment/rois/roi.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

const fs::path kData = test::source_folder() / "../shared/data/real/doublet_on_h";
constexpr double kPixel_um = 0.108;

/// The bundles that the eye sees in the actin image: two along the bars of the H, two along the free edges between
/// them.
const std::map<std::string, Polyline> kFibres = {
    {"ventral 1", {{33.9, 36.9}, {34.4, 44}, {34.5, 51}, {34.3, 61}, {33.6, 68.5}}},
    {"ventral 2", {{71.9, 37.5}, {72.4, 44}, {72.6, 58}, {73.1, 64.8}, {73.0, 68.5}}},
    {"edge 3", {{36.5, 36.1}, {41.8, 40.2}, {46.8, 41.6}, {51, 41.9}, {57.8, 41.4}, {63.3, 39.3}, {70, 35.4}}},
    {"edge 4",
     {{37.9, 72},
      {42.5, 66.9},
      {46.4, 65.7},
      {49.6, 65},
      {52.3, 65.2},
      {57.6, 65.1},
      {62.4, 67},
      {67, 69.6},
      {70.4, 71.5}}}};

void write_fibres_of_hand(const fs::path& file) {
  std::vector<rois::Roi> rois;
  for (const auto& [name, line] : kFibres) {
    rois::Roi roi;
    roi.shape = rois::RoiShape::polyline;
    roi.name = name;
    for (const Vec2 p : line) roi.points_px.push_back(1 / kPixel_um * p - Vec2{0.5, 0.5});  // from pixel centres
    rois.push_back(roi);
  }
  rois::write_roi_set(file, rois);
}

Vec2 middle_of_pattern_um() {
  const images::Image h = images::read_image(kData / "pattern_derived.tif");
  Vec2 low{1e9, 1e9}, high{-1e9, -1e9};
  for (int j = 0; j < h.height; ++j)
    for (int i = 0; i < h.width; ++i) {
      if (h.at(i, j) == 0) continue;
      low = {std::min(low.x, double(i)), std::min(low.y, double(j))};
      high = {std::max(high.x, i + 1.0), std::max(high.y, j + 1.0)};
    }
  return 0.5 * kPixel_um * (low + high);
}

enum class Fibres { traced, drawn };
enum class Outline { mask, found };

struct Answer {
  Vec2 quadrant_nN[2][2];  ///< top/bottom, left/right
  std::map<int, Tension> tensions;
  std::map<int, double> by_segmentation_nN;  ///< of the error budget
  Cell cell;
  FitSummary fit;
  double largest_displacement_um = 0, strain_energy_pJ = 0;
  test::Outcome outcome;
};

Answer run(Fibres fibres, Outline outline, double thickness_um = 60) {
  const test::TemporaryFolder folder;
  const fs::path cell = folder / "doublet";
  fs::create_directories(cell);
  for (const char* file : {"actin.tif", "beads_relaxed.tif", "beads_stressed.tif"}) fs::copy(kData / file, cell / file);
  fs::copy(kData / "pattern_derived.tif", cell / "adhesion_mask.tif");
  if (outline == Outline::mask) fs::copy(kData / "mask.tif", cell / "outline_mask.tif");
  if (fibres == Fibres::drawn) write_fibres_of_hand(cell / "fibres.zip");
  std::ofstream(cell / "cell.toml") << "pixel_size_um = " << kPixel_um
                                    << "\n[gel]\nyoungs_modulus_kPa = 19.66\npoisson_ratio = 0.5\nthickness_um = "
                                    << thickness_um << "\n[segment]\nadhesions = \"pattern\"\n"
                                    << "[images]\ncell_with = \"relaxed\"\n";  // the pattern was found from the beads
  Answer answer;
  answer.outcome = test::run_program("mbtfm run '" + cell.string() + "' --threads 2");
  EXPECT_EQ(answer.outcome.code, 0) << answer.outcome.output;
  if (answer.outcome.code != 0) return answer;
  answer.cell = files::read_cell(cell / "1_segment");
  std::map<int, Vec2> place;
  for (const Adhesion& a : answer.cell.adhesions) place[a.adhesion_id] = a.position_um;
  const Vec2 middle = middle_of_pattern_um();
  const std::vector<AdhesionForce> forces = files::read_adhesion_forces(cell / "4_fit/adhesion_forces.csv");
  for (const AdhesionForce& f : forces) {
    const Vec2 at = place.at(f.adhesion_id);
    answer.quadrant_nN[at.y > middle.y][at.x > middle.x] += f.force_nN;
  }
  for (const Tension& t : files::read_tensions(cell / "4_fit/tensions.csv")) answer.tensions[t.fibre_id] = t;
  answer.fit = files::read_fit_summary(cell / "4_fit/fit.json");
  if (answer.fit.error_budget)
    for (const TensionError& t : answer.fit.error_budget->tensions)
      answer.by_segmentation_nN[t.fibre_id] = t.parts_nN.segmentation;
  const DisplacementField field = files::read_displacement(cell / "2_track/displacement.csv");
  for (const Bead& b : field)
    if (b.flag.empty())
      answer.largest_displacement_um = std::max(answer.largest_displacement_um, norm(b.displacement_um));
  answer.strain_energy_pJ = report::figure_of(answer.fit, "strain_energy_fJ").value_or(0) / 1000;
  return answer;
}

void print(const char* title, const Answer& a) {
  std::cout << title << ": quadrants (nN)";
  for (const auto& row : a.quadrant_nN)
    for (const Vec2 f : row) std::cout << " (" << brief(f.x) << ", " << brief(f.y) << ")";
  std::cout << "; total " << brief(a.fit.total_force_nN) << " nN, surface tension "
            << brief(a.fit.network_surface_tension_nN_per_um) << " nN/um, relative L2 " << brief(a.fit.relative_l2)
            << " (noise " << brief(a.fit.expected_relative_l2) << "), largest displacement "
            << brief(a.largest_displacement_um) << " um, strain energy " << brief(a.strain_energy_pJ) << " pJ\n";
  for (const Fibre& f : a.cell.fibres) {
    const auto t = a.tensions.find(f.fibre_id);
    if (t == a.tensions.end()) continue;
    const auto by = a.by_segmentation_nN.find(f.fibre_id);
    std::cout << "  " << name_of(f.type) << " " << f.fibre_id << ": " << brief(t->second.tension_nN) << " nN ("
              << brief(t->second.low_nN.value_or(0)) << " to " << brief(t->second.high_nN.value_or(0))
              << "; by segmentation " << brief(by == a.by_segmentation_nN.end() ? 0 : by->second) << ")\n";
  }
}

/// Published of the same images, by optical flow and half-space Fourier tractions.
constexpr Vec2 kQuadrants_nN[2][2] = {{{88, 154}, {-68, 85}}, {{67, -153}, {-65, -98}}};

/// Sums of tractions over a quadrant vary by a tenth or two with the regularisation. The published ones do not balance,
/// as all forces of a cell do: any of them may be off by what is left.
void expect_quadrants(const Answer& a) {
  Vec2 left_nN;
  for (const auto& row : kQuadrants_nN)
    for (const Vec2 sum : row) left_nN += sum;
  for (int row = 0; row < 2; ++row)
    for (int column = 0; column < 2; ++column)
      EXPECT_LT(norm(a.quadrant_nN[row][column] - kQuadrants_nN[row][column]),
                0.2 * norm(kQuadrants_nN[row][column]) + norm(left_nN))
          << (row == 0 ? "top " : "bottom ") << (column == 0 ? "left" : "right");
}

/// The tension along a bar of the H, which the longest fibre there has.
double straight_nN(const Answer& a, bool is_left) {
  const Fibre* longest = nullptr;
  for (const Fibre& f : a.cell.fibres) {
    const bool is_there = std::ranges::all_of(f.points_um, [&](Vec2 p) { return is_left ? p.x < 42 : p.x > 65; });
    if (is_there && (longest == nullptr || length_um(f.points_um) > length_um(longest->points_um))) longest = &f;
  }
  return longest == nullptr ? 0 : a.tensions.at(longest->fibre_id).tension_nN;
}

TEST(Doublet, forces_on_a_pattern_are_those_of_fourier_tractions) {
  if (!fs::exists(kData)) GTEST_SKIP() << "no ../shared/data here";
  const Answer a = run(Fibres::traced, Outline::mask);
  print("traced fibres", a);
  const Answer found = run(Fibres::traced, Outline::found);
  print("traced fibres, outline found", found);
  for (const Answer* answer : {&a, &found}) {
    expect_quadrants(*answer);
    // From the corner forces, and published for 35 doublets; strain energy by the regularisation.
    EXPECT_GT(straight_nN(*answer, true), 88);
    EXPECT_LT(straight_nN(*answer, true), 125);
    EXPECT_GT(straight_nN(*answer, false), 15);
    EXPECT_LT(straight_nN(*answer, false), 50);
    // Published: 0.9 to 1.1 nN/um. The traced arcs are in pieces held at one end; what they lack the network carries.
    EXPECT_GT(answer->fit.network_surface_tension_nN_per_um, 0.7);
    EXPECT_LT(answer->fit.network_surface_tension_nN_per_um, 1.8);
    EXPECT_GT(answer->strain_energy_pJ, 0.19);
    EXPECT_LT(answer->strain_energy_pJ, 0.4);
    EXPECT_LT(answer->fit.relative_l2, 0.5) << "0.54 with the beads at rest and the fibres' ends on the lattice";
  }
  for (const double thickness_um : {30.0, 100.0})
    print("other thickness", run(Fibres::drawn, Outline::mask, thickness_um));
}

TEST(Doublet, tensions_of_drawn_fibres_are_those_of_the_corner_forces) {
  if (!fs::exists(kData)) GTEST_SKIP() << "no ../shared/data here";
  const Answer a = run(Fibres::drawn, Outline::mask);
  print("drawn fibres", a);
  expect_quadrants(a);
  // Independent: sum of tractions 500 to 920 nN, strain energy 0.19 to 0.37 pJ by the regularisation.
  EXPECT_GT(a.fit.total_force_nN, 500);
  EXPECT_LT(a.fit.total_force_nN, 920);
  EXPECT_GT(a.strain_energy_pJ, 0.19);
  EXPECT_LT(a.strain_energy_pJ, 0.4);
  std::map<std::string, const Tension*> by_name;
  for (const Fibre& f : a.cell.fibres) {
    by_name[std::string(name_of(f.type)) + (f.points_um[0].x < 50 ? " left" : " right") +
            (f.points_um[0].y < 50 ? "" : ", bottom")] = &a.tensions.at(f.fibre_id);
    EXPECT_EQ(f.start_adhesion_id.has_value() && f.end_adhesion_id.has_value(), true) << "held as drawn";
  }
  ASSERT_EQ(by_name.size(), 4u);
  // From the corner forces: the left straight fibre 88 to 116 nN, the right one 17 to 37, which the right corners' sums
  // by regularised tractions give; by forces of the beads alone these are half as large again (notes/accuracy.md). The
  // intervals meet what lies between.
  const Tension &left = *by_name.at("ventral left"), &right = *by_name.at("ventral right");
  EXPECT_GT(left.high_nN.value_or(0), 88);
  EXPECT_LT(left.low_nN.value_or(0), 116);
  EXPECT_GT(right.high_nN.value_or(0), 17);
  EXPECT_LT(right.low_nN.value_or(1000), 50);
  EXPECT_GT(left.tension_nN, right.tension_nN);
  // Published for 35 doublets: 0.9 to 1.1 nN/um; what the arcs lack the network carries.
  EXPECT_GT(a.fit.network_surface_tension_nN_per_um, 0.7);
  EXPECT_LT(a.fit.network_surface_tension_nN_per_um, 2.2);
}

}  // namespace
}  // namespace mbtfm
