#include "pipeline/report/texts.h"

#include <fmt/args.h>
#include <fmt/format.h>

#include "pipeline/files/texts.h"

namespace mbtfm::report {

extern const std::string_view kTexts;  // texts.txt

std::string text_of(const std::string& name) {
  static const files::Texts texts(kTexts);
  const std::size_t point = name.find('.');
  return texts.at(name.substr(0, point), name.substr(point + 1));
}

std::string filled(const std::string& name, const std::vector<TextValue>& values) {
  fmt::dynamic_format_arg_store<fmt::format_context> arguments;
  for (const TextValue& value : values) std::visit([&](const auto& v) { arguments.push_back(v); }, value);
  return fmt::vformat(text_of(name), arguments);
}

}  // namespace mbtfm::report
