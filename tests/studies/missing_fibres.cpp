/// missing_fibres FOLDER FIRST_SEED [cells]: what a run says where the strongest fibres are not among those that it is
/// given. Each cell is simulated with its field (20 nm of noise), its strongest ventral fibre taken out of 1_segment,
/// then the two strongest, and run whole. A table (CSV) on stdout, a row for each fibre taken out: whether the run
/// names its pair of adhesions among as many rows as were taken out, the tension it states there and its standard
/// error, and the open findings.
#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/json_record.h"
#include "tests/support/program.h"

namespace {

using namespace mbtfm;
namespace fs = std::filesystem;

bool run(const std::string& command) {
  const test::Outcome outcome = test::run_program(command);
  if (outcome.code != 0) std::fprintf(stderr, "%s\n", outcome.output.c_str());
  return outcome.code == 0;
}

std::string open_findings(const fs::path& cell) {
  std::string ids;
  for (const files::JsonRecord& finding : files::JsonRecord(cell / "run.json", "a run").at("findings").list())
    if (finding.at("severity").text() != "note") ids += (ids.empty() ? "" : "; ") + finding.at("id").text();
  return ids;
}

/// The ends of the fibres' pairs of adhesions, the lower id first.
std::pair<int, int> pair_of(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

void study(const fs::path& simulated, const fs::path& cell, std::uint64_t seed, std::size_t n_out) {
  fs::remove_all(cell);
  fs::copy(simulated, cell, fs::copy_options::recursive);
  std::vector<Fibre> fibres = files::read_fibres(cell / "1_segment/fibres.csv", cell / "1_segment/fibre_points.csv");
  const std::vector<Tension> truth = files::read_tensions(cell / "truth/tensions.csv");
  const auto true_nN = [&](const Fibre& f) {
    return std::ranges::find(truth, f.fibre_id, &Tension::fibre_id)->tension_nN;
  };
  std::ranges::stable_sort(fibres, std::ranges::greater{},
                           [&](const Fibre& f) { return f.type == FibreType::ventral ? true_nN(f) : -1; });
  const std::vector<Fibre> out(fibres.begin(), fibres.begin() + static_cast<std::ptrdiff_t>(n_out));
  fibres.erase(fibres.begin(), fibres.begin() + static_cast<std::ptrdiff_t>(n_out));
  std::ranges::sort(fibres, {}, &Fibre::fibre_id);
  files::write_fibres(cell / "1_segment/fibres.csv", cell / "1_segment/fibre_points.csv", fibres);
  if (!run("mbtfm run " + cell.string() + " --threads 1 --quiet")) return;
  const files::CsvTable hints(cell / "4_fit/missing_fibres.csv");
  for (const Fibre& f : out) {
    int place = 0;
    double found_nN = 0, sigma_nN = 0;
    for (int row = 0; row < hints.n_rows() && place == 0; ++row) {
      if (pair_of(hints.integer(row, "start_adhesion_id", 0), hints.integer(row, "end_adhesion_id", 0)) !=
          pair_of(f.start_adhesion_id.value_or(0), f.end_adhesion_id.value_or(0)))
        continue;
      place = row + 1;
      found_nN = hints.number(row, "tension_nN");
      sigma_nN = hints.number(row, "sigma_nN");
    }
    std::printf("%llu,%zu,%d,%s,%.3f,%.3f,%.3f,%.2f,\"%s\"\n", static_cast<unsigned long long>(seed), n_out, place,
                place > 0 && place <= static_cast<int>(n_out) ? "true" : "false", true_nN(f), found_nN, sigma_nN,
                place > 0 ? (found_nN - true_nN(f)) / sigma_nN : 0.0, open_findings(cell).c_str());
  }
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: missing_fibres FOLDER FIRST_SEED [cells]\n");
    return 2;
  }
  const fs::path folder = argv[1];
  const std::uint64_t first = std::stoull(argv[2]);
  const int n_cells = argc > 3 ? std::stoi(argv[3]) : 10;
  std::printf("cell,taken_out,place,named_first,true_nN,tension_nN,sigma_nN,z,findings\n");
  for (std::uint64_t seed = first; seed < first + static_cast<std::uint64_t>(n_cells); ++seed) {
    const fs::path simulated = folder / ("cell_" + std::to_string(seed));
    if (!run("mbtfm-simulate --quiet --noise_um 0.02 --seed " + std::to_string(seed) + " --out " + simulated.string()))
      return 1;
    for (const std::size_t n_out : {1, 2})
      study(simulated, folder / ("cell_" + std::to_string(seed) + "_less_" + std::to_string(n_out)), seed, n_out);
  }
}
