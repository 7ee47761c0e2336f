/// The files for ParaView, read by VTK's own readers: what is in them, in which unit, how large.
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkPointData.h>
#include <vtkXMLGenericDataObjectReader.h>

#include "pipeline/contract/results.h"
#include "pipeline/files/csv_files.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

/// A small cell that went through every stage, from images.
const fs::path& cell() {
  static const TemporaryFolder folder;
  static const fs::path made = [] {
    const fs::path path = folder / "cell";
    output_of("mbtfm-simulate --scenario ring --seed 101 --beads 800 --images --quiet --out " + path.string());
    output_of("mbtfm run " + path.string());
    return path;
  }();
  return made;
}

vtkSmartPointer<vtkDataSet> opened(const fs::path& file) {
  const auto reader = vtkSmartPointer<vtkXMLGenericDataObjectReader>::New();
  reader->SetFileName(file.c_str());
  reader->Update();
  return vtkDataSet::SafeDownCast(reader->GetOutput());
}

/// Smallest and largest magnitude of an array of points or cells.
struct Extent {
  double low = 0, high = 0;
  int n_components = 0;
};
Extent extent_of(const std::string& file, const char* array) {
  const auto data = opened(cell() / file);
  if (!data) throw std::runtime_error("VTK cannot read " + file);
  vtkDataArray* values = data->GetPointData()->GetArray(array);
  if (!values) values = data->GetCellData()->GetArray(array);
  if (!values) throw std::runtime_error(file + " has no array " + array);
  double range[2];
  values->GetRange(range, values->GetNumberOfComponents() > 1 ? -1 : 0);
  return {range[0], range[1], values->GetNumberOfComponents()};
}

void expect_the_arrays_of_the_page_on_formats() {
  const std::map<std::string, std::set<std::string>> expected = {
      {"1_segment/cell.vtp", {"adhesion_id", "adhesion_origin", "fibre_id", "fibre_type"}},
      {"2_track/displacement.vtp", {"displacement_um", "sigma_um", "is_good"}},
      {"3_network/network.vtu", {"fibre_id", "rest_length_um", "share", "adhesion_id"}},
      {"4_fit/contracted.vtu", {"fibre_id", "force_nN", "contraction_um", "adhesion_id"}},
      {"4_fit/tractions.vtp", {"adhesion_id", "force_nN", "traction_kPa"}},
      {"4_fit/displacement.vtp", {"measured_um", "fitted_um", "residual_um"}},
      {"4_fit/substrate.vtu", {"displacement_um", "traction_kPa"}}};
  std::set<std::string> found;
  for (const auto& entry : fs::recursive_directory_iterator(cell())) {
    const std::string file = fs::relative(entry.path(), cell()).generic_string();
    if (file.starts_with("truth/") || (entry.path().extension() != ".vtp" && entry.path().extension() != ".vtu"))
      continue;
    found.insert(file);
    ASSERT_TRUE(expected.contains(file)) << file << " is new: say here what is in it";
    for (const std::string& array : expected.at(file)) EXPECT_NO_THROW(extent_of(file, array.c_str())) << file;
  }
  EXPECT_EQ(found.size(), expected.size());
}

void expect_the_unit_in_the_name_of_every_quantity() {
  // numbers without a unit
  const std::set<std::string> pure = {"adhesion_id", "adhesion_origin", "fibre_id",         "fibre_type", "is_good",
                                      "share",       "state",           "informs_fibre_id", "weight"};
  for (const auto& entry : fs::recursive_directory_iterator(cell())) {
    if (entry.path().extension() != ".vtp" && entry.path().extension() != ".vtu") continue;
    const auto data = opened(entry.path());
    ASSERT_TRUE(data) << entry.path();
    for (vtkFieldData* arrays :
         {static_cast<vtkFieldData*>(data->GetPointData()), static_cast<vtkFieldData*>(data->GetCellData())}) {
      for (int i = 0; i < arrays->GetNumberOfArrays(); ++i) {
        const std::string name = arrays->GetArrayName(i);
        const bool has_unit = name.ends_with("_um") || name.ends_with("_nN") || name.ends_with("_kPa");
        EXPECT_TRUE(has_unit || pure.contains(name)) << entry.path() << ": " << name;
      }
    }
  }
}

