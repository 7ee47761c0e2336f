/// How well beads in stacks are found and followed: rendered stacks with known truth, and real ones where they are.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "pipeline/files/csv.h"
#include "pipeline/numerics/memory.h"
#include "pipeline/numerics/order_statistics.h"
#include "samples/drawing/stack.h"
#include "segment/images/png.h"
#include "segment/stacks/detect.h"
#include "segment/stacks/match.h"
#include "segment/stacks/near.h"

using namespace mbtfm;

namespace {

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

struct Scene {
  drawing::StackMicroscope microscope;
  std::vector<drawing::GlowingBead> relaxed, stressed;
};

Scene scene_of(int n, unsigned seed) {
  Scene s;
  std::mt19937_64 random(seed);
  const double field = s.microscope.pixel_size_um * s.microscope.image_size_px;
  const double deep = s.microscope.focus_step_um() * s.microscope.n_slices;
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  for (int k = 0; k < n; ++k) {
    const Vec3 p{field * unit(random), field * unit(random), deep * unit(random)};
    const double light = std::exp(0.25 * normal(random));
    const double x = (p.x - 0.5 * field) / 12, y = (p.y - 0.5 * field) / 12, z = p.z / 15;
    const double a = std::exp(-0.5 * (x * x + y * y + z * z));
    const Vec3 u{-1.5 * x * a, -1.5 * y * a, 0.8 * a};
    s.relaxed.push_back({p, light});
    s.stressed.push_back({p + u + Vec3{0.4, -0.3, 0.5}, light});
  }
  return s;
}

void draw(const std::vector<images::Image>& slices, const std::vector<stacks::Spot>& spots, int k,
          const std::string& file) {
  const images::Image& slice = slices[static_cast<std::size_t>(k)];
  const int scale = 2;
  std::vector<double> sorted(slice.pixels.begin(), slice.pixels.end());
  const double low = numerics::quantile(sorted, 0.01), high = numerics::quantile(sorted, 0.999);
  images::Picture picture{slice.width * scale, slice.height * scale, {}};
  picture.rgb.resize(static_cast<std::size_t>(picture.width) * picture.height * 3);
  for (int j = 0; j < picture.height; ++j)
    for (int i = 0; i < picture.width; ++i) {
      const double v = std::sqrt(std::clamp((slice.at(i / scale, j / scale) - low) / (high - low), 0.0, 1.0));
      for (int c = 0; c < 3; ++c)
        picture.rgb[3 * (static_cast<std::size_t>(j) * picture.width + i) + c] = static_cast<std::uint8_t>(255 * v);
    }
  for (const stacks::Spot& s : spots) {
    if (std::abs(s.place.z - k) > 2) continue;
    const bool is_near = std::abs(s.place.z - k) <= 0.7;
    for (int t = 0; t < 60; ++t) {
      const double a = 2 * M_PI * t / 60;
      const int x = static_cast<int>(scale * (s.place.x + 0.5 + 4 * std::cos(a))),
                y = static_cast<int>(scale * (s.place.y + 0.5 + 4 * std::sin(a)));
      if (x < 0 || y < 0 || x >= picture.width || y >= picture.height) continue;
      std::uint8_t* p = &picture.rgb[3 * (static_cast<std::size_t>(y) * picture.width + x)];
      p[0] = is_near ? 255 : 60, p[1] = is_near ? 80 : 160, p[2] = is_near ? 60 : 255;
    }
  }
  images::write_png(file, picture);
}

std::vector<stacks::PlacedBead> placed(const stacks::Detection& d, double pixel, double step, double first) {
  std::vector<stacks::PlacedBead> beads;
  for (const stacks::Spot& s : d.spots)
    beads.push_back({{pixel * (s.place.x + 0.5), pixel * (s.place.y + 0.5), first + step * (s.place.z + 0.5)},
                     s.height,
                     pixel * s.sigma,
                     step * s.sigma_z});
  return beads;
}

void synthetic(int n, unsigned seed, bool is_drawn) {
  const Scene s = scene_of(n, seed);
  const drawing::StackMicroscope& m = s.microscope;
  const double step = m.focus_step_um();
  double t0 = now();
  const drawing::PointSpread spread(m.optics, step * m.n_slices, m.pixel_size_um, 2);
  const auto relaxed = drawing::recorded_stack(s.relaxed, m, spread, {}, seed, 1, 2);
  const auto stressed = drawing::recorded_stack(s.stressed, m, spread, {}, seed, 0, 2);
  std::printf("n %d rendered %.1f s\n", n, now() - t0);
  t0 = now();
  const auto a = stacks::detect(relaxed, 5, "relaxed", 2);
  const double t1 = now();
  const auto b = stacks::detect(stressed, 5, "stressed", 2);
  const double t2 = now();
  const auto pa = placed(a, m.pixel_size_um, step, 0), pb = placed(b, m.pixel_size_um, step, 0);
  const auto w = a.widths_in_the_middle();
  const auto wt = a.shape.at({256, 256, 5}), wb = a.shape.at({256, 256, 95});
  std::printf("  found %zu %zu, widths %.2f %.2f top %.2f %.2f bottom %.2f %.2f, dark %.2f light %.2f\n",
              a.spots.size(), b.spots.size(), w.xy, w.z, wt.xy, wt.z, wb.xy, wb.z, a.noise.dark[50],
              a.noise.light_variance);
  if (is_drawn) draw(relaxed, a.spots, m.n_slices / 2, "/tmp/stacks_" + std::to_string(n) + ".png");
  const auto matching = stacks::match(pa, pb, {}, 2);
  const double t3 = now();
  // against the truth
  std::vector<Vec3> truth;
  for (const auto& bead : s.relaxed) truth.push_back(bead.position_um);
  const stacks::Near near(truth, 2);
  std::vector<double> ex, ez, nx, nz, px, pz;
  int good = 0, wrong = 0, followed = 0, far = 0;
  std::vector<char> is_followed(truth.size());
  for (std::size_t k = 0; k < pa.size(); ++k) {
    const auto found = near.within(pa[k].position_um, 0.8, 1);
    if (found.empty()) {
      ++far;
      continue;
    }
    const Vec3 off = pa[k].position_um - truth[static_cast<std::size_t>(found[0])];
    px.push_back(std::abs(off.x) / pa[k].sigma_um), pz.push_back(std::abs(off.z) / pa[k].sigma_z_um);
    const auto& match = matching.matches[k];
    if (match.flag != stacks::TrackFlag::none) continue;
    ++good;
    const Vec3 u = pb[static_cast<std::size_t>(match.partner)].position_um - pa[k].position_um;
    const Vec3 e = u - (s.stressed[static_cast<std::size_t>(found[0])].position_um -
                        s.relaxed[static_cast<std::size_t>(found[0])].position_um);
    if (norm(e) > 1.0) {
      ++wrong;
      continue;
    }
    is_followed[static_cast<std::size_t>(found[0])] = 1;
    ex.push_back(e.x), ez.push_back(e.z);
    const double sx = std::hypot(pa[k].sigma_um, pb[static_cast<std::size_t>(match.partner)].sigma_um);
    const double sz = std::hypot(pa[k].sigma_z_um, pb[static_cast<std::size_t>(match.partner)].sigma_z_um);
    nx.push_back(std::abs(e.x) / sx), nz.push_back(std::abs(e.z) / sz);
  }
  int n_inside = 0;
  const double field = m.pixel_size_um * m.image_size_px, deep = step * m.n_slices;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const auto in = [&](Vec3 p) {
      return p.x > 1 && p.y > 1 && p.z > 1.5 && p.x < field - 1 && p.y < field - 1 && p.z < deep - 1.5;
    };
    if (!in(truth[k]) || !in(s.stressed[k].position_um)) continue;
    ++n_inside;
    followed += is_followed[k];
  }
  const auto rms = [](const std::vector<double>& v) {
    double q = 0;
    for (double x : v) q += x * x;
    return std::sqrt(q / v.size());
  };
  std::printf(
      "  spurious %d, good %d, followed %.3f, wrong %.4f, rms err %.4f %.4f um, err/sigma rms %.2f %.2f, robust %.2f "
      "%.2f; place/sigma robust %.2f %.2f\n",
      far, good, 1.0 * followed / n_inside, 1.0 * wrong / good, rms(ex), rms(ez), rms(nx), rms(nz),
      numerics::quantile(nx, 0.683), numerics::quantile(nz, 0.683), numerics::quantile(px, 0.683),
      numerics::quantile(pz, 0.683));
  std::printf("  detect %.1f %.1f s, match %.1f s, peak %.2f GB\n", t1 - t0, t2 - t1, t3 - t2, 0.0);
}

