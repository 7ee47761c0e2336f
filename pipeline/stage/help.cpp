#include "pipeline/stage/help.h"

#include <CLI/CLI.hpp>

#include "pipeline/files/texts.h"

namespace mbtfm::stage {

extern const std::string_view kHelp;  // help.txt

std::string help_on(const std::string& section, const std::string& key, const std::vector<std::string>& values) {
  static const files::Texts texts(kHelp);
  std::string text = texts.find(section, key).value_or("");
  std::size_t at = 0;
  for (const std::string& value : values) {
    at = text.find("{}", at);
    text.replace(at, 2, value);
    at += value.size();
  }
  return text;
}

void describe(CLI::App& app, const std::string& name) {
  if (app.get_description().empty()) app.description(help_on(name, ""));
  for (CLI::Option* option : app.get_options([](const CLI::Option* o) { return o->get_description().empty(); }))
    for (const char* section : {name.c_str(), "any command", "any program"})
      if (option->get_description().empty()) option->description(help_on(section, option->get_name()));
  for (CLI::App* command : app.get_subcommands({})) describe(*command, name + " " + command->get_name());
}

}  // namespace mbtfm::stage
