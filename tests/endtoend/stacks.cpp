/// From two stacks of beads to displacements in space, as a person runs it.
#include <nlohmann/json.hpp>

#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/numerics/near.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/report/report.h"
#include "pipeline/report/space_results.h"
#include "samples/plan/scene.h"
#include "segment/images/image.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

/// A round cell of patches in a field of 72 um: small stacks, 2.7 million voxels each.
const std::string kScene =
    "mbtfm-simulate --scenario patches-on-ring --pixel_size_um 0.25 --image_size_px 288 --beads 1200 ";

/// Made once for all tests.
class Stacks : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new test::TemporaryFolder;
    output_of(kScene + "--images --slice_drift_um 0.02 --surface_beads 150 --out " + cell().string());
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  static fs::path cell() { return *folder_ / "cell"; }
  static std::string track(const std::string& relaxed, const std::string& stressed, const std::string& more = {},
                           const char* out = "out") {
    return "mbtfm-track --config " + (cell() / "cell.toml").string() + " --relaxed " + relaxed + " --stressed " +
           stressed + " --out " + (*folder_ / out).string() + " " + more;
  }
  static std::string relaxed() { return (cell() / "beads_relaxed.tif").string(); }
  static std::string stressed() { return (cell() / "beads_stressed.tif").string(); }
  /// A changed copy of the relaxed stack.
  template <class Change>
  static std::string changed(const std::string& name, const Change& change) {
    std::vector<images::Image> slices = images::read_slices(relaxed(), {});
    change(slices);
    images::write_tiff(*folder_ / name, slices);
    return (*folder_ / name).string();
  }
  static inline test::TemporaryFolder* folder_ = nullptr;
};

TEST_F(Stacks, beads_are_followed_to_the_truth_within_their_errors) {
  output_of(track(relaxed(), stressed(),
                  "--surface_beads " + (cell() / "surface_beads.tif").string() + " --record " +
                      (*folder_ / "out/record.json").string()));
  const fs::path out = *folder_ / "out";
  const auto found = files::read_displacement_in_space(out / "displacement_3d.csv");
  const auto truth = files::read_displacement_in_space(cell() / "truth/displacement_3d.csv");
  std::vector<Vec3> places;
  for (const BeadInSpace& bead : truth) places.push_back(bead.position_um);
  const numerics::Near near(places, 2);
  std::vector<double> across, along;
  int n_good = 0, n_wrong = 0;
  for (const BeadInSpace& bead : found) {
    if (!bead.flag.empty()) continue;
    ++n_good;
    const auto at = near.within(bead.position_um, 1, 1);
    const BeadInSpace* same = at.empty() ? nullptr : &truth[at[0]];
    const Vec3 off = same ? bead.displacement_um - same->displacement_um : Vec3{9, 9, 9};
    if (norm(off) > 1) ++n_wrong;
    across.push_back(std::hypot(off.x, off.y) / bead.sigma_um);
    along.push_back(std::abs(off.z) / bead.sigma_z_um);
  }
  // a tenth lies at the rim, a fiftieth is in one stack only
  EXPECT_GT(n_good, 950);
  EXPECT_LE(n_wrong, n_good / 100);
  // medians of a Rayleigh and a folded normal variable; half as much again for the drift of slices, which this scene
  // leaves some hundredths of um of
  EXPECT_LT(numerics::median(across), 1.5 * 1.18 * 1.3);
  EXPECT_LT(numerics::median(along), 1.5 * 0.67 * 1.3);
  std::ifstream file(out / "record.json");
  const auto record = nlohmann::json::parse(file);
  EXPECT_TRUE(record.dump().find("share_followed") != std::string::npos);
  EXPECT_TRUE(fs::exists(out / "displacement_3d.vtp"));
  EXPECT_TRUE(fs::exists(out / "slices.csv"));
  const files::CsvTable surface(out / "surface_beads.csv");
  ASSERT_GT(surface.n_rows(), 100);
  std::vector<double> heights;
  for (int row = 0; row < surface.n_rows(); ++row) heights.push_back(std::abs(surface.number(row, "z_um")));
  EXPECT_LT(numerics::median(heights), 0.1);  // they lie on the flat surface
}

