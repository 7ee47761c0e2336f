#include "mbtfm/mean/average.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "mbtfm/tractions/fttc.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "substrate/greens/wave.h"

namespace mbtfm::mean {

namespace {

Sample operator*(double share, const Sample& s) { return {share * s.displacement_um, share * s.traction_kPa}; }
Sample& operator+=(Sample& a, const Sample& b) {
  a.displacement_um += b.displacement_um;
  a.traction_kPa += b.traction_kPa;
  return a;
}

Vec2 squared(Vec2 v) { return {v.x * v.x, v.y * v.y}; }
Vec2 root(Vec2 v) { return {std::sqrt(std::max(0.0, v.x)), std::sqrt(std::max(0.0, v.y))}; }

/// Of a cell: sums of the traction towards the centre over the tips and over the rest of the edge.
struct Pulls {
  double tip = 0, edge = 0;
};

}  // namespace

CellField::CellField(const std::vector<GroundPatch>& patches, const Motion& motion, const Extent& seen)
    : motion_(motion), seen_(seen), origin_um_(patches.at(0).position_um) {
  spacing_um_ = std::sqrt(patches.front().area_um2);
  n_columns_ = 1;
  while (n_columns_ < std::ssize(patches) &&
         std::abs(patches[n_columns_].position_um.y - origin_um_.y) < 0.5 * spacing_um_)
    ++n_columns_;
  n_rows_ = static_cast<int>(std::ssize(patches)) / n_columns_;
  MBTFM_ASSERT(static_cast<std::size_t>(n_columns_) * n_rows_ == patches.size());
  for (const GroundPatch& patch : patches) nodes_.push_back({patch.displacement_um, patch.traction_kPa});
}

std::optional<Sample> CellField::at(Vec2 place_um) const {
  const Vec2 there = motion_.back_um(place_um), low = seen_.low_um, high = seen_.high_um;
  if (there.x < low.x || there.y < low.y || there.x > high.x || there.y > high.y) return std::nullopt;
  const Vec2 at = (1 / spacing_um_) * (there - origin_um_);
  const int column = static_cast<int>(std::floor(at.x)), row = static_cast<int>(std::floor(at.y));
  if (column < 0 || row < 0 || column >= n_columns_ || row >= n_rows_) return std::nullopt;
  const auto by_column = tractions::keys_weights(at.x - column), by_row = tractions::keys_weights(at.y - row);
  Sample sum;
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i) {
      const int c = std::clamp(column + i - 1, 0, n_columns_ - 1), r = std::clamp(row + j - 1, 0, n_rows_ - 1);
      sum += by_column[i] * by_row[j] * nodes_[static_cast<std::size_t>(r) * n_columns_ + c];
    }
  }
  return Sample{motion_.vector(sum.displacement_um), motion_.vector(sum.traction_kPa)};
}

std::optional<Sample> CellField::at(Vec2 place_um, const std::vector<Motion>& motions) const {
  Sample sum;
  int n = 0;
  for (const Motion& motion : motions) {
    const std::optional<Sample> there = at(motion.back_um(place_um));
    if (!there) continue;
    sum += {motion.vector(there->displacement_um), motion.vector(there->traction_kPa)};
    ++n;
  }
  if (n == 0) return std::nullopt;
  return (1.0 / n) * sum;
}

std::vector<NodeMean> mean_of(const std::vector<Vec2>& nodes_um,
                              const std::vector<std::vector<std::optional<Sample>>>& samples,
                              const Polygon& reference_um) {
  std::vector<NodeMean> means;
  for (std::size_t k = 0; k < nodes_um.size(); ++k) {
    NodeMean node{.position_um = nodes_um[k], .is_inside = contains(reference_um, nodes_um[k]), .mean = {}};
    for (const auto& cell : samples) {
      if (!cell[k]) continue;
      node.mean += *cell[k];
      node.n_cells += 1;
    }
    if (node.n_cells == 0) continue;
    const double n = node.n_cells;
    node.mean = (1 / n) * node.mean;
    Sample squares;
    for (const auto& cell : samples) {
      if (!cell[k]) continue;
      squares += {squared(cell[k]->displacement_um - node.mean.displacement_um),
                  squared(cell[k]->traction_kPa - node.mean.traction_kPa)};
    }
    if (node.n_cells > 1) {
      const double share = 1 / (n * (n - 1));
      node.sigma = Sample{root(share * squares.displacement_um), root(share * squares.traction_kPa)};
    }
    means.push_back(node);
  }
  return means;
}

