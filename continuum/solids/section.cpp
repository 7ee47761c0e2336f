#include "continuum/solids/section.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::solids {
namespace {

constexpr int kEvenInside = 2;  // elements along the inner half of the contact's radius
constexpr int kOutside = 3;  // elements from one and a half radii to the slab's side, and from half of one to its base

/// The cell, cut into three patches that meet in its middle: at the axis below, at the rim, at the top.
void add_cell(const Section& section, int towards_rim, std::vector<Patch>& patches) {
  const double a = section.contact_radius_um(), h = section.height_um;
  const double sphere = (a * a + h * h) / (2 * h);
  const double rim_angle = std::acos(std::clamp(1 - h / sphere, -1.0, 1.0));
  const auto on_sphere = [=](double angle) {
    return Vec2{sphere * std::sin(angle), sphere - h - sphere * std::cos(angle)};
  };
  const Vec2 middle = {0, 0}, rim = {a, 0}, top = {0, -h};
  const Vec2 half_base = {a / 2, 0}, half_axis = {0, -h / 2}, half_arc = on_sphere(rim_angle / 2);
  const Vec2 centre = (1.0 / 3) * (half_base + half_axis + half_arc);
  const std::vector<double> even = even_lines(kEvenInside), graded = lines_towards_zero(towards_rim);
  const Side rim_to_arc = [=](double s) { return s == 0 ? rim : on_sphere(rim_angle * (1 - s / 2)); };
  const Side top_to_arc = [=](double s) { return s == 0 ? top : on_sphere(rim_angle * s / 2); };
  // u along the base; v up
  patches.push_back({between(straight(middle, half_base), straight(half_axis, centre), straight(middle, half_axis),
                             straight(half_base, centre)),
                     even, graded, kCell});
  patches.push_back(
      {between(straight(half_base, rim), straight(centre, half_arc), straight(half_base, centre), rim_to_arc),
       turned(graded), graded, kCell});
  patches.push_back(
      {between(straight(half_axis, centre), top_to_arc, straight(half_axis, top), straight(centre, half_arc)), even,
       turned(graded), kCell});
  // z points down, so that u to the right and v up turn the squares over
  for (auto patch = patches.end() - 3; patch != patches.end(); ++patch) {
    patch->place_um = [place = patch->place_um](Vec2 at) { return place({at.x, 1 - at.y}); };
    patch->v_lines = turned(patch->v_lines);
  }
}

/// Lines (um) from `from` on, the first `first` wide at most, each interval wider than the one before by one factor.
std::vector<double> widening(double from, double to, double widest_first, int n) {
  const double span = to - from, first = std::min(widest_first, span / n);
  double low = 1, high = 1e3;
  constexpr int kBisections = 60;
  const auto length = [&](double growth) {
    double sum = 0, interval = first;
    for (int k = 0; k < n; ++k, interval *= growth) sum += interval;
    return sum;
  };
  for (int k = 0; k < kBisections; ++k) (length(std::sqrt(low * high)) < span ? low : high) = std::sqrt(low * high);
  std::vector<double> lines;
  double interval = first, at = from;
  for (int k = 1; k < n; ++k, interval *= low) lines.push_back(at += interval);
  lines.push_back(to);
  return lines;
}

void divide(std::vector<double>& lines, double by) {
  for (double& line : lines) line /= by;
  lines.front() = 0;
  lines.back() = 1;
}

Patch slab_patch(const Slab& slab, double a, int towards_rim) {
  const std::vector<double> graded = lines_towards_zero(towards_rim);
  std::vector<double> r = even_lines(kEvenInside), z;
  for (double& line : r) line *= a / 2;
  for (const double share : turned(graded))
    if (share > 0) r.push_back(a / 2 + a / 2 * share);
  const double beside = std::min(a / 2, (slab.radius_um - a) / 2), below = std::min(a / 2, slab.thickness_um / 2);
  for (const double share : graded) {
    if (share > 0) r.push_back(a + beside * share);
    z.push_back(below * share);
  }
  for (const double line : widening(a + beside, slab.radius_um, beside, kOutside)) r.push_back(line);
  for (const double line : widening(below, slab.thickness_um, below, kOutside)) z.push_back(line);
  divide(r, slab.radius_um);
  divide(z, slab.thickness_um);
  return {[=](Vec2 at) { return Vec2{slab.radius_um * at.x, slab.thickness_um * at.y}; }, r, z, kGel};
}

}  // namespace

double sphere_height_um(double volume_um3) { return std::cbrt(6 * volume_um3 / std::numbers::pi); }
double hemisphere_height_um(double volume_um3) { return std::cbrt(1.5 * volume_um3 / std::numbers::pi); }

double Section::contact_area_um2() const {
  return 2 * volume_um3 / height_um - std::numbers::pi * height_um * height_um / 3;
}
double Section::contact_radius_um() const { return std::sqrt(contact_area_um2() / std::numbers::pi); }

SectionMesh section_mesh(const Section& section, const Slab& slab, const Fineness& fineness) {
  // nearer to the whole sphere the cell meets the gel at more than 170 degrees, and touches it in a point
  constexpr double kMostOfSphere = 0.98;
  const double sphere = sphere_height_um(section.volume_um3);
  if (!(section.height_um > 0 && section.height_um <= kMostOfSphere * sphere))
    throw InvalidData("the cell's height",
                      "more than 0 and at most " + brief(kMostOfSphere * sphere) + " um: the whole sphere of " +
                          brief(section.volume_um3) + " um3 is " + brief(sphere) + " um high",
                      brief(section.height_um) + " um");
  const double a = section.contact_radius_um();
  constexpr double kWidest = 0.9;
  if (a > kWidest * slab.radius_um)
    throw InvalidData(
        "the cell's contact",
        "a radius of at most " + brief(kWidest * slab.radius_um) + " um, nine tenths of the gel's radius_um",
        brief(a) + " um");
  std::vector<Patch> patches = {slab_patch(slab, a, fineness.towards_rim)};
  add_cell(section, fineness.towards_rim, patches);
  return {std::make_shared<const Mesh>(make_mesh(patches, fineness.order)), slab, a};
}

Mesh::Place SectionMesh::in_gel(double r_um, double depth_um) const {
  if (!(r_um >= 0 && r_um <= slab.radius_um && depth_um >= 0 && depth_um <= slab.thickness_um))
    throw InvalidData("a depth of reading",
                      "a depth from 0 to the gel's thickness, " + brief(slab.thickness_um) + " um",
                      brief(depth_um) + " um");
  return mesh->place_in(kSlabPatch, {r_um / slab.radius_um, depth_um / slab.thickness_um});
}

Mesh::Place SectionMesh::top_of_cell() const {
  return mesh->place_in(static_cast<int>(mesh->patches.size()) - 1, {0, 0});
}

Unknowns unknowns_of(const SectionMesh& mesh) {
  const double base = mesh.slab.thickness_um;
  return {*mesh.mesh, [base](Vec2 at) {
            const bool on_base = at.y >= base * (1 - 1e-12);
            return Held{on_base, on_base};
          }};
}

}  // namespace mbtfm::solids
