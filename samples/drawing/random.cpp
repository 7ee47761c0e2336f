#include "samples/drawing/random.h"

#include <cmath>
#include <numbers>
#include <string>

#include "pipeline/contract/errors.h"

namespace mbtfm::drawing {

namespace {

/// The finaliser of splitmix64 (Steele, Lea & Flood 2014): neighbouring seeds become unrelated ones.
std::uint64_t mixed(std::uint64_t value) {
  value += 0x9e3779b97f4a7c15ull;
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9ull;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebull;
  return value ^ (value >> 31);
}

}  // namespace

Random::Random(std::uint64_t seed, Stream stream, std::uint64_t index)
    : engine_(mixed(mixed(mixed(seed) + static_cast<std::uint64_t>(stream)) + index)) {}

double Random::uniform() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }

double Random::normal() {
  if (spare_) {
    const double value = *spare_;
    spare_.reset();
    return value;
  }
  const double radius = std::sqrt(-2 * std::log(1 - uniform()));
  const double angle = 2 * std::numbers::pi * uniform();
  spare_ = radius * std::sin(angle);
  return radius * std::cos(angle);
}

double Random::poisson(double mean) {
  if (!(mean > 0)) return 0;
  if (mean < 10) {
    const double limit = std::exp(-mean);
    double product = uniform();
    int count = 0;
    for (; product > limit; ++count) product *= uniform();
    return count;
  }
  const double log_mean = std::log(mean);
  const double b = 0.931 + 2.53 * std::sqrt(mean);
  const double a = -0.059 + 0.02483 * b;
  const double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
  const double v_r = 0.9277 - 3.6224 / (b - 2);
  while (true) {
    const double u = uniform() - 0.5;
    const double v = 1 - uniform();
    const double us = 0.5 - std::abs(u);
    const double k = std::floor((2 * a / us + b) * u + mean + 0.43);
    if (us >= 0.07 && v <= v_r) return k;
    if (k < 0 || (us < 0.013 && v > us)) continue;
    int sign = 0;  // std::lgamma writes that to a variable that all threads share
    if (std::log(v) + std::log(inverse_alpha) - std::log(a / (us * us) + b) <=
        k * log_mean - mean - lgamma_r(k + 1, &sign))
      return k;
  }
}

namespace {

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

/// Probability to lie between the bounds.
double mass_of(const LogNormal& d) {
  const double centre = std::log(d.median);
  return normal_cdf((std::log(d.high) - centre) / d.log_sd) - normal_cdf((std::log(d.low) - centre) / d.log_sd);
}

}  // namespace

double draw(Random& random, const LogNormal& d) {
  if (d.log_sd == 0) return d.median;
  if (mass_of(d) < 1e-3) {
    throw UsageError("a quantity of median " + std::to_string(d.median) + " hardly ever lies between its bounds " +
                     std::to_string(d.low) + " and " + std::to_string(d.high));
  }
  while (true) {
    const double value = d.median * std::exp(d.log_sd * random.normal());
    if (value >= d.low && value <= d.high) return value;
  }
}

double mean_of(const LogNormal& d) {
  if (d.log_sd == 0) return d.median;
  const double centre = std::log(d.median);
  const double s = d.log_sd;
  const double upper = normal_cdf((std::log(d.high) - centre) / s - s);
  const double lower = normal_cdf((std::log(d.low) - centre) / s - s);
  return d.median * std::exp(s * s / 2) * (upper - lower) / mass_of(d);
}

LogNormal with_mean(LogNormal d, double mean) {
  if (d.log_sd == 0) {
    d.median = mean;
    return d;
  }
  double low = std::log(d.low);
  double high = std::log(d.high);
  const auto mean_at = [&](double log_median) {
    d.median = std::exp(log_median);
    return mean_of(d);
  };
  if (!(mean > mean_at(low) && mean < mean_at(high))) {
    throw UsageError("a mean of " + std::to_string(mean) + " is out of reach between " + std::to_string(d.low) +
                     " and " + std::to_string(d.high));
  }
  for (int i = 0; i < 60; ++i) {  // bisection to rounding
    const double middle = 0.5 * (low + high);
    (mean_at(middle) < mean ? low : high) = middle;
  }
  d.median = std::exp(0.5 * (low + high));
  return d;
}

}  // namespace mbtfm::drawing