std::vector<Vec2> lattice_over(const Polygon& reference_um, double margin_um, double spacing_um) {
  const auto [low, high] = extent_of(reference_um);
  // nodes lie evenly about the middle, so that a symmetric shape has symmetric nodes
  const Vec2 middle = centroid_um(reference_um);
  const auto reach = [&](double from, double to) {
    return static_cast<int>(std::ceil((to - from + margin_um) / spacing_um));
  };
  std::vector<Vec2> nodes;
  for (int j = -reach(low.y, middle.y); j <= reach(middle.y, high.y); ++j)
    for (int i = -reach(low.x, middle.x); i <= reach(middle.x, high.x); ++i)
      nodes.push_back(middle + spacing_um * Vec2{static_cast<double>(i), static_cast<double>(j)});
  return nodes;
}

std::vector<Vec2> tips_of(const Polygon& reference_um) {
  constexpr double kReachesOut = 1.1;  // a bump of less is lost in a mean's resolution
  constexpr double kApart = 0.3;       // rad: neighbouring points of one tip
  const Vec2 centre = centroid_um(reference_um);
  const double size = size_um(reference_um);
  std::vector<Vec2> far = reference_um;
  std::erase_if(far, [&](Vec2 p) { return norm(p - centre) < kReachesOut * size; });
  std::ranges::stable_sort(far, std::greater(), [&](Vec2 p) { return norm(p - centre); });
  std::vector<Vec2> tips;
  for (const Vec2 p : far) {
    const Vec2 arm = p - centre;
    const bool is_new = std::ranges::all_of(tips, [&](Vec2 tip) {
      const Vec2 other = tip - centre;
      return std::abs(std::atan2(cross(arm, other), dot(arm, other))) > kApart;
    });
    // a flank of a tip lies lower than the tip beside it: what counts as one of its own is as far as nine tenths of it
    if (is_new && norm(arm) > 0.9 * norm((tips.empty() ? p : tips.front()) - centre)) tips.push_back(p);
  }
  return tips;
}

std::vector<EdgePart> edge_parts(const std::vector<Vec2>& nodes_um, const Polygon& reference_um, double band_um,
                                 double tip_um) {
  const std::vector<Vec2> tips = tips_of(reference_um);
  std::vector<EdgePart> parts;
  for (const Vec2 p : nodes_um) {
    const bool is_edge = contains(reference_um, p) && distance_to_boundary_um(reference_um, p) <= band_um;
    const bool is_tip = std::ranges::any_of(tips, [&](Vec2 tip) { return norm(p - tip) <= tip_um; });
    parts.push_back(!is_edge || tips.empty() ? EdgePart::none : is_tip ? EdgePart::tip : EdgePart::edge);
  }
  return parts;
}

std::optional<Ratio> tip_over_edge(const std::vector<Vec2>& nodes_um,
                                   const std::vector<std::vector<std::optional<Sample>>>& samples,
                                   const std::vector<EdgePart>& parts, Vec2 centre_um, std::uint64_t seed) {
  std::vector<Pulls> pulls;
  for (const auto& cell : samples) {
    Pulls sum, n;
    for (std::size_t k = 0; k < nodes_um.size(); ++k) {
      if (parts[k] == EdgePart::none || !cell[k]) continue;
      const Vec2 inward = centre_um - nodes_um[k];
      const double pull = dot(cell[k]->traction_kPa, inward) / norm(inward);
      double& value = parts[k] == EdgePart::tip ? sum.tip : sum.edge;
      double& count = parts[k] == EdgePart::tip ? n.tip : n.edge;
      value += pull;
      count += 1;
    }
    if (n.tip > 0 && n.edge > 0) pulls.push_back({sum.tip / n.tip, sum.edge / n.edge});
  }
  if (pulls.size() < 2) return std::nullopt;
  Ratio ratio{.n_cells = static_cast<int>(pulls.size())};
  const auto mean_of_some = [&](const auto& index_of) {
    Pulls mean;
    for (std::size_t k = 0; k < pulls.size(); ++k) {
      const Pulls& one = pulls[index_of(k)];
      mean.tip += one.tip / static_cast<double>(pulls.size());
      mean.edge += one.edge / static_cast<double>(pulls.size());
    }
    return mean;
  };
  const Pulls all = mean_of_some([](std::size_t k) { return k; });
  ratio.tip_kPa = all.tip;
  ratio.edge_kPa = all.edge;
  ratio.ratio = all.tip / all.edge;
  constexpr int kResamples = 4000;  // the ends of the interval then vary by a fiftieth of its width
  std::mt19937_64 random(seed);
  std::vector<double> ratios;
  for (int b = 0; b < kResamples; ++b) {
    const Pulls mean = mean_of_some([&](std::size_t) { return static_cast<std::size_t>(random() % pulls.size()); });
    ratios.push_back(mean.tip / mean.edge);
  }
  std::ranges::sort(ratios);
  ratio.low = ratios[kResamples / 40];
  ratio.high = ratios[kResamples - 1 - kResamples / 40];
  return ratio;
}