TEST_F(Stacks, what_does_not_go_together_is_refused_with_the_remedy) {
  struct Case {
    std::string command, says;
    int code = 3;
    std::string of = {};  ///< the file that is not as expected
  };
  const std::string narrower = changed("narrower.tif", [](auto& s) {
    for (auto& slice : s) {
      --slice.height;
      slice.pixels.resize(slice.pixels.size() - static_cast<std::size_t>(slice.width));
    }
  });
  const std::string shorter = changed("shorter.tif", [](auto& s) { s.resize(s.size() - 2); });
  const std::string unscaled = changed("unscaled.tif", [](auto& s) { s.front().z_step_um.reset(); });
  const std::string coarser = changed("coarser.tif", [](auto& s) { s.front().z_step_um = 0.7; });
  const std::string dark = changed("dark.tif", [](auto& s) {
    for (auto& slice : s) std::ranges::fill(slice.pixels, 100.0f);
  });
  const auto into_out2 = [](const std::string& one, const std::string& other, const std::string& more = {}) {
    return track(one, other, more, "out2");
  };
  const std::vector<Case> cases = {
      {into_out2(relaxed(), narrower), "the same field at the same magnification", 3, narrower},
      {into_out2(relaxed(), shorter), "slices", 3, shorter},
      {into_out2(unscaled, unscaled), "track.z_step_um", 3, unscaled},
      {into_out2(relaxed(), coarser), "track.z_step_um", 3, coarser},
      {into_out2(dark, stressed()), "bright beads", 3, dark},
      {into_out2(relaxed(), relaxed()), "two stacks", 3, relaxed()},
      {"mbtfm-track --relaxed " + relaxed() + " --stressed " + stressed() + " --dimensions space --out " +
           (*folder_ / "out2").string(),
       "track.z_points", 2},
      {into_out2(relaxed(), stressed(), "--dimensions space --relaxed_z 3"), "leave relaxed_z", 2},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.command);
    EXPECT_TRUE(has_words(output_of(c.command, c.code), c.says, c.of));
    EXPECT_FALSE(fs::exists(*folder_ / "out2"));
  }
}

/// The four tables of a segmentation: the patches of the scene as adhesions, seen from above.
void write_adhesions_seen_from_above(const fs::path& folder) {
  const files::CsvTable patches(folder / "truth/patches.csv");
  std::vector<Adhesion> adhesions;
  Polygon outline;
  for (int row = 0; row < patches.n_rows(); ++row) {
    const double radius_um = patches.number(row, "radius_um");
    Adhesion& a = adhesions.emplace_back();
    a.adhesion_id = row + 1;
    a.position_um = {patches.number(row, "x_um"), patches.number(row, "y_um")};
    a.major_axis_um = a.minor_axis_um = 2 * radius_um;
    a.area_um2 = std::numbers::pi * radius_um * radius_um;
  }
  for (int k = 0; k < 40; ++k) {
    const double angle = 2 * std::numbers::pi * k / 40;
    outline.push_back(Vec2{36, 36} + 34 * Vec2{std::cos(angle), std::sin(angle)});
  }
  const fs::path out = folder / "1_segment";
  fs::create_directories(out);
  files::write_adhesions(out / "adhesions.csv", adhesions);
  files::write_fibres(out / "fibres.csv", out / "fibre_points.csv", {});
  files::write_outline(out / "outline.csv", outline, {}, {});
}

/// A finished folder is planned with by its own surface, adhesions, forces, beads and parameters. (What `mbtfm plan`
/// does with a scene is tested in endtoend/plan.)
void expect_a_plan_of(const fs::path& folder) {
  ASSERT_TRUE(plan::is_cell_in_space(folder));
  const plan::SpaceScene scene = plan::measured_in_space(folder, {});
  EXPECT_EQ(scene.gel.youngs_modulus_kPa, 15);
  const auto adhesions = files::read_adhesions(folder / "1_segment/adhesions.csv");
  const files::CsvTable forces(folder / "4_traction/traction_adhesion_forces.csv");
  ASSERT_EQ(scene.patches.size(), adhesions.size());
  for (int a = 0; a < forces.n_rows(); ++a) {
    const plan::SpacePatch& patch = scene.patches[a];
    EXPECT_EQ(patch.adhesion.adhesion_id, forces.integer(a, "adhesion_id", 1));
    EXPECT_EQ(patch.force_nN.x, forces.number(a, "fx_nN"));
    EXPECT_EQ(patch.force_nN.z, forces.number(a, "fz_nN"));
  }
  const auto beads = files::read_displacement_in_space(folder / "2_track/displacement_3d.csv");
  EXPECT_NEAR(scene.own_beads_per_um3 * scene.volume_um3(), static_cast<double>(beads.size()),
              0.3 * static_cast<double>(beads.size()));
  EXPECT_GT(scene.bead_depth_um, 0);
  EXPECT_TRUE(scene.warnings.empty());
}

