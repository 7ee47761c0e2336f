#include "substrate/surface/formula.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <sstream>
#include <vector>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/parsed.h"

namespace mbtfm::surface {
namespace {

using std::numbers::pi;
using Function = std::function<double(Vec2)>;
using Numbers = std::map<std::string, double>;

enum class Needs { number, positive, nothing };
struct Argument {
  std::string name;
  Needs needs = Needs::number;
};
struct Formula {
  std::string name;
  std::vector<Argument> arguments;
  std::function<Function(const Numbers&)> make;
};

Vec2 direction(const Numbers& n) {
  const double angle = n.at("angle_deg") * pi / 180;
  return {std::cos(angle), std::sin(angle)};
}
Vec2 middle(const Numbers& n) { return {n.at("x_um"), n.at("y_um")}; }

const std::vector<Formula>& formulas() {
  static const Argument angle{"angle_deg", Needs::nothing}, x{"x_um", Needs::nothing}, y{"y_um", Needs::nothing};
  static const std::vector<Formula> table = {
      {"flat", {{"z_um", Needs::nothing}}, [](const Numbers& n) { return [z = n.at("z_um")](Vec2) { return z; }; }},
      {"wave",
       {{"amplitude_um"}, {"period_um", Needs::positive}, {"phase_um", Needs::nothing}, angle},
       [](const Numbers& n) {
         return [a = n.at("amplitude_um"), k = 2 * pi / n.at("period_um"), phase = n.at("phase_um"),
                 v = direction(n)](Vec2 p) { return -a * std::cos(k * (dot(v, p) - phase)); };
       }},
      {"eggbox",
       {{"amplitude_um"}, {"period_um", Needs::positive}},
       [](const Numbers& n) {
         return [a = n.at("amplitude_um"), k = 2 * pi / n.at("period_um")](Vec2 p) {
           return -a * std::cos(k * p.x) * std::cos(k * p.y);
         };
       }},
      {"groove",
       {{"depth_um"}, {"width_um", Needs::positive}, {"wall_um", Needs::positive}, angle},
       [](const Numbers& n) {
         return
             [depth = n.at("depth_um"), half = n.at("width_um") / 2, wall = n.at("wall_um"), v = direction(n)](Vec2 p) {
               return depth / 2 * (std::tanh((dot(v, p) + half) / wall) - std::tanh((dot(v, p) - half) / wall));
             };
       }},
      {"well",
       {{"depth_um"}, {"radius_um", Needs::positive}, {"wall_um", Needs::positive}, x, y},
       [](const Numbers& n) {
         return [depth = n.at("depth_um"), radius = n.at("radius_um"), wall = n.at("wall_um"), m = middle(n)](Vec2 p) {
           return depth / 2 * (1 - std::tanh((norm(p - m) - radius) / wall));
         };
       }},
      {"cap", {{"radius_um", Needs::positive}, {"height_um", Needs::positive}, x, y}, [](const Numbers& n) {
         const double radius = n.at("radius_um"), height = n.at("height_um");
         if (height > radius) {
           throw UsageError("formula cap: expected a height_um up to radius_um, found " + brief(height) + " and " +
                            brief(radius) + ": beyond half a sphere it overhangs");
         }
         return [=, m = middle(n)](Vec2 p) {
           const double r = norm(p - m), from_middle = radius * radius - r * r;
           return from_middle > 0 ? std::min(0.0, radius - height - std::sqrt(from_middle)) : 0.0;
         };
       }}};
  return table;
}

double number_in(const std::string& text, const std::string& word) {
  if (const auto value = parsed<double>(text); value && std::isfinite(*value)) return *value;
  throw UsageError("formula: expected NAME=NUMBER, found '" + word + "'");
}

Numbers numbers_of(const Formula& formula, std::istringstream& words) {
  Numbers numbers;
  std::vector<std::string> names;
  for (const Argument& argument : formula.arguments) names.push_back(argument.name);
  for (std::string word; words >> word;) {
    const std::size_t equals = word.find('=');
    const std::string name = word.substr(0, equals);
    if (equals == word.npos || std::ranges::find(names, name) == names.end())
      throw UsageError("formula " + formula.name + ": expected NAME=NUMBER of " + listed(names) + ", found '" + word +
                       "'");
    if (!numbers.emplace(name, number_in(word.substr(equals + 1), word)).second)
      throw UsageError("formula " + formula.name + ": expected " + name + " once, found it twice");
  }
  for (const auto& [name, needs] : formula.arguments) {
    if (needs == Needs::nothing) numbers.emplace(name, 0);
    if (!numbers.contains(name)) throw UsageError("formula " + formula.name + ": expected " + name + ", found none");
    if (needs == Needs::positive && !(numbers[name] > 0))
      throw UsageError("formula " + formula.name + ": expected " + name + " > 0, found " + brief(numbers[name]));
  }
  return numbers;
}

}  // namespace

Function formula_of(const std::string& text) {
  std::istringstream words(text);
  std::string name;
  words >> name;
  std::vector<std::string> names;
  for (const Formula& formula : formulas()) {
    if (formula.name == name) return formula.make(numbers_of(formula, words));
    names.push_back(formula.name);
  }
  throw UsageError("formula: expected one of " + listed(names) + ", found '" + name + "'");
}

std::string formulas_listed() {
  std::string text;
  for (const Formula& formula : formulas()) {
    text += (text.empty() ? "" : "; ") + formula.name;
    for (const Argument& argument : formula.arguments)
      text += argument.needs == Needs::nothing ? " [" + argument.name + "]" : " " + argument.name;
  }
  return text;
}

HeightMap sampled(const Function& height_um, Vec2 low_um, Vec2 high_um, double spacing_um) {
  const Vec2 size = high_um - low_um;
  if (!(size.x > 0 && size.y > 0)) throw UsageError("the surface's extent: expected its low corner before its high");
  const auto n = [&](double length) { return 1 + std::max(3.0, std::ceil(length / spacing_um - 1e-9)); };
  constexpr double kMost = 4e6;  // of 32 MB
  if (n(size.x) * n(size.y) > kMost)
    throw UsageError("spacing_um: expected a lattice of at most " + brief(kMost) + " vertices, found " +
                     brief(n(size.x)) + " x " + brief(n(size.y)));
  HeightMap map{.origin_um = low_um,
                .spacing_um = {},
                .n_x = static_cast<int>(n(size.x)),
                .n_y = static_cast<int>(n(size.y)),
                .z_um = {},
                .sigma_um = {}};
  map.spacing_um = {size.x / (map.n_x - 1), size.y / (map.n_y - 1)};
  for (int j = 0; j < map.n_y; ++j) {
    for (int i = 0; i < map.n_x; ++i) map.z_um.push_back(height_um(map.place_um(i, j)));
  }
  check(map);
  return map;
}

}  // namespace mbtfm::surface
