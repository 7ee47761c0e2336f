/// The whole chain on simulated cells, against the truth.
#include "pipeline/contract/results.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/report/compare.h"
#include "substrate/compliance.h"
#include "substrate/greens/models.h"
#include "tests/support/json_schema.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

using report::compare_with_truth;
using report::Comparison;

report::Comparison simulate_and_run(const fs::path& cell, const std::string& arguments) {
  output_of("mbtfm-simulate " + arguments + " --quiet --out " + cell.string());
  output_of("mbtfm run " + cell.string());
  test::expect_schemas_hold(cell);
  return report::compare_with_truth(cell);
}

void expect_no_net_force_and_no_net_torque(const fs::path& cell) {
  const auto adhesions = files::read_adhesions(cell / "1_segment/adhesions.csv");
  const auto forces = files::read_adhesion_forces(cell / "4_fit/adhesion_forces.csv");
  ASSERT_EQ(adhesions.size(), forces.size());
  Vec2 net_nN;
  double total_nN = 0, net_torque_nN_um = 0, total_torque_nN_um = 0;
  for (std::size_t a = 0; a < forces.size(); ++a) {
    ASSERT_EQ(forces[a].adhesion_id, adhesions[a].adhesion_id);
    ASSERT_TRUE(forces[a].moment_nN_um.has_value());
    const double torque_nN_um = cross(adhesions[a].position_um, forces[a].force_nN) + *forces[a].moment_nN_um;
    net_nN += forces[a].force_nN;
    total_nN += norm(forces[a].force_nN);
    net_torque_nN_um += torque_nN_um;
    total_torque_nN_um += std::abs(torque_nN_um);
  }
  // Each of some thousand free vertices is at rest to 1e-9 of the largest tension.
  EXPECT_LE(norm(net_nN), 1e-6 * total_nN);
  EXPECT_LE(std::abs(net_torque_nN_um), 1e-6 * total_torque_nN_um);
}

/// A key that is not ours, a key that is not there, a value of another type or word.
void expect_schemas_refuse_spoilt_files(const fs::path& cell, const fs::path& spoilt) {
  const std::vector<std::array<std::string, 3>> faults = {{"run", "\"threads\": ", "\"threats\": "},
                                                          {"run", "\"outcome\": \"done\"", "\"outcome\": \"fine\""},
                                                          {"run", "\"severity\": \"note\"", "\"severity\": 1"},
                                                          {"fit", "\"converged\": true", "\"converged\": \"true\""},
                                                          {"fit", "\"relative_l2\": ", "\"relative_l3\": "},
                                                          {"fit", "\"beads\": ", "\"pearls\": "}};
  for (const auto& [schema, old, now] : faults) {
    std::string text = files::read_text(cell / (schema == "run" ? "run.json" : "4_fit/fit.json"));
    const auto at = text.find(old);
    ASSERT_NE(at, text.npos) << old;
    files::write_text(spoilt, text.replace(at, old.size(), now));
    EXPECT_NE(test::schema_errors(spoilt, schema), "") << now;
  }
}

using Chain = test::InFolder;

TEST_F(Chain, tensions_come_back_from_the_true_segmentation_and_noisy_beads) {
  const fs::path cell = folder / "cell";
  const report::Comparison comparison = simulate_and_run(cell, "--scenario u2os --seed 1 --noise 0.07 --beads 10000");
  EXPECT_LE(comparison.relative_error, 0.25);
  EXPECT_NEAR(comparison.total_force_nN / *comparison.true_total_force_nN, 1, 0.1);
  expect_no_net_force_and_no_net_torque(cell);
  expect_schemas_refuse_spoilt_files(cell, folder / "spoilt.json");
}

