/// The gel's surface from meshes of triangles in the files of other programs.
#include "pipeline/contract/errors.h"
#include "pipeline/files/text.h"
#include "pipeline/files/triangle_mesh.h"
#include "substrate/surface/mesh.h"
#include "tests/support/mesh_files.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::surface {
namespace {

using namespace test;

constexpr double kSide = 2;  // um, of the mesh's squares
constexpr int kSquares = 12;

double wavy(Vec2 p) { return 3 * std::sin(0.4 * p.x) + std::cos(0.7 * p.y) - 5; }

/// Squares from (-8, 4) um on, each two triangles along the diagonal from its first corner.
TriangleMesh height_field(const std::function<double(Vec2)>& height, int n_squares = kSquares, double side_um = kSide) {
  TriangleMesh mesh;
  for (int j = 0; j <= n_squares; ++j)
    for (int i = 0; i <= n_squares; ++i) {
      const Vec2 at = {-8 + side_um * i, 4 + side_um * j};
      mesh.points_um.push_back({at.x, at.y, height(at)});
    }
  for (int j = 0; j < n_squares; ++j)
    for (int i = 0; i < n_squares; ++i) {
      const int a = i + (n_squares + 1) * j, b = a + n_squares + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  return mesh;
}

/// What that mesh's triangles make of it.
double interpolated(Vec2 p) {
  const auto square = [](double x) { return std::clamp(std::floor(x / kSide), 0.0, kSquares - 1.0); };
  const double i = square(p.x + 8), j = square(p.y - 4), u = (p.x + 8) / kSide - i, v = (p.y - 4) / kSide - j;
  const auto z = [&](double a, double b) { return wavy({-8 + kSide * (i + a), 4 + kSide * (j + b)}); };
  return u > v ? z(0, 0) + u * (z(1, 0) - z(0, 0)) + v * (z(1, 1) - z(1, 0))
               : z(0, 0) + v * (z(0, 1) - z(0, 0)) + u * (z(1, 1) - z(0, 1));
}

Vec2 vertex(const HeightMap& map, std::size_t k) {
  const auto n_x = static_cast<std::size_t>(map.n_x);
  return map.origin_um +
         Vec2{static_cast<double>(k % n_x) * map.spacing_um.x, static_cast<double>(k / n_x) * map.spacing_um.y};
}

TriangleMesh read_back(const TemporaryFolder& folder, const std::string& name, const std::string& bytes,
                       double length_unit_um = 1) {
  files::write_text(folder / name, bytes);
  return files::read_triangle_mesh(folder / name, length_unit_um);
}

std::string refusal(const TemporaryFolder& folder, const std::string& name, const std::string& bytes) {
  const auto error = test::caught<InputError>([&] { read_back(folder, name, bytes); });
  if (error) EXPECT_TRUE(has_words(error->where, (folder / name).string()));
  return error ? error->what() : "read";
}

std::string refusal(const TriangleMesh& mesh) {
  const auto error = test::caught<InvalidData>([&] { sample_mesh(mesh, 1); });
  return error ? error->what() : "sampled";
}

std::string with(std::string text, const std::string& old, const std::string& now) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, text.npos) << old;
  return at == text.npos ? text : text.replace(at, old.size(), now);
}

/// Heights of a few um: some roundings of 1e-15 um each.
constexpr double kRounding = 1e-13;

using SurfaceMesh = test::InFolder;

TEST_F(SurfaceMesh, every_format_gives_the_heights_of_the_triangles) {
  const TriangleMesh mesh = height_field(wavy);
  // a float holds heights and places of up to 28 um to 1 um/2^20 = 1e-6 um, the surface's slope is at most 1.2 + 0.7
  const double of_float = 3e-6;
  struct Written {
    std::string name, bytes;
    double rounding;
  };
  for (const auto& [name, bytes, rounding] :
       std::vector<Written>{{"text.stl", stl_text(mesh), kRounding},
                            {"binary.stl", stl_binary(mesh), of_float},
                            {"text.ply", ply_text(mesh), kRounding},
                            {"little.ply", ply_binary(mesh, Order::little_endian), kRounding},
                            {"big.ply", ply_binary(mesh, Order::big_endian), kRounding},
                            {"text.OBJ", obj_text(mesh), kRounding},
                            {"text.vtp", vtp_text(mesh), kRounding}}) {
    SCOPED_TRACE(name);
    const TriangleMesh read = read_back(folder, name, bytes);
    EXPECT_EQ(read.points_um.size(), mesh.points_um.size());
    EXPECT_EQ(read.triangles.size(), mesh.triangles.size());
    for (const double spacing : {2.0, 0.7, 5.0}) {
      const auto [map, n_flipped] = sample_mesh(read, spacing);
      EXPECT_EQ(n_flipped, 0);
      EXPECT_NO_THROW(check(map)) << "a height everywhere, up to the rim";
      EXPECT_LE(map.spacing_um.x, spacing);
      EXPECT_NEAR(map.high_um().y, 28, 1e-12);
      for (std::size_t k = 0; k < map.z_um.size(); ++k)
        ASSERT_NEAR(map.z_um[k], interpolated(vertex(map, k)), rounding) << "vertex " << k;
    }
  }
}

