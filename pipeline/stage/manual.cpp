#include "pipeline/stage/manual.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <iterator>
#include <string_view>

#include "pipeline/contract/version.h"
#include "pipeline/files/text.h"
#include "pipeline/stage/help.h"

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

namespace {

/// As troff prints it: dashes that can be copied, no line that begins with a command, letters beyond ASCII by number.
std::string troff(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c == '\\') {
      result += "\\e";
    } else if (c == '-') {
      result += "\\-";
    } else if ((c == '.' || c == '\'') && (result.empty() || result.back() == '\n')) {
      result += std::string("\\&") + text[i];
    } else if (c < 0x80) {
      result += text[i];
    } else {
      const int n_more = c >= 0xF0 ? 3 : c >= 0xE0 ? 2 : 1;
      unsigned code = c & (0x3F >> n_more);
      for (int k = 0; k < n_more && i + 1 < text.size(); ++k) code = code << 6 | (text[++i] & 0x3F);
      char number[16];
      std::snprintf(number, sizeof number, "\\[u%04X]", code);
      result += number;
    }
  }
  return result;
}

std::string bold(const std::string& text) { return "\\fB" + troff(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + troff(text) + "\\fR"; }

std::string synopsis(const std::string& name, const DeclaredCommand& command) {
  std::string line = ".B " + troff(name) + "\n";
  if (!command.subcommands.empty()) return line + italic("COMMAND") + " \\&...\n";
  for (const DeclaredOption& option : command.options)
    if (option.flag.empty()) line += italic(option.name) + "\n";
  return line + "[" + italic("OPTIONS") + "]\n";
}

enum class Groups { have_titles, are_one };

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

std::string options(const DeclaredCommand& command, Groups groups) {
  std::string text, group;
  for (const DeclaredOption& option : command.options) {
    if (groups == Groups::have_titles && option.group != group) {
      text += ".SH " + troff(upper(option.group)) + "\n";
      group = option.group;
    }
    text += ".TP\n" + (option.flag.empty() ? italic(option.name) : bold(option.flag));
    if (!option.flag.empty() && option.takes_value) text += " " + italic(option.name);
    text += "\n" + troff(option.meaning) + "\n";
  }
  return text;
}

}  // namespace

std::string manual_page(const CLI::App& app) {
  const DeclaredCommand program = declared(app);
  std::string page = ".TH " + troff(upper(program.name)) + " 1 \"\" \"mbtfm " + troff(kVersion) +
                     "\" \"mbtfm\"\n.SH NAME\n" + troff(program.name) + " \\- " + troff(program.meaning) +
                     "\n.SH SYNOPSIS\n" + synopsis(program.name, program) + options(program, Groups::have_titles);
  if (!program.subcommands.empty()) page += ".SH COMMANDS\n";
  for (const DeclaredCommand& command : program.subcommands) {
    page += ".SS " + troff(command.name) + "\n" + synopsis(program.name + " " + command.name, command) + ".PP\n" +
            troff(command.meaning) + ".\n" + options(command, Groups::are_one);
  }
  page += ".SH EXIT STATUS\n" + troff(help_on("exit status", "")) + "\n.SH SEE ALSO\n";
  page += !program.subcommands.empty()
              ? "The stages that it starts: mbtfm\\-segment(1), mbtfm\\-track(1), mbtfm\\-network(1), mbtfm\\-fit(1).\n"
              : "mbtfm(1)\n";
  return page + ".PP\nThe documentation is in the folder doc/mbtfm of the installation.\n";
}

// How shells complete the command line.

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

/// In single quotes of a shell, where `quote` replaces one of them within.
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

void write_manuals(const CLI::App& app, const WordsOfFlags& words, const std::filesystem::path& share) {
  const std::string name = app.get_name();
  const auto write = [&](const std::filesystem::path& file, const std::string& text) {
    std::filesystem::create_directories((share / file).parent_path());
    files::write_text(share / file, text);
  };
  write("man/man1/" + name + ".1", manual_page(app));
  write("bash-completion/completions/" + name, bash_completion(app, words));
  write("zsh/site-functions/_" + name, zsh_completion(app, words));
  write("fish/vendor_completions.d/" + name + ".fish", fish_completion(app, words));
}

}  // namespace mbtfm::stage