/// In a plan no bead is wrong: what a robust loss is for is not planned with, and said.
void expect_a_plan_says_that_it_has_no_robust_loss(const fs::path& folder) {
  files::write_text(folder / "cell.toml", files::read_text(folder / "cell.toml") + "loss = \"huber\"\n");
  const plan::SpaceScene scene = plan::measured_in_space(folder, {});
  EXPECT_EQ(scene.spatial.loss, mbtfm::spatial::BeadLoss::l2);
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_TRUE(has_words(scene.warnings.front(), "traction.loss = huber"));
}

/// What batch.csv says of a cell is what the statistics take.
void expect_statistics_of(const fs::path& study) {
  EXPECT_TRUE(has_words(output_of("mbtfm stats " + study.string()), "1 cell in space"));
  const files::CsvTable batch(study / "batch_all.csv"), cells(study / "statistics/cells.csv");
  EXPECT_EQ(cells.text(0, "included"), "TRUE") << cells.text(0, "reason");
  for (const auto& [ours, stage] : {std::pair{"space_force_nN", "traction.total_force_nN"},
                                    {"space_strain_energy_fJ", "traction.strain_energy_fJ"},
                                    {"space_contractile_moment_nN_um", "traction.contractile_moment_nN_um"}})
    EXPECT_NEAR(cells.number(0, ours), batch.number(0, stage), 1e-4 * std::abs(batch.number(0, stage))) << ours;
  EXPECT_FALSE(fs::exists(study / "statistics/figures/cells_in_space.svg")) << "one cell is no distribution";
  EXPECT_EQ(files::CsvTable(study / "statistics/adhesions_in_space.csv").n_rows(),
            files::CsvTable(study / "cell_1/4_traction/traction_adhesion_forces.csv").n_rows());
}

void expect_the_truth_of(const fs::path& folder) {
  const std::string text = output_of("mbtfm compare " + folder.string());
  const double truth = report::true_space_map(folder).total_force_nN;
  EXPECT_TRUE(has_words(text, "total_force_nN", " " + brief(truth) + "\n", "|t - truth| / |truth| = 0."));
  EXPECT_TRUE(has_words(files::read_text(folder / "report.html"), "Beside the truth"));
}

/// Beside the truth, in a little time: the cell as it is, and what else there is time for.
void expect_a_cost_study_of(const fs::path& folder) {
  const std::string before = files::read_text(folder / "4_traction/traction.csv");
  output_of("mbtfm cost --repeats 1 --budget 0.05 " + folder.string());
  const files::CsvTable table(folder / "cost/cost.csv");
  EXPECT_EQ(table.text(0, "knob"), "as it is");
  EXPECT_GT(table.number(0, "traction_error"), 0.2);  // 9 um between tractions do not show patches of 6 um
  EXPECT_LT(table.number(0, "traction_error"), 1);
  EXPECT_GT(table.number(0, "cpu_seconds"), 0);
  EXPECT_TRUE(has_words(files::read_text(folder / "cost/cost.md"), "against the truth over the surface"));
  EXPECT_FALSE(fs::exists(folder / "cost/scratch"));
  EXPECT_EQ(files::read_text(folder / "4_traction/traction.csv"), before);
}

