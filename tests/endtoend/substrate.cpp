/// mbtfm-substrate on files: forces or tractions in; points, the surface or the gel's inside out.
#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkDataArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>

#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

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
  void write(const std::string& name, const std::string& text) { files::write_text(folder_ / name, text); }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  test::Outcome run(const std::string& arguments) {
    return run_in(folder_, "mbtfm-substrate --quiet --gel gel.toml " + arguments);
  }
  std::string forces() const { return "--adhesions adhesions.csv --forces forces.csv "; }

  test::TemporaryFolder folder_;
};

TEST_F(SubstrateProgram, displaces_points_by_forces_and_by_the_same_force_as_tractions) {
  const std::string at_points = "--model layer --points points.csv --out ";
  ASSERT_EQ(run(forces() + at_points + "a.csv").code, 0);
  // the disc as squares of 0.1 um: those whose centres it holds
  std::string rows = "x_um,y_um,tx_kPa,ty_kPa\n";
  int n = 0;
  for (int j = -12; j < 12; ++j)
    for (int i = -12; i < 12; ++i) {
      const double x = 0.1 * (i + 0.5), y = 0.1 * (j + 0.5);
      const bool is_inside = std::hypot(x, y) < 1;
      n += is_inside ? 1 : 0;
      rows +=
          shortest(20 + x) + "," + shortest(20 + y) + (is_inside ? ",0.954929658551372,0.318309886183791\n" : ",0,0\n");
    }
  write("traction.csv", rows);
  ASSERT_EQ(run("--traction traction.csv " + at_points + "b.csv").code, 0);
  const DisplacementField a = files::read_displacement(file("a.csv")), b = files::read_displacement(file("b.csv"));
  ASSERT_EQ(a.size(), 4u);
  const double share = 0.01 * n / 3.141592653589793;  // of the disc that the squares cover
  for (std::size_t i = 0; i < a.size(); ++i) {
    // along the rim squares stand out by up to half their side, a twentieth of the radius, one way and the other
    EXPECT_LT(norm(b[i].displacement_um - share * a[i].displacement_um), 0.025 * norm(a[i].displacement_um)) << i;
  }
}

TEST_F(SubstrateProgram, writes_the_vertical_part_where_asked_for) {
  ASSERT_EQ(run(forces() + "--model split --vertical_displacement on --points points.csv --out u.csv").code, 0);
  const files::CsvTable table{fs::path(file("u.csv"))};
  // a point ahead of the force is pressed into the gel, and one above it keeps still but for its other component
  EXPECT_GT(table.number(1, "uz_um"), 0);
  EXPECT_NEAR(table.number(0, "uz_um"), 0, 1e-3 * table.number(0, "ux_um"));
  ASSERT_EQ(run(forces() + "--model split --points points.csv --out v.csv").code, 0);
  EXPECT_FALSE(files::CsvTable{fs::path(file("v.csv"))}.has("uz_um"));
}

/// As VTK's own reader, and so ParaView, sees a file.
vtkSmartPointer<vtkUnstructuredGrid> opened(const std::string& file) {
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName(file.c_str());
  reader->Update();
  EXPECT_EQ(reader->GetErrorCode(), 0u) << file;
  return reader->GetOutput();
}

/// Largest magnitude of a component of an array of the right shape.
double largest(vtkDataSetAttributes* attributes, const char* name, vtkIdType n, int components, int component) {
  vtkDataArray* array = attributes->GetArray(name);
  if (array == nullptr || array->GetNumberOfTuples() != n || array->GetNumberOfComponents() != components) {
    ADD_FAILURE() << name;
    return NAN;
  }
  double range[2];
  array->GetRange(range, component);
  return std::max(std::abs(range[0]), std::abs(range[1]));
}

TEST_F(SubstrateProgram, moves_its_inside_and_answers_to_forces_into_it) {
  write("points_3d.csv", "x_um,y_um,z_um\n20,20,0\n23,20,5\n20,26,20\n");
  write("lifted.csv", "adhesion_id,x_um,y_um,area_um2,fx_nN,fy_nN,fz_nN\n1,20,20,3.141592653589793,3,1,-2\n");
  const std::string inside = " --points points_3d.csv --out ";
  ASSERT_EQ(run(forces() + inside + "along.csv").code, 0);
  ASSERT_EQ(run("--adhesions adhesions.csv --forces lifted.csv" + inside + "up.csv").code, 0);
  ASSERT_EQ(run(forces() + "--points points.csv --out flat.csv").code, 0);
  const files::CsvTable along(folder_ / "along.csv"), up(folder_ / "up.csv"), flat(folder_ / "flat.csv");
  EXPECT_NEAR(along.number(0, "ux_um"), flat.number(0, "ux_um"), 1e-6 * flat.number(0, "ux_um"));
  EXPECT_LT(up.number(0, "uz_um"), along.number(0, "uz_um"));  // lifted where it is pulled up
  for (const char* u : {"ux_um", "uy_um", "uz_um"}) EXPECT_NEAR(up.number(2, u), 0, 1e-9);  // the base
  write("deep.csv", "x_um,y_um,z_um\n20,20,21\n");
  const Outcome deep = run(forces() + "--points deep.csv --out no.csv");
  EXPECT_NE(deep.code, 0);
  EXPECT_TRUE(has_words(deep.output, "thickness"));
  EXPECT_FALSE(fs::exists(folder_ / "no.csv"));
  const Outcome split = run(forces() + "--model split" + inside + "no.csv");
  EXPECT_NE(split.code, 0);
}

