/// The data that flows between stages. Plain structs; `check` states what must hold and is called by every reader
/// and writer. Units: um, nN, kPa, rad. Axes: x right, y down, origin at the outer corner of the top-left pixel.
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace mbtfm {

struct Vec2 {
  double x = 0;
  double y = 0;
};

inline Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
inline Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
inline Vec2 operator*(double s, Vec2 a) { return {s * a.x, s * a.y}; }
inline Vec2& operator+=(Vec2& a, Vec2 b) { return a = a + b; }
inline bool operator==(Vec2 a, Vec2 b) { return a.x == b.x && a.y == b.y; }
inline double dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }
inline double cross(Vec2 a, Vec2 b) { return a.x * b.y - a.y * b.x; }
inline double norm(Vec2 a) { return std::hypot(a.x, a.y); }
inline bool is_finite(Vec2 a) { return std::isfinite(a.x) && std::isfinite(a.y); }

/// A point set whose last point joins its first.
using Polygon = std::vector<Vec2>;
using Polyline = std::vector<Vec2>;

/// Where an adhesion comes from: found in an image or a mask of one; drawn by hand; put where a fibre drawn by hand
/// must be held and no adhesion is; or put where one may be, because nothing shows the adhesions.
enum class AdhesionOrigin { image, drawn, anchor, candidate };
inline constexpr AdhesionOrigin kAdhesionOrigins[] = {AdhesionOrigin::image, AdhesionOrigin::drawn,
                                                      AdhesionOrigin::anchor, AdhesionOrigin::candidate};
std::string_view name_of(AdhesionOrigin origin);
std::optional<AdhesionOrigin> adhesion_origin_of(std::string_view name);
/// Nobody has seen it: it is an anchor or a candidate.
inline bool is_assumed(AdhesionOrigin origin) {
  return origin == AdhesionOrigin::anchor || origin == AdhesionOrigin::candidate;
}

/// A segmented focal adhesion: the ellipse of equal second moments, scaled to the area of the segmented component.
struct Adhesion {
  int adhesion_id = 0;  ///< stable label, >= 1
  Vec2 position_um;
  double area_um2 = 0;
  double major_axis_um = 0;  ///< full axes, not semi-axes
  double minor_axis_um = 0;
  double angle_rad = 0;  ///< of the major axis, from +x towards +y
  double eccentricity = 0;
  double mean_intensity = 0;
  AdhesionOrigin origin = AdhesionOrigin::image;
  std::optional<double> edge_distance_um{};  ///< from the centre to the outline, holes included; none: not stated
};
/// A candidate of a hexagonal lattice stands for its cell, which is larger than the disc drawn into it; any other
/// adhesion for its own area.
double area_stood_for_um2(const Adhesion& adhesion);

/// Hotulainen & Lappalainen (2006): dorsal fibres end on an adhesion with one end, arcs with none, ventral with both.
/// An edge fibre is held at both ends, too, and runs along a free piece of the outline.
enum class FibreType { dorsal, arc, ventral, edge };
inline constexpr FibreType kFibreTypes[] = {FibreType::dorsal, FibreType::arc, FibreType::ventral, FibreType::edge};
std::string_view name_of(FibreType type);
std::optional<FibreType> fibre_type_of(std::string_view name);
/// How many of its ends the type says are held.
int n_held_ends(FibreType type);

struct Fibre {
  int fibre_id = 0;  ///< stable label, >= 1
  FibreType type = FibreType::arc;
  double width_um = 0;
  std::optional<int> start_adhesion_id;  ///< the adhesion that holds points_um.front()
  std::optional<int> end_adhesion_id;    ///< the adhesion that holds points_um.back()
  double mean_intensity = 0;
  double confidence = 1;       ///< that it is a fibre, 0 to 1
  Polyline points_um;          ///< at least two, no two in a row equal
  double type_confidence = 1;  ///< that its type is right, 0 to 1
  std::string type_reason{};   ///< in words; empty: none given
};

