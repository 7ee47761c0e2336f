/// network.vtu as others write it, and damaged.
#include "pipeline/contract/errors.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/files/vtu_file.h"
#include "tests/support/fake_tables.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vtu_variants.h"

namespace mbtfm {
namespace {

std::string written(const TemporaryFolder& folder) {
  files::write_network(folder / "written.vtu", test::small_network());
  return files::read_text(folder / "written.vtu");
}

Network read_back(const TemporaryFolder& folder, const std::string& text) {
  files::write_text(folder / "read.vtu", text);
  return files::read_network(folder / "read.vtu");
}

std::string refusal(const TemporaryFolder& folder, const std::string& text) {
  const auto error = test::caught<InputError>([&] { read_back(folder, text); });
  return error ? error->what() + std::string("; ") + error->hint : "read";
}

std::string with(std::string text, const std::string& old, const std::string& now) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, text.npos) << old;
  return at == text.npos ? text : text.replace(at, old.size(), now);
}

void expect_same(const Network& read, const Network& truth) {
  EXPECT_TRUE(read.vertices_um == truth.vertices_um);
  EXPECT_EQ(read.adhesion_id, truth.adhesion_id);
  ASSERT_EQ(read.links.size(), truth.links.size());
  for (std::size_t k = 0; k < truth.links.size(); ++k) {
    EXPECT_EQ(read.links[k].vertex_a, truth.links[k].vertex_a);
    EXPECT_EQ(read.links[k].vertex_b, truth.links[k].vertex_b);
    EXPECT_EQ(read.links[k].fibre_id, truth.links[k].fibre_id);
    EXPECT_EQ(read.links[k].rest_length_um, truth.links[k].rest_length_um);
    EXPECT_EQ(read.links[k].share, truth.links[k].share);
  }
}

using VtuFiles = test::InFolder;

TEST_F(VtuFiles, a_network_reads_the_same_however_vtk_stores_it) {
  const std::string whole = written(folder);
  for (const test::VtuVariant& variant : test::vtu_variants()) {
    SCOPED_TRACE(variant.name());
    // VTK's text has eleven digits and more: here enough for the doubles to come back
    const Network read = read_back(folder, test::stored_as(whole, variant));
    ASSERT_EQ(read.links.size(), test::small_network().links.size());
    if (variant.mode != test::VtuMode::ascii) expect_same(read, test::small_network());
  }
}

TEST_F(VtuFiles, a_compression_that_is_not_known_is_refused_by_its_name) {
  const std::string lzma = test::stored_as(written(folder), {.compressor = vtkXMLWriterBase::LZMA});
  EXPECT_TRUE(has_words(refusal(folder, lzma), "vtkLZMADataCompressor"));
}

/// As meshio writes it: 64-bit sizes, no padding of numbers, another order of the sections, Float32 labels allowed.
TEST_F(VtuFiles, text_written_by_hand_and_in_pieces_is_read) {
  const auto piece = [](int first_adhesion) {
    return R"(<Piece NumberOfPoints="3" NumberOfCells="2"><Points><DataArray type="Float64" Name="Points"
      NumberOfComponents="3" format="ascii">0 0 0  1 0.5 0  2 1e0 0</DataArray></Points>
      <Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 1 2</DataArray>
      <DataArray type="Int32" Name="offsets" format="ascii">2 4</DataArray>
      <DataArray type="UInt8" Name="types" format="ascii">3 3</DataArray></Cells>
      <PointData><DataArray type="Float32" Name="adhesion_id" format="ascii">)" +
           std::to_string(first_adhesion) + R"( 0 0</DataArray></PointData>
      <CellData><DataArray type="Int64" Name="fibre_id" NumberOfComponents="1" format="ascii">0 2</DataArray>
      <DataArray type="Float64" Name="rest_length_um" format="ascii">1 1.5</DataArray></CellData></Piece>)";
  };
  const Network read = read_back(folder, "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\"><UnstructuredGrid>" +
                                             piece(4) + piece(9) + "</UnstructuredGrid></VTKFile>");
  EXPECT_EQ(read.adhesion_id, (std::vector<int>{4, 0, 0, 9, 0, 0}));
  ASSERT_EQ(read.links.size(), 4u);
  EXPECT_EQ(read.links[2].vertex_a, 3);
  EXPECT_EQ(read.links[3].fibre_id, 2);
  EXPECT_EQ(read.links[3].share, 1);
  EXPECT_EQ(read.vertices_um[4], (Vec2{1, 0.5}));
}