/// What cell.toml sets stays; the rest is the preset's.
void expect_that_a_preset_is_taken(const fs::path& folder) {
  const auto parameters = [&]() {
    std::ifstream file(folder / "4_traction/record.json");
    return nlohmann::json::parse(file).at("parameters");
  };
  const auto fast = run_program("mbtfm run --preset fast " + folder.string());
  ASSERT_EQ(fast.code, 0) << fast.output;
  EXPECT_EQ(parameters().at("substrate").at("displacement_tolerance"), 0.05);
  EXPECT_EQ(parameters().at("traction").at("spacing_beads"), 1.06);
  EXPECT_EQ(parameters().at("traction").at("spacing_um"), 9);
  EXPECT_TRUE(has_words(files::read_text(folder / "run.json"), "\"preset\": \"fast\""));
  output_of("mbtfm run " + folder.string());
  EXPECT_EQ(parameters().at("substrate").at("displacement_tolerance"), 0.02);
}

TEST_F(Stacks, a_folder_of_stacks_is_run_to_its_report_and_only_once) {
  const fs::path folder = *folder_ / "study/cell_1";
  fs::create_directories(folder.parent_path());
  fs::copy(cell(), folder, fs::copy_options::recursive);
  write_adhesions_seen_from_above(folder);
  // few tractions: the gel's answer to them is most of the work
  files::write_text(folder / "cell.toml",
                    files::read_text(folder / "cell.toml") + "\n[traction]\nspacing_um = 9\nmethod = \"tikhonov\"\n");
  const std::string run = "mbtfm run " + folder.string();
  EXPECT_TRUE(has_words(output_of(run + " --accuracy 5%", 2), "--accuracy: is an error of fibre tensions"));
  EXPECT_FALSE(fs::exists(folder / "run.json"));
  output_of(run);
  for (const char* file :
       {"2_track/displacement_3d.csv", "3_surface/surface.vtp", "4_traction/traction.csv", "4_traction/traction.vtp",
        "4_traction/traction_adhesion_forces.csv", "report.html", "view_in_paraview.py"})
    EXPECT_TRUE(fs::exists(folder / file)) << file;
  std::ifstream file(folder / "run.json");
  const auto record = nlohmann::json::parse(file);
  EXPECT_EQ(record.at("kind"), "space");
  EXPECT_EQ(record.at("outcome"), "done");
  EXPECT_TRUE(has_words(record.at("kind_because").get<std::string>(), "track.z_points"));
  EXPECT_EQ(record.at("stages").at("segment").at("state"), "given");
  const std::string page = files::read_text(folder / "report.html");
  EXPECT_TRUE(has_words(page, "<h2>In space</h2>", "Normal traction", "Tangential traction", "Resolution",
                        "Forces of the adhesions", "Beads in a slice along x", "Balance", "strain energy of the gel",
                        "Tractions in space were found with the program mbtfm"));
  // the page tells what chose lambda, not what was asked for
  EXPECT_TRUE(has_words(page, "(criterion: risk)"));
  const std::string figures = files::read_text(folder / "4_traction/traction.json");
  const auto told = [&](const char* by) {
    const std::string key = "\"lambda_by\": \"risk\"";
    files::write_text(folder / "4_traction/traction.json",
                      std::string(figures).replace(figures.find(key), key.size(), std::string("\"lambda_by\": ") + by));
    return report::report_html(folder);
  };
  const std::string by_evidence = told("\"evidence\"");
  EXPECT_TRUE(has_words(by_evidence, "(criterion: evidence)"));
  EXPECT_FALSE(has_words(by_evidence, "(criterion: risk)"));
  EXPECT_TRUE(has_words(told("\"given\""), "The regularisation was given"));
  files::write_text(folder / "4_traction/traction.json", figures);
  EXPECT_TRUE(has_words(output_of(run), "traction up to date", "beads in space, as track.z_points is set"));
  EXPECT_EQ(run_program("mbtfm verify " + folder.string()).code, 0);
  expect_a_plan_of(folder);
  // beads corrected by hand are the user's, and the tractions follow them
  auto beads = files::read_displacement_in_space(folder / "2_track/displacement_3d.csv");
  beads.pop_back();
  files::write_displacement_in_space(folder / "2_track/displacement_3d.csv", beads);
  EXPECT_TRUE(
      has_words(output_of(run), "displacement_3d.csv was changed by hand: kept", "2_track/displacement_3d.csv"));
  const auto batch = run_program("mbtfm batch " + folder.parent_path().string());
  EXPECT_EQ(batch.code, 0) << batch.output;
  const files::CsvTable table(folder.parent_path() / "batch_all.csv");
  EXPECT_GT(table.number(0, "traction.total_force_nN"), 0);
  EXPECT_GT(table.number(0, "traction.strain_energy_fJ"), 0);
  EXPECT_TRUE(table.has("traction.moment_x_nN_um"));
  expect_statistics_of(folder.parent_path());
  expect_the_truth_of(folder);
  expect_a_cost_study_of(folder);
  expect_that_a_preset_is_taken(folder);

  // an outline that covers nothing of it
  const std::string tractions = files::read_text(folder / "4_traction/traction.csv");
  files::write_outline(folder / "1_segment/outline.csv", {{500, 500}, {540, 500}, {520, 540}});
  const auto elsewhere = run_program(run);
  EXPECT_EQ(elsewhere.code, 3) << elsewhere.output;
  EXPECT_TRUE(has_words(elsewhere.output, "outline.csv", "all of it elsewhere", "hint:"));
  EXPECT_EQ(files::read_text(folder / "4_traction/traction.csv"), tractions);
  expect_a_plan_says_that_it_has_no_robust_loss(folder);
}

