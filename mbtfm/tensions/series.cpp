#include "mbtfm/tensions/series.h"

#include <algorithm>
#include <map>
#include <set>

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/tables.h"
#include "pipeline/charts/chart.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/hash.h"

namespace mbtfm::tensions {

namespace {

void check_same_beads(const Path& file, const DisplacementField& beads, const DisplacementField& first) {
  if (beads.size() != first.size()) {
    throw InputError(file.string(), std::to_string(first.size()) + " beads, as in the first frame",
                     std::to_string(beads.size()));
  }
  for (std::size_t i = 0; i < beads.size(); ++i) {
    if (beads[i].position_um == first[i].position_um) continue;
    throw InputError(file.string() + ": bead " + std::to_string(i + 1), "the place of the same bead in the first frame",
                     "another", "track all frames of a series together, against one relaxed image");
  }
}

/// Which of `all` are `beads`; nothing where not all of them are there, in that order.
std::optional<std::vector<Index>> places_among(const DisplacementField& all, const DisplacementField& beads) {
  std::vector<Index> places;
  for (std::size_t i = 0, next = 0; next < beads.size(); ++i) {
    if (i == all.size()) return std::nullopt;
    if (all[i].position_um != beads[next].position_um) continue;
    ++next;
    places.push_back(static_cast<Index>(i));
  }
  return places;
}

struct FrameData {
  DisplacementField beads;
  std::vector<bool> is_used;
  substrate::SharedResponse response;
};

/// Without the flagged beads.
FrameData good_beads_of(const SeriesFrame& frame, const substrate::SharedResponse& response,
                        const std::vector<bool>& is_used) {
  FrameData data;
  std::vector<Index> good;
  for (std::size_t i = 0; i < frame.beads.size(); ++i) {
    if (!frame.beads[i].flag.empty()) continue;
    data.beads.push_back(frame.beads[i]);
    data.is_used.push_back(is_used.empty() || is_used[i]);
    good.push_back(static_cast<Index>(i));
  }
  data.response = response->at_points(good);
  return data;
}

FrameFit described(const SeriesFrame& frame, const EnsembleFit& fit) {
  return {.frame = frame.frame,
          .refused = {},
          .displacement_sha256 = frame.sha256,
          .tensions = tensions_of(fit),
          .total_force_nN = fit.total_force_nN,
          .network_force_nN = fit.network_force_nN,
          .relative_l2 = relative_l2(fit.data, fit.forces.nN),
          .chi_squared_per_degree = fit.misfit.chi_squared_per_degree,
          .converged = fit.report.converged};
}

VectorXd values_of(const FrameFit& fit) {
  VectorXd values_nN(static_cast<Index>(fit.tensions.size()));
  for (Index i = 0; i < values_nN.size(); ++i) values_nN[i] = fit.tensions[i].tension_nN;
  return values_nN;
}

FibreType type_of(const Tension& tension, const std::vector<Fibre>& fibres) {
  const auto fibre = std::ranges::find(fibres, tension.fibre_id, &Fibre::fibre_id);
  MBTFM_ASSERT(fibre != fibres.end());
  return fibre->type;
}

std::optional<double> time_s(int frame, std::optional<double> interval_s) {
  if (!interval_s) return std::nullopt;
  return (frame - 1) * *interval_s;
}

/// A value over time, with bars.
struct Track {
  std::vector<Vec2> points;
  std::vector<double> low, high;
};

void draw(charts::Chart& chart, const Track& track, const std::string& colour, const std::string& name) {
  chart.curve(track.points, "fill:none;stroke-width:1.5;stroke:" + colour);
  for (std::size_t i = 0; i < track.points.size(); ++i) {
    const Vec2 p = track.points[i];
    chart.curve({{p.x, track.low[i]}, {p.x, track.high[i]}}, "stroke-width:0.8;stroke-opacity:0.45;stroke:" + colour);
    chart.dot(p, 2.5, "fill:" + colour, name);
  }
}

charts::Axis time_axis(const std::vector<FrameFit>& fits, std::optional<double> interval_s) {
  std::vector<double> times;
  for (const FrameFit& f : fits) times.push_back(time_s(f.frame, interval_s).value_or(f.frame));
  return charts::axis_over(interval_s ? "time (s)" : "frame", times, charts::Scale::linear);
}

charts::Axis from_zero(const std::string& label, double largest) {
  // above the highest curve there is room for the key
  return {.label = label, .low = 0, .high = largest > 0 ? 1.4 * largest : 1, .scale = charts::Scale::linear};
}

charts::Chart tension_chart(const std::vector<FrameFit>& fits, const std::vector<Fibre>& fibres,
                            std::optional<double> interval_s) {
  std::map<int, Track> tracks;
  std::map<int, FibreType> types;
  double largest = 0;
  for (const FrameFit& f : fits) {
    for (const Tension& t : f.tensions) {
      if (t.fibre_id == 0) continue;
      Track& track = tracks[t.fibre_id];
      track.points.push_back({time_s(f.frame, interval_s).value_or(f.frame), t.tension_nN});
      track.low.push_back(t.low_nN.value_or(t.tension_nN));
      track.high.push_back(t.high_nN.value_or(t.tension_nN));
      types[t.fibre_id] = type_of(t, fibres);
      largest = std::max(largest, t.tension_nN);  // a bar of a fibre that no bead resolves may reach beyond
    }
  }
  charts::Chart chart("Tensions of the fibres", time_axis(fits, interval_s), from_zero("tension (nN)", largest));
  std::set<FibreType> named;
  for (const auto& [id, track] : tracks) {
    const FibreType type = types.at(id);
    if (named.insert(type).second) chart.key(std::string(name_of(type)), charts::colour_of(type));
    draw(chart, track, charts::colour_of(type), "fibre " + std::to_string(id));
  }
  return chart;
}

charts::Chart force_chart(const std::vector<FrameFit>& fits, std::optional<double> interval_s) {
  Track total;
  std::vector<Vec2> network;
  double largest = 0;
  for (const FrameFit& f : fits) {
    if (!f.refused.empty()) continue;
    const double x = time_s(f.frame, interval_s).value_or(f.frame), half = 1.96 * f.total_force_nN.standard_error;
    total.points.push_back({x, f.total_force_nN.value});
    total.low.push_back(f.total_force_nN.value - half);
    total.high.push_back(f.total_force_nN.value + half);
    network.push_back({x, f.network_force_nN.value});
    largest = std::max(largest, total.high.back());
  }
  charts::Chart chart("Force of the cell", time_axis(fits, interval_s), from_zero("force (nN)", largest));
  draw(chart, total, charts::kColours[0], "total");
  chart.curve(network, std::string("fill:none;stroke-width:1.5;stroke:") + charts::kColours[1]);
  chart.key("total", charts::kColours[0]);
  chart.key("network", charts::kColours[1]);
  return chart;
}

}  // namespace

std::vector<SeriesFrame> read_series(const Path& folder) {
  std::vector<SeriesFrame> frames;
  const DisplacementField* first = nullptr;
  for (const files::FrameRow& row : files::read(folder / "frames.csv", files::frame_table()))
    frames.push_back({.frame = row.frame, .refused = row.refused, .beads = {}});
  for (SeriesFrame& frame : frames) {
    if (!frame.refused.empty()) continue;
    const Path file = folder / files::displacement_of_frame(frame.frame);
    frame.beads = files::read_displacement(file);
    frame.sha256 = files::sha256_of_file(file);
    if (first) check_same_beads(file, frame.beads, *first);
    if (!first) first = &frame.beads;
  }
  if (!first) throw InputError((folder / "frames.csv").string(), "a frame that was tracked", "none");
  return frames;
}

const DisplacementField& beads_of(const std::vector<SeriesFrame>& frames) {
  return std::find_if(frames.begin(), frames.end(), [](const SeriesFrame& f) { return f.refused.empty(); })->beads;
}

Responses responses_of(const DisplacementField& beads, const std::vector<SeriesFrame>& frames,
                       const std::function<substrate::SharedResponse(const DisplacementField&)>& response) {
  if (frames.empty()) return {response(beads), {}};
  const DisplacementField& all = beads_of(frames);
  Responses result{{}, response(all)};
  const auto places = places_among(all, beads);
  result.of_beads = places ? result.of_series->at_points(*places) : response(beads);
  return result;
}

std::vector<FrameFit> fit_series(const std::vector<SeriesFrame>& frames, const network::Ensemble& networks,
                                 const substrate::SharedResponse& response, const std::vector<bool>& is_used,
                                 const std::vector<int>& adhesion_ids, const FitParameters& parameters, bool moves,
                                 bool is_coupled, const Work& work, Trial start, const std::vector<FrameFit>& kept,
                                 const AllowMore& allow, const FindMore& find) {
  std::vector<FrameFit> fits;
  const auto fitted = [&](const SeriesFrame& frame) {
    FrameData good = good_beads_of(frame, response, is_used);
    LinearData data = reduce(good.beads, std::move(good.response), good.is_used, work.threads,
                             moves ? affine_motions(good.beads) : MatrixXd());
    const TensionProblem problem(networks.front(), data.reduced, adhesion_ids, {}, work.threads);
    const Trial begin = problem.evaluate(start.tensions_nN, &start);
    if (allow) data = allow(std::move(data), begin.forces_nN);
    EnsembleFit fit = fit_ensemble(networks, std::move(data), adhesion_ids, parameters, work.threads, {}, &begin);
    return described(frame, find ? find(std::move(fit)) : std::move(fit));
  };
  for (const SeriesFrame& frame : frames) {
    work.tell(static_cast<double>(fits.size()) / static_cast<double>(frames.size()),
              "frame " + std::to_string(frame.frame));
    const FrameFit not_fitted{.frame = frame.frame, .refused = frame.refused, .displacement_sha256 = frame.sha256};
    fits.push_back(not_fitted);
    if (!frame.refused.empty()) continue;
    const auto known = std::find_if(kept.begin(), kept.end(), [&](const FrameFit& fit) {
      return fit.frame == frame.frame && !frame.sha256.empty() && fit.displacement_sha256 == frame.sha256;
    });
    try {
      fits.back() = known != kept.end() ? *known : fitted(frame);
      if (is_coupled && fits.back().refused.empty()) start.tensions_nN = values_of(fits.back());
    } catch (const NotSolved& error) {  // one frame that cannot be fitted does not stop the others
      fits.back().refused = error.what();
    } catch (const InvalidData& error) {
      fits.back().refused = error.what();
    }
  }
  return fits;
}

void write_tracks(const Path& file, const std::vector<FrameFit>& fits, const std::vector<Fibre>& fibres,
                  std::optional<double> interval_s) {
  std::vector<TrackRow> rows;
  for (const FrameFit& f : fits) {
    for (const files::FibreTension& fibre : files::with_types(f.tensions, fibres))
      rows.push_back({.frame = f.frame, .time_s = time_s(f.frame, interval_s), .fibre = fibre});
  }
  files::write(file, track_table(), rows);
}

void write_frames(const Path& file, const std::vector<FrameFit>& fits, std::optional<double> interval_s) {
  std::vector<FitOfFrame> rows;
  for (const FrameFit& f : fits) rows.push_back({.fit = f, .time_s = time_s(f.frame, interval_s)});
  files::write(file, frame_fit_table(), rows);
}

std::vector<FrameFit> read_fits(const Path& folder) {
  if (!std::filesystem::is_regular_file(folder / "frames.csv")) return {};
  if (!std::filesystem::is_regular_file(folder / "tracks.csv")) return {};
  if (!files::CsvTable(folder / "frames.csv").has("displacement_sha256")) return {};  // of a version without it
  std::map<int, FrameFit> fits;
  for (FitOfFrame& row : files::read(folder / "frames.csv", frame_fit_table())) {
    const int frame = row.fit.frame;
    fits[frame] = std::move(row.fit);
  }
  for (const TrackRow& row : files::read(folder / "tracks.csv", track_table())) {
    fits[row.frame].frame = row.frame;
    fits[row.frame].tensions.push_back(row.fibre.tension);
  }
  std::vector<FrameFit> result;
  for (auto& [frame, fit] : fits) result.push_back(std::move(fit));
  return result;
}

std::string series_picture(const std::vector<FrameFit>& fits, const std::vector<Fibre>& fibres,
                           std::optional<double> interval_s) {
  return charts::svg_file({tension_chart(fits, fibres, interval_s), force_chart(fits, interval_s)}, 2,
                          {std::to_string(fits.size()) + " frames. Bars: 95 % intervals."});
}

}  // namespace mbtfm::tensions
