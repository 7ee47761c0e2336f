#include "pipeline/stage/declared.h"

#include <algorithm>

namespace mbtfm::stage {

namespace {

DeclaredOption option_of(const CLI::Option& option) {
  const bool is_positional = option.get_positional();
  std::string name = is_positional ? option.get_name(true, false) : option.get_type_name();
  if (const auto extra = name.find_first_of(":,"); extra != name.npos) name.erase(extra);  // of checks
  return {.flag = is_positional || option.get_lnames().empty() ? "" : "--" + option.get_lnames().front(),
          .name = name.empty() ? "VALUE" : name,
          .group = option.get_group(),
          .meaning = option.get_description(),
          .takes_value = option.get_items_expected_max() > 0};
}

}  // namespace

DeclaredCommand declared(const CLI::App& app) {
  DeclaredCommand command{.name = app.get_name(), .meaning = app.get_description()};
  for (const CLI::Option* option : app.get_options())
    if (!option->get_group().empty()) command.options.push_back(option_of(*option));
  std::stable_partition(command.options.begin(), command.options.end(),
                        [](const DeclaredOption& option) { return option.flag.empty(); });
  for (const CLI::App* subcommand : app.get_subcommands([](const CLI::App*) { return true; }))
    if (!subcommand->get_group().empty()) command.subcommands.push_back(declared(*subcommand));
  return command;
}

}  // namespace mbtfm::stage