namespace {

constexpr double kTolerance = 1e-4;  // of the tractions, in energy: a hundredth of them

tractions::LatticeProblem problem_of(const Registered& cell, const tractions::TractionParameters& parameters) {
  return {cell.beads, cell.gel, tractions::lattice_options(parameters, 1)};
}

CellField solved(const tractions::LatticeProblem& problem, tractions::TikhonovSolver& solver, const Registered& cell,
                 const tractions::TractionParameters& parameters, double lambda) {
  solver.solve(lambda, kTolerance);
  const tractions::WaveField waves = solver.solution();
  return {tractions::patches_of(problem, tractions::tractions_kPa(problem, waves, parameters.read_out, 0),
                                problem.displaced(waves)),
          cell.motion, extent_of(cell.beads, &Bead::position_um)};
}

}  // namespace

double lambda_by_risk_um_per_kPa(const Registered& cell, const tractions::TractionParameters& parameters) {
  const tractions::LatticeProblem problem = problem_of(cell, parameters);
  tractions::TikhonovSolver solver(problem);
  return tractions::chosen_lambda(tractions::scan_lambda(problem, solver), inverse::LambdaCriterion::risk);
}

CellField field_of(const Registered& cell, const tractions::TractionParameters& parameters, double lambda_um_per_kPa) {
  const tractions::LatticeProblem problem = problem_of(cell, parameters);
  tractions::TikhonovSolver solver(problem);
  return solved(problem, solver, cell, parameters, lambda_um_per_kPa);
}

CellField blurred(const std::function<Vec2(Vec2 place_um)>& traction_kPa, const Registered& cell,
                  const tractions::TractionParameters& parameters, double lambda_um_per_kPa) {
  const tractions::LatticeProblem problem = problem_of(cell, parameters);
  tractions::NodeField nodes = problem.transform().no_field();
  for (int j = 0; j < problem.field().n_rows; ++j) {
    for (int i = 0; i < problem.field().n_columns; ++i) {
      const Vec2 there = cell.motion.place_um(problem.field().position_um(i, j));
      const Vec2 traction = cell.motion.vector_back(traction_kPa(there));
      const Eigen::Index at = i + static_cast<Eigen::Index>(problem.box().n_columns) * j;
      nodes.x[at] = traction.x;
      nodes.y[at] = traction.y;
    }
  }
  const tractions::NodeField displacement = problem.displaced(problem.transform().forward(nodes));
  const tractions::NodeField spread = problem.spread(problem.at_beads(displacement));
  tractions::TikhonovSolver solver(problem, problem.pulled_back(spread), 1);
  return solved(problem, solver, cell, parameters, lambda_um_per_kPa);
}

std::vector<WaveShare> wave_shares(const std::vector<Registered>& cells, const std::vector<double>& lambdas_um_per_kPa,
                                   GelModel model, double size_um) {
  constexpr double kShortest = 0.01, kStep = 1.05;  // of the size
  std::vector<WaveShare> shares;
  for (double wavelength = kShortest * size_um; wavelength < 4 * size_um; wavelength *= kStep) {
    const double wave = 2 * std::numbers::pi / wavelength;
    WaveShare share{.wavelength_um = wavelength};
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const auto compliance = greens::wave_compliance(cells[k].gel, model, wave);
      const auto left = [&](double c) { return c * c / (c * c + lambdas_um_per_kPa[k] * lambdas_um_per_kPa[k]); };
      // at the edge, a size from the middle, a wave through it is moved by shift and turn
      const double moved2 =
          std::pow(cells[k].shift_error_um, 2) + 0.5 * std::pow(size_um * cells[k].angle_error_rad, 2);
      const double n = static_cast<double>(cells.size());
      share.along += left(compliance.along_um_per_kPa) / n;
      share.across += left(compliance.across_um_per_kPa) / n;
      share.registration += std::exp(-0.5 * wave * wave * moved2) / n;
    }
    shares.push_back(share);
  }
  return shares;
}

double gaussian_um(const std::vector<WaveShare>& shares, const std::function<double(const WaveShare&)>& share) {
  for (const WaveShare& one : shares) {
    // exp(-k² s² / 2) = 1/2
    if (share(one) >= 0.5)
      return one.wavelength_um == shares.front().wavelength_um
                 ? 0
                 : std::sqrt(2 * std::numbers::ln2) * one.wavelength_um / (2 * std::numbers::pi);
  }
  return std::sqrt(2 * std::numbers::ln2) * shares.back().wavelength_um / (2 * std::numbers::pi);
}

}  // namespace mbtfm::mean