/// Shares, and how well neighbours agree, where nobody knows the truth.
void print_agreement(const std::vector<stacks::PlacedBead>& relaxed, const stacks::Matching& matching) {
  std::size_t n_good = 0;
  std::vector<double> across, along, z, zn;
  std::map<std::string, int> flags;
  for (std::size_t k = 0; k < relaxed.size(); ++k) {
    const auto& m = matching.matches[k];
    ++flags[name_of(m.flag)];
    if (m.flag != stacks::TrackFlag::none) continue;
    ++n_good;
    across.push_back(std::hypot(m.from_neighbours_um.x, m.from_neighbours_um.y) / 1.4142);
    along.push_back(std::abs(m.from_neighbours_um.z));
    z.push_back(across.back() / m.sigma_um), zn.push_back(along.back() / m.sigma_z_um);
  }
  std::printf(
      "  matched %zu of %zu (%.3f); off the neighbours, median: %.4f across, %.4f along z; over sigma, robust: %.2f "
      "%.2f\n",
      n_good, relaxed.size(), 1.0 * n_good / relaxed.size(), numerics::quantile(across, 0.5),
      numerics::quantile(along, 0.5), numerics::quantile(z, 0.5) / 0.8326, numerics::quantile(zn, 0.5) / 0.6745);
  for (const auto& [flag, n] : flags) std::printf("    %-22s %d\n", flag.empty() ? "good" : flag.c_str(), n);
  const auto& f = matching.first;
  std::printf("  first motion (%.2f, %.2f, %.2f), turn %.3f deg, spacing %.2f\n", f.shift_um.x, f.shift_um.y,
              f.shift_um.z, f.turn_rad * 57.2958, matching.spacing_um);
}