TEST_F(SubstrateProgram, writes_a_surface_that_vtk_opens) {
  ASSERT_EQ(run(forces() + "--model layer --out surface.vtu").code, 0);
  const auto grid = opened(file("surface.vtu"));
  const vtkIdType n_points = grid->GetNumberOfPoints(), n_cells = grid->GetNumberOfCells();
  ASSERT_GT(n_cells, 160 * 160);  // the adhesion's rectangle alone
  for (vtkIdType cell = 0; cell < n_cells; ++cell) ASSERT_EQ(grid->GetCellType(cell), VTK_QUAD);
  EXPECT_GT(largest(grid->GetPointData(), "displacement_um", n_points, 3, 0), 0);
  // a surface in space has three components, but where the third is switched off
  EXPECT_GT(largest(grid->GetPointData(), "displacement_um", n_points, 3, 2), 0);
  ASSERT_EQ(run(forces() + "--model layer --vertical_displacement off --out flat.vtu").code, 0);
  EXPECT_EQ(largest(opened(file("flat.vtu"))->GetPointData(), "displacement_um", n_points, 3, 2), 0);
  // 3 and 1 nN over pi um²
  EXPECT_NEAR(largest(grid->GetCellData(), "traction_kPa", n_cells, 3, 0), 3 / std::numbers::pi, 1e-9);
  EXPECT_NEAR(largest(grid->GetCellData(), "traction_kPa", n_cells, 3, 1), 1 / std::numbers::pi, 1e-9);
  EXPECT_EQ(largest(grid->GetCellData(), "traction_kPa", n_cells, 3, 2), 0);
}

TEST_F(SubstrateProgram, writes_an_inside_that_vtk_opens) {
  ASSERT_EQ(run(forces() + "--model refined --stress --out volume.vtu").code, 0);
  const auto grid = opened(file("volume.vtu"));
  const vtkIdType n_points = grid->GetNumberOfPoints(), n_cells = grid->GetNumberOfCells();
  double volume = 0;
  for (vtkIdType cell = 0; cell < n_cells; ++cell) {
    ASSERT_EQ(grid->GetCellType(cell), VTK_HEXAHEDRON);
    double b[6];
    grid->GetCellBounds(cell, b);
    volume += (b[1] - b[0]) * (b[3] - b[2]) * (b[5] - b[4]);
  }
  double b[6];
  grid->GetBounds(b);
  EXPECT_EQ(b[4], 0);
  EXPECT_EQ(b[5], 20);
  EXPECT_NEAR(volume, (b[1] - b[0]) * (b[3] - b[2]) * 20, 1e-9 * volume);  // filled, none twice
  for (int axis = 0; axis < 3; ++axis) {
    const double u = largest(grid->GetPointData(), "displacement_um", n_points, 3, axis);
    EXPECT_GT(u, 0);
    EXPECT_LT(u, 1);  // 3 nN on a disc of 1 um at 8.4 kPa: 0.2 um
  }
  for (int k = 0; k < 6; ++k) {
    const double stress = largest(grid->GetCellData(), "stress_kPa", n_cells, 6, k);
    EXPECT_GT(stress, 0);
    EXPECT_LT(stress, 10);  // the traction is 1 kPa
  }
  ASSERT_EQ(run(forces() + "--model refined --out plain_volume.vtu").code, 0);
  EXPECT_EQ(opened(file("plain_volume.vtu"))->GetCellData()->GetNumberOfArrays(), 0);
}

