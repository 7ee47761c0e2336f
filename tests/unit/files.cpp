#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/space_files.h"
#include "pipeline/files/text.h"
#include "pipeline/files/texts.h"
#include "pipeline/files/vtk_files.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm {
namespace {

Adhesion adhesion(int id) {
  return {.adhesion_id = id,
          .position_um = {1.0 / 3, 2},
          .area_um2 = 0.5,
          .major_axis_um = 1.2,
          .minor_axis_um = 0.5,
          .angle_rad = 0.25,
          .eccentricity = 0.9,
          .mean_intensity = 100};
}

Fibre fibre(int id) {
  return {.fibre_id = id,
          .type = FibreType::dorsal,
          .width_um = 0.6,
          .start_adhesion_id = 7,
          .mean_intensity = 3,
          .confidence = 0.5,
          .points_um = {{0, 0}, {1, 0.5}, {2, 0.7}},
          .type_confidence = 0.75,
          .type_reason = "start held 0.1 um from adhesion 7; end free"};
}

Network network() {
  return {.vertices_um = {{0, 0}, {1, 0}, {0, 1}},
          .adhesion_id = {7, 0, 8},
          .links = {{.vertex_a = 0, .vertex_b = 1, .fibre_id = 0, .rest_length_um = 1, .share = 0.75},
                    {.vertex_a = 1, .vertex_b = 2, .fibre_id = 3, .rest_length_um = 1.25, .share = 1}}};
}

std::string message_of(const std::function<void()>& action) {
  const auto error = test::caught<InputError>([&] { action(); });
  return error ? error->what() : "no InputError";
}

using Files = test::InFolder;

TEST_F(Files, adhesions_and_fibres_come_back_as_they_were_written) {
  files::write_adhesions(folder / "adhesions.csv", {adhesion(7), adhesion(9)});
  const auto adhesions = files::read_adhesions(folder / "adhesions.csv");
  ASSERT_EQ(adhesions.size(), 2u);
  EXPECT_EQ(adhesions[1].adhesion_id, 9);
  EXPECT_EQ(adhesions[0].position_um.x, 1.0 / 3) << "shortest round-trip numbers lose nothing";
  EXPECT_NEAR(adhesions[0].angle_rad, 0.25, 1e-15) << "one rounding each way through degrees";

  files::write_fibres(folder / "fibres.csv", folder / "fibre_points.csv", {fibre(1), fibre(4)});
  const auto fibres = files::read_fibres(folder / "fibres.csv", folder / "fibre_points.csv");
  ASSERT_EQ(fibres.size(), 2u);
  EXPECT_EQ(fibres[1].type, FibreType::dorsal);
  EXPECT_EQ(fibres[1].start_adhesion_id, 7);
  EXPECT_EQ(fibres[1].end_adhesion_id, std::nullopt);
  EXPECT_TRUE(fibres[1].points_um == fibre(4).points_um);
  EXPECT_EQ(fibres[1].type_confidence, 0.75);
  EXPECT_EQ(fibres[1].type_reason, fibre(4).type_reason);
}

TEST_F(Files, fibres_drawn_elsewhere_need_no_reasons) {
  files::write_text(folder / "fibres.csv",
                    "fibre_id,type,length_um,width_um,start_adhesion_id,end_adhesion_id,mean_intensity,confidence\n"
                    "1,arc,5,0.6,,,3,1\n");
  files::write_text(folder / "fibre_points.csv", "fibre_id,point,x_um,y_um\n1,0,0,0\n1,1,3,4\n");
  const auto fibres = files::read_fibres(folder / "fibres.csv", folder / "fibre_points.csv");
  ASSERT_EQ(fibres.size(), 1u);
  EXPECT_TRUE(fibres[0].type_reason.empty());
}

TEST_F(Files, an_outline_comes_back_with_its_holes_and_without_the_column_is_one_ring) {
  const Polygon outer = {{0, 0}, {10, 0}, {10, 10}, {0, 10}}, hole = {{4, 4}, {6, 4}, {5, 6}};
  files::write_outline(folder / "outline.csv", outer, {hole});
  EXPECT_EQ(files::read_outline(folder / "outline.csv"), (std::vector<Polygon>{outer, hole}));
  files::write_text(folder / "plain.csv", "x_um,y_um\n0,0\n1,0\n0,1\n");
  EXPECT_EQ(files::read_outline(folder / "plain.csv"), (std::vector<Polygon>{{{0, 0}, {1, 0}, {0, 1}}}));
  files::write_text(folder / "gap.csv", "x_um,y_um,ring\n0,0,0\n1,0,0\n0,1,0\n0,0,2\n");
  EXPECT_TRUE(has_words(message_of([&] { files::read_outline(folder / "gap.csv"); }), "rings in order"));
}

TEST_F(Files, a_hole_lies_inside_its_outline) {
  Cell cell{{}, {}, {{0, 0}, {10, 0}, {10, 10}, {0, 10}}, {{{4, 4}, {6, 4}, {5, 6}}}};
  EXPECT_NO_THROW(check(cell));
  cell.holes_um[0][1].x = 11;
  EXPECT_THROW(check(cell), InvalidData);
  cell.holes_um[0] = {{4, 4}, {6, 4}};
  EXPECT_THROW(check(cell), InvalidData);
}

TEST_F(Files, a_network_comes_back_as_it_was_written) {
  files::write_network(folder / "network.vtu", network());
  const Network read = files::read_network(folder / "network.vtu");
  EXPECT_TRUE(read.vertices_um == network().vertices_um);
  EXPECT_EQ(read.adhesion_id, network().adhesion_id);
  ASSERT_EQ(read.links.size(), 2u);
  EXPECT_EQ(read.links[1].fibre_id, 3);
  EXPECT_EQ(read.links[1].rest_length_um, 1.25);
  EXPECT_EQ(read.links[0].share, 0.75);

  files::write_contracted_network(folder / "contracted.vtu", network(), {{0, 0}, {0.5, 0.5}, {0, 1}}, {0.1, 2},
                                  {CableState::collapsed, CableState::slack});
  const ContractedNetwork contracted = files::read_contracted_network(folder / "contracted.vtu");
  EXPECT_EQ(contracted.network.vertices_um[1].y, 0.5);
  EXPECT_EQ(contracted.link_force_nN[1], 2);
}

TEST_F(Files, a_vtk_file_cut_anywhere_is_an_input_error) {
  files::write_network(folder / "network.vtu", network());
  const std::string whole = files::read_text(folder / "network.vtu");
  for (std::size_t n = 0; n < whole.size() - 1; n += 7) {
    files::write_text(folder / "cut.vtu", whole.substr(0, n));
    EXPECT_THROW(files::read_network(folder / "cut.vtu"), InputError) << "cut after " << n << " bytes";
  }
}

TEST_F(Files, an_error_names_file_line_column_label_expectation_and_finding) {
  files::write_adhesions(folder / "adhesions.csv", {adhesion(7), adhesion(11)});
  std::string text = files::read_text(folder / "adhesions.csv");
  text.replace(text.rfind(",0.5,1.2"), 4, ",-3.2");
  files::write_text(folder / "adhesions.csv", text);
  EXPECT_EQ(message_of([&] { files::read_adhesions(folder / "adhesions.csv"); }),
            (folder / "adhesions.csv").string() +
                ":3: column 'area_um2' of adhesion 11: expected a number > 0, found '-3.2'");
}

TEST_F(Files, not_a_number_is_refused_where_a_number_is_due) {
  for (const char* bad : {"nan", "inf", "", "1e", "1.5x", " 1"}) {
    files::write_text(folder / "displacement.csv",
                      std::string("x_um,y_um,ux_um,uy_um,sigma_um\n1,2,") + bad + ",0,0.02\n");
    EXPECT_TRUE(has_words(message_of([&] { files::read_displacement(folder / "displacement.csv"); }),
                          ":2: column 'ux_um': expected a number, found '" + std::string(bad) + "'"));
  }
}

TEST_F(Files, missing_columns_extra_fields_open_quotes_and_early_ends_are_refused) {
  EXPECT_THROW(files::CsvTable("a,b\n1,2,3\n", "t"), InputError);
  EXPECT_THROW(files::CsvTable("a,b\n1\n", "t"), InputError);
  EXPECT_THROW(files::CsvTable("a,b\n1,2", "t"), InputError);
  EXPECT_THROW(files::CsvTable("a,b\n\"1,2\n", "t"), InputError);
  EXPECT_THROW(files::CsvTable("a,a\n1,2\n", "t"), InputError);
  EXPECT_THROW(files::CsvTable("", "t"), InputError);
  EXPECT_THROW(files::CsvTable("a\n1\n", "t").require({"b"}), InputError);
}

TEST_F(Files, semicolons_and_capitals_in_a_table_are_answered_with_how_to_write_it) {
  const auto error_of = [](const std::string& text) {
    const auto error = test::caught<InputError>([&] { files::CsvTable(text, "points.csv").require({"x_um"}); });
    return error ? error->found + " | " + error->hint : std::string("read");
  };
  EXPECT_TRUE(has_words(error_of("x_um;y_um\n1,5;2,5\n"), "semicolons | save it as CSV with commas"));
  EXPECT_TRUE(has_words(error_of("x_um\ty_um\n1\t2\n"), "tabs | "));
  EXPECT_TRUE(has_words(error_of("X_um,y_um\n1,2\n"), "write 'X_um' as 'x_um'"));
}

TEST_F(Files, quoted_fields_and_carriage_returns_are_read) {
  const files::CsvTable table(
      "\xEF\xBB\xBF"
      "a,b\r\n\"x, \"\"y\"\"\",2\r\n",
      "t");
  EXPECT_EQ(table.text(0, "a"), "x, \"y\"");
  EXPECT_EQ(table.integer(0, "b", 0), 2);
  files::CsvText text({"a"});
  text.add("x, \"y\"").end_row();
  EXPECT_EQ(files::CsvTable(text.str(), "t").text(0, "a"), "x, \"y\"");
}

TEST_F(Files, a_full_disk_is_an_output_error) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  EXPECT_THROW(files::write_text("/dev/full", std::string(100000, 'x')), OutputError);
  EXPECT_THROW(files::write_network("/dev/full", network()), OutputError);
}

