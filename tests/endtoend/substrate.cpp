/// mbtfm-substrate on files: forces or tractions in; points, the surface or the gel's inside out.
#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/contract/files.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

namespace fs = std::filesystem;

class SubstrateProgram : public testing::Test {
 protected:
  SubstrateProgram() {
    write("gel.toml",
          "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8.4\npoisson_ratio = 0.45\nthickness_um = 20\n");
    write("adhesions.csv",
          "adhesion_id,x_um,y_um,area_um2,major_axis_um,minor_axis_um,angle_deg,eccentricity,mean_intensity\n"
          "1,20,20,3.141592653589793,2,2,0,0,1\n");
    write("forces.csv", "adhesion_id,x_um,y_um,area_um2,fx_nN,fy_nN\n1,20,20,3.141592653589793,3,1\n");
    write("points.csv", "x_um,y_um\n20,20\n23,20\n20,26\n30,28\n");
  }
  void write(const std::string& name, const std::string& text) { write_text(folder_ / name, text); }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  test::Outcome run(const std::string& arguments) {
    return test::run_program("mbtfm-substrate --quiet --gel " + file("gel.toml") + " " + arguments);
  }
  std::string forces() const {
    return "--adhesions " + file("adhesions.csv") + " --forces " + file("forces.csv") + " ";
  }

  test::TemporaryFolder folder_;
};

TEST_F(SubstrateProgram, displaces_points_by_forces_and_by_the_same_force_as_tractions) {
  const std::string at_points = "--model layer --points " + file("points.csv") + " --out ";
  ASSERT_EQ(run(forces() + at_points + file("a.csv")).code, 0);
  // the disc as squares of 0.1 um: those whose centres it holds
  std::string rows = "x_um,y_um,tx_kPa,ty_kPa\n";
  int n = 0;
  for (int j = -12; j < 12; ++j) {
    for (int i = -12; i < 12; ++i) {
      const double x = 0.1 * (i + 0.5), y = 0.1 * (j + 0.5);
      const bool is_inside = std::hypot(x, y) < 1;
      n += is_inside ? 1 : 0;
      rows +=
          shortest(20 + x) + "," + shortest(20 + y) + (is_inside ? ",0.954929658551372,0.318309886183791\n" : ",0,0\n");
    }
  }
  write("traction.csv", rows);
  ASSERT_EQ(run("--traction " + file("traction.csv") + " " + at_points + file("b.csv")).code, 0);
  const DisplacementField a = read_displacement(file("a.csv")), b = read_displacement(file("b.csv"));
  ASSERT_EQ(a.size(), 4u);
  const double share = 0.01 * n / 3.141592653589793;  // of the disc that the squares cover
  for (std::size_t i = 0; i < a.size(); ++i) {
    // along the rim squares stand out by up to half their side, a twentieth of the radius, one way and the other
    EXPECT_LT(norm(b[i].displacement_um - share * a[i].displacement_um), 0.025 * norm(a[i].displacement_um)) << i;
  }
}

TEST_F(SubstrateProgram, writes_the_vertical_part_where_asked_for) {
  ASSERT_EQ(run(forces() + "--model split --vertical --points " + file("points.csv") + " --out " + file("u.csv")).code,
            0);
  const CsvTable table{fs::path(file("u.csv"))};
  // a point ahead of the force is pressed into the gel, and one above it keeps still but for its other component
  EXPECT_GT(table.number(1, "uz_um"), 0);
  EXPECT_NEAR(table.number(0, "uz_um"), 0, 1e-3 * table.number(0, "ux_um"));
  ASSERT_EQ(run(forces() + "--model split --points " + file("points.csv") + " --out " + file("v.csv")).code, 0);
  EXPECT_FALSE(CsvTable{fs::path(file("v.csv"))}.has("uz_um"));
}

TEST_F(SubstrateProgram, writes_surface_and_inside_for_paraview) {
  ASSERT_EQ(run(forces() + "--model layer --out " + file("surface.vtu")).code, 0);
  ASSERT_EQ(run(forces() + "--model refined --stress --out " + file("volume.vtu")).code, 0);
  for (const auto& [name, array] : {std::pair{"surface.vtu", "traction_kPa"}, std::pair{"volume.vtu", "stress_kPa"}}) {
    const std::string text = read_text(file(name));
    EXPECT_NE(text.find("displacement_um"), std::string::npos);
    EXPECT_NE(text.find(array), std::string::npos);
    EXPECT_NE(text.find("format=\"appended\""), std::string::npos);
    EXPECT_NE(text.find("vtkZLibDataCompressor"), std::string::npos);
  }
  ASSERT_EQ(run(forces() + "--model refined --out " + file("plain_volume.vtu")).code, 0);
  EXPECT_EQ(read_text(file("plain_volume.vtu")).find("stress_kPa"), std::string::npos);
}

TEST_F(SubstrateProgram, says_what_it_lacks) {
  const std::string out = "--out " + file("u.csv");
  EXPECT_EQ(run(out).code, 2);
  EXPECT_EQ(run(forces() + out).code, 2);  // a table, and no points
  EXPECT_EQ(run(forces() + "--model layer --out " + file("volume.vtu")).code, 2);
  EXPECT_EQ(run(forces() + "--poisson_ratio 0.5 --points " + file("points.csv") + " " + out).code, 2);
  EXPECT_EQ(run(forces() + "--youngs_modulus_kPa -1 --points " + file("points.csv") + " " + out).code, 2);
  write("traction.csv", "x_um,y_um,tx_kPa,ty_kPa\n1,1,1,0\n");
  const test::Outcome lone = run("--traction " + file("traction.csv") + " --points " + file("points.csv") + " " + out);
  EXPECT_EQ(lone.code, 3);
  EXPECT_NE(lone.output.find("area_um2"), std::string::npos) << lone.output;
  EXPECT_FALSE(fs::exists(file("u.csv")));
}

}  // namespace
}  // namespace mbtfm