/// A segmented cell.
struct Cell {
  std::vector<Adhesion> adhesions;
  std::vector<Fibre> fibres;
  Polygon outline_um;
  std::vector<Polygon> holes_um;  ///< gaps in the cell, inside the outline
  /// By piece of the outline, from its point to the next: it is a cut, along the image's border, and the cell goes on
  /// beyond. Empty: none is.
  std::vector<bool> is_cut{};
};
/// Of the outline's pieces that are cuts: their ends.
using Cuts = std::vector<std::pair<Vec2, Vec2>>;
Cuts cuts_of(const Cell& cell);
double distance_to_cut_um(const Cell& cell, Vec2 point);
/// To the nearest ring of the outline, of a hole as of the cell.
double distance_to_edge_um(const Cell& cell, Vec2 point);

/// Displacement (stressed minus relaxed position) of one bead.
struct Bead {
  Vec2 position_um;  ///< in the relaxed state
  Vec2 displacement_um;
  double sigma_um = 0;  ///< standard error of each component
  std::string flag;     ///< why it must not be used; empty: good
};
using DisplacementField = std::vector<Bead>;
/// Over the rectangle that holds them; 0 where they spread over no area.
double beads_per_um2(const DisplacementField& beads);

struct Gel {
  double youngs_modulus_kPa = 0;
  double poisson_ratio = 0.49;
  double thickness_um = 60;
  // standard errors, where the user knows them: the error budget then has a part for the gel
  std::optional<double> youngs_modulus_sigma_kPa{}, poisson_ratio_sigma{}, thickness_sigma_um{};
};

/// A cable between two vertices of a network.
struct Link {
  int vertex_a = 0;
  int vertex_b = 0;
  int fibre_id = 0;  ///< 0: the actin network
  double rest_length_um = 0;
  double share = 1;  ///< multiplies its group's tension and its stiffness: the width of material this cable stands for
};

/// How a cable carries its force in equilibrium: slack with its tension alone, taut with more, being longer than at
/// rest, and collapsed to a point with less, in whatever direction its ends are pressed together.
enum class CableState { slack, taut, collapsed };

struct Network {
  std::vector<Vec2> vertices_um;
  std::vector<int> adhesion_id;  ///< by vertex; the substrate holds it where it is not 0
  std::vector<Link> links;
  std::vector<bool> held_by_cut{};  ///< by vertex: the part of the cell that the image does not show holds it; empty:
                                    ///< none. No adhesion holds it, too
};
/// By an adhesion or by the cut.
bool is_held(const Network& network, std::size_t vertex);

struct Tension {
  int fibre_id = 0;  ///< 0: the actin network
  double tension_nN = 0;
  std::optional<double> low_nN, high_nN;  ///< 95 % interval
  bool identifiable = true;
};

struct AdhesionForce {
  int adhesion_id = 0;
  Vec2 force_nN;  ///< of the cell on the substrate
  std::optional<double> sigma_nN;
  bool connected = false;              ///< a segmented fibre ends on it
  std::optional<double> moment_nN_um;  ///< about the adhesion's centre, from +x towards +y
};

double length_um(const Polyline& points);
/// Where between a (0) and b (1) the segment is nearest to the point.
double nearest_share(Vec2 a, Vec2 b, Vec2 point);
double distance_to_segment_um(Vec2 point_um, Vec2 a_um, Vec2 b_um);
/// The ellipse of an adhesion as a polygon.
Polygon ellipse_corners(const Adhesion& adhesion, int n_corners);
/// Signed area; positive where the polygon turns from +x towards +y.
double signed_area_um2(const Polygon& polygon);
bool contains(const Polygon& polygon, Vec2 point);
/// Distance to the nearest point of the closed line, inside or outside.
double distance_to_boundary_um(const Polygon& polygon, Vec2 point);
/// Nearest point of the closed line.
Vec2 nearest_on_boundary_um(const Polygon& polygon, Vec2 point);

/// State what must hold of a value. @throws InvalidData naming the element and the finding.
void check(const std::vector<Adhesion>& adhesions);
void check(const std::vector<Fibre>& fibres);
void check(const Cell& cell);
void check(const DisplacementField& field);
void check(const Gel& gel);
void check(const Network& network);

}  // namespace mbtfm