TEST_F(Files, writers_check_what_they_write) {
  Adhesion bad = adhesion(1);
  bad.area_um2 = -1;
  EXPECT_THROW(files::write_adhesions(folder / "a.csv", {bad}), InvalidData);
  Network torn = network();
  torn.links[0].vertex_b = 17;
  EXPECT_THROW(files::write_network(folder / "n.vtu", torn), InvalidData);
}

TEST_F(Files, an_adhesions_origin_distance_from_the_edge_and_probability_are_kept) {
  std::vector<Adhesion> adhesions;
  for (const AdhesionOrigin origin : values_of<AdhesionOrigin>())
    adhesions.push_back({.adhesion_id = static_cast<int>(adhesions.size()) + 1,
                         .position_um = {1, 2},
                         .area_um2 = 1,
                         .major_axis_um = 1.2,
                         .minor_axis_um = 1.1,
                         .origin = origin});
  adhesions[1].edge_distance_um = 0.25;
  adhesions[1].probability = 0.75;
  files::write_adhesions(folder / "adhesions.csv", adhesions);
  const auto read = files::read_adhesions(folder / "adhesions.csv");
  ASSERT_EQ(read.size(), adhesions.size());
  for (std::size_t i = 0; i < read.size(); ++i) EXPECT_EQ(read[i].origin, adhesions[i].origin);
  EXPECT_FALSE(read[0].edge_distance_um);
  EXPECT_EQ(read[1].edge_distance_um, 0.25);
  EXPECT_FALSE(read[0].probability);
  EXPECT_EQ(read[1].probability, 0.75);
  adhesions[1].probability = 1.5;
  EXPECT_THROW(files::write_adhesions(folder / "adhesions.csv", adhesions), InvalidData);
}

