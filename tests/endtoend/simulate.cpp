/// mbtfm-simulate as a person runs it.
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/vtk_files.h"
#include "samples/drawing/scenario.h"
#include "segment/images/image.h"
#include "tests/support/program.h"

namespace {

using namespace mbtfm;

Outcome simulate(const std::string& arguments) { return run_program("mbtfm-simulate " + arguments); }

/// A small experiment: what does not need a whole cell is tested on this.
const std::string kSmall = "--scenario two-adhesions --beads 300 ";

using Simulate = test::InFolder;

TEST_F(Simulate, every_scenario_makes_a_cell_that_reads_back) {
  for (const auto& entry : fs::directory_iterator(test::source_folder() / "samples" / "scenarios")) {
    const std::string name = entry.path().stem().string();
    SCOPED_TRACE(name);
    const fs::path cell = folder / name;
    output_of(simulate("--beads 500 --mesh_um 6 --scenario " + name + " --out " + cell.string()));
    if (fs::exists(cell / "truth" / "sheet.csv")) {  // a contracting sheet
      EXPECT_FALSE(files::read_outline(cell / "1_segment" / "outline.csv").empty());
      EXPECT_EQ(files::read_displacement(cell / "truth" / "displacement.csv").size(), 500u);
      EXPECT_EQ(files::read_displacement(cell / "2_track" / "displacement.csv").size(), 500u);
      continue;
    }
    if (fs::exists(cell / "surface.vtp")) {  // on a gel in space
      EXPECT_EQ(files::read_displacement_in_space(cell / "truth" / "displacement_3d.csv").size(), 500u);
      EXPECT_EQ(files::read_displacement_in_space(cell / "2_track" / "displacement_3d.csv").size(), 500u);
      continue;
    }
    const Cell segmented = files::read_cell(cell / "1_segment");
    const Cell truth = files::read_cell(cell / "truth");
    EXPECT_EQ(segmented.adhesions.size(), truth.adhesions.size());
    EXPECT_EQ(files::read_tensions(cell / "truth" / "tensions.csv").size(), truth.fibres.size() + 1);
    EXPECT_EQ(files::read_adhesion_forces(cell / "truth" / "adhesion_forces.csv").size(), truth.adhesions.size());
    EXPECT_EQ(files::read_displacement(cell / "truth" / "displacement.csv").size(), 500u);
    EXPECT_EQ(files::read_displacement(cell / "2_track" / "displacement.csv").size(), 500u);
    EXPECT_FALSE(files::read_network(cell / "truth" / "network.vtu").links.empty());
    EXPECT_FALSE(fs::exists(cell / "paxillin.tif"));
  }
}

TEST_F(Simulate, images_stand_in_for_segmentation_and_displacement) {
  const fs::path cell = folder / "cell";
  output_of(simulate(kSmall + "--images --out " + cell.string()));
  for (const char* name : {"paxillin.tif", "actin.tif", "beads_stressed.tif", "beads_relaxed.tif"}) {
    SCOPED_TRACE(name);
    const images::Image image = images::read_image(cell / name);
    EXPECT_EQ(image.width, 512);
    EXPECT_EQ(image.height, 512);
    ASSERT_TRUE(image.pixel_size_um);
    EXPECT_NEAR(*image.pixel_size_um, 0.1, 1e-6);
    const auto [low, high] = std::ranges::minmax(image.pixels);
    EXPECT_GT(low, 0) << "clipped";
    EXPECT_LT(high, 65535) << "clipped";
    EXPECT_GT(high, low + 200) << "nothing to see";
  }
  EXPECT_TRUE(fs::exists(cell / "truth" / "beads.csv"));
  EXPECT_FALSE(fs::exists(cell / "1_segment"));
  EXPECT_FALSE(fs::exists(cell / "2_track"));
}

TEST_F(Simulate, colonies_have_images_of_their_beads_and_of_themselves) {
  output_of(simulate(
      "--scenario colony-disc --images --radius_um 12 --image_size_px 400 --beads 800 --n_colonies 2 --n_dipoles 0 "
      "--mesh_um 3 --out " +
      (folder / "all").string()));
  for (const char* name : {"colony_001", "colony_002"}) {
    const fs::path colony = folder / "all" / name;
    const Polygon rim = files::read_outline(colony / "1_segment" / "outline.csv").front();
    for (const char* file : {"beads_relaxed.tif", "beads_stressed.tif", "phase.tif"}) {
      const images::Image image = images::read_image(colony / file);
      ASSERT_TRUE(image.pixel_size_um) << file;
      EXPECT_EQ(image.width, 400);
      const auto [low, high] = std::ranges::minmax(image.pixels);
      EXPECT_GT(high, low + 200) << file;
      if (std::string(file) != "phase.tif") continue;
      double inside = 0, outside = 0, n_inside = 0, n_outside = 0;  // variances: cells are seen by their texture
      for (int j = 0; j + 1 < image.height; ++j)
        for (int i = 0; i + 1 < image.width; ++i) {
          const bool is_inside = contains(rim, *image.pixel_size_um * Vec2{i + 0.5, j + 0.5});
          (is_inside ? inside : outside) += std::pow(image.at(i, j) - image.at(i + 1, j), 2);
          (is_inside ? n_inside : n_outside) += 1;
        }
      ASSERT_GT(n_inside, 1000);
      EXPECT_GT(inside / n_inside, 1.5 * outside / n_outside) << "the colony is not seen";
    }
    EXPECT_FALSE(fs::exists(colony / "2_track"));
  }
  EXPECT_FALSE(files::read_text(folder / "all/colony_001/beads_stressed.tif") ==
               files::read_text(folder / "all/colony_002/beads_stressed.tif"));
}

TEST_F(Simulate, images_do_not_join_the_segmentation_of_another_experiment) {
  const std::string out = "--out " + (folder / "cell").string();
  ASSERT_EQ(simulate(kSmall + out).code, 0);
  EXPECT_EQ(simulate(kSmall + out).code, 0) << "the same again is no matter";
  EXPECT_EQ(simulate(kSmall + "--images " + out).code, 2);
  EXPECT_FALSE(fs::exists(folder / "cell" / "actin.tif"));
}

TEST_F(Simulate, nothing_of_a_users_cell_is_written_over) {
  const fs::path cell = folder / "mine";
  fs::create_directories(cell);
  const std::map<std::string, std::string> files = {{"cell.toml", "pixel_size_um = 0.1\n"}, {"paxillin.tif", "II*"}};
  for (const auto& [name, text] : files) files::write_text(cell / name, text);
  for (const std::string& command : std::vector<std::string>{
           "mbtfm-simulate --images " + kSmall + "--out ", "mbtfm-simulate --force --images " + kSmall + "--out ",
           "mbtfm-simulate --rough 3 --out ", "mbtfm-simulate --scenario wave --beads 60 --out ",
           "mbtfm-simulate --scenario colony-disc --beads 300 --out ", "mbtfm demo ", "mbtfm demo --force "}) {
    const Outcome refused = run_program(command + cell.string());
    EXPECT_EQ(refused.code, 2) << command;
    EXPECT_TRUE(has_words(refused.output, (cell / "cell.toml").string()));
  }
  for (const auto& [name, text] : files) EXPECT_EQ(files::read_text(cell / name), text);
  EXPECT_EQ(std::distance(fs::directory_iterator(cell), {}), 2);
}

TEST_F(Simulate, what_was_simulated_is_written_over_if_it_is_asked_for) {
  const std::string out = " --out " + (folder / "cell").string();
  output_of(simulate(kSmall + out));
  const std::string before = files::read_text(folder / "cell/truth/displacement.csv");
  EXPECT_TRUE(has_words(output_of(simulate(kSmall + "--seed 2" + out), 2), "--force"));
  EXPECT_EQ(files::read_text(folder / "cell/truth/displacement.csv"), before);
  output_of(simulate(kSmall + "--seed 2 --force" + out));
  EXPECT_NE(files::read_text(folder / "cell/truth/displacement.csv"), before);
}

TEST_F(Simulate, same_seed_same_bytes_for_any_number_of_threads) {
  ASSERT_EQ(simulate(kSmall + "--images --threads 1 --out " + (folder / "a").string()).code, 0);
  ASSERT_EQ(simulate(kSmall + "--images --threads 3 --out " + (folder / "b").string()).code, 0);
  int n_files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder / "a")) {
    if (!entry.is_regular_file()) continue;
    const fs::path relative = fs::relative(entry.path(), folder / "a");
    EXPECT_TRUE(files::read_text(entry.path()) == files::read_text(folder / "b" / relative)) << relative;
    ++n_files;
  }
  EXPECT_GE(n_files, 12);
}

