#include <algorithm>
#include <iterator>
#include <string_view>

#include "pipeline/stage/declared.h"
#include "pipeline/stage/manual.h"

namespace mbtfm::stage {

namespace {

std::string function_name(const std::string& program) {
  std::string name = "_" + program;
  std::ranges::replace(name, '-', '_');
  return name;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::string flags_of(const DeclaredCommand& command) {
  std::vector<std::string> flags;
  for (const DeclaredOption& option : command.options)
    if (!option.flag.empty()) flags.push_back(option.flag);
  return joined(flags);
}

/// The beginning of a meaning, for a menu: up to the first bracket or colon.
std::string brief_meaning(const DeclaredOption& option) {
  const auto end = option.meaning.find_first_of("([;:");
  std::string text = option.meaning.substr(0, end);
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

/// In single quotes of a shell, where `quote` stands for one of them within.
std::string quoted(const std::string& text, const std::string& quote) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? quote : std::string(1, c);
  return result + "'";
}

constexpr std::string_view kPaths[] = {"FILE", "FOLDER", "CELL"};

bool is_file(const DeclaredOption& option) {
  return option.flag.empty() || std::ranges::find(kPaths, option.name) != std::end(kPaths);
}

std::string zsh_arguments(const DeclaredCommand& command, const WordsOfFlags& words) {
  std::string text;
  for (const DeclaredOption& option : command.options) {
    std::string spec = option.flag.empty() ? "*:" + option.name : option.flag + "[" + brief_meaning(option) + "]";
    std::ranges::replace(spec, '\n', ' ');
    if (option.takes_value && !option.flag.empty()) spec += ":" + option.name;
    const auto found = words.find(option.flag);
    if (found != words.end() && option.takes_value)
      spec += ":(" + joined(found->second) + ")";
    else if (option.takes_value)
      spec += is_file(option) ? ":_files" : ":";
    text += " \\\n    " + quoted(spec, "'\\''");
  }
  return text;
}

std::string fish_line(const std::string& program, const std::string& condition, const DeclaredOption& option,
                      const WordsOfFlags& words) {
  std::string line = "complete -c " + program + condition + " -l " + option.flag.substr(2) + " -d " +
                     quoted(brief_meaning(option), "\\'");
  const auto found = words.find(option.flag);
  if (found != words.end()) return line + " -x -a " + quoted(joined(found->second), "\\'") + "\n";
  if (option.takes_value) line += is_file(option) ? " -r -F" : " -x";
  return line + "\n";
}

}  // namespace

std::string bash_completion(const CLI::App& app, const WordsOfFlags& words) {
  const DeclaredCommand program = declared(app);
  const std::string name = function_name(program.name);
  std::string text = "# bash completion for " + program.name + "\n" + name + "() {\n" +
                     "  local now=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} flags\n" +
                     "  case $before in\n";
  for (const auto& [flag, allowed] : words)
    text += "    " + flag + ") COMPREPLY=($(compgen -W '" + joined(allowed) + "' -- \"$now\")); return ;;\n";
  text += "  esac\n";
  if (program.subcommands.empty()) {
    text += "  flags='" + flags_of(program) + "'\n";
  } else {
    std::vector<std::string> names;
    std::string cases;
    for (const DeclaredCommand& command : program.subcommands) {
      names.push_back(command.name);
      cases += "    " + command.name + ") flags='" + flags_of(command) + "' ;;\n";
    }
    text += "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n    COMPREPLY=($(compgen -W '" + joined(names) + " " +
            flags_of(program) + "' -- \"$now\"))\n    return\n  fi\n  case ${COMP_WORDS[1]} in\n" + cases + "  esac\n";
  }
  return text + "  case $now in -*) COMPREPLY=($(compgen -W \"$flags\" -- \"$now\")) ;; esac\n}\n" +
         "complete -o default -F " + name + " " + program.name + "\n";
}

std::string zsh_completion(const CLI::App& app, const WordsOfFlags& words) {
  const DeclaredCommand program = declared(app);
  std::string text = "#compdef " + program.name + "\n";
  if (program.subcommands.empty()) return text + "_arguments" + zsh_arguments(program, words) + "\n";
  text += "local -a commands=(\n";
  for (const DeclaredCommand& command : program.subcommands)
    text += "  " + quoted(command.name + ":" + command.meaning, "'\\''") + "\n";
  text +=
      ")\nif (( CURRENT == 2 )); then\n  _describe command commands\n  return\nfi\nlocal command=$words[2]\n"
      "shift words\n(( CURRENT-- ))\ncase $command in\n";
  for (const DeclaredCommand& command : program.subcommands)
    text += "  " + command.name + ") _arguments" + zsh_arguments(command, words) + " ;;\n";
  return text + "esac\n";
}

std::string fish_completion(const CLI::App& app, const WordsOfFlags& words) {
  const DeclaredCommand program = declared(app);
  std::string text;
  for (const DeclaredOption& option : program.options)
    if (!option.flag.empty()) text += fish_line(program.name, "", option, words);
  for (const DeclaredCommand& command : program.subcommands) {
    text += "complete -c " + program.name + " -n __fish_use_subcommand -a " + command.name + " -d " +
            quoted(command.meaning, "\\'") + "\n";
    const std::string condition = " -n '__fish_seen_subcommand_from " + command.name + "'";
    for (const DeclaredOption& option : command.options)
      if (!option.flag.empty()) text += fish_line(program.name, condition, option, words);
  }
  return text;
}

}  // namespace mbtfm::stage