TEST_F(Files, adhesions_of_an_older_version_are_read_as_seen_in_the_image) {
  const std::string columns =
      "adhesion_id,x_um,y_um,area_um2,major_axis_um,minor_axis_um,angle_deg,eccentricity,mean_intensity";
  files::write_text(folder / "adhesions.csv", columns + "\n1,1,2,1,1.2,1.1,0,0.4,100\n");
  const auto read = files::read_adhesions(folder / "adhesions.csv");
  EXPECT_EQ(read.at(0).origin, AdhesionOrigin::image);
  EXPECT_FALSE(read[0].edge_distance_um);
  files::write_text(folder / "adhesions.csv", columns + ",origin\n1,1,2,1,1.2,1.1,0,0.4,100,seen\n");
  EXPECT_THROW(files::read_adhesions(folder / "adhesions.csv"), InputError);
}

TEST_F(Files, a_candidate_stands_for_the_cell_of_its_lattice) {
  const Adhesion disc{.area_um2 = 3.14159265, .origin = AdhesionOrigin::candidate};  // of 2 um, on a lattice of 2 um
  EXPECT_NEAR(area_stood_for_um2(disc), std::sqrt(3.0) / 2 * 4, 1e-6);
  EXPECT_EQ(area_stood_for_um2({.area_um2 = 1.5}), 1.5);
}

