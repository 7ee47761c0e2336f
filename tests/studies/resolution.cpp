/// resolution DOCS: the force resolution of single adhesions by density and noise, for three methods. Writes
/// resolution.md, images/resolution.csv, images/resolution_pairs.csv and images/resolution.svg in the folder DOCS:
/// docs/make_resolution.sh.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>

#include "mbtfm/plan/drawn.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/charts/chart.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/greens/half_space.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::plan;

constexpr int kThreads = 2, kCellsOfTable = 1;
constexpr double kOwn_kPa = 8.4;
const std::vector<double> kDensities = {0.125, 0.25, 0.5, 1, 2};
const std::vector<double> kNoises_um = {0.01, 0.02, 0.04, 0.08};

// --- forces of the adhesions of whole cells

struct Row {
  double beads_per_um2 = 0, noise_um = 0;
  ForceErrors drawn;  ///< mean over the cells
  double planned_with_network_nN = 0, planned_alone_nN = 0;
};

double planned_nN(const Grid& grid, const Point& p, Quantity quantity) {
  return std::ranges::find_if(grid.expected,
                              [&](const Expected& e) {
                                return e.quantity == quantity && e.point.beads_per_um2 == p.beads_per_um2 &&
                                       e.point.noise_um == p.noise_um;
                              })
      ->standard_error_nN;
}

std::vector<Row> rows_of_cells() {
  std::vector<Row> rows(kDensities.size() * kNoises_um.size());
  for (int seed = 1; seed <= kCellsOfTable; ++seed) {
    Parameters parameters;
    parameters.seed = static_cast<std::uint64_t>(seed);
    const Scene scene = simulated_scene(parameters);
    const Asked asked{.noise_um = kNoises_um,
                      .beads_per_um2 = kDensities,
                      .youngs_modulus_kPa = {kOwn_kPa},
                      .target_nN = 0.2,
                      .within = 0.2};
    const Computed computed = compute(scene, asked, {.threads = kThreads});
    const Grid grid = grid_of(scene, asked, computed);
    for (std::size_t d = 0; d < kDensities.size(); ++d) {
      for (std::size_t n = 0; n < kNoises_um.size(); ++n) {
        const Point point{kOwn_kPa, kDensities[d], kNoises_um[n]};
        const Drawn drawn = draw_experiments(scene, computed, point, 1, {.threads = kThreads});
        Row& row = rows[d * kNoises_um.size() + n];
        row.beads_per_um2 = point.beads_per_um2;
        row.noise_um = point.noise_um;
        row.drawn.with_network_nN += drawn.forces.with_network_nN / kCellsOfTable;
        row.drawn.alone_nN += drawn.forces.alone_nN / kCellsOfTable;
        row.drawn.fttc_nN += drawn.forces.fttc_nN / kCellsOfTable;
        row.planned_with_network_nN += planned_nN(grid, point, Quantity::adhesion_force) / kCellsOfTable;
        row.planned_alone_nN += planned_nN(grid, point, Quantity::free_force) / kCellsOfTable;
        std::fprintf(stderr, "cell %d: %g beads, %g um: %.3f %.3f %.3f\n", seed, point.beads_per_um2, point.noise_um,
                     drawn.forces.with_network_nN, drawn.forces.alone_nN, drawn.forces.fttc_nN);
      }
    }
  }
  return rows;
}

std::string csv_of(const std::vector<Row>& rows) {
  files::CsvText csv({"beads_per_um2", "noise_um", "with_network_nN", "alone_nN", "fttc_nN", "planned_with_network_nN",
                      "planned_alone_nN"});
  for (const Row& r : rows) {
    csv.add(r.beads_per_um2).add(r.noise_um);
    for (const double v :
         {r.drawn.with_network_nN, r.drawn.alone_nN, r.drawn.fttc_nN, r.planned_with_network_nN, r.planned_alone_nN})
      csv.add(significant(v, 3));
    csv.end_row();
  }
  return csv.str();
}

charts::Chart chart_of(const std::vector<Row>& rows, const std::string& title, double ForceErrors::*method,
                       const charts::Axis& y) {
  charts::Chart chart(title, charts::axis_over("beads per µm²", kDensities, charts::Scale::logarithmic), y);
  for (std::size_t n = 0; n < kNoises_um.size(); ++n) {
    const std::string colour = charts::kColours[n];
    std::vector<Vec2> points;
    for (const Row& r : rows)
      if (r.noise_um == kNoises_um[n]) points.push_back({r.beads_per_um2, r.drawn.*method});
    chart.curve(points, "fill:none;stroke-width:2;stroke:" + colour);
    for (const Vec2 p : points) chart.dot(p, 3, "stroke:#fff;fill:" + colour);
    chart.key(brief(1000 * kNoises_um[n]) + " nm", colour);
  }
  return chart;
}

