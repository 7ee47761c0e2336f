#include "pipeline/report/texts.h"

#include <fmt/args.h>
#include <fmt/format.h>

#include "pipeline/files/texts.h"

namespace mbtfm::report {

extern const std::string_view kTexts;  // texts.txt

namespace {

/// A line does not break between a number, or the place of one, and its unit. What is filled in, such as a path, is
/// left as it is: people copy it.
std::string with_units_held(std::string text) {
  constexpr std::string_view kHeld = "\u00a0";
  for (const char* unit : {" %", " nN", " µm", " kPa", " fJ", " nm"})
    for (std::size_t at = 0; (at = text.find(unit, at + 1)) != text.npos;)
      if (std::string_view("}0123456789").find(text[at - 1]) != std::string_view::npos) text.replace(at, 1, kHeld);
  return text;
}

}  // namespace

std::string text_of(const std::string& name) {
  static const files::Texts texts(kTexts);
  const std::size_t point = name.find('.');
  return texts.at(name.substr(0, point), name.substr(point + 1));
}

std::string filled(const std::string& name, const std::vector<TextValue>& values) {
  fmt::dynamic_format_arg_store<fmt::format_context> arguments;
  for (const TextValue& value : values) std::visit([&](const auto& v) { arguments.push_back(v); }, value);
  return fmt::vformat(with_units_held(text_of(name)), arguments);
}

}  // namespace mbtfm::report
