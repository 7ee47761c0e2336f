/// Where lines run already, and the best way on of one, in position, direction and curvature together. Internal to
/// segment/ (OpenCV types). Lengths in pixels.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "segment/cells/ridge.h"

namespace mbtfm::cells {

/// Which directions of lines already pass through each pixel, a bit each.
class Claims {
 public:
  Claims(cv::Size size, int n_directions) : bits_(size, CV_32S, cv::Scalar(0)), n_(n_directions) {}

  bool has(cv::Point2d point, double angle_rad) const;
  /// Lines within one of the filter's directions.
  void add(cv::Point2d point, double angle_rad, double radius_px);
  void add_all_directions(cv::Point2d point, double radius_px) { mark(point, (1 << n_) - 1, radius_px); }

 private:
  void mark(cv::Point2d point, int mask, double radius_px);
  int index(double angle_rad) const;
  cv::Mat bits_;
  int n_;
};

/// A place on a line, and how it runs there.
struct Course {
  cv::Point2d point;
  double angle_rad = 0;
  double curvature = 0;  ///< 1/px, positive from +x towards +y
};

struct WayRule {
  double reach_px = 30;            ///< so far ahead is looked
  double step_px = 3;              ///< in steps of this length
  double smallest_radius_px = 60;  ///< of curvature
  double follow_noise = 2;         ///< standard deviations above which going on gains
};

struct Way {
  double gain_px = 0;    ///< length of bright line less that of none; 0 where it is best to end
  double curvature = 0;  ///< to begin with
};

/// Ways are two arcs in a row. A pixel of line that is bright gains one, a dark one loses one, and a change of
/// curvature costs its share of that from straight to the smallest radius, which costs as much as the reach may gain.
/// So lines bend on as they bend, and a kink into a line that crosses is dearer than the gap that it avoids.
class Ways {
 public:
  Ways(const Ridges& ridges, const WayRule& rule);

  /// @param over_noise  standard deviations of the line so far: where it falls to less than a quarter it loses
  /// @param claims  on other lines nothing is gained
  Way best(const Course& from, double over_noise, const Claims& claims) const;
  /// The best arc through a place, both ways.
  Way through(const Course& at) const;
  /// Is it but the skirt of a line of another direction?
  bool is_hidden(cv::Point2d point, double angle_rad) const;

 private:
  struct Walk {
    float x, y, dx, dy, angle;
  };
  struct Turn {
    float angle, cosine, sine;  ///< the last two of half of it
  };
  struct Line {
    float level;           ///< from here on a line gains fully
    const Claims* claims;  ///< none: everything is free
  };
  Turn turn_of(double curvature) const;
  Walk walk_from(const Course& from) const;
  bool advance(Walk& walk, const Turn& turn) const;
  std::size_t index_of(float angle_rad) const;
  bool is_hidden(std::uint8_t over_noise, cv::Point pixel) const;
  float gain(const Walk& walk, const Line& line) const;
  double arc(Walk from, double curvature, const Line& line) const;
  double after(Walk from, double curvature, int n_steps, const Line& line, double least) const;
  Way beginning(const Course& from, double curvature, const Line& line, double spent) const;

  WayRule rule_;
  int n_steps_ = 0;
  std::vector<cv::Mat> over_noise_;  ///< by direction, CV_8U
  cv::Mat strongest_;
};

}  // namespace mbtfm::cells
