/// Tractions from displacements that other programs wrote, beside what those programs made of them.
#include "continuum/sheet/borders.h"
#include "continuum/sheet/from_traction.h"
#include "continuum/sheet/mesh_size.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/files/csv.h"
#include "segment/cells/mask.h"
#include "segment/images/image.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace mbtfm::tractions {
namespace {

const fs::path kData = test::source_folder() / "../shared/data";

/// Two vector fields compared: |a − b| / |b|, correlation of all components, mean magnitude of each.
struct Comparison {
  double relative_rms = 0, correlation = 0, mean_one = 0, mean_other = 0;
};

Comparison compare(const std::vector<Vec2>& one, const std::vector<Vec2>& other) {
  double dd = 0, aa = 0, bb = 0, ab = 0;
  Comparison c;
  for (std::size_t i = 0; i < one.size(); ++i) {
    dd += dot(one[i] - other[i], one[i] - other[i]);
    aa += dot(one[i], one[i]);
    bb += dot(other[i], other[i]);
    ab += dot(one[i], other[i]);
    c.mean_one += norm(one[i]) / static_cast<double>(one.size());
    c.mean_other += norm(other[i]) / static_cast<double>(one.size());
  }
  c.relative_rms = std::sqrt(dd / bb);
  c.correlation = ab / std::sqrt(aa * bb);
  return c;
}

std::vector<Vec2> tractions_of(const Reconstruction& r) {
  std::vector<Vec2> tractions;
  for (const GroundPatch& p : r.patches) tractions.push_back(p.traction_kPa);
  return tractions;
}

std::vector<std::vector<double>> read_rows(const fs::path& file, std::size_t n_columns) {
  std::ifstream stream(file);
  std::vector<std::vector<double>> rows;
  std::vector<double> row(n_columns);
  while (true) {
    for (double& value : row) stream >> value;
    if (!stream) return rows;
    rows.push_back(row);
  }
}

TEST(OthersData, tractions_of_a_monolayer_are_those_of_the_program_that_published_them) {
  const fs::path folder = kData / "beads/mdck_pdms_bism/reference";
  if (!fs::exists(folder)) GTEST_SKIP() << "no ../shared/data here";
  for (const char* frame : {"1", "2"}) {
    TractionInputs inputs{.gel = {.youngs_modulus_kPa = 15, .poisson_ratio = 0.499999, .thickness_um = 1e6}};
    for (const auto& row : read_rows(folder / ("PIV" + std::string(frame) + ".txt"), 4))
      inputs.beads.push_back({.position_um = {0.64 * row[0], 0.64 * row[1]},
                              .displacement_um = {0.64 * row[2], 0.64 * row[3]},
                              .sigma_um = 0});
    std::vector<Vec2> published;
    for (const auto& row : read_rows(folder / ("Traction_PIV" + std::string(frame) + ".txt"), 5))
      published.push_back({row[2] / 1000, row[3] / 1000});
    TractionParameters parameters;
    parameters.gel_model = GelModel::half_space;
    parameters.padding = 1;
    parameters.read_out = ReadOut::points;
    parameters.lambda_um_per_kPa = 0.9;  // sqrt(8.1e-19) m/Pa
    Reconstruction r = reconstruct(inputs, parameters, 1);
    ASSERT_EQ(r.patches.size(), published.size());
    const Comparison same = compare(tractions_of(r), published);
    parameters.lambda_um_per_kPa = {};
    parameters.read_out = ReadOut::cells;
    parameters.padding = 1.5;
    r = reconstruct(inputs, parameters, 1);
    const Comparison own = compare(tractions_of(r), published);
    std::printf("monolayer %s: relative rms %.4f; own lambda %.2f um/kPa: r %.3f, mean |T| %.1f of %.1f Pa\n", frame,
                same.relative_rms, *r.lambda, own.correlation, 1000 * own.mean_one, 1000 * own.mean_other);
    EXPECT_LE(same.relative_rms, 0.02);
    EXPECT_GE(own.correlation, 0.95);
    if (frame == std::string("1")) EXPECT_NEAR(1000 * own.mean_one, 225.35, 0.15 * 225.35);
  }
}

TEST(OthersData, discs_of_a_synthetic_cell_carry_their_tractions) {
  const fs::path folder = kData / "displacement/easytfm_synthetic";
  if (!fs::exists(folder)) GTEST_SKIP() << "no ../shared/data here";
  constexpr double kPixel_um = 0.1;
  TractionInputs inputs{.gel = {.youngs_modulus_kPa = 10, .poisson_ratio = 0.3, .thickness_um = 1e6}};
  const files::CsvTable field(folder / "converted_frame1.csv");
  for (int row = 0; row < field.n_rows(); ++row)
    inputs.beads.push_back({.position_um = kPixel_um * Vec2{field.number(row, "x_px"), field.number(row, "y_px")},
                            .displacement_um = kPixel_um * Vec2{field.number(row, "u_px"), field.number(row, "v_px")},
                            .sigma_um = 0});
  const files::CsvTable discs(folder / "derived_discs_frame1.csv");
  for (int row = 0; row < discs.n_rows(); ++row) {
    const double radius = kPixel_um * discs.number(row, "radius_px");
    inputs.adhesions.push_back({.adhesion_id = row + 1,
                                .position_um = kPixel_um * Vec2{discs.number(row, "cx_px"), discs.number(row, "cy_px")},
                                .area_um2 = std::numbers::pi * radius * radius,
                                .major_axis_um = 2 * radius,
                                .minor_axis_um = 2 * radius,
                                .angle_rad = 0,
                                .eccentricity = 0,
                                .mean_intensity = 1});
  }
  TractionParameters parameters;
  parameters.method = TractionMethod::adhesion_forces;
  parameters.gel_model = GelModel::half_space;
  const Reconstruction r = reconstruct(inputs, parameters, 2);
  double furthest = 0;
  int n_inside = 0;
  for (int row = 0; row < discs.n_rows(); ++row) {
    const GroundPatch& p = r.patches[row];
    const Vec2 off = 1000 * p.traction_kPa - Vec2{discs.number(row, "tx_Pa"), discs.number(row, "ty_Pa")};
    furthest = std::max(furthest, norm(off));
    const double sigma_Pa = 1000 * *r.forces[row].sigma_nN / p.area_um2;
    n_inside += std::abs(1000 * norm(p.traction_kPa) - discs.number(row, "t_Pa")) <= sigma_Pa;
    if (discs.number(row, "t_Pa") < 50) {
      std::printf("weak disc: %.1f +- %.1f Pa, listed %.1f\n", 1000 * norm(p.traction_kPa), sigma_Pa,
                  discs.number(row, "t_Pa"));
    }
  }
  const double residual_px2 = std::get<double>(r.figures.front().second) / (kPixel_um * kPixel_um);
  std::printf("synthetic discs: furthest %.2f Pa, residual variance %.5f px2, %d of %d inside one sigma\n", furthest,
              residual_px2, n_inside, discs.n_rows());
  EXPECT_LE(furthest, 10);
  EXPECT_LE(residual_px2, 0.0026);
}

/// Two published colonies (zero-padded FTTC on a layer, not regularised, then a Gaussian) as arrays of NumPy.
struct Grid {
  int n_rows = 0, n_columns = 0;
  std::vector<double> values;
};

Grid read_npy(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  char start[8];
  std::uint16_t n_header = 0;
  stream.read(start, sizeof start).read(reinterpret_cast<char*>(&n_header), sizeof n_header);
  std::string header(n_header, ' ');
  stream.read(header.data(), n_header);
  Grid grid;
  const std::string shape = header.substr(header.find('(') + 1);
  grid.n_rows = std::stoi(shape);
  grid.n_columns = std::stoi(shape.substr(shape.find(',') + 1));
  grid.values.resize(static_cast<std::size_t>(grid.n_rows * grid.n_columns));
  stream.read(reinterpret_cast<char*>(grid.values.data()), static_cast<std::streamsize>(8 * grid.values.size()));
  EXPECT_TRUE(stream) << file;
  return grid;
}

/// The pixels that a closed line of one label encloses, itself among them: what a flood from the corner does not reach.
std::vector<bool> enclosed(const images::Image& mask, float label) {
  std::vector<bool> is_inside(mask.pixels.size(), true);
  std::vector<std::pair<int, int>> queue = {{0, 0}};
  is_inside[0] = false;
  while (!queue.empty()) {
    const auto [x, y] = queue.back();
    queue.pop_back();
    for (const auto& [i, j] : {std::pair{x + 1, y}, {x - 1, y}, {x, y + 1}, {x, y - 1}}) {
      if (i < 0 || j < 0 || i >= mask.width || j >= mask.height || mask.at(i, j) == label) continue;
      if (!is_inside[static_cast<std::size_t>(j) * mask.width + i]) continue;
      is_inside[static_cast<std::size_t>(j) * mask.width + i] = false;
      queue.emplace_back(i, j);
    }
  }
  return is_inside;
}

constexpr double kCameraPixel_um = 0.201;

struct Colony {
  TractionInputs inputs;
  int n_rows = 0, n_columns = 0;
  double step_um = 0;
  std::vector<Vec2> published_kPa;
  std::vector<bool> is_on_colony;
  double area_um2 = 0;
};

Colony read_colony(const fs::path& folder, const std::string& name) {
  const auto read = [&](const char* what) { return read_npy(folder / (name + what)); };
  const Grid u = read("_u.npy"), v = read("_v.npy"), tx = read("_tx.npy"), ty = read("_ty.npy");
  const images::Image mask = images::read_image(folder / (name + "_mask.png"));
  Colony colony{.inputs = {.gel = {.youngs_modulus_kPa = 49, .poisson_ratio = 0.49, .thickness_um = 300}},
                .n_rows = u.n_rows,
                .n_columns = u.n_columns,
                .step_um = kCameraPixel_um * mask.width / u.n_columns,
                .area_um2 = 0};
  const std::vector<bool> force_area = enclosed(mask, 1), cells = enclosed(mask, 3);
  colony.area_um2 =
      kCameraPixel_um * kCameraPixel_um * static_cast<double>(std::count(cells.begin(), cells.end(), true));
  for (int j = 0; j < u.n_rows; ++j)
    for (int i = 0; i < u.n_columns; ++i) {
      const auto at = static_cast<std::size_t>(j * u.n_columns + i);
      colony.inputs.beads.push_back({.position_um = colony.step_um * Vec2{i + 0.5, j + 0.5},
                                     .displacement_um = kCameraPixel_um * Vec2{u.values[at], v.values[at]},
                                     .sigma_um = 0});
      colony.published_kPa.push_back(0.001 * Vec2{tx.values[at], ty.values[at]});
      const int x = static_cast<int>((i + 0.5) * mask.width / u.n_columns);
      const int y = static_cast<int>((j + 0.5) * mask.height / u.n_rows);
      colony.is_on_colony.push_back(force_area[static_cast<std::size_t>(y) * mask.width + x]);
    }
  return colony;
}

/// The publication's sums over the colony: of the magnitudes at the nodes; of the forces' parts towards the centre of
/// squared tractions; of the energies, less at each node the lowest fifth of all nodes'.
struct ColonySums {
  double tractions_Pa = 0, contractility_nN = 0, energy_fJ = 0;
};

ColonySums sums_over(const Colony& colony, const std::vector<Vec2>& tractions_kPa) {
  const double area = colony.step_um * colony.step_um;
  std::vector<double> energies;
  Vec2 centre;
  double weight = 0;
  for (std::size_t p = 0; p < tractions_kPa.size(); ++p) {
    const Bead& node = colony.inputs.beads[p];
    energies.push_back(0.5 * area * dot(tractions_kPa[p], node.displacement_um));
    if (!colony.is_on_colony[p]) continue;
    weight += dot(tractions_kPa[p], tractions_kPa[p]);
    centre += dot(tractions_kPa[p], tractions_kPa[p]) * node.position_um;
  }
  centre = 1 / weight * centre;
  std::vector<double> sorted = energies;
  std::sort(sorted.begin(), sorted.end());
  const double background = sorted[sorted.size() / 5];
  ColonySums sums;
  for (std::size_t p = 0; p < tractions_kPa.size(); ++p) {
    if (!colony.is_on_colony[p]) continue;
    const Vec2 inward = centre - colony.inputs.beads[p].position_um;
    sums.tractions_Pa += 1000 * norm(tractions_kPa[p]);
    sums.contractility_nN += area * dot(tractions_kPa[p], inward) / std::max(norm(inward), 1e-9);
    sums.energy_fJ += energies[p] - background;
  }
  return sums;
}

TEST(OthersData, tractions_of_colonies_are_those_of_the_program_that_published_them) {
  const fs::path folder = kData / "displacement/pytfm_colonies";
  if (!fs::exists(folder)) GTEST_SKIP() << "no ../shared/data here";
  struct Published {
    const char* name;
    double area_um2, contractility_nN, energy_fJ;
  };
  for (const Published& published : {Published{"KO04", 6340, 2070, 200}, {"WT03", 4440, 1060, 61.8}}) {
    const Colony colony = read_colony(folder, published.name);
    EXPECT_NEAR(colony.area_um2, published.area_um2, 0.005 * published.area_um2);  // three digits
    TractionParameters parameters;
    parameters.padding = 1;
    parameters.read_out = ReadOut::points;
    parameters.lambda_um_per_kPa = 1e-5;  // none
    parameters.gaussian_um = std::max(colony.n_columns, colony.n_rows) / 50.0 * colony.step_um;
    const std::vector<Vec2> same = tractions_of(reconstruct(colony.inputs, parameters, 1));
    // Where a field that is not periodic is cut off, each program does what it does: inside of 20 nodes it is
    // forgotten.
    std::vector<Vec2> inside, inside_published;
    constexpr int kRim = 20;
    for (int j = kRim; j < colony.n_rows - kRim; ++j)
      for (int i = kRim; i < colony.n_columns - kRim; ++i) {
        inside.push_back(same[j * colony.n_columns + i]);
        inside_published.push_back(colony.published_kPa[j * colony.n_columns + i]);
      }
    const Comparison whole = compare(same, colony.published_kPa), inner = compare(inside, inside_published);
    const ColonySums sums = sums_over(colony, same), theirs = sums_over(colony, colony.published_kPa);
    const Reconstruction own = reconstruct(colony.inputs, {}, 2);
    const ColonySums own_sums = sums_over(colony, tractions_of(own));
    std::printf(
        "%s: with rim rms %.3f, r %.3f; without rms %.4f, r %.4f; sum |T| %.4g of %.4g Pa, contractility %.0f nN (from "
        "their map %.0f, published %.0f), energy %.1f fJ (from their map %.1f, published %.1f)\n",
        published.name, whole.relative_rms, whole.correlation, inner.relative_rms, inner.correlation, sums.tractions_Pa,
        theirs.tractions_Pa, sums.contractility_nN, theirs.contractility_nN, published.contractility_nN, sums.energy_fJ,
        theirs.energy_fJ, published.energy_fJ);
    std::printf("%s with own lambda, l %.2f um: sum |T| %.4g Pa, contractility %.0f nN, energy %.1f fJ\n",
                published.name, *own.length_um, own_sums.tractions_Pa, own_sums.contractility_nN, own_sums.energy_fJ);
    EXPECT_LE(inner.relative_rms, 0.1);
    EXPECT_NEAR(sums.tractions_Pa, theirs.tractions_Pa, 0.1 * theirs.tractions_Pa);
    EXPECT_NEAR(sums.contractility_nN, published.contractility_nN, 0.1 * published.contractility_nN);
    EXPECT_NEAR(sums.energy_fJ, published.energy_fJ, 0.1 * published.energy_fJ);
  }
}

/// The closed line of a label as an outline.
sheet::Region region_enclosed(const images::Image& mask, float label) {
  const std::vector<bool> is_inside = enclosed(mask, label);
  cells::LabelMask filled{.name = "mask", .width = mask.width, .height = mask.height};
  for (const bool inside : is_inside) filled.labels.push_back(inside ? 1 : 0);
  Polygon ring;
  double largest = 0;
  for (const Polygon& one : cells::rings_px(filled, 1)) {
    if (signed_area_um2(one) <= largest) continue;  // specks, and holes, which turn the other way
    largest = signed_area_um2(one);
    ring.clear();
    for (const Vec2 p : one) ring.push_back(kCameraPixel_um * p);
  }
  return {{sheet::Curve(ring)}, {}};
}

/// Size of the force per length across the borders between cells, which the mask's label 3 draws.
double mean_across_borders(const images::Image& mask, const sheet::Solution& solution) {
  const std::vector<bool> is_inside = enclosed(mask, 3);
  cells::LabelMask parts{.name = "cells", .width = mask.width, .height = mask.height, .is_binary = true};
  for (std::size_t k = 0; k < is_inside.size(); ++k)
    parts.labels.push_back(is_inside[k] && mask.pixels[k] != 3 ? 1 : 0);
  parts = cells::with_parts_labelled(parts);
  constexpr int kWidestLine_px = 15;
  double sum = 0, length = 0;
  for (const sheet::Border& border : sheet::borders_of(
           sheet::with_lines_filled({mask.width, mask.height, kCameraPixel_um, parts.labels}, kWidestLine_px), solution,
           2)) {
    sum += border.length_um * border.magnitude_nN_per_um;
    length += border.length_um;
  }
  return sum / length;
}

/// pyTFM's figures are means over the colony, of a sheet that ends at a larger area drawn by hand. What that area does
/// is in the second line: the same tractions on the colony alone.
TEST(OthersData, tensions_of_colonies_are_those_of_the_program_that_published_them) {
  const fs::path folder = kData / "displacement/pytfm_colonies";
  if (!fs::exists(folder)) GTEST_SKIP() << "no ../shared/data here";
  struct Published {
    const char* name;
    double mean, variation, shear, shear_tolerance, on_colony_alone, across_borders;  // nN/um
  };
  for (const Published& published :
       {Published{"WT03", 3.00, 0.268, -0.418, 0.05, 1.25, 3.09}, {"KO04", 5.18, 0.279, 0.134, 0.08, 2.83, 6.00}}) {
    const Colony colony = read_colony(folder, published.name);
    const images::Image mask = images::read_image(folder / (std::string(published.name) + "_mask.png"));
    std::vector<GroundPatch> tractions;
    for (std::size_t p = 0; p < colony.published_kPa.size(); ++p)
      tractions.push_back(
          {colony.inputs.beads[p].position_um, colony.step_um * colony.step_um, colony.published_kPa[p], {}});
    const sheet::Region area = region_enclosed(mask, 2), cells = region_enclosed(mask, 3);
    sheet::Solution last;
    const auto figures_on = [&](const sheet::Region& region, double poisson_ratio) {
      constexpr double kAnything =
          1;  // on the colony alone 38 % of the forces are a net force: refused, if not asked for
      const sheet::FromTraction found = sheet::tensions_from(
          tractions, region, {1, poisson_ratio, 1}, sheet::size_for_tractions(region, tractions), 2, kAnything);
      EXPECT_NEAR(found.balance.mean_tension_nN_per_um / found.balance.virial_tension_nN_per_um, 1, 1e-9);
      last = found.solution;
      return sheet::figures_inside(found.solution, cells.rims.front().points_um());
    };
    const sheet::TensionFigures theirs = figures_on(area, 0.5);
    const double across_borders = mean_across_borders(mask, last);
    const sheet::TensionFigures other = figures_on(area, 0), alone = figures_on(cells, 0.5);
    EXPECT_NEAR(across_borders, published.across_borders, 0.05 * published.across_borders);
    std::printf(
        "%s: mean %.3f (published %.2f), cv %.3f (%.3f), shear %.3f (%.3f); nu = 0: %.3f; colony alone: %.3f; across "
        "borders %.3f (%.2f)\n",
        published.name, theirs.mean_nN_per_um, published.mean, theirs.variation, published.variation,
        theirs.shear_nN_per_um, published.shear, other.mean_nN_per_um, alone.mean_nN_per_um, across_borders,
        published.across_borders);
    EXPECT_NEAR(theirs.mean_nN_per_um, published.mean, 0.02 * published.mean);
    EXPECT_NEAR(theirs.variation, published.variation, 0.01);
    EXPECT_NEAR(theirs.shear_nN_per_um, published.shear, published.shear_tolerance * std::abs(published.shear));
    // by balance alone: which tractions at the rim count, by their centres here, makes 4 % of it
    EXPECT_NEAR(alone.mean_nN_per_um, published.on_colony_alone, 0.05 * published.on_colony_alone);
  }
}

}  // namespace
}  // namespace mbtfm::tractions