using Columns = test::InFolder;

TEST_F(Columns, a_truth_value_is_written_for_r_and_pandas_and_read_as_any_program_writes_it) {
  files::write_tensions(folder / "tensions.csv", {{.fibre_id = 0, .tension_nN = 1}}, {});
  EXPECT_TRUE(has_words(files::read_text(folder / "tensions.csv"), ",TRUE\n"));
  const auto is_identifiable = [&](const std::string& word) {
    files::write_text(folder / "tensions.csv", "fibre_id,tension_nN,identifiable\n0,1," + word + "\n");
    return files::read_tensions(folder / "tensions.csv").at(0).identifiable;
  };
  for (const char* word : {"TRUE", "True", "true"}) EXPECT_TRUE(is_identifiable(word));
  for (const char* word : {"FALSE", "False", "false"}) EXPECT_FALSE(is_identifiable(word));
  for (const char* word : {"1", "yes", ""}) EXPECT_THROW(is_identifiable(word), InputError);
}

TEST_F(Columns, a_table_of_an_older_version_is_read_and_its_later_columns_are_unset) {
  files::write_text(folder / "tensions.csv",
                    "fibre_id,type,tension_nN,low_nN,high_nN,identifiable\n1,ventral,4.17,3.37,4.98,true\n");
  const Tension tension = files::read_tensions(folder / "tensions.csv").at(0);
  EXPECT_EQ(tension.high_nN, 4.98);
  EXPECT_FALSE(tension.sigma_nN.has_value());
  files::write_text(folder / "forces.csv", "adhesion_id,fx_nN,fy_nN,sigma_nN,connected\n3,1,2,0.1,true\n");
  const AdhesionForce force = files::read_adhesion_forces(folder / "forces.csv").at(0);
  EXPECT_EQ(force.sigma_nN, 0.1);
  EXPECT_FALSE(force.low_nN.has_value());
}

TEST_F(Files, displacements_in_space_come_back_and_are_checked) {
  const std::vector<BeadInSpace> beads = {{{1, 2, 3.25}, {0.1, -0.2, 1.0 / 3}, 0.01, 0.03, ""},
                                          {{4, 5, 6}, {}, 0, 0, "defocused"}};
  files::write_displacement_in_space(folder / "d.csv", beads);
  const std::vector<BeadInSpace> read = files::read_displacement_in_space(folder / "d.csv");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].position_um, beads[0].position_um);
  EXPECT_EQ(read[0].displacement_um, beads[0].displacement_um);
  EXPECT_EQ(read[0].sigma_z_um, 0.03);
  EXPECT_EQ(read[1].flag, "defocused");
  EXPECT_THROW(check(std::vector<BeadInSpace>{{{0, 0, 0}, {}, 0, -1, ""}}), InvalidData);
  files::write_text(folder / "bare.csv", "x_um,y_um,z_um,ux_um,uy_um,uz_um\n1,2,3,0,0,0.5\n");
  EXPECT_EQ(files::read_displacement_in_space(folder / "bare.csv").front().displacement_um.z, 0.5);
  files::write_text(folder / "flat.csv", "x_um,y_um,ux_um,uy_um\n1,2,0,0\n");
  EXPECT_THROW(files::read_displacement_in_space(folder / "flat.csv"), InputError);
}