void expect_the_numbers_of_the_tables() {
  double largest_force_nN = 0, largest_displacement_um = 0;
  for (const AdhesionForce& f : files::read_adhesion_forces(cell() / "4_fit/adhesion_forces.csv"))
    largest_force_nN = std::max(largest_force_nN, norm(f.force_nN));
  for (const Bead& b : files::read_displacement(cell() / "2_track/displacement.csv"))
    largest_displacement_um = std::max(largest_displacement_um, norm(b.displacement_um));
  // written as doubles, and as shortest round-trip numbers: the same but for the rounding of a norm
  EXPECT_NEAR(extent_of("4_fit/tractions.vtp", "force_nN").high, largest_force_nN, 1e-12 * largest_force_nN);
  EXPECT_NEAR(extent_of("2_track/displacement.vtp", "displacement_um").high, largest_displacement_um,
              1e-12 * largest_displacement_um);
  int largest_id = 0;
  for (const Tension& t : files::read_tensions(cell() / "4_fit/tensions.csv"))
    largest_id = std::max(largest_id, t.fibre_id);
  EXPECT_EQ(extent_of("4_fit/contracted.vtu", "fibre_id").low, 0) << "the actin network";
  EXPECT_EQ(extent_of("4_fit/contracted.vtu", "fibre_id").high, largest_id);
}

void expect_finite_values_of_a_cells_size() {
  struct Bound {
    const char *file, *array;
    int n_components;
    double low, high;
  };
  // generous: a wrong unit is off by a thousand, a wrong pixel size by ten
  const Bound bounds[] = {{"2_track/displacement.vtp", "displacement_um", 3, 0.01, 10},
                          {"3_network/network.vtu", "rest_length_um", 1, 0.1, 10},
                          {"4_fit/contracted.vtu", "force_nN", 1, 0.1, 100},
                          {"4_fit/tractions.vtp", "traction_kPa", 3, 0.1, 200},
                          {"4_fit/displacement.vtp", "fitted_um", 3, 0.01, 10},
                          {"4_fit/substrate.vtu", "displacement_um", 3, 0.01, 20}};
  for (const Bound& b : bounds) {
    const Extent extent = extent_of(b.file, b.array);
    EXPECT_EQ(extent.n_components, b.n_components) << b.file << " " << b.array;
    EXPECT_TRUE(std::isfinite(extent.low)) << b.file << " " << b.array;
    EXPECT_GE(extent.high, b.low) << b.file << " " << b.array;
    EXPECT_LE(extent.high, b.high) << b.file << " " << b.array;
  }
}

// one test: each would make the cell anew
TEST(VtkFiles, hold_the_arrays_that_they_should_with_units_and_the_numbers_of_the_tables) {
  expect_the_arrays_of_the_page_on_formats();
  expect_the_unit_in_the_name_of_every_quantity();
  expect_the_numbers_of_the_tables();
  expect_finite_values_of_a_cells_size();
}

TEST(VtkFiles, paraview_shows_the_standard_view) {
  // ParaView and the VTK that the programs are built with exclude each other in Debian 12: seldom on one machine
  if (std::system("command -v pvbatch >/dev/null 2>&1 && command -v xvfb-run >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "no pvbatch and xvfb-run here (Debian: paraview, xvfb)";
  const fs::path picture = cell() / "view.png";
  const std::string command = "xvfb-run -a -s '-noreset -screen 0 1280x1024x24' pvbatch '" +
                              (cell() / "view_in_paraview.py").string() + "' '" + picture.string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
  ASSERT_TRUE(fs::exists(picture));
  EXPECT_GT(fs::file_size(picture), 50000u) << "an empty view has some 5 kB";
}

}  // namespace
}  // namespace mbtfm