std::string svg_of(const std::vector<Row>& rows) {
  std::vector<double> all;
  for (const Row& r : rows) all.insert(all.end(), {r.drawn.with_network_nN, r.drawn.alone_nN, r.drawn.fttc_nN});
  const charts::Axis y = charts::axis_over("error of an adhesion's force (nN)", all, charts::Scale::logarithmic);
  return charts::svg_file({chart_of(rows, "Model-based", &ForceErrors::with_network_nN, y),
                           chart_of(rows, "Adhesion forces alone", &ForceErrors::alone_nN, y),
                           chart_of(rows, "FTTC", &ForceErrors::fttc_nN, y)},
                          3,
                          {"Simulated U2OS cells on 8.4 kPa: robust standard error of single adhesions' forces along "
                           "their direction.",
                           "Colours: noise of a displacement component. On another gel the same curves hold for noise "
                           "× modulus / 8.4 kPa."});
}

// --- two adhesions

constexpr double kArea_um2 = 0.46, kForce_nN = 2, kSide_um = 30;

/// Two adhesions side by side that pull alike, across the line between them: their beads.
DisplacementField pair_of(double distance_um, double beads_per_um2, double noise_um, int draw) {
  const Gel gel{.youngs_modulus_kPa = kOwn_kPa, .poisson_ratio = 0.49, .thickness_um = 60};
  std::mt19937_64 random(static_cast<std::uint64_t>(draw) + 1);
  std::uniform_real_distribution<double> place(0, kSide_um);
  std::normal_distribution<double> normal(0, noise_um);
  std::vector<greens::HalfSpaceEllipse> discs;
  const double radius_um = std::sqrt(kArea_um2 / 3.141592653589793);
  for (const double side : {-0.5, 0.5}) {
    substrate::Ellipse e;
    e.centre_um = {kSide_um / 2 + side * distance_um, kSide_um / 2};
    e.semi_major_um = e.semi_minor_um = radius_um;
    discs.emplace_back(gel, e);
  }
  DisplacementField field;
  const auto n = static_cast<int>(beads_per_um2 * kSide_um * kSide_um);
  for (int i = 0; i < n; ++i) {
    const double x = place(random), y = place(random);
    Vec2 u{normal(random), normal(random)};
    for (const greens::HalfSpaceEllipse& disc : discs) {
      const greens::Sym2 g = disc.compliance_um_per_nN({x, y});
      u += kForce_nN * Vec2{g.xy, g.yy};
    }
    field.push_back({.position_um = {x, y}, .displacement_um = u, .sigma_um = noise_um, .flag = {}});
  }
  return field;
}

/// Traction of the map along y at a place: bilinear between its nodes.
double traction_at(const std::vector<tractions::Patch>& patches, Vec2 at) {
  // nodes lie on a lattice: the four nearest are its cell's corners
  const double spacing = std::sqrt(patches.front().area_um2);
  double sum = 0, weights = 0;
  for (const tractions::Patch& p : patches) {
    const double wx = 1 - std::abs(p.position_um.x - at.x) / spacing,
                 wy = 1 - std::abs(p.position_um.y - at.y) / spacing;
    if (wx <= 0 || wy <= 0) continue;
    sum += wx * wy * p.traction_kPa.y;
    weights += wx * wy;
  }
  return sum / weights;
}

/// Lord Rayleigh's criterion: the map between the two is below 0.735 of what it is on the weaker.
bool has_dip(const DisplacementField& beads, double distance_um) {
  tractions::TractionParameters p;
  p.gel_model = GelModel::half_space;
  const Gel gel{.youngs_modulus_kPa = kOwn_kPa, .poisson_ratio = 0.49, .thickness_um = 60};
  const auto r = tractions::reconstruct_fttc({.beads = beads, .gel = gel, .adhesions = {}, .outline_um = {}}, p, 1);
  const auto at = [&](double side) {
    return traction_at(r.patches, {kSide_um / 2 + side * distance_um, kSide_um / 2});
  };
  return at(0) < 0.735 * std::min(at(-0.5), at(0.5)) && std::min(at(-0.5), at(0.5)) > 0;
}

struct PairRow {
  double beads_per_um2 = 0, noise_um = 0;
  std::optional<double> fttc_um, alone_um;
};

