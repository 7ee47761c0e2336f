/// mesh_spread OUT [cell] [meshes] [finest edge, um] [coarsest edge, um]: how far the adhesion forces of one cell with
/// given tensions, and their derivatives by tension, differ from mesh to mesh, by formulation and edge length. The cell
/// is drawn as of the scenario u2os by a number, or any outline, adhesions and fibres as tests draw them by r and a
/// number. Writes OUT/mesh_spread.csv and OUT/mesh_spread.svg; rows that the table has already are not measured again.
#include <ctime>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "network/cables/cables.h"
#include "network/mesh/mesh.h"
#include "pipeline/charts/chart.h"
#include "pipeline/numerics/parallel.h"
#include "samples/drawing/draw.h"
#include "samples/experiment/experiment.h"
#include "tests/support/random_cell.h"

namespace {

using namespace mbtfm;
using mesh::AdhesionAnchor, mesh::LinkReach, mesh::LinkWeights, mesh::Seeds;

struct Formulation {
  const char* name;
  LinkWeights link_weights;
  AdhesionAnchor adhesion_anchor;
  Seeds seeds;
  LinkReach link_reach;
  bool keeps_surface_tension;  ///< links pull in proportion to the edge; the thesis' are the same at any edge
  double finest_um;            ///< edge length below which it is left out: the rim has small ones of its own
};
constexpr LinkReach kNear = LinkReach::neighbours, kFar = LinkReach::second_neighbours;
constexpr Formulation kFormulations[] = {
    {"thesis: link values, points", LinkWeights::equal, AdhesionAnchor::centre, Seeds::jittered, kNear, false, 0},
    {"link values per edge, points", LinkWeights::equal, AdhesionAnchor::centre, Seeds::jittered, kNear, true, 0},
    {"width, points", LinkWeights::width, AdhesionAnchor::centre, Seeds::jittered, kNear, true, 0},
    {"width, ellipses", LinkWeights::width, AdhesionAnchor::ellipse, Seeds::jittered, kNear, true, 0},
    {"width, ellipses, regular", LinkWeights::width, AdhesionAnchor::ellipse, Seeds::regular, kNear, true, 0},
    {"width, ellipses, Poisson disc", LinkWeights::width, AdhesionAnchor::ellipse, Seeds::poisson, kNear, true, 0},
    {"width, rims (dashed)", LinkWeights::width, AdhesionAnchor::rim, Seeds::jittered, kNear, true, 0.9},
    {"second neighbours: default (dashed)", LinkWeights::width, AdhesionAnchor::ellipse, Seeds::jittered, kFar, true,
     0}};
constexpr double kEdges_um[] = {3, 2, 1.5, 1, 0.7, 0.4};

/// What one mesh gives.
struct Sample {
  Eigen::VectorXd forces;
  Eigen::MatrixXd derivatives;
  std::size_t n_vertices = 0;
  double seconds = 0;
};

/// Of the processor, by this thread.
double now_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

drawing::DrawnCell scene(const std::string& name) {
  if (name.starts_with('r')) {
    const auto seed = static_cast<std::uint64_t>(std::atoi(name.c_str() + 1));
    drawing::DrawnCell drawn{.cell = test::random_cell(seed, {.least_distance_um = 1}), .tensions_nN = {}};
    std::mt19937_64 engine(seed);
    for (std::size_t i = 0; i < drawn.cell.fibres.size(); ++i)
      drawn.tensions_nN.push_back(test::uniform(engine, 0.3, 6));
    return drawn;
  }
  const drawing::ScenarioParameters p;
  return drawing::draw_cell(p.cell, p.tension, drawing::field_um(p.microscope),
                            static_cast<std::uint64_t>(std::stoi(name)));
}

Sample sample(const drawing::DrawnCell& drawn, const Formulation& f, double edge_um, std::uint64_t seed) {
  const double begin = now_s();
  mesh::NetworkParameters p;
  p.edge_length_um = edge_um;
  p.seed = seed;
  p.seeds = f.seeds;
  p.link_weights = f.link_weights;
  p.link_reach = f.link_reach;
  p.adhesion_anchor = f.adhesion_anchor;
  Network network = mesh::generate_network(drawn.cell, p).network;
  for (Link& link : network.links)
    if (f.keeps_surface_tension && link.fibre_id == 0) link.share *= edge_um / experiment::kReferenceEdge_um;
  Sample s;
  s.n_vertices = network.vertices_um.size();
  const cables::CableNetwork cables(std::move(network));
  std::vector<double> tensions = {0.06};  // of the thesis' network at the reference edge; then the fibres, by their ids
  tensions.insert(tensions.end(), drawn.tensions_nN.begin(), drawn.tensions_nN.end());
  const cables::Equilibrium equilibrium = cables.equilibrium(tensions);
  s.forces = cables.adhesion_forces_nN(tensions, equilibrium);
  s.derivatives = cables.adhesion_force_derivatives(tensions, equilibrium);
  s.seconds = now_s() - begin;
  return s;
}

/// Root mean square deviation of the vectors from their mean, over the mean's length.
template <class Get>
double relative_spread(const std::vector<Sample>& samples, Get get) {
  const auto n = static_cast<double>(samples.size());
  Eigen::VectorXd mean = get(samples[0]) / n;
  for (std::size_t i = 1; i < samples.size(); ++i) mean += get(samples[i]) / n;
  double squares = 0;
  for (const Sample& s : samples) squares += (get(s) - mean).squaredNorm() / (n - 1);
  return std::sqrt(squares) / mean.norm();
}

constexpr const char* kQuantities[] = {"adhesion forces", "derivatives, network", "derivatives, dorsal fibres",
                                       "derivatives, arcs", "derivatives, ventral fibres"};

/// A line of the table.
struct Row {
  const Formulation* formulation = nullptr;
  double edge_um = 0, n_vertices = 0, seconds = 0;
  double spread[5] = {};  ///< of kQuantities
};

Row measure(const drawing::DrawnCell& drawn, const Formulation& f, double edge_um, int n_meshes) {
  std::vector<Sample> samples(n_meshes);
  numerics::parallel_for(n_meshes, numerics::available_threads(),
                         [&](int m) { samples[m] = sample(drawn, f, edge_um, static_cast<std::uint64_t>(m) + 1); });
  Row row{.formulation = &f, .edge_um = edge_um};
  for (const Sample& s : samples) {
    row.n_vertices += static_cast<double>(s.n_vertices) / n_meshes;
    row.seconds += s.seconds / n_meshes;
  }
  const auto of_group = [&](Eigen::Index g) {
    return relative_spread(samples, [g](const Sample& s) -> Eigen::VectorXd { return s.derivatives.col(g); });
  };
  row.spread[0] = relative_spread(samples, [](const Sample& s) -> Eigen::VectorXd { return s.forces; });
  row.spread[1] = of_group(0);
  for (std::size_t k = 0; k < std::size(kFibreTypes); ++k) {
    int n = 0;
    double sum = 0;
    for (std::size_t i = 0; i < drawn.cell.fibres.size(); ++i) {
      if (drawn.cell.fibres[i].type != kFibreTypes[k]) continue;
      sum += of_group(static_cast<Eigen::Index>(i) + 1);
      ++n;
    }
    row.spread[2 + k] = n > 0 ? sum / n : 0;
  }
  return row;
}

constexpr const char* kHeader = "formulation,edge_um,vertices,seconds,forces,d_network,d_dorsal,d_arc,d_ventral";

void write_table(const std::string& folder, const std::vector<Row>& rows) {
  std::ofstream out(folder + "/mesh_spread.csv");
  out << kHeader << '\n';
  for (const Row& r : rows) {
    out << '"' << r.formulation->name << "\"," << r.edge_um << ',' << std::lround(r.n_vertices) << ',' << r.seconds;
    for (const double s : r.spread) out << ',' << s;
    out << '\n';
  }
}

/// The rows of a table as write_table makes it; of others none.
std::vector<Row> read_table(std::istream& in) {
  std::vector<Row> rows;
  std::string line;
  if (!std::getline(in, line) || line != kHeader) return rows;
  while (std::getline(in, line)) {
    const std::size_t end = line.rfind('"');
    const auto f = std::ranges::find_if(kFormulations, [&](const Formulation& formulation) {
      return end != std::string::npos && line.substr(1, end - 1) == formulation.name;
    });
    if (f == std::end(kFormulations)) continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream values(line.substr(end + 1));
    Row row{.formulation = &*f};
    values >> row.edge_um >> row.n_vertices >> row.seconds;
    for (double& s : row.spread) values >> s;
    if (values) rows.push_back(row);
  }
  return rows;
}

/// Spread against edge length: a chart by quantity, a curve by formulation.
std::string drawn_table(const std::vector<Row>& rows, int n_meshes) {
  std::vector<charts::Chart> all;
  for (std::size_t q = 0; q < std::size(kQuantities); ++q) {
    std::vector<double> edges, spreads;
    for (const Row& r : rows) {
      edges.push_back(r.edge_um);
      spreads.push_back(100 * r.spread[q]);
    }
    charts::Axis spread = charts::axis_over("spread from mesh to mesh (%)", spreads, charts::Scale::logarithmic);
    if (q == 0) spread.high *= 20;  // room for the key
    charts::Chart chart(kQuantities[q], charts::axis_over("edge length (um)", edges, charts::Scale::logarithmic),
                        std::move(spread));
    chart.put_key(charts::Chart::KeySide::left);
    int colour = 0;
    for (const Formulation& f : kFormulations) {
      std::vector<Vec2> points;
      for (const Row& r : rows)
        if (r.formulation == &f) points.push_back({r.edge_um, 100 * r.spread[q]});
      const std::string stroke = charts::kColours[colour % std::size(charts::kColours)];
      const std::string dashes = colour >= static_cast<int>(std::size(charts::kColours)) ? ";stroke-dasharray:4 3" : "";
      chart.curve(points, "stroke:" + stroke + ";stroke-width:1.8" + dashes);
      for (const Vec2 p : points) chart.dot(p, 2.5, "fill:" + stroke);
      if (q == 0) chart.key(f.name, stroke);
      ++colour;
    }
    all.push_back(std::move(chart));
  }
  return charts::svg_file(
      all, 3,
      {"One simulated cell, " + std::to_string(n_meshes) +
           " meshes each: root mean square deviation of all adhesion forces from their mean over the "
           "meshes, and of their derivatives",
       "by the tension of the network or of a fibre (mean over the fibres of a type), in parts of "
       "the mean. The mean over n meshes spreads by 1 / sqrt(n) of it."});
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: mesh_spread OUT [cell] [meshes] [finest edge, um]\n");
    return 2;
  }
  const std::string out = argv[1];
  const drawing::DrawnCell drawn = scene(argc > 2 ? argv[2] : "1");
  const int n_meshes = argc > 3 ? std::atoi(argv[3]) : 20;
  const double finest_um = argc > 4 ? std::atof(argv[4]) : 0;
  const double coarsest_um = argc > 5 ? std::atof(argv[5]) : kEdges_um[0];
  std::ifstream earlier(out + "/mesh_spread.csv");
  std::vector<Row> known = read_table(earlier), rows;
  for (const Formulation& f : kFormulations) {
    for (const double edge_um : kEdges_um) {
      if (edge_um < std::max(f.finest_um, finest_um) || edge_um > coarsest_um) continue;
      const auto is_this = [&](const Row& r) { return r.formulation == &f && std::abs(r.edge_um - edge_um) < 1e-6; };
      if (std::ranges::none_of(known, is_this)) {
        known.push_back(measure(drawn, f, edge_um, n_meshes));
        write_table(out, known);
      }
      rows.push_back(*std::ranges::find_if(known, is_this));
      std::fprintf(stderr, "%s, %g um: forces %.3f, %.2f s a mesh\n", f.name, edge_um, rows.back().spread[0],
                   rows.back().seconds);
    }
  }
  write_table(out, rows);
  std::ofstream(out + "/mesh_spread.svg") << drawn_table(rows, n_meshes);
}