TEST_F(Simulate, flags_override_the_scenario_and_its_record_repeats_it) {
  const fs::path first = folder / "first", again = folder / "again";
  ASSERT_EQ(simulate(kSmall + "--youngs_modulus_kPa 3 --noise 0.1 --out " + first.string()).code, 0);
  EXPECT_TRUE(has_words(files::read_text(first / "cell.toml"), "youngs_modulus_kPa = 3"));
  output_of(simulate("--scenario " + (first / "truth" / "scenario.toml").string() + " --out " + again.string()));
  EXPECT_EQ(files::read_text(first / "2_track" / "displacement.csv"),
            files::read_text(again / "2_track" / "displacement.csv"));
}

TEST_F(Simulate, colonies_differ_by_place_beads_and_dipoles_alone) {
  output_of(simulate(
      "--scenario colony-spikes --beads 2000 --noise_um 0 --n_colonies 2 --scatter_um 8 --n_dipoles 0 --mesh_um 8 "
      "--out " +
      (folder / "all").string()));
  const fs::path a = folder / "all" / "colony_001", b = folder / "all" / "colony_002";
  EXPECT_EQ(files::read_text(a / "truth" / "sheet.csv"), files::read_text(b / "truth" / "sheet.csv"));
  const Polygon one = files::read_outline(a / "1_segment" / "outline.csv").front(),
                other = files::read_outline(b / "1_segment" / "outline.csv").front();
  ASSERT_EQ(one.size(), other.size());
  EXPECT_NEAR(signed_area_um2(one), signed_area_um2(other), 1e-9 * std::abs(signed_area_um2(one)));
  EXPECT_GT(norm(one.front() - other.front()), 1);
  // a contracting sheet draws its beads in, wherever it lies and however it is turned
  for (const fs::path& cell : {a, b}) {
    Vec2 centre;
    const Polygon rim = files::read_outline(cell / "1_segment" / "outline.csv").front();
    for (const Vec2 p : rim) centre += (1.0 / static_cast<double>(rim.size())) * p;
    double inwards = 0, whole = 0;
    for (const Bead& bead : files::read_displacement(cell / "truth" / "displacement.csv")) {
      if (!contains(rim, bead.position_um)) continue;
      inwards -= dot(bead.displacement_um, bead.position_um - centre) / norm(bead.position_um - centre);
      whole += norm(bead.displacement_um);
    }
    EXPECT_GT(inwards, 0.8 * whole);
  }
}