std::vector<PairRow> rows_of_pairs() {
  constexpr int kDraws = 20;
  const Gel gel{.youngs_modulus_kPa = kOwn_kPa, .poisson_ratio = 0.49, .thickness_um = 60};
  const PairResolution alone(gel, kArea_um2, kThreads);
  std::vector<PairRow> rows;
  for (const double density : {0.5, 2.0}) {
    for (const double noise_um : {0.005, 0.02}) {
      PairRow row{.beads_per_um2 = density,
                  .noise_um = noise_um,
                  .fttc_um = {},
                  .alone_um = alone.least_distance_um(kForce_nN, kOwn_kPa, density, noise_um)};
      for (double distance_um = 0.8; distance_um < 12; distance_um *= 1.25) {
        std::vector<char> told(kDraws);
        numerics::parallel_for(kDraws, kThreads, [&](int draw) {
          told[static_cast<std::size_t>(draw)] = has_dip(pair_of(distance_um, density, noise_um, draw), distance_um);
        });
        if (std::ranges::count(told, 1) < kChance * kDraws) continue;
        row.fttc_um = distance_um;
        break;
      }
      std::fprintf(stderr, "pair: %g beads, %g um: fttc %g\n", density, noise_um, row.fttc_um.value_or(-1));
      rows.push_back(row);
    }
  }
  return rows;
}

std::string csv_of(const std::vector<PairRow>& rows) {
  files::CsvText csv({"beads_per_um2", "noise_um", "fttc_um", "alone_um"});
  for (const PairRow& r : rows) {
    csv.add(r.beads_per_um2).add(r.noise_um);
    csv.add(r.fttc_um ? significant(*r.fttc_um, 2) : "").add(r.alone_um ? significant(*r.alone_um, 2) : "").end_row();
  }
  return csv.str();
}

// --- the page

/// ln error = a + p ln noise + q ln density, by least squares over the rows.
struct Law {
  double noise = 0, density = 0;
};
Law law_of(const std::vector<Row>& rows, double ForceErrors::*method) {
  Eigen::MatrixXd X(static_cast<Eigen::Index>(rows.size()), 3);
  Eigen::VectorXd y(X.rows());
  for (Eigen::Index i = 0; i < X.rows(); ++i) {
    const Row& r = rows[static_cast<std::size_t>(i)];
    X.row(i) << 1, std::log(r.noise_um), std::log(r.beads_per_um2);
    y[i] = std::log(r.drawn.*method);
  }
  const Eigen::Vector3d fit = (X.transpose() * X).ldlt().solve(X.transpose() * y);
  return {fit[1], fit[2]};
}

std::string of_law(const Law& law) {
  const auto two = [](double v) {
    char text[16];
    std::snprintf(text, sizeof text, "%.2f", v);
    return std::string(text);
  };
  return "noise^" + two(law.noise) + " · density^" + two(law.density);
}

std::string table_of(const std::vector<Row>& rows) {
  std::string table =
      "| beads per µm² | noise (nm) | model-based | adhesion forces alone | FTTC | planned: model-based | planned: "
      "alone |\n|---|---|---|---|---|---|---|\n";
  for (const Row& r : rows) {
    table += "| " + brief(r.beads_per_um2) + " | " + brief(1000 * r.noise_um);
    for (const double v :
         {r.drawn.with_network_nN, r.drawn.alone_nN, r.drawn.fttc_nN, r.planned_with_network_nN, r.planned_alone_nN})
      table += " | " + significant(v, 2);
    table += " |\n";
  }
  return table;
}

std::string table_of(const std::vector<PairRow>& rows) {
  std::string table = "| beads per µm² | noise (nm) | adhesion forces alone (µm) | FTTC (µm) |\n|---|---|---|---|\n";
  const auto text = [](const std::optional<double>& v) { return v ? significant(*v, 2) : std::string("not at 12"); };
  for (const PairRow& r : rows)
    table += "| " + brief(r.beads_per_um2) + " | " + brief(1000 * r.noise_um) + " | " + text(r.alone_um) + " | " +
             text(r.fttc_um) + " |\n";
  return table;
}

/// "2 to 9 times", of the errors of another method over the model-based ones.
std::string gain_over(const std::vector<Row>& rows, double ForceErrors::*method) {
  double low = 1e300, high = 0;
  for (const Row& r : rows) {
    const double gain = r.drawn.*method / r.drawn.with_network_nN;
    low = std::min(low, gain);
    high = std::max(high, gain);
  }
  return significant(low, 2) + " to " + significant(high, 2) + " times";
}

