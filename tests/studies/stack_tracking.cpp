/// stack_tracking [photons] [folder for pictures]: beads in rendered stacks of 512 x 512 x 100 voxels, 2 000 to 20 000
/// of them, found, followed and compared with the truth; then the real data of ../shared/data, where they are.
///
/// Followed: of the beads that both stacks hold, 1 um and more from the rim. Wrong: further than 0.5 um off, of those
/// that are not flagged. Error over standard error: what 68 % are below, which is 1 where the errors are normal.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "pipeline/files/csv.h"
#include "pipeline/numerics/near.h"
#include "pipeline/numerics/order_statistics.h"
#include "samples/drawing/stack.h"
#include "segment/images/png.h"
#include "segment/stacks/track.h"

using namespace mbtfm;
namespace fs = std::filesystem;

namespace {

constexpr int kThreads = 2;

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
double processor_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) + 1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}
double peak_GB() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1048576;
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

// --- pictures

void ring(images::Picture& picture, double x, double y, const std::uint8_t (&colour)[3]) {
  for (int t = 0; t < 60; ++t) {
    const double a = 2 * std::numbers::pi * t / 60;
    const int i = static_cast<int>(x + 8 * std::cos(a)), j = static_cast<int>(y + 8 * std::sin(a));
    if (i < 0 || j < 0 || i >= picture.width || j >= picture.height) continue;
    std::copy(colour, colour + 3, &picture.rgb[3 * (static_cast<std::size_t>(j) * picture.width + i)]);
  }
}

/// A slice, twice as large, with what is found: red in this slice, blue within two of it.
void draw(const images::Image& slice, const std::vector<stacks::Spot>& spots, int k, const fs::path& file) {
  constexpr int kScale = 2;
  const double low = numerics::quantile(std::vector<double>(slice.pixels.begin(), slice.pixels.end()), 0.01);
  const double high = numerics::quantile(std::vector<double>(slice.pixels.begin(), slice.pixels.end()), 0.999);
  images::Picture picture{slice.width * kScale, slice.height * kScale, {}};
  for (int j = 0; j < picture.height; ++j) {
    for (int i = 0; i < picture.width; ++i) {
      const double v = (slice.at(i / kScale, j / kScale) - low) / std::max(1.0, high - low);
      picture.rgb.insert(picture.rgb.end(), 3, static_cast<std::uint8_t>(255 * std::sqrt(std::clamp(v, 0.0, 1.0))));
    }
  }
  for (const stacks::Spot& s : spots) {
    if (std::abs(s.place.z - k) > 2) continue;
    const bool is_here = std::abs(s.place.z - k) <= 0.7;
    const double x = kScale * (s.place.x + 0.5), y = kScale * (s.place.y + 0.5);
    is_here ? ring(picture, x, y, {255, 80, 60}) : ring(picture, x, y, {60, 160, 255});
  }
  images::write_png(file, picture);
}

// --- rendered stacks

struct Scene {
  drawing::StackMicroscope microscope;
  std::vector<drawing::GlowingBead> relaxed, stressed;
  stacks::Scale scale() const {
    return {.pixel_um = microscope.pixel_size_um,
            .step_um = microscope.focus_step_um(),
            .first_um = 0,
            .z_points = ZPoints::into_gel,
            .depth = microscope.n_slices};
  }
  Vec3 size_um() const {
    const double side = microscope.pixel_size_um * microscope.image_size_px;
    return {side, side, microscope.focus_step_um() * microscope.n_slices};
  }
};

/// Evenly drawn beads; a pull of 1.5 um towards the middle of the surface.
Scene scene_of(int n_beads, double photons, unsigned seed) {
  Scene s;
  s.microscope.bead_photons = photons;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  const Vec3 size = s.size_um();
  for (int k = 0; k < n_beads; ++k) {
    const Vec3 place{size.x * unit(random), size.y * unit(random), size.z * unit(random)};
    const double light = std::exp(s.microscope.bead_brightness_log_sd * normal(random));
    const Vec3 d{(place.x - size.x / 2) / 12, (place.y - size.y / 2) / 12, place.z / 15};
    const double a = std::exp(-0.5 * dot(d, d));
    s.relaxed.push_back({place, light});
    s.stressed.push_back({place + Vec3{-2.5 * d.x * a, -2.5 * d.y * a, 0.8 * a}, light});
  }
  return s;
}

struct Errors {
  std::vector<double> across_um, along_um, across, along;  ///< the last two over the standard errors
  int n_followed = 0, n_asked = 0, n_good = 0, n_wrong = 0, n_spurious = 0;
};

