/// Places and lines in the plane, places in space. Axes: x right, y down, origin at the outer corner of the top-left
/// pixel.
#pragma once

#include <cmath>
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

/// In space: z into the gel, the flat surface at 0.
struct Vec3 {
  double x = 0;
  double y = 0;
  double z = 0;
};

inline Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(double s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
inline Vec3& operator+=(Vec3& a, Vec3 b) { return a = a + b; }
inline bool operator==(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
inline double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline double norm(Vec3 a) { return std::hypot(a.x, a.y, a.z); }
inline bool is_finite(Vec3 a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }

/// A point set whose last point joins its first.
using Polygon = std::vector<Vec2>;
using Polyline = std::vector<Vec2>;

double length_um(const Polyline& points);
/// Where between a (0) and b (1) the segment is nearest to the point.
double nearest_share(Vec2 a, Vec2 b, Vec2 point);
double distance_to_segment_um(Vec2 point_um, Vec2 a_um, Vec2 b_um);
/// Signed area; positive where the polygon turns from +x towards +y.
double signed_area_um2(const Polygon& polygon);
bool contains(const Polygon& polygon, Vec2 point);
/// Distance to the nearest point of the closed line, inside or outside.
double distance_to_boundary_um(const Polygon& polygon, Vec2 point);
/// Nearest point of the closed line.
Vec2 nearest_on_boundary_um(const Polygon& polygon, Vec2 point);

}  // namespace mbtfm
