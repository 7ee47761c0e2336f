/// An elliptical disc seen through a microscope. Internal to segment/. Lengths are px, 0 at the first pixel's centre.
#pragma once

#include <array>
#include <vector>

namespace mbtfm::cells {

/// A disc after a Gaussian. Its brightness is highest in the middle and may slope along the major axis:
/// brightness · (1 − dome · ρ²) + slope · u / semi_major, with ρ = 0 in the centre and 1 on the rim.
struct BlurredEllipse {
  double x = 0, y = 0;  ///< centre
  double semi_major = 1, semi_minor = 1;
  double angle_rad = 0;   ///< of the major axis, from +x towards +y
  double brightness = 0;  ///< before the blur
  double slope = 0;       ///< change of brightness from the centre to the end of the major axis
  double dome = 0;        ///< share of the brightness lost from the centre to the rim
  double blur = 1;        ///< standard deviation of the Gaussian
};

/// The model at one place: its value and its derivatives by x, y, ln semi_major, ln semi_minor, angle, brightness,
/// slope, dome, ln blur.
struct EllipseValue {
  static constexpr int kParameters = 9;
  double value = 0;
  std::array<double, kParameters> derivative{};
};

/// f(u, v) = ∫ φ(u − a sin t) S(v; t) a cos t dt, t = −π/2 … π/2,   S(v; t) = ∫ shade(t, w) φ(v − w) dw, |w| ≤ b cos t,
///
/// u, v along the axes, φ the Gaussian: the disc cut into strips across its major axis, of which each is blurred
/// exactly (the shade is a polynomial). The integrand is smooth and periodic, so that the midpoint rule with nodes no
/// further apart than 1.2 standard deviations is right to 2e-6.
class EllipseModel {
 public:
  explicit EllipseModel(const BlurredEllipse& ellipse);
  double value(double x, double y) const;
  EllipseValue with_derivatives(double x, double y) const;

 private:
  struct Node {
    double sine, along, half_width, weight, brightness;
  };
  BlurredEllipse ellipse_;
  double cosine_, sine_;
  std::vector<Node> nodes_;
};

}  // namespace mbtfm::cells