TEST_F(VtuFiles, what_a_file_claims_is_compared_with_what_it_holds) {
  const std::string whole = written(folder);
  const std::string points = "NumberOfPoints=\"41\"", cells = "NumberOfCells=\"40\"";
  for (const auto& [changed, expected] : std::vector<std::pair<std::string, std::string>>{
           {with(whole, points, "NumberOfPoints=\"42\""), "blocks of"},
           {with(whole, points, "NumberOfPoints=\"-1\""), "a number of points or cells"},
           {with(whole, points, "NumberOfPoints=\"4000000000\""), "as the file can hold"},
           {with(whole, points, "NumberOfPoints=\"18446744073709551615\""), "as the file can hold"},
           {with(whole, cells, "NumberOfCells=\"39\""), "blocks of"},
           {with(whole, cells, "NumberOfCells=\"99999999999\""), "as the file can hold"},
           {with(whole, "offset=\"0\"", "offset=\"99999999\""), "within the appended data"},
           {with(whole, "offset=\"0\"", "offset=\"-8\""), "within the appended data"},
           {with(whole, "type=\"Int32\"", "type=\"Float16\""), "a type of VTK"},
           {with(whole, "type=\"Int32\"", "type=\"Int64\""), "blocks of"},
           {with(whole, "NumberOfComponents=\"3\"", "NumberOfComponents=\"2\""), "3 components"},
           {with(whole, "format=\"appended\"", "format=\"telepathy\""), "ascii, binary or appended"},
           {with(whole, "UnstructuredGrid", "PolyData"), "unstructured grid"},
           {with(whole, "fibre_id", "fibre_ID"), "cell array 'fibre_id'"}}) {
    EXPECT_TRUE(has_words(refusal(folder, changed), expected));
  }
}

TEST_F(VtuFiles, sizes_of_blocks_are_compared_with_the_array) {
  const std::string whole = written(folder);
  const std::size_t begin = whole.find('_', whole.find("<AppendedData")) + 1;
  for (const std::size_t word : {0, 1, 2, 3}) {  // blocks, their size, the last one's, the first one's packed size
    for (const std::uint32_t value : {0u, 1u, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
      std::string changed = whole;
      if (word == 0 && value == 1) continue;  // as it is
      if (word == 2 && value == 0) continue;  // VTK's word for: full
      for (int k = 0; k < 4; ++k) changed[begin + 4 * word + k] = static_cast<char>(value >> 8 * k);
      EXPECT_NE(refusal(folder, changed), "read") << "word " << word << " set to " << value;
    }
  }
}

TEST_F(VtuFiles, a_cell_is_a_line_between_points_of_the_file) {
  const std::string text = test::stored_as(written(folder), {.mode = test::VtuMode::ascii});
  const auto in_array = [&](const std::string& name, const std::string& first) {
    const std::size_t tag = text.find("Name=\"" + name + "\""),
                      at = text.find_first_of("0123456789", text.find('>', tag));
    std::string changed = text;
    return changed.replace(at, text.find_first_of(" \n", at) - at, first);
  };
  EXPECT_EQ(refusal(folder, in_array("types", "3")), "read");
  for (const auto& [array, value] : std::vector<std::pair<std::string, std::string>>{{"types", "5"},
                                                                                     {"offsets", "3"},
                                                                                     {"offsets", "-2"},
                                                                                     {"connectivity", "41"},
                                                                                     {"connectivity", "0.5"},
                                                                                     {"connectivity", "nan"},
                                                                                     {"fibre_id", "99999999999"},
                                                                                     {"fibre_id", "1.5"},
                                                                                     {"rest_length_um", "nan"},
                                                                                     {"rest_length_um", "0"},
                                                                                     {"adhesion_id", "-1"},
                                                                                     {"types", "1e300"}})
    EXPECT_NE(refusal(folder, in_array(array, value)), "read") << array << ": " << value;
}

/// Two triangles and a quadrilateral, in two pieces, beside a line.
std::string polygons_in_text() {
  const auto piece = [](const std::string& counts, const std::string& ends, const std::string& corners) {
    return "<Piece NumberOfPoints=\"4\" " + counts + R"(><PointData><DataArray type="Float32" Name="sigma_um"
      format="ascii">1 2 3 4</DataArray></PointData><Points><DataArray type="Float32" Name="Points"
      NumberOfComponents="3" format="ascii">0 0 5  1 0 5  1 1 5  0 1 5</DataArray></Points><Lines><DataArray
      type="Int64" Name="connectivity" format="ascii">0 1</DataArray><DataArray type="Int64" Name="offsets"
      format="ascii">2</DataArray></Lines><Polys><DataArray type="Int64" Name="connectivity" format="ascii">)" +
           corners + "</DataArray><DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">" + ends +
           "</DataArray></Polys></Piece>";
  };
  return "<VTKFile type=\"PolyData\" version=\"0.1\"><PolyData>" +
         piece("NumberOfLines=\"1\" NumberOfPolys=\"2\"", "3 6", "0 1 2 0 2 3") +
         piece("NumberOfLines=\"1\" NumberOfPolys=\"1\"", "4", "0 1 2 3") + "</PolyData></VTKFile>";
}