TEST_F(Files, heights_of_a_lattice_come_in_any_order_and_have_holes) {
  std::string text = "z_um,y_um,x_um\n";
  for (const int i : {2, 0, 3, 1})
    for (const int j : {1, 3, 0, 2})
      if (i != 3 || j != 2)
        text += (i == 1 && j == 1 ? "" : std::to_string(10 * j + i)) + "," + std::to_string(2 * j) + "," +
                std::to_string(i) + "\n";
  files::write_text(folder / "lattice.csv", text);
  const HeightMap map = files::read_heights(folder / "lattice.csv");
  EXPECT_EQ(map.spacing_um, (Vec2{1, 2}));
  for (std::size_t k = 0; k < 16; ++k) {
    const std::size_t i = k % 4, j = k / 4;
    const bool is_hole = (i == 1 && j == 1) || (i == 3 && j == 2);
    if (is_hole)
      EXPECT_TRUE(std::isnan(map.z_um[k]));
    else
      EXPECT_EQ(map.z_um[k], static_cast<double>(10 * j + i));
  }
}

/// Of a lattice from its lines: n rows may claim n x n vertices.
TEST_F(Files, heights_along_a_diagonal_are_refused_before_memory_is_taken) {
  std::string text = "x_um,y_um,z_um\n";
  for (int k = 0; k < 100'000; ++k) text += std::to_string(k) + "," + std::to_string(k) + ",1\n";
  files::write_text(folder / "diagonal.csv", text);
  const InputError error = test::thrown<InputError>([&] { files::read_heights(folder / "diagonal.csv"); });
  EXPECT_TRUE(has_words(error.expected, "100000 x 100000 vertices")) << error.what();
}

TEST_F(Files, two_heights_for_one_place_are_refused_by_line) {
  std::string text = "x_um,y_um,z_um\n";
  for (int k = 0; k < 16; ++k) text += std::to_string(k % 4) + "," + std::to_string(k / 4) + ",1\n";
  files::write_text(folder / "twice.csv", text + "2,1,5\n");
  const InputError error = test::thrown<InputError>([&] { files::read_heights(folder / "twice.csv"); });
  EXPECT_TRUE(has_words(error.where, ":18")) << error.what();
}

/// What a later stage computes with comes back as it was; a result has the digits that mean something.
TEST_F(Columns, results_have_six_digits_and_what_is_computed_with_has_all) {
  const double third = 1.0 / 3;
  files::write_tensions(folder / "tensions.csv",
                        {{.fibre_id = 0, .tension_nN = third, .low_nN = third, .sigma_nN = third}}, {});
  EXPECT_EQ(files::read_text(folder / "tensions.csv"),
            "fibre_id,type,tension_nN,low_nN,high_nN,sigma_nN,identifiable\n"
            "0,network,0.333333,0.333333,,0.333333,TRUE\n");
  const DisplacementField field = {
      {.position_um = {third, third}, .displacement_um = {third, third}, .sigma_um = third}};
  files::write_displacement(folder / "displacement.csv", field);
  EXPECT_EQ(files::read_displacement(folder / "displacement.csv").at(0).sigma_um, third);
}

TEST_F(Files, numbers_that_no_cell_can_have_are_refused_by_row_and_column) {
  const auto refusal = [&](const std::string& row) {
    files::write_text(folder / "a.csv", "x_um,y_um,ux_um,uy_um,traction_kPa\n1,2,0,0,3\n" + row + "\n");
    const files::CsvTable table(folder / "a.csv");
    const auto error = test::caught<InputError>([&] {
      for (const char* column : {"x_um", "y_um", "ux_um", "uy_um", "traction_kPa"}) table.number(1, column);
    });
    return error ? std::string(error->what()) : std::string();
  };
  EXPECT_EQ(refusal("-1e6,1e6,0,0,-1e30"), "");
  for (const char* row : {"1e7,0,0,0,0", "0,-1e300,0,0,0", "0,0,1e40,0,0"})
    EXPECT_TRUE(has_words(refusal(row), "a number >= -1e+06 and <= 1e+06"));
  EXPECT_TRUE(has_words(refusal("0,0,0,0,1e200"), "a.csv:3: column 'traction_kPa'"));
}

TEST_F(Files, tractions_are_read_as_people_write_them) {
  const auto read = [&](const std::string& text) {
    files::write_text(folder / "t.csv", text);
    return files::read_tractions(folder / "t.csv");
  };
  const std::string rows = "0,5;0,5;1,25;0\n2,5;0,5;0;-1,5\n0,5;1,5;0;0\n2,5;1,5;0;0\n";
  for (const std::string header :
       {"x_um;y_um;tx_kPa;ty_kPa\n", "sep=;\n# of our program\nX_um;Y_um;tx_kpa; ty_kPa\n"}) {
    const std::vector<GroundPatch> patches = read(header + rows + ";;;\n");
    ASSERT_EQ(patches.size(), 4u) << header;
    EXPECT_EQ(patches[1].position_um, (Vec2{2.5, 0.5}));
    EXPECT_EQ(patches[1].traction_kPa, (Vec2{0, -1.5}));
    EXPECT_EQ(patches[1].area_um2, 2);
  }
  const auto error = test::caught<InputError>([&] { read("x;y;tx;ty\n" + rows); });
  ASSERT_TRUE(error);
  EXPECT_TRUE(has_words(error->what(), "tx_kPa")) << error->what();
}

TEST_F(Files, standard_errors_of_tractions_in_space_come_back_where_they_are_known) {
  const std::vector<SurfaceTraction> rows = {{.sigma_kPa = Vec3{1, 2, 3}}, {}};
  files::write(folder / "t.csv", files::surface_traction_table(), rows);
  const std::vector<SurfaceTraction> back = files::read(folder / "t.csv", files::surface_traction_table());
  EXPECT_EQ(norm(back[0].sigma_kPa.value_or(Vec3{}) - Vec3{1, 2, 3}), 0);
  EXPECT_FALSE(back[1].sigma_kPa);
}

TEST_F(Files, what_has_no_end_is_refused_and_what_is_empty_is_empty) {
  EXPECT_EQ(files::read_text("/dev/null"), "");
  EXPECT_THROW(files::read_text("/dev/zero"), InputError);
}

TEST_F(Files, texts_have_sections_keys_and_lines_that_go_on) {
  const files::Texts texts("# of nothing\n[a b] its own\nx: one,\n  two\nd_#_um: # um deep\n\n[c]\nx: three: four\n");
  EXPECT_EQ(texts.at("a b", ""), "its own");
  EXPECT_EQ(texts.at("a b", "x"), "one, two");
  EXPECT_EQ(texts.at("c", "x"), "three: four");
  EXPECT_EQ(texts.at("a b", "d_15_um"), "15 um deep");
  EXPECT_FALSE(texts.find("c", "d_15_um"));
  EXPECT_THROW(texts.at("c", "y"), std::logic_error);
  EXPECT_THROW(files::Texts("[a]\nx: 1\nx: 2\n"), std::logic_error);
  EXPECT_THROW(files::Texts("[a]\nno key\n"), std::logic_error);
}

TEST_F(Files, a_surface_beyond_a_metre_is_none) {
  HeightMap map{.origin_um = {0, 0}, .spacing_um = {1, 1}, .n_x = 4, .n_y = 4};
  map.z_um.assign(16, -2);
  EXPECT_NO_THROW(check(map));
  for (const double far : {1e300, -2e6, std::nan("")}) {
    HeightMap high = map, away = map, wide = map;
    high.z_um[5] = far;
    away.origin_um.y = far;
    wide.spacing_um.x = std::abs(far);
    for (const HeightMap& damaged : {high, away, wide}) EXPECT_THROW(check(damaged), InvalidData) << far;
    const TriangleMesh mesh{.points_um = {{0, 0, 0}, {1, 0, 0}, {0, 1, far}}, .triangles = {{0, 1, 2}}};
    EXPECT_THROW(check(mesh), InvalidData) << far;
  }
}

}  // namespace
}  // namespace mbtfm
