/// Where the image's border cuts a cell: outline, fibres, files, the network's held vertices.
#include "network/mesh/mesh.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/text.h"
#include "pipeline/files/vtk_files.h"
#include "segment/cells/fibre_ends.h"
#include "segment/cells/outline.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm {
namespace {

using cells::cut_by_border;
using cells::CutRing;

constexpr Vec2 kField_um{50, 40};

TEST(Cut, pieces_with_both_ends_at_one_side_are_cut_and_put_onto_it) {
  const cells::CutRing cut = cells::cut_by_border({{0.2, 10}, {20, 5}, {20, 30}, {0.1, 30}}, kField_um, 0.5);
  EXPECT_EQ(cut.is_cut, (std::vector<bool>{false, false, false, true}));
  EXPECT_EQ(cut.points_um.front().x, 0);
  EXPECT_EQ(cut.points_um.back().x, 0);
  EXPECT_EQ(cut.points_um[1].x, 20);
}

TEST(Cut, a_point_that_touches_the_border_is_no_cut) {
  const cells::CutRing cut = cells::cut_by_border({{0.2, 10}, {20, 5}, {20, 30}}, kField_um, 0.5);
  EXPECT_EQ(std::ranges::count(cut.is_cut, true), 0);
  EXPECT_EQ(cut.points_um.front().x, 0.2);
}

TEST(Cut, a_ring_round_the_images_corner_gets_the_corner) {
  const cells::CutRing cut = cells::cut_by_border({{0, 20}, {0, 1}, {1, 0}, {20, 0}, {15, 15}}, kField_um, 0.5);
  EXPECT_EQ(cut.points_um.size(), 6u);
  EXPECT_TRUE(cut.points_um[2] == (Vec2{0, 0}));
  EXPECT_EQ(cut.is_cut, (std::vector<bool>{true, true, true, true, false, false}));
  // a straight line between two sides, far from the corner, is the cell's own edge
  EXPECT_EQ(std::ranges::count(cells::cut_by_border({{0, 20}, {20, 0}, {15, 15}}, kField_um, 0.5).is_cut, true), 0);
}

Fibre fibre(const Polyline& points) {
  Fibre f;
  f.fibre_id = 1;
  f.width_um = 0.5;
  f.points_um = points;
  return f;
}

TEST(Cut, a_free_end_that_points_at_the_cut_is_led_to_it_and_its_type_is_uncertain) {
  const Cuts cuts = {{{0, 0}, {0, 40}}};
  Fibre f = fibre({{10, 20}, {5, 20}, {0.6, 20}});
  cells::lead_to_cut(f, cuts, 1);
  EXPECT_EQ(f.points_um.size(), 4u);
  EXPECT_NEAR(f.points_um.back().x, 0, 1e-12);
  EXPECT_LE(f.type_confidence, 0.5);
  cells::lead_to_cut(f, cuts, 1);  // it is there
  EXPECT_EQ(f.points_um.size(), 4u);
}

TEST(Cut, ends_that_are_held_far_or_run_along_it_stay) {
  const Cuts cuts = {{{0, 0}, {0, 40}}};
  Fibre held = fibre({{10, 20}, {0.6, 20}}), far = fibre({{10, 20}, {1.5, 20}}), along = fibre({{0.6, 10}, {0.6, 30}});
  held.end_adhesion_id = 3;
  for (Fibre* f : {&held, &far, &along}) {
    cells::lead_to_cut(*f, cuts, 1);
    EXPECT_EQ(f->points_um.size(), 2u);
    EXPECT_EQ(f->type_confidence, 1);
  }
}

TEST(Cut, an_outline_comes_back_with_its_cut_and_without_one_has_no_such_column) {
  const TemporaryFolder folder;
  const Polygon outer = {{0, 0}, {10, 0}, {10, 10}, {0, 10}};
  files::write_adhesions(folder / "adhesions.csv", {});
  files::write_fibres(folder / "fibres.csv", folder / "fibre_points.csv", {});
  files::write_outline(folder / "outline.csv", outer, {{{4, 4}, {6, 4}, {5, 6}}}, {false, false, false, true});
  EXPECT_EQ(files::read_cell(folder.path()).is_cut, (std::vector<bool>{false, false, false, true}));
  ASSERT_EQ(cuts_of(files::read_cell(folder.path())).size(), 1u);
  EXPECT_EQ(distance_to_cut_um(files::read_cell(folder.path()), {3, 5}), 3);
  files::write_outline(folder / "outline.csv", outer, {}, {false, false, false, false});
  EXPECT_TRUE(files::read_cell(folder.path()).is_cut.empty());
  files::write_text(folder / "outline.csv", "x_um,y_um,ring,is_cut\n0,0,0,true\n9,0,0,false\n0,9,0,2\n");
  EXPECT_THROW(files::read_cell(folder.path()), InputError);
}

/// A square that the image cuts at its left, with an adhesion in the middle and a fibre from it through the cut.
Cell square() {
  Cell cell{{}, {}, {{0, 0}, {20, 0}, {20, 20}, {0, 20}}, {}, {false, false, false, true}};
  for (const double y : {6.0, 10.0, 14.0}) {
    Adhesion a;
    a.adhesion_id = static_cast<int>(cell.adhesions.size()) + 1;
    a.position_um = {12, y};
    a.major_axis_um = a.minor_axis_um = 1;
    a.area_um2 = 0.785;
    cell.adhesions.push_back(a);
  }
  cell.fibres.push_back(fibre({{0, 10.4}, {6, 10.2}, {12, 10}}));
  cell.fibres.front().end_adhesion_id = 2;
  return cell;
}

TEST(Cut, holds_the_vertices_on_it_and_the_ends_of_fibres_there_and_nothing_else) {
  const Network network = mesh::generate_network(square(), {}).network;
  ASSERT_EQ(network.held_by_cut.size(), network.vertices_um.size());
  int n_held = 0;
  std::vector<int> n_links(network.vertices_um.size(), 0);
  for (const Link& link : network.links) {
    if (link.fibre_id == 0) continue;
    ++n_links[link.vertex_a];
    ++n_links[link.vertex_b];
  }
  for (std::size_t v = 0; v < network.vertices_um.size(); ++v) {
    n_held += network.held_by_cut[v];
    EXPECT_EQ(network.held_by_cut[v], network.vertices_um[v].x < 0.25 * 1.5 && network.adhesion_id[v] == 0);
    EXPECT_TRUE(n_links[v] != 1 || is_held(network, v)) << "an end of the fibre";
  }
  EXPECT_GE(n_held, 20 / 1.5);
  Cell whole = square();
  whole.is_cut.clear();
  EXPECT_TRUE(mesh::generate_network(whole, {}).network.held_by_cut.empty());
}

TEST(Cut, a_network_comes_back_with_it_and_no_vertex_is_held_twice) {
  const TemporaryFolder folder;
  Network network = mesh::generate_network(square(), {}).network;
  files::write_network(folder / "network.vtu", network);
  EXPECT_EQ(files::read_network(folder / "network.vtu").held_by_cut, network.held_by_cut);
  network.held_by_cut.assign(network.vertices_um.size(), true);
  EXPECT_THROW(check(network), InvalidData);
}

}  // namespace
}  // namespace mbtfm
