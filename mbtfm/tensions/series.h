/// The fit of a time series: one cell, its networks and the gel's compliance, and displacements frame by frame. Each
/// frame is a fit of its own, with its own errors, that starts from the tensions of the frame before.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mbtfm/tensions/ensemble.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/results.h"

namespace mbtfm::tensions {

/// Displacements of one frame; of the same beads in all frames, some of them flagged.
struct SeriesFrame {
  int frame = 0;
  std::string refused;      ///< why it has no displacements
  std::string sha256 = {};  ///< of its file
  DisplacementField beads;  ///< empty where refused
};

/// frames.csv and displacement_0001.csv … of mbtfm-track.
/// @throws InputError where a frame has other beads than the first
std::vector<SeriesFrame> read_series(const Path& folder);

/// The beads of the first frame that was tracked, and so of all. @param frames  one at least is not refused
const DisplacementField& beads_of(const std::vector<SeriesFrame>& frames);

/// Response of displacement.csv's good beads, and of all beads of a series.
struct Responses {
  substrate::SharedResponse of_beads, of_series;
};
/// displacement.csv is a frame of the series, as a rule, and so found with it; of another origin it is found apart.
/// @param frames  may be none
/// @param response  by beads
Responses responses_of(const DisplacementField& beads, const std::vector<SeriesFrame>& frames,
                       const std::function<substrate::SharedResponse(const DisplacementField&)>& response);

/// What came of a frame.
struct FrameFit {
  int frame = 0;
  std::string refused;                   ///< why it has no fit
  std::string displacement_sha256 = {};  ///< of the file that it was fitted to
  std::vector<Tension> tensions = {};
  Estimate total_force_nN = {}, network_force_nN = {};
  double relative_l2 = 0, chi_squared_per_degree = 0;
  bool converged = false;
};

/// The fits that write_tracks and write_frames put into a folder; none where not both files are there.
std::vector<FrameFit> read_fits(const Path& folder);

/// The data of a frame whose beads may do more besides forces and common motion. @param forces_nN  of the network, with
/// which the frame's fit starts
using AllowMore = std::function<LinearData(LinearData, const VectorXd& forces_nN)>;
/// A frame's fit with what is found in addition.
using FindMore = std::function<EnsembleFit(EnsembleFit)>;

/// @param response  of all beads
/// @param is_used  by bead, as by reduce(); flagged beads are left out anyway
/// @param moves  a common motion of the beads is found with the tensions
/// @param is_coupled  each frame starts from the tensions of the one before; else all from `start`
/// @param start  of the first frame, on the first network
/// @param kept  fits of the same networks, compliance and parameters: taken for frames whose file is still the same
std::vector<FrameFit> fit_series(const std::vector<SeriesFrame>& frames, const network::Ensemble& networks,
                                 const substrate::SharedResponse& response, const std::vector<bool>& is_used,
                                 const std::vector<int>& adhesion_ids, const FitParameters& parameters, bool moves,
                                 bool is_coupled, const Work& work, Trial start, const std::vector<FrameFit>& kept = {},
                                 const AllowMore& allow = {}, const FindMore& find = {});

/// By frame and fibre. @param interval_s  between frames, if known
void write_tracks(const Path& file, const std::vector<FrameFit>& fits, const std::vector<Fibre>& fibres,
                  std::optional<double> interval_s);
/// By frame: forces, misfit.
void write_frames(const Path& file, const std::vector<FrameFit>& fits, std::optional<double> interval_s);
/// Tensions and forces over time as SVG, with 95 % intervals.
std::string series_picture(const std::vector<FrameFit>& fits, const std::vector<Fibre>& fibres,
                           std::optional<double> interval_s);

}  // namespace mbtfm::tensions