Errors errors_of(const Scene& scene, const stacks::Followed& followed) {
  Errors e;
  std::vector<Vec3> places;
  for (const auto& bead : scene.relaxed) places.push_back(bead.position_um);
  const numerics::Near near(places, 2);
  std::vector<char> is_followed(places.size());
  for (const BeadInSpace& bead : followed.field) {
    const auto at = near.within(bead.position_um, 0.6, 1);
    e.n_spurious += at.empty();
    if (!bead.flag.empty()) continue;
    ++e.n_good;
    constexpr double kWrong_um = 0.5;
    const auto k = at.empty() ? 0 : static_cast<std::size_t>(at[0]);
    const Vec3 off = bead.displacement_um - (scene.stressed[k].position_um - scene.relaxed[k].position_um);
    if (at.empty() || norm(off) > kWrong_um) {
      ++e.n_wrong;
      continue;
    }
    is_followed[k] = 1;
    for (const double c : {off.x, off.y}) e.across_um.push_back(c), e.across.push_back(std::abs(c) / bead.sigma_um);
    e.along_um.push_back(off.z), e.along.push_back(std::abs(off.z) / bead.sigma_z_um);
  }
  const Vec3 size = scene.size_um();
  const auto is_inside = [&](Vec3 p) {
    constexpr double kRim_um = 1;
    return std::min({p.x, p.y, p.z, size.x - p.x, size.y - p.y, size.z - p.z}) > kRim_um;
  };
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (!is_inside(places[k]) || !is_inside(scene.stressed[k].position_um)) continue;
    ++e.n_asked, e.n_followed += is_followed[k];
  }
  return e;
}

void rendered(int n_beads, double photons, const std::string& pictures) {
  const Scene scene = scene_of(n_beads, photons, 1);
  const drawing::StackMicroscope& m = scene.microscope;
  const drawing::PointSpread spread(m.optics, scene.size_um().z, m.pixel_size_um, kThreads);
  // a drift of slices by steps of 0.03 um, and a jump of 0.3 um
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  drawing::StageMotion stage;
  Vec2 at;
  for (int k = 0; k < m.n_slices; ++k) {
    at += Vec2{0.03 * normal(random), 0.03 * normal(random)};
    if (k == 40) at += Vec2{0.3, -0.2};
    stage.shift_um.push_back(at);
  }
  auto relaxed = drawing::recorded_stack(scene.relaxed, m, spread, {}, 1, 1, kThreads);
  auto stressed = drawing::recorded_stack(scene.stressed, m, spread, stage, 1, 0, kThreads);
  const images::Image shown = relaxed[static_cast<std::size_t>(m.n_slices / 2)];
  const double start = now_s(), start_processor = processor_s();
  const auto a = stacks::detect(std::move(relaxed), 5, "relaxed", kThreads);
  const auto b = stacks::detect(std::move(stressed), 5, "stressed", kThreads);
  const double found = processor_s();
  const auto followed = stacks::follow(stacks::placed(a, scene.scale()), stacks::placed(b, scene.scale()), {},
                                       Switch::automatic, scene.scale().slices(), kThreads);
  const double end = processor_s();
  const Errors e = errors_of(scene, followed);
  std::printf("| %d | %zu | %.4f | %.5f | %.4f, %.4f | %.2f, %.2f | %.2f, %.2f | %.1f | %.0f + %.0f (%.0f) | %.2f |\n",
              n_beads, a.spots.size(), 1.0 * e.n_followed / e.n_asked, 1.0 * e.n_wrong / e.n_good, rms(e.across_um),
              rms(e.along_um), numerics::quantile(e.across, 0.683), numerics::quantile(e.along, 0.683),
              followed.error_ratio, followed.error_ratio_z, followed.common.slice_drift_ratio, found - start_processor,
              end - found, now_s() - start, peak_GB());
  const int k = m.n_slices / 2;
  if (!pictures.empty()) draw(shown, a.spots, k, fs::path(pictures) / ("rendered_" + std::to_string(n_beads) + ".png"));
}

// --- real data