TEST_F(VtuFiles, polygons_are_read_piece_by_piece) {
  const files::VtuFile file(polygons_in_text(), "surface.vtp", files::VtuKind::poly_data);
  EXPECT_EQ(file.polygons(), (std::vector<std::vector<int>>{{0, 1, 2}, {0, 2, 3}, {4, 5, 6, 7}}));
  EXPECT_EQ(file.scalars(files::VtuSection::point_data, "sigma_um"), (std::vector<double>{1, 2, 3, 4, 1, 2, 3, 4}));
  EXPECT_EQ(file.coordinates().size(), 24u);
}

TEST_F(VtuFiles, damaged_polygons_are_refused) {
  const std::string whole = polygons_in_text();
  for (const auto& [changed, expected] : std::vector<std::pair<std::string, std::string>>{
           {with(whole, "NumberOfPolys=\"2\"", "NumberOfPolys=\"3\""), "3 numbers"},
           {with(whole, "NumberOfPolys=\"2\"", "NumberOfPolys=\"2000000000\""), "as the file can hold"},
           {with(whole, "NumberOfPolys=\"2\"", "NumberOfPolys=\"18446744073709551615\""), "as the file can hold"},
           {with(whole, "NumberOfPolys=\"2\"", "NumberOfPolys=\"two\""), "a number of points or cells"},
           {with(whole, "NumberOfLines", "NumberOfStrips"), "strips of triangles"},
           {with(whole, ">3 6<", ">3 1e300<"), "three or more corners"},
           {with(whole, ">3 6<", ">3 2<"), "three or more corners"},
           {with(whole, ">3 6<", ">3 5<"), "three or more corners"},
           {with(whole, ">3 6<", ">3 7<"), "7 numbers"},
           {with(whole, "0 2 3<", "0 2 4<"), "a point below 4"},
           {with(whole, "0 2 3<", "0 2 -1<"), "a point below 4"},
           {with(whole, "type=\"PolyData\"", "type=\"UnstructuredGrid\""), "polygons (.vtp"}}) {
    const auto refusal_of = [](const std::string& text) -> std::string {
      const auto error =
          test::caught<InputError>([&] { files::VtuFile(text, "surface.vtp", files::VtuKind::poly_data).polygons(); });
      return error ? error->what() : "read";
    };
    EXPECT_TRUE(has_words(refusal_of(changed), expected));
  }
}

}  // namespace
}  // namespace mbtfm
