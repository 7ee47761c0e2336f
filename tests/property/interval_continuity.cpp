/// Other processors, other libraries and other numbers of beads to a block round differently. What a fit reports must
/// not depend on that: tensions and the ends of their intervals are continuous in the data.
/// MBTFM_CASES=N takes as many seeds; MBTFM_PRINT=1 prints how far each case moves, in standard errors.
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

using test::TensionScene;

struct Case {
  std::string name;
  double noise = 0;
  TensionScene scene;
  std::vector<cables::CableNetwork> networks;
};

Case of_reference(const std::string& name, double noise, unsigned seed) {
  Case c{name + ", noise " + std::to_string(noise) + ", seed " + std::to_string(seed),
         noise,
         test::tension_scene(name, 1000, noise, seed),
         {}};
  c.networks.emplace_back(c.scene.cables.network());
  return c;
}

/// A ring of adhesions with crossing fibres, of which every other one is slack in truth: many end at the bound.
Case of_round_cell(int n_meshes, double noise, unsigned seed) {
  Cell cell = test::round_cell(15, 12, {{1, 6}, {2, 7}, {3, 10}, {4, 9}, {5, 12}, {8, 11}});
  Eigen::VectorXd tensions = test::thesis_tensions_nN(cell.fibres.size(), seed);
  for (Eigen::Index i = 1; i < tensions.size(); i += 2) tensions[i] = 0;
  Case c{std::to_string(n_meshes) + " meshes, noise " + std::to_string(noise) + ", seed " + std::to_string(seed),
         noise,
         test::scene_of(cell, tensions, 600, noise, seed),
         {}};
  for (int m = 0; m < n_meshes; ++m) {
    mesh::NetworkParameters p;
    p.seed = static_cast<std::uint64_t>(m + 1);
    c.networks.emplace_back(mesh::generate_network(cell, p).network);
  }
  return c;
}

struct Answer {
  Eigen::VectorXd value, error, low, high;
  double total = 0, network = 0, total_error = 0, network_error = 0;
};

Answer answer_of(const Case& c, double relative, unsigned seed) {
  test::Normal normal(seed);
  DisplacementField beads = c.scene.beads;
  for (Bead& b : beads) {
    b.displacement_um.x *= 1 + relative * normal();
    b.displacement_um.y *= 1 + relative * normal();
  }
  LinearData data = reduce(beads, c.scene.compliance_um_per_nN);
  const EnsembleFit fit = fit_ensemble(c.networks, data, c.scene.adhesion_ids, {.loss = Loss::squares}, 2);
  const auto n = static_cast<Eigen::Index>(fit.tensions.nN.size());
  Answer answer{
      .value = Eigen::VectorXd(n), .error = Eigen::VectorXd(n), .low = Eigen::VectorXd(n), .high = Eigen::VectorXd(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Estimate& e = fit.tensions.nN[i];
    const Interval interval = interval_95(e);
    answer.value[i] = e.value;
    answer.error[i] = e.standard_error;
    answer.low[i] = interval.low;
    answer.high[i] = interval.high;
  }
  answer.total = fit.total_force_nN.value;
  answer.network = fit.network_force_nN.value;
  answer.total_error = fit.total_force_nN.standard_error;
  answer.network_error = fit.network_force_nN.standard_error;
  return answer;
}

/// The beads' error is `noise` of the largest displacement. A relative change of 1e-7 of N displacements is at most
/// 1e-7 √(2N) / noise of their errors together, in any direction, and a tension follows by no more than that part of
/// its standard error: 4e-5 for 1 000 beads and noise 0.1. Five times that leaves room for interval ends, which follow
/// the tensions and their errors, and for the model's bending.
double largest_change(const Case& c) {
  constexpr double kRelative = 1e-7, kRoom = 5;
  return kRoom * kRelative * std::sqrt(2.0 * static_cast<double>(c.scene.beads.size())) / c.noise;
}

void expect_continuous(const Case& c) {
  const Answer base = answer_of(c, 0, 0);
  double worst_value = 0, worst_end = 0, worst_error = 0, worst_sum = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const Answer other = answer_of(c, seed % 2 == 1 ? 1e-7 : 1e-8, seed);
    const Eigen::ArrayXd scale = ((base.high - base.low) / 3.92).array();
    const auto worst = [&](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
      return ((a - b).array().abs() / scale).maxCoeff();
    };
    worst_value = std::max(worst_value, worst(base.value, other.value));
    worst_end = std::max({worst_end, worst(base.low, other.low), worst(base.high, other.high)});
    worst_error = std::max(worst_error, worst(base.error, other.error));
    worst_sum = std::max({worst_sum, std::abs(base.total - other.total) / base.total_error,
                          std::abs(base.network - other.network) / base.network_error,
                          std::abs(base.total_error - other.total_error) / base.total_error,
                          std::abs(base.network_error - other.network_error) / base.network_error});
  }
  const int n_at_bound = static_cast<int>((base.value.array() <= 0).count());
  if (std::getenv("MBTFM_PRINT"))
    std::printf("%-45s at bound %2d of %2d: value %.1e end %.1e error %.1e sums %.1e\n", c.name.c_str(), n_at_bound,
                static_cast<int>(base.value.size()), worst_value, worst_end, worst_error, worst_sum);
  EXPECT_LT(worst_value, largest_change(c)) << c.name;
  EXPECT_LT(worst_end, largest_change(c)) << c.name;
  EXPECT_LT(worst_error, largest_change(c)) << c.name;
  EXPECT_LT(worst_sum, largest_change(c)) << c.name;
}

TEST(Continuity, tensions_and_interval_ends_follow_the_data) {
  const char* more = std::getenv("MBTFM_CASES");
  const unsigned n = more ? static_cast<unsigned>(std::atoi(more)) : 1;
  for (const double noise : {0.05, 0.15, 0.3})
    for (unsigned seed = 1; seed <= n; ++seed) {
      for (const std::string name : {"case_21", "case_22"}) expect_continuous(of_reference(name, noise, seed));
      for (const int n_meshes : {1, 2}) expect_continuous(of_round_cell(n_meshes, noise, seed));
    }
}

}  // namespace
}  // namespace mbtfm::tensions