/// Shares, and how well neighbours agree, where nobody knows the truth.
void print_agreement(const std::vector<stacks::PlacedBead>& relaxed, const stacks::Matching& matching) {
  std::vector<double> across, along, over, over_z;
  int n_good = 0, n_inside = 0;
  for (std::size_t k = 0; k < relaxed.size(); ++k) {
    const stacks::Match& m = matching.matches[k];
    n_inside += relaxed[k].flag != stacks::TrackFlag::edge;
    if (m.flag != stacks::TrackFlag::none) continue;
    ++n_good;
    across.push_back(std::hypot(m.from_neighbours_um.x, m.from_neighbours_um.y));
    along.push_back(std::abs(m.from_neighbours_um.z));
    over.push_back(across.back() / m.sigma_um), over_z.push_back(along.back() / m.sigma_z_um);
  }
  std::printf("  followed %d of %d (%.3f; %.3f of those inside); off their neighbours %.4f across, %.4f along z",
              n_good, static_cast<int>(relaxed.size()), 1.0 * n_good / static_cast<double>(relaxed.size()),
              1.0 * n_good / n_inside, numerics::quantile(across, 0.5) / 1.1774,
              numerics::quantile(along, 0.5) / 0.6745);
  if (relaxed.front().sigma_um > 0)
    std::printf(" (%.2f and %.2f standard errors)", numerics::quantile(over, 0.5) / 1.1774,
                numerics::quantile(over_z, 0.5) / 0.6745);
  std::printf("\n");
  for (const auto flag : values_of<stacks::TrackFlag>()) {
    const auto n = std::ranges::count_if(matching.matches, [&](const auto& m) { return m.flag == flag; });
    if (n > 0 && flag != stacks::TrackFlag::none) std::printf("    %s: %d\n", name_of(flag), static_cast<int>(n));
  }
  const stacks::RigidMotion& f = matching.first;
  std::printf("  shift (%.2f, %.2f, %.2f), turn %.3f deg\n", f.shift_um.x, f.shift_um.y, f.shift_um.z,
              f.turn_rad * 180 / std::numbers::pi);
}

void real_stacks(const fs::path& folder, const std::string& pictures) {
  std::vector<stacks::PlacedBead> beads[2];
  const char* names[] = {"CytoD_Beads.tif", "Normal_Beads.tif"};
  for (int s = 0; s < 2; ++s) {
    std::vector<images::Image> slices = images::read_slices(folder / names[s], {});
    const int depth = static_cast<int>(slices.size()), k = depth / 2;
    const images::Image shown = slices[static_cast<std::size_t>(k)];
    const double start = processor_s();
    const stacks::Detection d = stacks::detect(std::move(slices), 5, names[s], kThreads);
    const stacks::Widths w = d.widths_in_the_middle();
    std::printf("%s: %d beads, widths %.2f px, %.2f slices; %.1f s\n", names[s], static_cast<int>(d.spots.size()), w.xy,
                w.z, processor_s() - start);
    if (!pictures.empty()) draw(shown, d.spots, k, fs::path(pictures) / ("real_" + std::string(names[s]) + ".png"));
    beads[s] = stacks::placed(d, {149.95 / 512, 140.0 / 176, 0, ZPoints::into_gel, depth});
  }
  const double start = processor_s();
  const stacks::Matching matching = stacks::match(beads[0], beads[1], {}, kThreads);
  std::printf("followed in %.1f s\n", processor_s() - start);
  print_agreement(beads[0], matching);
}

void real_coordinates(const fs::path& folder) {
  std::vector<stacks::PlacedBead> beads[2];
  const char* names[] = {"before.csv", "after.csv"};
  for (int s = 0; s < 2; ++s) {
    const files::CsvTable table(folder / names[s]);
    for (int row = 0; row < table.n_rows(); ++row)
      beads[s].push_back({{table.number(row, "x_px"), table.number(row, "y_px"), table.number(row, "z_px")}});
  }
  const double start = processor_s();
  const stacks::Matching matching = stacks::match(beads[0], beads[1], {}, kThreads);
  std::printf("coordinates alone: %d and %d beads, followed in %.1f s\n", static_cast<int>(beads[0].size()),
              static_cast<int>(beads[1].size()), processor_s() - start);
  print_agreement(beads[0], matching);
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const double photons = argc > 1 ? std::atof(argv[1]) : 150;
  const std::string pictures = argc > 2 ? argv[2] : "";
  if (photons > 0) {
    std::printf(
        "| beads | found | followed | wrong | rms error across, along z (um) | error over sigma | beads over their "
        "errors | drift | "
        "seconds to find + follow (passed) | GB |\n|---|---|---|---|---|---|---|---|---|---|\n");
    for (const int n : {2000, 6000, 20000}) rendered(n, photons, pictures);
  }
  const fs::path data = fs::path(MBTFM_SOURCE_DIR) / "../shared/data/real";
  if (!fs::exists(data)) {
    std::printf("no real data in %s\n", data.c_str());
    return 0;
  }
  real_stacks(data / "beads_in_volume", pictures);
  real_coordinates(data / "beads_3d_coordinates");
}
