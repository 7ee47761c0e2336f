/// resolution_curves ROWS OUT.svg: the curves of docs/resolution.md from the rows of its table, which
/// docs/make_resolution.sh leaves in its work folder.
#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/text.h"

namespace {

using namespace mbtfm;

/// "| density | noise | network | alone | FTTC | …"
struct Row {
  double beads_per_um2 = 0, noise_nm = 0;
  std::array<double, 3> errors_nN{};
};

std::vector<Row> read_rows(const char* file) {
  std::ifstream in(file);
  std::vector<Row> rows;
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    Row r;
    char bar = 0;
    cells >> bar >> r.beads_per_um2 >> bar >> r.noise_nm;
    for (double& error : r.errors_nN) cells >> bar >> error;
    if (cells) rows.push_back(r);
  }
  return rows;
}

std::vector<charts::Chart> charts_of(const std::vector<Row>& rows) {
  constexpr const char* kMethods[] = {"with the network", "alone (dashed)", "FTTC (dotted)"};
  constexpr const char* kDashes[] = {"", ";stroke-dasharray:7 4", ";stroke-dasharray:2 4"};
  constexpr double kOfNothing_nN = 0.4;  // of a method that finds no force: 1.48 times the middle force of the scene
  std::vector<double> densities, errors = {kOfNothing_nN};
  std::map<double, std::vector<Row>> by_noise;
  for (const Row& r : rows) {
    densities.push_back(r.beads_per_um2);
    errors.insert(errors.end(), r.errors_nN.begin(), r.errors_nN.end());
    by_noise[r.noise_nm].push_back(r);
  }
  std::vector<charts::Chart> all;
  for (const auto& [noise_nm, of_noise] : by_noise) {
    charts::Chart chart("Noise " + brief(noise_nm) + " nm on 8.4 kPa",
                        charts::axis_over("beads per µm²", densities, charts::Scale::logarithmic),
                        charts::axis_over("error of an adhesion's force (nN)", errors, charts::Scale::logarithmic));
    for (std::size_t k = 0; k < std::size(kMethods); ++k) {
      std::vector<Vec2> points;
      for (const Row& r : of_noise) points.push_back({r.beads_per_um2, r.errors_nN[k]});
      chart.curve(points, std::string("fill:none;stroke-width:2;stroke:") + charts::kColours[k] + kDashes[k]);
      for (const Vec2 p : points) chart.dot(p, 3, std::string("fill:") + charts::kColours[k]);
      chart.key(kMethods[k], charts::kColours[k]);
    }
    chart.level(kOfNothing_nN, "stroke:#333;stroke-width:1");
    all.push_back(std::move(chart));
  }
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "resolution_curves ROWS OUT.svg\n"), 2;
  const std::vector<Row> rows = read_rows(argv[1]);
  if (rows.empty()) return std::fprintf(stderr, "resolution_curves: no rows in %s\n", argv[1]), 3;
  files::write_text(argv[2],
                    charts::svg_file(charts_of(rows), 2,
                                     {"Robust standard error of the force of a single adhesion, drawn experiments.",
                                      "Grey line: what a method errs that finds no force anywhere."}));
}