std::string page_of(const std::vector<Row>& rows, const std::vector<PairRow>& pairs) {
  return "# Resolution of single adhesions\n\n"
         "How exactly do beads tell the force of one adhesion? When do they tell it apart from its neighbour? This "
         "page "
         "compares three methods\non simulated cells. It is made by `docs/make_resolution.sh` from this version of the "
         "program; [planning](planning.md) does the same for your cell.\n\n"
         "- **model-based**: the force of the adhesion in the tension fit (`mbtfm-fit`);\n"
         "- **adhesion forces alone**: one force for each adhesion of the image, without a network "
         "(`mbtfm-traction --method adhesion-forces`);\n"
         "- **FTTC**: a map of tractions, without the image of the adhesions. Its force of an adhesion is the sum over "
         "the adhesion and 1.5 µm around it.\n\n"
         "## Force of one adhesion\n\n"
         "![Errors of adhesion forces](images/resolution.svg)\n\n" +
         std::to_string(kCellsOfTable) + (kCellsOfTable == 1 ? " simulated U2OS cell" : " simulated U2OS cells") +
         " of 170 adhesions on 8.4 kPa, the segmentation with its usual errors. Numbers are "
         "robust standard errors (1.48 times\nthe median) of a force along its direction, in nN. The mean force of an "
         "adhesion is 1 nN.\n\n" +
         table_of(rows) +
         "\nOn another gel the same numbers hold at the same product of noise and modulus: 20 nm on 8.4 kPa is 84 nm "
         "on "
         "2 kPa.\n\n## The law\n\n"
         "By the beads alone an error grows in proportion to noise and modulus and falls with the root of the density: "
         "noise^1 · density^-0.5.\nOver the whole table the drawn errors follow\n\n"
         "| method | error ∝ |\n|---|---|\n| model-based | " +
         of_law(law_of(rows, &ForceErrors::with_network_nN)) + " |\n| adhesion forces alone | " +
         of_law(law_of(rows, &ForceErrors::alone_nN)) + " |\n| FTTC | " + of_law(law_of(rows, &ForceErrors::fttc_nN)) +
         " |\n\nThe model-based error hardly depends on the beads: what is left is the network's mesh. "
         "Without a network each adhesion needs beads of its own nearby: below one bead per adhesion's surroundings "
         "the error grows faster than the law. FTTC hardly gains from more or better beads here: its error is that of "
         "the smoothing, and of "
         "neighbours within its 1.5 µm.\n\n"
         "## Where model-based TFM wins, and by how much\n\n"
         "Over the table the error without a network is " +
         gain_over(rows, &ForceErrors::alone_nN) + " the model-based one, that of FTTC " +
         gain_over(rows, &ForceErrors::fttc_nN) +
         ". The gain is largest where beads are\nfew or noisy: the network ties the forces of all adhesions to some "
         "twenty tensions. Where the beads are dense and exact, forces alone\nare better or as good, and they do not "
         "depend on the network being right. A fibre that the network lacks is an error that this page does not "
         "show\n([validation](validation.md)).\n\n"
         "## Two adhesions\n\n"
         "Two adhesions of 0.46 µm² lie side by side and pull with " +
         brief(kForce_nN) +
         " nN each on 8.4 kPa. From which distance, centre to centre, are they told apart\nin 8 of 10 experiments? "
         "Without a network but with their image: the fit of two explains the beads better than that of one (χ² "
         "smaller by 9;\npredicted, [planning](planning.md)). FTTC, without their image: the map falls between them "
         "below 0.735 of the weaker one (Rayleigh's criterion).\n\n" +
         table_of(pairs) +
         "\nThe image of the adhesions is worth more than the beads: it says where the forces are, and the beads need "
         "only "
         "tell how large they are.\n\n"
         "## What others found\n\n"
         "- Sabass, Gardel, Waterman and Schwarz (Biophys. J. 94, 207, 2008) reconstructed tractions with a resolution "
         "of about 1 µm from beads of two\n  colours, by regularised FTTC and boundary elements. Both underestimate "
         "forces "
         "at small adhesions. Forces at given points do not.\n"
         "- Holenstein, Silvan and Snedeker (Sci. Rep. 7, 41633, 2017) found by simulation that traction maps gain "
         "more "
         "than 35 % in accuracy from beads that\n  lie as densely and as near to the surface as possible, and that "
         "errors grow as adhesions get smaller.\n"
         "- Colin-York et al. (Nano Lett. 16, 2633, 2016) raised the bead density with STED microscopy to resolve "
         "smaller "
         "patterns of traction.\n"
         "- Soiné et al. (PLoS Comput. Biol. 11, e1004076, 2015) left the lower bounds of density and noise of the "
         "model-based method open. The tables above\n  are an answer for cells of this kind.\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "resolution DOCS\n"), 2;
  const std::filesystem::path docs = argv[1], images = docs / "images";
  const std::vector<PairRow> pairs = rows_of_pairs();
  const std::vector<Row> rows = rows_of_cells();
  files::write_text(images / "resolution_pairs.csv", csv_of(pairs));
  files::write_text(images / "resolution.csv", csv_of(rows));
  files::write_text(images / "resolution.svg", svg_of(rows));
  files::write_text(docs / "resolution.md", page_of(rows, pairs));
}