void real_stacks(const std::string& folder) {
  std::vector<stacks::PlacedBead> beads[2];
  const char* names[] = {"CytoD_Beads.tif", "Normal_Beads.tif"};
  for (int s = 0; s < 2; ++s) {
    auto slices = images::read_slices(folder + "/" + names[s], {});
    std::map<int, std::size_t> histogram;
    for (const auto& slice : slices)
      for (const float v : slice.pixels) ++histogram[static_cast<int>(v)];
    std::printf("%s: %zu slices; values", names[s], slices.size());
    for (const int v : {0, 1, 2, 3, 4, 5, 8, 16, 32, 64, 128, 200, 250, 254, 255})
      std::printf(" %d:%zu", v, histogram[v]);
    std::printf("\n");
    const auto copy = slices;
    draw(copy, {}, 88, std::string("/tmp/stacks_raw_") + names[s] + ".png");
    const double t = now();
    const auto d = stacks::detect(std::move(slices), 5, s ? "stressed" : "relaxed", 2);
    const auto w = d.widths_in_the_middle(), top = d.shape.at({256, 256, 10}), low = d.shape.at({256, 256, 165});
    std::printf(
        "  %zu beads in %.1f s, widths %.2f %.2f, top %.2f %.2f, bottom %.2f %.2f, dark %.2f light %.2f saturated "
        "%.2g\n",
        d.spots.size(), now() - t, w.xy, w.z, top.xy, top.z, low.xy, low.z, d.noise.dark[88], d.noise.light_variance,
        d.share_saturated);
    draw(copy, d.spots, 88, std::string("/tmp/stacks_real_") + names[s] + ".png");
    beads[s] = placed(d, 149.95 / 512, 140.0 / 176, 0);
    std::vector<double> sx, sz;
    for (const auto& b : beads[s]) sx.push_back(b.sigma_um), sz.push_back(b.sigma_z_um);
    std::printf("  sigma median %.4f %.4f um\n", numerics::median(sx), numerics::median(sz));
  }
  const double t = now();
  const auto m = stacks::match(beads[0], beads[1], {}, 2);
  std::printf("  matched in %.1f s\n", now() - t);
  print_agreement(beads[0], m);
}

void real_coordinates(const std::string& folder) {
  std::vector<stacks::PlacedBead> beads[2];
  const char* names[] = {"before.csv", "after.csv"};
  for (int s = 0; s < 2; ++s) {
    const files::CsvTable table(folder + "/" + names[s]);
    for (int row = 0; row < table.n_rows(); ++row)
      beads[s].push_back({{table.number(row, "x_px"), table.number(row, "y_px"), table.number(row, "z_px")}});
  }
  const double t = now();
  const auto m = stacks::match(beads[0], beads[1], {}, 2);
  std::printf("coordinates: %zu, %zu matched in %.1f s\n", beads[0].size(), beads[1].size(), now() - t);
  print_agreement(beads[0], m);
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const int n = argc > 1 ? std::atoi(argv[1]) : 5000;
  const std::string data = std::string(MBTFM_SOURCE_DIR) + "/../shared/data/real/";
  if (n == -1) real_stacks(data + "beads_in_volume");
  if (n == -2) real_coordinates(data + "beads_3d_coordinates");
  if (n > 0) synthetic(n, 1, true);
  return 0;
}