TEST_F(SurfaceMesh, at_the_meshs_own_points_the_heights_are_theirs) {
  const MeshSurface sampled = sample_mesh(height_field(wavy), kSide);
  ASSERT_EQ(sampled.map.n_x, kSquares + 1);
  for (std::size_t k = 0; k < sampled.map.z_um.size(); ++k)
    EXPECT_DOUBLE_EQ(sampled.map.z_um[k], wavy(vertex(sampled.map, k)));
}

TEST_F(SurfaceMesh, the_unit_of_length_scales_all_coordinates) {
  const TriangleMesh mesh = height_field(wavy);
  const TriangleMesh read = read_back(folder, "mm.obj", obj_text(mesh), 1000);
  for (std::size_t k = 0; k < mesh.points_um.size(); ++k)
    EXPECT_TRUE(read.points_um[k] == 1000 * mesh.points_um[k]) << k;
}

TEST_F(SurfaceMesh, polygons_are_cut_into_triangles) {
  const TriangleMesh read =
      read_back(folder, "pentagon.obj", "v 0 0 1\nv 2 0 1\nv 3 1 1\nv 2 2 1\nv 0 2 1\nf 1/1 2/2 3/3 4/4 5/5 # all\n");
  EXPECT_EQ(read.triangles, (std::vector<std::array<int, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST_F(SurfaceMesh, flipped_triangles_are_counted_and_change_no_height) {
  const TriangleMesh mesh = height_field(wavy);
  TriangleMesh flipped = mesh;
  for (std::size_t k = 0; k < flipped.triangles.size(); k += 3)
    std::swap(flipped.triangles[k][0], flipped.triangles[k][1]);
  const MeshSurface sampled = sample_mesh(flipped, 0.7), truth = sample_mesh(mesh, 0.7);
  EXPECT_EQ(sampled.n_flipped, 2 * kSquares * kSquares / 3);
  for (std::size_t k = 0; k < truth.map.z_um.size(); ++k)
    EXPECT_NEAR(sampled.map.z_um[k], truth.map.z_um[k], kRounding);
  for (std::size_t k = 1; k < flipped.triangles.size(); k += 3)
    std::swap(flipped.triangles[k][0], flipped.triangles[k][1]);
  EXPECT_EQ(sample_mesh(flipped, 0.7).n_flipped, kSquares * kSquares * 2 / 3) << "the fewer are the flipped ones";
}

TEST_F(SurfaceMesh, a_hole_has_no_height_there_and_only_there) {
  TriangleMesh mesh = height_field(wavy);
  const auto in_hole = [](Vec2 p, double rim) { return std::abs(p.x - 1) < 3 - rim && std::abs(p.y - 13) < 3 - rim; };
  std::erase_if(mesh.triangles, [&](const auto& t) {
    const Vec3 sum = mesh.points_um[t[0]] + mesh.points_um[t[1]] + mesh.points_um[t[2]];
    return in_hole({sum.x / 3, sum.y / 3}, 0);
  });
  const HeightMap map = sample_mesh(mesh, 0.5).map;
  for (std::size_t k = 0; k < map.z_um.size(); ++k)
    EXPECT_EQ(std::isnan(map.z_um[k]), in_hole(vertex(map, k), 1e-9)) << k;
}

TEST_F(SurfaceMesh, an_overhang_is_refused_by_place) {
  TriangleMesh mesh = height_field(wavy);
  const int n = static_cast<int>(mesh.points_um.size());
  for (const Vec3 p : {Vec3{0.5, 10.5, -9}, {2.5, 10.5, -9}, {0.5, 12.5, -9}}) mesh.points_um.push_back(p);
  mesh.triangles.push_back({n, n + 1, n + 2});
  EXPECT_TRUE(has_words(refusal(mesh), "an overhang at x, y = 1, 11 um", "-9 "));
}

/// A step of 2 um along x = 1 um, between vertices of the lattice.
TEST_F(SurfaceMesh, a_wall_is_a_jump_where_it_has_a_height) {
  TriangleMesh mesh;
  mesh.points_um = {{-4, 0, 0}, {0.9, 0, 0}, {0.9, 9, 0}, {-4, 9, 0}, {0.9, 0, 2}, {5, 0, 2}, {5, 9, 2}, {0.9, 9, 2}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}, {1, 4, 2}, {4, 7, 2}};
  EXPECT_TRUE(has_words(refusal(mesh), "an overhang at x, y = 0.9, "));
  for (Vec3& p : mesh.points_um) p.z = 0;
  EXPECT_EQ(refusal(mesh), "sampled") << "triangles without an area are no wall";
}

TEST_F(SurfaceMesh, a_closed_mesh_is_refused_with_the_remedy) {
  TriangleMesh ball;
  constexpr int kRound = 16, kDown = 8;
  for (int j = 0; j <= kDown; ++j)
    for (int i = 0; i < kRound; ++i) {
      const double polar = std::numbers::pi * j / kDown, turn = 2 * std::numbers::pi * i / kRound;
      const double radius = j == 0 || j == kDown ? 0 : 10 * std::sin(polar);
      ball.points_um.push_back({radius * std::cos(turn), radius * std::sin(turn), 10 * std::cos(polar)});
    }
  for (int j = 0; j < kDown; ++j)
    for (int i = 0; i < kRound; ++i) {
      const int a = kRound * j + i, b = kRound * j + (i + 1) % kRound;
      if (j > 0) ball.triangles.push_back({a, b, b + kRound});
      if (j < kDown - 1) ball.triangles.push_back({a, b + kRound, a + kRound});
    }
  EXPECT_TRUE(has_words(refusal(ball), "a closed mesh", "cut the mesh"));
  ball.triangles.pop_back();
  EXPECT_TRUE(has_words(refusal(ball), "an overhang at"));
}

/// The work goes with what the triangles cover.
TEST_F(SurfaceMesh, triangles_that_cover_an_area_again_and_again_are_refused_and_twice_is_read) {
  TriangleMesh mesh = height_field(wavy);
  mesh.triangles.insert(mesh.triangles.end(), mesh.triangles.begin(), mesh.triangles.end());
  EXPECT_EQ(refusal(mesh), "sampled");
  for (int k = 0; k < 2; ++k) mesh.triangles.insert(mesh.triangles.end(), mesh.triangles.begin(), mesh.triangles.end());
  EXPECT_TRUE(has_words(refusal(mesh), "cover its extent 8 times"));
}

/// Triangles from one corner to points along the two opposite sides, some of them slivers askew to the lattice.
TEST_F(SurfaceMesh, slivers_askew_give_the_plane_that_they_lie_in) {
  const auto height = [](Vec2 p) { return 0.3 * p.x - 0.2 * p.y + 1; };
  TriangleMesh mesh;
  const auto add = [&](Vec2 p) { mesh.points_um.push_back({p.x, p.y, height(p)}); };
  add({0, 0});
  constexpr int kPoints = 200;
  for (int k = 0; k <= kPoints; ++k) add(k <= kPoints / 2 ? Vec2{10, 0.1 * k} : Vec2{20 - 0.1 * k, 10});
  for (int k = 1; k <= kPoints; ++k) mesh.triangles.push_back({0, k, k + 1});
  const HeightMap map = sample_mesh(mesh, 0.13).map;
  for (std::size_t k = 0; k < map.z_um.size(); ++k) EXPECT_NEAR(map.z_um[k], height(vertex(map, k)), kRounding) << k;
}

TEST_F(SurfaceMesh, what_spans_no_area_is_refused) {
  EXPECT_TRUE(has_words(refusal(TriangleMesh{}), "found none"));
  const TriangleMesh upright = {.points_um = {{0, 0, 0}, {1, 0, 0}, {1, 0, 4}}, .triangles = {{0, 1, 2}}};
  EXPECT_TRUE(has_words(refusal(upright), "one line"));
  EXPECT_THROW(sample_mesh(height_field(wavy), 0), InvalidData);
  EXPECT_THROW(sample_mesh(height_field(wavy), 1e-9), InvalidData) << "more vertices than memory holds";
  EXPECT_THROW(suggested_spacing_um(TriangleMesh{}), InvalidData);
}

/// Two of a triangle's three edges are sides, one a diagonal.
TEST_F(SurfaceMesh, the_suggested_spacing_is_the_side_of_squares) {
  EXPECT_NEAR(suggested_spacing_um(height_field(wavy)), kSide, 1e-12);
}

/// A square of two triangles and, in its corner, many more that are a millionth of it wide; then a strip as narrow.
TEST_F(SurfaceMesh, small_triangles_beside_large_ones_make_no_lattice_of_millions) {
  for (const double height : {1.0, 1e-6}) {
    TriangleMesh mesh{.points_um = {{0, 0, 0}, {1, 0, 0}, {1, height, 0}, {0, height, 0}},
                      .triangles = {{0, 1, 2}, {0, 2, 3}}};
    const double small = 1e-6 * height;
    for (int k = 0; k < 20; ++k) {
      const int first = static_cast<int>(mesh.points_um.size());
      for (const Vec2 p : {Vec2{0, 0}, Vec2{small, 0}, Vec2{0, small}}) mesh.points_um.push_back({p.x, p.y, 0});
      mesh.triangles.push_back({first, first + 1, first + 2});
    }
    const HeightMap map = sample_mesh(mesh, suggested_spacing_um(mesh)).map;
    // 10 000, 100 a triangle; up to two lines more along either side, for its end and what is left
    const double most = 1e4 + 100 * 22;
    EXPECT_LE(map.z_um.size(), most + 2 * (map.n_x + map.n_y)) << height;
    for (const double z : map.z_um) ASSERT_EQ(z, 0);
  }
}

TEST_F(SurfaceMesh, stage_coordinates_as_floats_make_no_overhang_and_no_hole) {
  TriangleMesh mesh = height_field(wavy);
  for (Vec3& p : mesh.points_um) p = {p.x + 40000.3, p.y - 23000.7, p.z + 3000.1};
  const HeightMap map = sample_mesh(read_back(folder, "stage.stl", stl_binary(mesh)), 0.5).map;
  EXPECT_NO_THROW(check(map));
}

TEST_F(SurfaceMesh, damaged_files_are_refused_by_name) {
  const TriangleMesh mesh = height_field(wavy, 2);
  const std::string stl = stl_binary(mesh), text = stl_text(mesh), ply = ply_text(mesh), obj = obj_text(mesh),
                    little = ply_binary(mesh, Order::little_endian);
  struct Damaged {
    std::string name, bytes, expected;
  };
  for (const auto& [name, bytes, expected] : std::vector<Damaged>{
           {"cut.stl", stl.substr(0, stl.size() - 7), "a binary STL file of 484 bytes"},
           {"short.stl", stl.substr(0, 60), "at least 84 bytes"},
           {"cut_text.stl", text.substr(0, text.size() - 40), "endsolid"},
           {"word.stl", with(text, "vertex -8", "vertex minus"), ":4: expected a finite number, found 'minus'"},
           {"line.stl", with(text, "outer", "inner"), "a line of an STL file"},
           {"corners.stl", with(text, "vertex -8 4", "#"), "a line of an STL file"},
           {"points.ply", with(ply, "vertex 9", "vertex 2000000000"), "2000000000 times 'vertex'"},
           {"faces.ply", with(ply, "face 8", "face 2000000000"), "2000000000 times 'face'"},
           {"absurd.ply", with(ply, "vertex 9", "vertex 99999999999999999999"), "a whole number from 0 on"},
           {"negative.ply", with(ply, "vertex 9", "vertex -9"), "a whole number from 0 on"},
           {"fewer.ply", with(ply, "face 8", "face 9"), "a finite number, found the end"},
           {"more.ply", with(ply, "face 8", "face 7"), "the end of the file"},
           {"corner.ply", with(ply, "\n3 0 1 4", "\n3 0 1 9"), "points below 9"},
           {"list.ply", with(ply, "\n3 0 1 4", "\n-3 0 1 4"), "a whole number from 0 on"},
           {"two.ply", with(ply, "\n3 0 1 4", "\n2 0 1"), "three or more corners"},
           {"type.ply", with(ply, "uchar int", "uchar quaternion"), "a type of PLY's numbers"},
           {"format.ply", with(ply, "ascii", "morse"), "the format ascii"},
           {"no_z.ply", with(ply, "double z", "double depth"), "no 'z'"},
           {"cut.ply", little.substr(0, little.size() - 3), "more bytes"},
           {"head.ply", little.substr(0, little.find("element face")), "end_header"},
           {"many.ply", with(little, "uchar int", "int int"), "found"},
           {"point.obj", with(obj, "f 1//1", "f 10//1"), "one of the 9 points"},
           {"zero.obj", with(obj, "f 1//1", "f 0//1"), "a whole number from 0 on"},
           {"word.obj", with(obj, "v -8", "v west"), "found 'west'"},
           {"nan.obj", with(obj, "v -8", "v nan"), "found 'nan'"},
           {"none.obj", "# nothing\n", "expected triangles, found none"},
           {"cut.vtp", vtp_text(mesh).substr(0, 300), "</VTKFile>"},
           {"empty.stl", "", "an empty file"},
           {"empty.ply", "", "an empty file"},
           {"empty.obj", "", "an empty file"},
           {"empty.vtp", "", "an empty file"},
           {"surface.off", "OFF", ".stl, .ply, .obj or .vtp"},
           {"surface", "OFF", ".stl, .ply, .obj or .vtp"}}) {
    EXPECT_TRUE(has_words(refusal(folder, name, bytes), expected)) << name;
  }
  EXPECT_THROW(files::read_triangle_mesh(folder / "nowhere.stl", 1), InputError);
}

}  // namespace
}  // namespace mbtfm::surface