TEST_F(SubstrateProgram, says_what_it_lacks) {
  const std::string out = "--out u.csv";
  EXPECT_EQ(run(out).code, 2);
  EXPECT_EQ(run(forces() + out).code, 2);  // a table, and no points
  EXPECT_EQ(run(forces() + "--model layer --out volume.vtu").code, 2);
  for (const std::string model : {"split", "refined"})  // their bulk modulus would be infinite
    EXPECT_EQ(run(forces() + "--poisson_ratio 0.5 --model " + model + " --points points.csv " + out).code, 2);
  EXPECT_EQ(run(forces() + "--poisson_ratio 0.51 --points points.csv " + out).code, 2);
  EXPECT_EQ(run(forces() + "--youngs_modulus_kPa -1 --points points.csv " + out).code, 2);
  write("traction.csv", "x_um,y_um,tx_kPa,ty_kPa\n1,1,1,0\n");
  EXPECT_TRUE(has_words(output_of(run("--traction traction.csv --points points.csv " + out), 3), "area_um2"));
  EXPECT_FALSE(fs::exists(file("u.csv")));
}

/// Loading them takes longer than many a fit.
TEST(Programs, load_no_finite_elements_before_they_need_them) {
  for (const char* program : {"mbtfm-fit", "mbtfm-substrate"}) {
    const Outcome libraries = test::run_program(program, "LD_TRACE_LOADED_OBJECTS=1 ");
    EXPECT_TRUE(has_words(libraries.output, "libc.so"));
    EXPECT_FALSE(has_words(libraries.output, "deal.ii"));
  }
}

TEST_F(SubstrateProgram, takes_large_strains_where_the_material_and_the_tractions_call_for_them) {
  write("points.csv", "x_um,y_um,z_um\n22,20,0\n20,23,2\n16,20,0\n");
  const std::string rest =
      "--displacement_tolerance 0 --elements_across_adhesion 0.7 --growth 10 --points points.csv --out ";
  const auto displaced = [&](const std::string& name) {
    std::vector<double> numbers;
    const files::CsvTable table(file(name));
    for (int row = 0; row < table.n_rows(); ++row)
      for (const char* column : {"ux_um", "uy_um", "uz_um"}) numbers.push_back(table.number(row, column));
    return numbers;
  };
  const auto apart = [&](const std::string& a, double times, const std::string& b) {
    const std::vector<double> x = displaced(a), y = displaced(b);
    double difference = 0, size = 0;
    for (std::size_t k = 0; k < x.size(); ++k) {
      difference += std::pow(times * x[k] - y[k], 2);
      size += y[k] * y[k];
    }
    return std::sqrt(difference / size);
  };
  // 1 kPa, a third of the shear modulus
  ASSERT_EQ(run(forces() + "--model curved " + rest + "small.csv").code, 0);
  ASSERT_EQ(run(forces() + "--material neo-hooke " + rest + "large.csv").code, 0);
  ASSERT_EQ(run(forces() + "--model curved --material neo-hooke --large_strain off " + rest + "off.csv").code, 0);
  EXPECT_EQ(apart("off.csv", 1, "small.csv"), 0);
  // a hundredth of the force: linear theory holds, up to what the elements of each make of so coarse a mesh
  write("forces.csv", "adhesion_id,x_um,y_um,area_um2,fx_nN,fy_nN\n1,20,20,3.141592653589793,0.03,0.01\n");
  ASSERT_EQ(run(forces() + "--material neo-hooke --large_strain on " + rest + "weak.csv").code, 0);
  ASSERT_EQ(run(forces() + "--model curved --material neo-hooke " + rest + "linear.csv").code, 0);
  EXPECT_LT(apart("linear.csv", 100, "small.csv"), 1e-12);
  EXPECT_LT(apart("weak.csv", 1, "linear.csv"), 0.1);
  EXPECT_GT(apart("weak.csv", 100, "large.csv"), 0.005);
  EXPECT_LT(apart("weak.csv", 100, "large.csv"), 0.1);
  // what cannot be
  EXPECT_TRUE(has_words(output_of(run(forces() + "--large_strain on " + rest + "x.csv"), 2), "neo-hooke"));
  const Outcome layer = run(forces() + "--model layer --material neo-hooke --large_strain on " + rest + "x.csv");
  EXPECT_EQ(layer.code, 2);
  const Outcome by_name = run(forces() + "--model layer --material neo-hooke --large_strain auto " + rest + "x.csv");
  EXPECT_EQ(by_name.code, 0) << "0.03 nN need none";
  // a load that turns the gel inside out
  write("forces.csv", "adhesion_id,x_um,y_um,area_um2,fx_nN,fy_nN\n1,20,20,3.141592653589793,900,0\n");
  const Outcome torn = run(forces() + "--material neo-hooke " + rest + "torn.csv");
  EXPECT_TRUE(has_words(output_of(run(forces() + "--model layer --material neo-hooke " + rest + "torn.csv"), 2),
                        "take the model curved or auto"));
  EXPECT_NE(torn.code, 0);
  EXPECT_TRUE(has_words(torn.output, "no state at rest beyond"));
  EXPECT_FALSE(std::filesystem::exists(file("torn.csv")));
}

}  // namespace
}  // namespace mbtfm