TEST_F(Chain, tensions_come_back_from_images_alone) {
  const fs::path cell = folder / "cell";
  const report::Comparison comparison =
      simulate_and_run(cell, "--scenario u2os --seed 1 --noise 0.07 --beads 10000 --images");
  EXPECT_GE(comparison.n_long_found_and_typed, 0.8 * comparison.n_long);
  EXPECT_LE(comparison.relative_error, 0.35);
  EXPECT_NEAR(comparison.total_force_nN / *comparison.true_total_force_nN, 1, 0.1);
  expect_no_net_force_and_no_net_torque(cell);
  // two straight lines that nothing holds
  output_of("mbtfm stats " + folder.path().string());
  const std::pair<const char*, const char*> expected[] = {{"cell/1_segment/fibres.csv", ",unclassified,"},
                                                          {"cell/4_fit/tensions.csv", ",unclassified,"},
                                                          {"cell/report.html", "arcs, 7 ventral, 2 unclassified)"},
                                                          {"statistics/types.csv", ",unclassified,1,2,"}};
  for (const auto& [file, words] : expected) EXPECT_TRUE(has_words(files::read_text(folder / file), words)) << file;
}

/// Without a floor under the beads' noise, the error of the model would put all weight on the few modes of the forces
/// that no mesh disagrees upon: 0.14.
TEST_F(Chain, beads_without_any_noise_are_fitted_no_worse_than_noisy_ones) {
  const report::Comparison comparison =
      simulate_and_run(folder / "cell", "--scenario u2os --seed 1 --noise 0 --beads 5000");
  EXPECT_LE(comparison.relative_error, 0.1);
}

TEST_F(Chain, noise_free_tensions_on_the_simulations_own_network_come_back) {
  const fs::path cell = folder / "cell";
  output_of("mbtfm-simulate --scenario u2os --seed 2 --noise 0 --beads 3000 --quiet --out " + cell.string());
  output_of("mbtfm-fit --model layer --n_meshes 1 --tolerance 1e-9 --compare_sheet on --cell " +
            (cell / "1_segment").string() + " --network " + (cell / "truth/network.vtu").string() + " --displacement " +
            (cell / "2_track/displacement.csv").string() + " --config " + (cell / "cell.toml").string() + " --out " +
            (cell / "4_fit").string());
  const auto found = files::read_tensions(cell / "4_fit/tensions.csv");
  const auto truth = files::read_tensions(cell / "truth/tensions.csv");
  ASSERT_EQ(found.size(), truth.size());
  double error = 0, size = 0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    ASSERT_EQ(found[i].fibre_id, truth[i].fibre_id);
    error += std::pow(found[i].tension_nN - truth[i].tension_nN, 2);
    size += std::pow(truth[i].tension_nN, 2);
  }
  EXPECT_LE(std::sqrt(error / size), 1e-6);
  // a cell with fibres is no even sheet, and a sheet is more than nothing
  const files::CsvTable models(cell / "4_fit/models.csv");
  double of_sheet = 0, of_fibres = 0;
  for (int row = 0; row < models.n_rows(); ++row) {
    if (models.text(row, "model") == "sheet") of_sheet = models.number(row, "relative_l2");
    if (models.text(row, "model") == "full") of_fibres = models.number(row, "relative_l2");
  }
  EXPECT_GT(of_sheet, 10 * of_fibres);
  EXPECT_GT(of_sheet, 0.1);
  EXPECT_LT(of_sheet, 1);
}

TEST_F(Chain, a_second_run_does_nothing_and_a_changed_input_runs_what_depends_on_it) {
  const fs::path cell = folder / "cell";
  simulate_and_run(cell, "--scenario two-adhesions --seed 1 --noise 0.07 --beads 800");
  const auto before = fs::last_write_time(cell / "4_fit/tensions.csv");
  EXPECT_EQ(run_program("mbtfm run " + cell.string()).code, 0);
  EXPECT_EQ(fs::last_write_time(cell / "4_fit/tensions.csv"), before);

  DisplacementField field = files::read_displacement(cell / "2_track/displacement.csv");
  for (Bead& bead : field) bead.displacement_um = 2 * bead.displacement_um;
  files::write_displacement(cell / "2_track/displacement.csv", field);
  const double tension = files::read_tensions(cell / "4_fit/tensions.csv")[1].tension_nN;
  EXPECT_EQ(run_program("mbtfm run " + cell.string()).code, 0);
  EXPECT_GT(files::read_tensions(cell / "4_fit/tensions.csv")[1].tension_nN, 1.5 * tension);
}

