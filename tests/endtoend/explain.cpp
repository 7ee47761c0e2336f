/// What `--explain` says that an effect would change, against a run that has it.
#include "pipeline/contract/results.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

/// On a gel whose base, sides and grading all matter.
constexpr const char* kScenario =
    "pixel_size_um = 0.1\n[gel]\nyoungs_modulus_kPa = 8.4\npoisson_ratio = 0.49\nthickness_um = 25\n"
    "[scenario]\ndiameter_um = 24\nimage_size_px = 400\nn_adhesions = 14\nn_ventral = 3\nn_dorsal = 2\nn_arc = 0\n"
    "noise = 0.07\nbeads = 800\n";
/// The cell stays where it is: otherwise each run places it anew, and what is stated is for the place first found.
/// One mesh of finite elements serves as well as a fine one: asked is what is said, not how right the gel is.
constexpr const char* kSettings =
    "\n[fit]\nn_meshes = 3\nsurface_lines = 10\n[substrate]\nside_distance_um = 20\n"
    "modulus_profile = '0:8.4, 25:10.9'\nelements_across_adhesion = 2\n[effects]\nchannel_shift = 'off'\n";

using Switches = std::map<std::string, std::string>;
const Switches kAllOff = {{"finite_thickness", "off"},
                          {"finite_sides", "off"},
                          {"depth_graded_gel", "off"},
                          {"cable_elasticity", "off"},
                          {"robust_loss", "off"}};
const Switches kEndlessEvenGel = {{"finite_sides", "off"}, {"depth_graded_gel", "off"}};

class Explained : public ::testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    files::write_text(folder_ / "scenario.toml", kScenario);
    output_of("mbtfm-simulate --quiet --scenario " + (folder_ / "scenario.toml").string() + " --seed " +
              std::to_string(GetParam()) + " --out " + cell().string());
    toml_ = files::read_text(cell() / "cell.toml") + kSettings;
  }
  fs::path cell() const { return folder_ / "cell"; }

  std::vector<Tension> run(const Switches& switches, const std::string& flags = {}) {
    std::string toml = toml_;
    for (const auto& [name, setting] : switches) toml += name + " = '" + setting + "'\n";
    files::write_text(cell() / "cell.toml", toml);
    output_of("mbtfm run " + cell().string() + flags);
    return files::read_tensions(cell() / "4_fit/tensions.csv");
  }

  /// By effect and fibre.
  std::map<std::string, std::map<int, double>> stated() const {
    const files::CsvTable table(cell() / "4_fit/effects_left_out.csv");
    std::map<std::string, std::map<int, double>> result;
    for (int row = 0; row < table.n_rows(); ++row)
      result[table.text(row, "effect")][table.integer(row, "fibre_id", 0)] = table.number(row, "change_nN");
    return result;
  }

 private:
  test::TemporaryFolder folder_;
  std::string toml_;
};

double size_of(const std::vector<Tension>& tensions) {
  double squares = 0;
  for (const Tension& t : tensions) squares += t.tension_nN * t.tension_nN;
  return std::sqrt(squares);
}

void expect_as_stated(const std::string& effect, const std::map<int, double>& stated,
                      const std::vector<Tension>& without, const std::vector<Tension>& with) {
  const double rounding = 1e-6 * size_of(without);  // the fit's tolerance
  double most = 0;
  for (std::size_t i = 0; i < without.size(); ++i) {
    const double made = with[i].tension_nN - without[i].tension_nN;
    EXPECT_NEAR(made, stated.at(without[i].fibre_id), rounding) << effect << ", fibre " << without[i].fibre_id;
    most = std::max(most, std::abs(made));
  }
  EXPECT_GT(most, 100 * rounding) << effect << ": a scene where it changes something";
}

TEST_P(Explained, an_effect_changes_every_tension_as_stated) {
  const std::vector<Tension> without = run(kAllOff, " --explain");
  const auto changes = stated();
  for (const auto& [name, key] : std::map<std::string, std::string>{{"finite thickness", "finite_thickness"},
                                                                    {"finite sides", "finite_sides"},
                                                                    {"elasticity of cables", "cable_elasticity"},
                                                                    {"robust loss", "robust_loss"}}) {
    Switches switches = kAllOff;
    switches[key] = "on";
    if (key == "finite_sides") switches["finite_thickness"] = "auto";  // a gel with sides has a base
    expect_as_stated(name, changes.at(name), without, run(switches));
  }
}

TEST_P(Explained, fibres_change_the_networks_tension_as_stated) {
  Switches switches = kEndlessEvenGel;
  switches["stress_fibres"] = "off";
  const std::vector<Tension> without = run(switches, " --explain");
  const double change_nN = stated().at("stress fibres").at(0);
  const std::vector<Tension> with = run(kEndlessEvenGel);
  EXPECT_NEAR(with.front().tension_nN - without.front().tension_nN, change_nN, 1e-6 * size_of(without));
  EXPECT_GT(std::abs(change_nN), 1e-3 * size_of(without));
}

TEST_P(Explained, a_graded_gel_changes_the_tensions_by_no_more_than_stated) {
  Switches switches = kEndlessEvenGel;
  const std::vector<Tension> without = run(switches, " --explain");
  const std::string record = files::read_text(cell() / "4_fit/record.json");
  const std::string says = "would change the tensions by at most ";
  const auto at = record.find(says);
  ASSERT_NE(at, record.npos) << record;
  const double bound = std::stod(record.substr(at + says.size())) / 100;
  switches["depth_graded_gel"] = "on";
  const std::vector<Tension> with = run(switches);
  double squares = 0;
  for (std::size_t i = 1; i < with.size(); ++i) squares += std::pow(with[i].tension_nN - without[i].tension_nN, 2);
  EXPECT_GT(squares, 0);
  EXPECT_LE(std::sqrt(squares), bound * size_of(without));
}

INSTANTIATE_TEST_SUITE_P(Scenes, Explained, ::testing::Values(201, 202));

}  // namespace
}  // namespace mbtfm