TEST_F(Stacks, init_and_check_know_them) {
  const fs::path folder = *folder_ / "new";
  fs::create_directories(folder);
  for (const char* file : {"beads_relaxed.tif", "beads_stressed.tif"}) fs::copy(cell() / file, folder / file);
  const std::string made = output_of("mbtfm init " + folder.string());
  EXPECT_TRUE(has_words(made, "z_points in [track]"));
  EXPECT_FALSE(has_words(made, "actin"));
  fs::remove(folder / "cell.toml");
  fs::copy(cell() / "cell.toml", folder / "cell.toml");
  EXPECT_TRUE(has_words(output_of("mbtfm check " + folder.string()), "beads in space"));
  fs::remove(folder / "beads_stressed.tif");
  EXPECT_NE(run_program("mbtfm check " + folder.string()).code, 0);
  output_of("mbtfm run " + folder.string(), 3);
  EXPECT_FALSE(fs::exists(folder / "2_track"));
}

TEST_F(Stacks, scenes_are_in_balance_and_at_rest_at_the_base) {
  for (const char* scene : {"wave", "groove-edge", "between-grooves", "between-waves"}) {
    SCOPED_TRACE(scene);
    const fs::path made = *folder_ / scene;
    output_of("mbtfm-simulate --scenario " + std::string(scene) + " --beads 200 --out " + made.string());
    const files::CsvTable sources(made / "truth/sources.csv");
    Vec3 sum, moment;
    double size = 0;
    for (int row = 0; row < sources.n_rows(); ++row) {
      const auto vector = [&](const char* x, const char* y, const char* z) {
        return Vec3{sources.number(row, x), sources.number(row, y), sources.number(row, z)};
      };
      const Vec3 place = vector("x_um", "y_um", "z_um"), force = vector("fx_nN", "fy_nN", "fz_nN");
      sum += force, moment += cross(place, force), size += norm(force);
    }
    // held at zero in the fit; nine digits in the file, arms of 100 um
    EXPECT_LT(norm(sum), 1e-6 * size);
    EXPECT_LT(norm(moment), 1e-4 * size);
    const HeightMap surface = files::read_surface(made / "surface.vtp");
    EXPECT_GT(*std::ranges::max_element(surface.z_um) - *std::ranges::min_element(surface.z_um), 15);
    const files::CsvTable patches(made / "truth/patches.csv");
    for (int row = 0; row < patches.n_rows(); ++row) {
      const auto off = [&](const char* a, const char* b) { return patches.number(row, a) - patches.number(row, b); };
      const Vec3 difference{off("fx_nN", "aimed_fx_nN"), off("fy_nN", "aimed_fy_nN"), off("fz_nN", "aimed_fz_nN")};
      const Vec3 aimed{patches.number(row, "aimed_fx_nN"), patches.number(row, "aimed_fy_nN"),
                       patches.number(row, "aimed_fz_nN")};
      // the sources are solved for it, with a sum of steps of 1 um, and it is measured with one of 0.5 um
      EXPECT_LT(norm(difference), 0.05 * norm(aimed)) << "patch " << row + 1;
    }
  }
}

}  // namespace
}  // namespace mbtfm
