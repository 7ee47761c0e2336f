// error_budget FIRST LAST [images]: do the parts of the error budget add up to the errors that simulated cells show?
// Simulates u2os cells FIRST … LAST in error_budget_cells/ of the working folder and runs the chain on them: from their
// images, or from the true segmentation and noisy beads. Prints a row a cell; the last row sums up in squares.
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/report/compare.h"
#include "pipeline/runner/process.h"

namespace {

namespace fs = std::filesystem;
using namespace mbtfm;

/// Sums of squares over tensions, or of total forces.
struct Row {
  double observed = 0, stated = 0;
  std::array<double, 6> parts{};
  double n = 0, normalised = 0;  ///< (error / stated error)²
};

void add(Row& row, double error, const ErrorParts& p) {
  const double stated = total(p) * total(p);
  row.observed += error * error;
  row.stated += stated;
  const std::array<double, 6> parts = {p.beads, p.segmentation, p.mesh.value_or(0), p.substrate, p.solver, p.model};
  for (std::size_t i = 0; i < parts.size(); ++i) row.parts[i] += parts[i] * parts[i];
  if (stated == 0) return;  // a tension held at zero
  row.n += 1;
  row.normalised += error * error / stated;
}

void add(Row& sum, const Row& row) {
  sum.observed += row.observed;
  sum.stated += row.stated;
  for (std::size_t i = 0; i < row.parts.size(); ++i) sum.parts[i] += row.parts[i];
  sum.n += row.n;
  sum.normalised += row.normalised;
}

void print(const std::string& name, const Row& row) {
  std::printf("%s,%.3f,%.3f,%.2f,%.2f", name.c_str(), std::sqrt(row.observed), std::sqrt(row.stated),
              std::sqrt(row.observed / row.stated), row.normalised / row.n);
  for (const double part : row.parts) std::printf(",%.3f", std::sqrt(part));
  std::printf("\n");
  std::fflush(stdout);
}

void make_cell(const fs::path& cell, int seed, bool from_images) {
  const std::string programs = MBTFM_BINARY_DIR "/bin/";
  std::vector<std::string> simulate = {programs + "mbtfm-simulate",
                                       "--scenario",
                                       "u2os",
                                       "--seed",
                                       std::to_string(seed),
                                       "--noise",
                                       "0.07",
                                       "--beads",
                                       "10000",
                                       "--quiet",
                                       "--out",
                                       cell.string()};
  if (from_images) simulate.emplace_back("--images");
  const bool is_new = !fs::exists(cell);
  if (is_new && runner::run_process(simulate).exit_code != 0) throw OutputError("mbtfm-simulate failed");
  if (is_new && !from_images) {  // this segmentation has no errors
    std::ofstream(cell / "cell.toml", std::ios::app)
        << "\n[fit]\nadhesion_shift_error_um = 0\nadhesion_area_error = 0\n"
           "adhesion_angle_error_deg = 0\nfibre_end_error_um = 0\n";
  }
  const auto run = runner::run_process({programs + "mbtfm", "run", "--quiet", cell.string()});
  if (run.exit_code != 0) throw OutputError("mbtfm run failed");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return std::fprintf(stderr, "error_budget FIRST LAST [images]\n"), 2;
  const bool from_images = argc > 3;
  Row tensions, forces;
  std::printf("cell,observed_nN,stated_nN,ratio,mean_z_squared,beads,segmentation,mesh,substrate,solver,model\n");
  for (int seed = std::atoi(argv[1]); seed <= std::atoi(argv[2]); ++seed) {
    const std::string name = (from_images ? "images-" : "given-") + std::to_string(seed);
    const fs::path cell = fs::path("error_budget_cells") / name;
    make_cell(cell, seed, from_images);
    const report::Comparison comparison = report::compare_with_truth(cell);
    const ErrorBudget budget = files::read_fit_summary(cell / "4_fit/fit.json").error_budget.value();
    Row row;
    for (const report::ComparedFibre& fibre : comparison.fibres) {
      if (!fibre.tension || !fibre.true_tension_nN) continue;
      for (const TensionError& t : budget.tensions) {
        if (t.fibre_id == fibre.tension->fibre_id) add(row, t.tension_nN - *fibre.true_tension_nN, t.parts_nN);
      }
    }
    print(name, row);
    add(tensions, row);
    add(forces, comparison.total_force_nN - comparison.true_total_force_nN.value(), budget.total_force_parts_nN);
  }
  print("tensions", tensions);
  print("total forces", forces);
}
