#include "pipeline/stage/manual.h"

#include <algorithm>
#include <cctype>
#include <cstdio>

#include "pipeline/contract/version.h"
#include "pipeline/files/text.h"
#include "pipeline/stage/declared.h"

namespace mbtfm::stage {

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

std::string exit_codes() {
  return "0 done, 1 some cells failed, 2 wrong flag, 3 bad input, 4 not converged (outputs are there, marked), 5 "
         "cannot write, 6 out of memory or time, 7 no answer (nothing written), 70 our bug, 75 cell is busy, 130 "
         "interrupted, 128 + n killed by signal n.";
}

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
  page += ".SH EXIT STATUS\n" + troff(exit_codes()) + "\n.SH SEE ALSO\n";
  page += !program.subcommands.empty()
              ? "The stages that it starts: mbtfm\\-segment(1), mbtfm\\-track(1), mbtfm\\-network(1), mbtfm\\-fit(1).\n"
              : "mbtfm(1)\n";
  return page + ".PP\nThe documentation is in the folder doc/mbtfm of the installation.\n";
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