TEST_F(Simulate, dipoles_pull_inside_of_a_colony_and_add_to_its_sheet) {
  const auto field = [&](int n_dipoles) {
    const fs::path out = folder / std::to_string(n_dipoles);
    output_of(simulate("--scenario colony-disc --beads 2000 --noise_um 0 --n_dipoles " + std::to_string(n_dipoles) +
                       " --mesh_um 8 --out " + out.string()));
    return files::read_displacement(out / "truth" / "displacement.csv");
  };
  const DisplacementField without = field(0), with = field(6);
  const files::CsvTable dipoles(folder / "6" / "truth" / "dipoles.csv");
  ASSERT_EQ(dipoles.n_rows(), 6);
  const Polygon rim = files::read_outline(folder / "6" / "1_segment" / "outline.csv").front();
  ASSERT_EQ(with.size(), without.size());
  Vec2 mean;
  double most_um = 0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    const Vec2 added = with[i].displacement_um - without[i].displacement_um;
    mean += 1.0 / static_cast<double>(with.size()) * added;
    most_um = std::max(most_um, norm(added));
    double nearest_um = 1e9;
    for (int k = 0; k < dipoles.n_rows(); ++k) {
      const Vec2 at{dipoles.number(k, "x_um"), dipoles.number(k, "y_um")};
      EXPECT_TRUE(contains(rim, at));
      nearest_um = std::min(nearest_um, norm(with[i].position_um - at));
    }
    if (nearest_um > 60) EXPECT_LT(norm(added), 0.005) << "a pair of opposite forces is not felt far away";
  }
  EXPECT_GT(most_um, 0.02);
  EXPECT_LT(norm(mean), 0.05 * most_um);
}

TEST_F(Simulate, on_springs_what_lies_under_the_sheet_moves_and_nothing_else) {
  const fs::path cell = folder / "cell";
  const std::string disc = "--scenario contracting-disc --beads 2000 --mesh_um 4 --ground springs ";
  ASSERT_EQ(simulate(disc + "--adhesion_stiffness_nN_per_um3 0.1 --out " + cell.string()).code, 0);
  const Polygon rim = files::read_outline(cell / "1_segment" / "outline.csv").front();
  for (const Bead& bead : files::read_displacement(cell / "truth" / "displacement.csv")) {
    const double clear = distance_to_boundary_um(rim, bead.position_um);
    if (clear < 0.1) continue;
    EXPECT_EQ(norm(bead.displacement_um) > 0, contains(rim, bead.position_um));
  }
  EXPECT_TRUE(has_words(
      output_of(simulate(disc + "--adhesion_stiffness_nN_per_um3 0.1 --n_dipoles 3 --out " + cell.string()), 2),
      "n_dipoles"));
}

TEST_F(Simulate, wrong_arguments_are_explained_and_leave_nothing_behind) {
  const std::string out = " --out " + (folder / "cell").string();
  EXPECT_TRUE(has_words(output_of(simulate("--scenario no-such" + out), 2), "two-adhesions"));
  EXPECT_EQ(simulate("--scenario ./nowhere.toml" + out).code, 2);
  EXPECT_EQ(simulate("--noise -1" + out).code, 2);
  EXPECT_EQ(simulate("--youngs_modulus_kPa 0" + out).code, 2);
  EXPECT_EQ(simulate("--poisson_ratio 0.51" + out).code, 2);
  EXPECT_EQ(simulate(kSmall + "--bead_distance_um 9" + out).code, 2);
  for (const char* scenario : {"wave", "contracting-disc"}) {
    const Outcome strained = simulate("--simulation_material neo-hooke --scenario " + std::string(scenario) + out);
    EXPECT_EQ(strained.code, 2) << scenario;
    EXPECT_TRUE(has_words(strained.output, "simulation_material"));
  }
  EXPECT_FALSE(fs::exists(folder / "cell"));

  const fs::path file = folder / "mine.toml";
  std::ofstream(file) << "[scenario]\nn_adhesion = 5\n";
  EXPECT_TRUE(has_words(output_of(simulate("--scenario " + file.string() + out), 3), "n_adhesions"));
}

}  // namespace
