/// Bead images of simulated cells, and what became of the beads in them.
#pragma once

#include "samples/drawing/render.h"
#include "samples/experiment/experiment.h"
#include "segment/beads/plane.h"
#include "tests/support/tracking_accuracy.h"

namespace mbtfm::test {

struct CellPair {
  experiment::Experiment experiment;
  images::Image relaxed, stressed;
  beads::Neighbours shown;    ///< relaxed places of all beads, um
  std::vector<char> is_lost;  ///< by bead: not in the stressed image
};

inline CellPair drawn_pair(const drawing::ScenarioParameters& p, int threads) {
  CellPair pair{experiment::simulate(p, threads), {}, {}, {}, {}};
  const drawing::MicroscopeParameters m = drawing::at_quality(p.microscope);
  std::vector<Vec2> relaxed, stressed;
  for (const Bead& bead : pair.experiment.measured) {
    relaxed.push_back(bead.position_um);
    stressed.push_back(bead.position_um + bead.displacement_um);
  }
  const drawing::BeadImages spots = drawing::bead_spots(relaxed, stressed, p.lost_bead_fraction, m, p.seed);
  pair.relaxed = drawing::recorded(drawing::photons_of(spots.relaxed, m, threads), m, p.seed, 2, threads);
  pair.stressed = drawing::recorded(drawing::photons_of(spots.stressed, m, threads), m, p.seed, 3, threads);
  std::size_t next = 0;  // the spots that are there lie in the order of the beads
  for (const Vec2 end : stressed) {
    const bool is_shown = next < spots.stressed.size() && spots.stressed[next].position_um == end;
    pair.is_lost.push_back(!is_shown);
    next += is_shown;
  }
  pair.shown = beads::Neighbours(std::move(relaxed), 1);
  return pair;
}

struct Flags {
  int n = 0, n_right = 0;
};

struct Peaks {
  int n = 0, n_right = 0, n_wrong = 0;
};

struct Counts {
  std::map<std::string, Flags> flags;
  Peaks peaks;
  MeanSquare own, field;  ///< px, of a component, about the bead's own step and about the field
  MeanSquare variance;    ///< of error/sigma about the field
  Counts& operator+=(const Counts& other) {
    for (const auto& [name, f] : other.flags) flags[name].n += f.n, flags[name].n_right += f.n_right;
    peaks.n += other.peaks.n, peaks.n_right += other.peaks.n_right, peaks.n_wrong += other.peaks.n_wrong;
    own += other.own, field += other.field, variance += other.variance;
    return *this;
  }
};

inline constexpr double kLost = 1e3;  ///< px

inline Counts counted(const beads::Tracking& tracking, const CellPair& pair, const drawing::MicroscopeParameters& m) {
  Counts counts;
  const double pixel = m.pixel_size_um, margin = 3 * tracking.bead_sigma_um, side = drawing::field_um(m);
  for (const Bead& bead : tracking.field) {
    const auto around = pair.shown.within(bead.position_um, 2 * pixel, 3);
    double off = around.empty() ? 0 : kLost;  // chance spots have no step of their own
    bool is_leaving = false;
    for (const int k : around) {
      const Bead& truth = pair.experiment.measured[k];
      const Vec2 end = truth.position_um + truth.displacement_um;
      if (std::min({end.x, end.y, side - end.x, side - end.y}) < margin) is_leaving = true;
      if (!pair.is_lost[k]) off = std::min(off, norm(bead.displacement_um - truth.displacement_um) / pixel);
    }
    const bool is_good = bead.flag.empty();
    Flags& flags = counts.flags[bead.flag];
    ++flags.n;
    flags.n_right += is_good ? off <= 1 : off > 1 || is_leaving;
    if (around.empty()) continue;
    const Vec2 field_um = pair.experiment.displacement[around[0]].displacement_um;
    if (norm(field_um) > 5 * pixel) {
      ++counts.peaks.n;
      if (is_good) ++(off <= 1 ? counts.peaks.n_right : counts.peaks.n_wrong);
    }
    if (!is_good) continue;
    if (off < kLost) counts.own.add(0.5 * off * off);
    const Vec2 error = bead.displacement_um - field_um;
    counts.field.add(0.5 * dot(error, error) / (pixel * pixel));
    counts.variance.add(0.5 * dot(error, error) / (bead.sigma_um * bead.sigma_um));
  }
  return counts;
}

}  // namespace mbtfm::test
