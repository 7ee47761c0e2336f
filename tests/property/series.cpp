/// A time series: every frame is a fit of its own on one cell, and follows what the tensions do.
#include "mbtfm/tensions/series.h"

#include "pipeline/contract/errors.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/text.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/tension_scene.h"

namespace mbtfm::tensions {
namespace {

constexpr double kNoiseOfFrames = 0.05;

/// Each tension swells and ebbs by half, one after the other.
Eigen::VectorXd tensions_at(const Eigen::VectorXd& base_nN, int frame) {
  Eigen::VectorXd tensions = base_nN;
  for (Eigen::Index i = 0; i < tensions.size(); ++i)
    tensions[i] *= 1 + 0.5 * std::sin(0.8 * frame + static_cast<double>(i));
  return tensions;
}

struct Series {
  test::TensionScene scene;
  std::vector<Eigen::VectorXd> true_nN;
  std::vector<double> true_total_nN;
  std::vector<SeriesFrame> frames;
};

Series make_series(int n_frames) {
  Series series{.scene = test::tension_scene("case_21", 1500, kNoiseOfFrames, 1)};
  const Eigen::VectorXd base_nN = series.scene.tensions_nN;
  for (int f = 1; f <= n_frames; ++f) {
    series.true_nN.push_back(tensions_at(base_nN, f));
    contract(series.scene, series.true_nN.back());
    measure(series.scene, kNoiseOfFrames, static_cast<unsigned>(f));
    series.true_total_nN.push_back(total_nN(series.scene.forces_nN));
    series.frames.push_back({.frame = f, .beads = series.scene.beads});
  }
  return series;
}

std::vector<FrameFit> fit(const Series& series, const std::vector<FrameFit>& kept = {}) {
  std::vector<cables::CableNetwork> networks;
  networks.emplace_back(series.scene.cables.network());
  FitParameters parameters;
  parameters.n_meshes = 1;
  const Trial start = uniform_start({networks.front(), series.scene.data.reduced, series.scene.adhesion_ids});
  return fit_series(series.frames, networks, substrate::dense_response(series.scene.compliance_um_per_nN), {},
                    series.scene.adhesion_ids, parameters, true, true, 2, start, kept);
}

using FrameSeries = test::InFolder;

TEST_F(FrameSeries, tensions_and_total_force_that_change_are_followed_within_their_standard_errors) {
  const Series series = make_series(12);
  const std::vector<FrameFit> fits = fit(series);
  ASSERT_EQ(fits.size(), series.frames.size());
  double squares = 0, total_squares = 0;
  int n = 0;
  for (std::size_t f = 0; f < fits.size(); ++f) {
    ASSERT_TRUE(fits[f].refused.empty()) << fits[f].refused;
    for (std::size_t i = 0; i < fits[f].tensions.size(); ++i) {
      const double truth = series.true_nN[f][static_cast<Eigen::Index>(i)];
      if (truth < 3 * *fits[f].tensions[i].sigma_nN) continue;  // the bound t >= 0 makes those better than stated
      squares += std::pow((fits[f].tensions[i].tension_nN - truth) / *fits[f].tensions[i].sigma_nN, 2);
      ++n;
    }
    const Estimate& total = fits[f].total_force_nN;
    total_squares += std::pow((total.value - series.true_total_nN[f]) / total.standard_error, 2);
  }
  ASSERT_GE(n, 40);
  // The root mean of n squares of normal variables deviates by 1/sqrt(2n): four of those.
  EXPECT_NEAR(std::sqrt(squares / n), 1, 4 / std::sqrt(2.0 * n));
  const double n_frames = static_cast<double>(fits.size());
  EXPECT_NEAR(std::sqrt(total_squares / n_frames), 1, 4 / std::sqrt(2 * n_frames));
}

TEST_F(FrameSeries, a_frame_without_displacements_or_with_too_few_beads_does_not_stop_the_others) {
  Series series = make_series(4);
  series.frames[1] = {.frame = 2, .refused = "out of focus"};
  for (std::size_t i = 2; i < series.frames[2].beads.size(); ++i) series.frames[2].beads[i].flag = "lost";
  const std::vector<FrameFit> fits = fit(series);
  EXPECT_EQ(fits[1].refused, "out of focus");
  EXPECT_TRUE(has_words(fits[2].refused, "at least"));
  EXPECT_TRUE(fits[0].converged);
  EXPECT_TRUE(fits[3].converged);
}

TEST_F(FrameSeries, flagged_beads_do_not_count) {
  Series series = make_series(1);
  const std::vector<FrameFit> before = fit(series);
  for (std::size_t i = 0; i < series.frames[0].beads.size(); i += 10) series.frames[0].beads[i].flag = "ambiguous";
  const std::vector<FrameFit> without = fit(series);
  for (std::size_t i = 0; i < series.frames[0].beads.size(); i += 10)
    series.frames[0].beads[i].displacement_um = {100, 100};
  const std::vector<FrameFit> wrong = fit(series);
  for (std::size_t i = 0; i < before[0].tensions.size(); ++i) {
    EXPECT_NE(before[0].tensions[i].tension_nN, without[0].tensions[i].tension_nN);
    EXPECT_EQ(wrong[0].tensions[i].tension_nN, without[0].tensions[i].tension_nN);
  }
}

TEST_F(FrameSeries, the_response_of_beads_that_the_frames_share_is_found_once) {
  const Series series = make_series(2);
  int n_calls = 0;
  const auto response = [&](const DisplacementField& beads) {
    ++n_calls;
    Eigen::MatrixXd places(2 * beads.size(), 1);
    for (std::size_t i = 0; i < beads.size(); ++i) {
      places(2 * static_cast<Eigen::Index>(i), 0) = beads[i].position_um.x;
      places(2 * static_cast<Eigen::Index>(i) + 1, 0) = beads[i].position_um.y;
    }
    return substrate::dense_response(places);
  };
  const auto column = [](const substrate::SharedResponse& r) { return r->displace(Eigen::MatrixXd::Ones(1, 1)); };
  DisplacementField good;  // as displacement.csv without the beads that its frame flags
  for (std::size_t i = 3; i < series.frames[0].beads.size(); i += 2) good.push_back(series.frames[0].beads[i]);
  const Responses shared = responses_of(good, series.frames, response);
  EXPECT_EQ(n_calls, 1);
  EXPECT_EQ(column(shared.of_beads), column(response(good)));
  EXPECT_EQ(column(shared.of_series), column(response(series.frames[0].beads)));
  good.back().position_um.x += 1;  // a field of another origin beside the series
  n_calls = 0;
  const Responses apart = responses_of(good, series.frames, response);
  EXPECT_EQ(n_calls, 2);
  EXPECT_EQ(column(apart.of_beads), column(response(good)));
  responses_of(good, {}, response);
  EXPECT_EQ(n_calls, 4);
}

TEST_F(FrameSeries, fits_read_back_are_kept_for_frames_whose_file_is_the_same) {
  Series series = make_series(3);
  for (SeriesFrame& frame : series.frames) frame.sha256 = "file " + std::to_string(frame.frame);
  std::vector<FrameFit> whole = fit(series);
  whole[0].tensions[0].tension_nN = 42;  // no fit gives it
  write_tracks(folder / "tracks.csv", whole, {}, 30);
  write_frames(folder / "frames.csv", whole, 30);
  const std::vector<FrameFit> known = read_fits(folder / "");
  contract(series.scene, series.true_nN[0]);
  measure(series.scene, kNoiseOfFrames, 99);
  series.frames[1] = {.frame = 2, .sha256 = "another file", .beads = series.scene.beads};
  const std::vector<FrameFit> again = fit(series, known);
  EXPECT_EQ(again[0].tensions[0].tension_nN, 42);
  EXPECT_NE(again[1].total_force_nN.value, whole[1].total_force_nN.value);
  EXPECT_EQ(again[1].displacement_sha256, "another file");
  EXPECT_EQ(again[2].total_force_nN.value, whole[2].total_force_nN.value);
  const auto written = [&](const std::vector<FrameFit>& fits) {
    write_tracks(folder / "t.csv", fits, {}, 30);
    write_frames(folder / "f.csv", fits, 30);
    return files::read_text(folder / "t.csv") + files::read_text(folder / "f.csv");
  };
  EXPECT_EQ(written(known), written(whole));  // the same bytes
}

TEST_F(FrameSeries, time_begins_with_the_first_frame) {
  std::vector<FrameFit> fits(2);
  for (FrameFit& fit : fits) fit.tensions.resize(1);
  fits[0].frame = 1;
  fits[1].frame = 4;
  write_frames(folder / "frames.csv", fits, 30);
  write_tracks(folder / "tracks.csv", fits, {}, 30);
  for (const char* name : {"frames.csv", "tracks.csv"}) {
    const files::CsvTable table(folder / name);
    EXPECT_EQ(table.number(0, "time_s"), 0) << name;
    EXPECT_EQ(table.number(1, "time_s"), 90) << name;
  }
}

TEST_F(FrameSeries, frames_of_other_beads_are_an_error_that_names_the_file) {
  Series series = make_series(2);
  files::write_text(folder / "frames.csv", "frame,image,refused\n1,a.tif,\n2,b.tif,\n");
  files::write_displacement(folder / "displacement_0001.csv", series.frames[0].beads);
  series.frames[1].beads[7].position_um.x += 1;
  files::write_displacement(folder / "displacement_0002.csv", series.frames[1].beads);
  const InputError error = test::thrown<InputError>([&] { read_series(folder / ""); });
  EXPECT_TRUE(has_words(error.what(), "displacement_0002.csv: bead 8"));
}

}  // namespace
}  // namespace mbtfm::tensions