TEST_F(Chain, one_two_and_four_threads_give_the_same_bytes) {
  const fs::path cell = folder / "cell";
  ASSERT_EQ(run_program("mbtfm-simulate --scenario ring --seed 1 --beads 1500 --quiet --out " + cell.string()).code, 0);
  std::string first, first_of_usual_method;
  for (const char* threads : {"1", "2", "4"}) {
    fs::remove_all(cell / "4_fit");
    output_of("mbtfm run --threads " + std::string(threads) + " " + cell.string());
    const std::string tensions = files::read_text(cell / "4_fit/tensions.csv");
    if (first.empty()) first = tensions;
    EXPECT_EQ(tensions, first) << threads << " threads";
    const std::string usual_method = files::read_text(cell / "4_fit/fttc.csv");
    if (first_of_usual_method.empty()) first_of_usual_method = usual_method;
    EXPECT_EQ(usual_method, first_of_usual_method) << threads << " threads";
  }
  output_of("mbtfm-traction --displacement " + (cell / "2_track/displacement.csv").string() + " --outline " +
            (cell / "1_segment/outline.csv").string() + " --config " + (cell / "cell.toml").string() + " --out " +
            (folder / "traction.csv").string());
  // fttc.csv ends a little around the cell, and has no errors by point
  const std::string whole = files::read_text(folder / "traction.csv");
  std::istringstream lines(first_of_usual_method);
  int n_lines = 0;
  for (std::string line; std::getline(lines, line); ++n_lines)
    EXPECT_TRUE(has_words(whole, line + ",")) << "not mbtfm-traction's: " << line;
  EXPECT_GT(n_lines, 100);
}

/// The displacement of these cells as they come is that of other forces: all x components, then all y components, read
/// as x, y, x, y … (the layer reproduces it to 1e-6 that way, and misses it by 170 % with the forces as listed). Here
/// the noise-free part is computed anew from the listed forces; the noise stays as it is. Where the listed displacement
/// is right, this changes nothing.
void recompute_displacement(const fs::path& cell) {
  const std::vector<Adhesion> adhesions = files::read_adhesions(cell / "1_segment/adhesions.csv");
  std::vector<substrate::Ellipse> ellipses;
  for (const Adhesion& a : adhesions) ellipses.push_back(substrate::ellipse_of(a));
  std::vector<Vec2> forces_nN;
  for (const AdhesionForce& f : files::read_adhesion_forces(cell / "truth/adhesion_forces.csv"))
    forces_nN.push_back(f.force_nN);
  const files::CsvTable truth(cell / "truth/displacement.csv");
  DisplacementField beads = files::read_displacement(cell / "2_track/displacement.csv");
  std::vector<Vec2> points_um;
  for (const Bead& b : beads) points_um.push_back(b.position_um);
  const auto layer = greens::make_greens({.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 60},
                                         {.model = substrate::ModelKind::layer}, 2);
  const std::vector<Vec2> u_um = layer->displacements_um(points_um, ellipses, forces_nN);
  for (int i = 0; i < truth.n_rows(); ++i) {
    const Vec2 listed{truth.number(i, "ux_um"), truth.number(i, "uy_um")};
    beads[i].displacement_um = beads[i].displacement_um - listed + u_um[i];
  }
  files::write_displacement(cell / "2_track/displacement.csv", beads);
}

TEST_F(Chain, tensions_of_the_oracle_cells_come_back_from_the_displacement_of_their_forces) {
  const fs::path reference = test::source_folder() / "../shared/reference";
  if (!fs::exists(reference)) GTEST_SKIP() << "no ../shared/reference here";
  for (const char* name : {"oracle_cell_21", "oracle_cell_22"}) {
    const fs::path cell = folder / name;
    fs::copy(reference / name, cell, fs::copy_options::recursive);
    fs::permissions(cell, fs::perms::owner_write, fs::perm_options::add);
    for (const auto& entry : fs::recursive_directory_iterator(cell))
      fs::permissions(entry, fs::perms::owner_write, fs::perm_options::add);
    recompute_displacement(cell);
    EXPECT_TRUE(has_words(output_of("mbtfm run " + cell.string()), "given")) << "segmentation and tracking are skipped";
    EXPECT_LE(report::compare_with_truth(cell).relative_error, 0.30) << name;
  }
}

}  // namespace
}  // namespace mbtfm
