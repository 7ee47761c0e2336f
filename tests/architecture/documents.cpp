/// The pages of docs/ are in step with the program.
#include <regex>
#include <set>

#include "docs/pages.h"
#include "pipeline/files/csv_files.h"
#include "tests/support/plain_words.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

const fs::path kDocs = test::source_folder() / "docs", kPrograms = test::build_folder() / "bin";

TEST(Documents, the_examples_of_the_page_of_tables_are_read) {
  const std::string page = files::read_text(kDocs / "formats/tables.md");
  const std::regex example("```csv ([a-z_0-9]+\\.csv)\n([^`]*)```");
  const test::TemporaryFolder folder;
  int n_examples = 0;
  for (std::sregex_iterator at(page.begin(), page.end(), example), end; at != end; ++at, ++n_examples)
    files::write_text(folder / (*at)[1], (*at)[2].str());
  EXPECT_EQ(n_examples, 8);
  EXPECT_EQ(files::read_cell(folder.path()).fibres.size(), 2u);
  EXPECT_EQ(files::read_displacement(folder / "displacement.csv").size(), 2u);
  EXPECT_EQ(files::read_displacement_in_space(folder / "displacement_3d.csv").size(), 2u);
  EXPECT_EQ(files::read_tensions(folder / "tensions.csv").size(), 3u);
  EXPECT_EQ(files::read_adhesion_forces(folder / "adhesion_forces.csv").size(), 2u);
}

/// Who reads one row, in --help or on the page, needs no other to understand it.
TEST(Documents, a_parameters_meaning_stands_alone_in_plain_words) {
  const std::regex leans(R"(^(of|unless|the same|their|its|likewise)\b)");
  int n_rows = 0;
  for (const std::string& line : test::lines_of_prose(pages::parameter_page(kPrograms))) {
    for (const std::string& found : test::unplain_words_in(line)) ADD_FAILURE() << found;
    const auto last = line.rfind(" | ");
    if (!line.starts_with("| code |") || last == line.npos) continue;
    ++n_rows;
    EXPECT_FALSE(std::regex_search(line.substr(last + 3), leans)) << line;
  }
  EXPECT_GE(n_rows, 250);
}

/// What a page asks for is in texts.txt, and what is there is asked for.
TEST(Documents, the_sentences_of_pages_are_those_that_the_sources_name) {
  std::set<std::string> there, asked;
  std::istringstream lines(files::read_text(test::source_folder() / "pipeline/report/texts.txt"));
  const std::regex key("([a-z0-9-]+): .*");
  std::string page;
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (line.starts_with('[')) page = line.substr(1, line.find(']') - 1);
    if (std::regex_match(line, match, key)) there.insert(page + "." + match[1].str());
  }
  ASSERT_GT(there.size(), 100u);
  const std::regex name("\"((cell|maps|sheet|space|study|plan|cost)\\.[a-z0-9-]+)\"");
  for (const char* folder : {"pipeline/report", "pipeline/statistics", "pipeline/cost", "samples/plan"})
    for (const auto& entry : fs::directory_iterator(test::source_folder() / folder)) {
      if (entry.path().extension() != ".cpp") continue;
      const std::string source = files::read_text(entry.path());
      for (std::sregex_iterator at(source.begin(), source.end(), name), end; at != end; ++at)
        asked.insert((*at)[1].str());
    }
  for (const std::string& sentence : there) EXPECT_TRUE(asked.contains(sentence)) << sentence << ": nobody asks for it";
}

/// A flag that is gone leaves no text behind.
TEST(Documents, the_help_has_texts_of_flags_that_are_there) {
  std::istringstream lines(files::read_text(test::source_folder() / "pipeline/stage/help.txt"));
  std::string help, program;
  int n_flags = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('[')) {
      program = line.substr(1, line.find(']') - 1);
      if (!program.starts_with("mbtfm")) continue;
      help = run_program(program + " --help").output;
      EXPECT_FALSE(std::regex_search(help, std::regex("\n  -[^ ]*( [A-Z:]+)?\n  -"))) << program << "\n" << help;
    } else if (program.starts_with("mbtfm") && line.starts_with("--")) {
      ++n_flags;
      EXPECT_TRUE(has_words(help, line.substr(0, line.find(':')))) << program << ": " << line;
    }
  }
  EXPECT_GT(n_flags, 80);
}

TEST(Documents, the_pages_that_are_made_are_not_written_in_the_tree) {
  for (const char* name : pages::kMade) {
    EXPECT_FALSE(fs::exists(kDocs / name)) << name;
    EXPECT_EQ(files::read_text(test::build_folder() / "docs" / name), pages::made_page(name, kPrograms)) << name;
  }
}

/// tests/mutations.sh plants faults in the sources as they are: the text that each replaces is there, once.
TEST(Documents, the_list_of_planted_faults_fits_the_sources) {
  std::istringstream list(files::read_text(test::source_folder() / "tests/mutations.txt"));
  std::string name, file, old;
  int n_faults = 0;
  const auto expect_once = [&] {
    if (file.empty()) return;
    ++n_faults;
    const std::string source = files::read_text(test::source_folder() / file);
    const auto at = source.find(old);
    EXPECT_NE(at, source.npos) << name << ": no longer in " << file;
    if (at == source.npos) return;
    EXPECT_EQ(source.find(old, at + 1), source.npos) << name << ": twice in " << file;
  };
  for (std::string line; std::getline(list, line);) {
    if (line.starts_with("fault: ")) {
      expect_once();
      name = line.substr(7);
      file.clear();
      old.clear();
    }
    if (line.starts_with("in: ")) file = line.substr(4);
    if (line.starts_with("- ")) old += (old.empty() ? "" : "\n") + line.substr(2);
  }
  expect_once();
  EXPECT_GE(n_faults, 60);
}

/// Each test of tests/stability has its line in the catalogue, which says what is hard and what must come out.
TEST(Documents, the_catalogue_lists_every_hard_case) {
  const std::string page = files::read_text(test::source_folder() / "notes/hard-cases.md");
  const std::regex any_test("\nTEST(?:_F|_P)?\\(\\w+, (\\w+)\\)");
  for (const auto& entry : fs::directory_iterator(test::source_folder() / "tests/stability")) {
    const std::string text = files::read_text(entry.path());
    for (std::sregex_iterator at(text.begin(), text.end(), any_test), end; at != end; ++at) {
      std::string name = (*at)[1];
      std::replace(name.begin(), name.end(), '_', ' ');
      EXPECT_TRUE(has_words(page, name + " |")) << name << ": give it a row in notes/hard-cases.md";
    }
  }
}

}  // namespace
}  // namespace mbtfm
