/// The pages for users do what they say: their commands run, their links lead somewhere, their sentences are short.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <regex>
#include <sstream>

#include "tests/support/program.h"

namespace mbtfm {
namespace {

namespace fs = std::filesystem;

const fs::path kProject = MBTFM_SOURCE_DIR, kDocs = kProject / "docs";

/// The blocks of a page that are marked as commands, each as it stands.
std::vector<std::string> commands_of(const fs::path& page) {
  const std::string text = files::read_text(page);
  const std::regex fence("```sh\n([^`]*)```");
  std::vector<std::string> blocks;
  for (std::sregex_iterator at(text.begin(), text.end(), fence), end; at != end; ++at) blocks.push_back((*at)[1]);
  return blocks;
}

/// One after the other, as somebody would who has built the project: its programs are below the folder.
void run_commands_of(const fs::path& page, const fs::path& folder) {
  fs::create_directory_symlink(MBTFM_BINARY_DIR, folder / "build");
  std::string script = "set -eu\ncd '" + folder.string() + "'\n";
  for (const std::string& block : commands_of(page)) script += block;
  files::write_text(folder / "commands.sh", script);
  const std::string log = (folder / "log").string();
  const int status = std::system(("bash '" + (folder / "commands.sh").string() + "' > '" + log + "' 2>&1").c_str());
  EXPECT_EQ(status, 0) << files::read_text(log);
}

TEST(Readme, every_command_runs) {
  const test::TemporaryFolder folder;
  run_commands_of(kProject / "README.md", folder.path());
  for (const char* file : {"study/cell_1/report.html", "study/statistics/report.html"})
    EXPECT_TRUE(fs::is_regular_file(folder / file)) << file;
}

TEST(Tutorial, every_command_runs) {
  const test::TemporaryFolder folder;
  run_commands_of(kDocs / "tutorial.md", folder.path());
  for (const char* file : {"tutorial/cell_1/report.html", "tutorial/cell_1/1_segment/overlay.png",
                           "tutorial/cell_4/report.html", "tutorial/statistics/report.html"})
    EXPECT_TRUE(fs::is_regular_file(folder / file)) << file;
}

TEST(CurvedGels, every_command_runs) {
  const test::TemporaryFolder folder;
  run_commands_of(kDocs / "curved-gels.md", folder.path());
  for (const char* file : {"curved/cell_1/report.html", "curved/cell_1/4_traction/traction.csv"})
    EXPECT_TRUE(fs::is_regular_file(folder / file)) << file;
}

std::vector<fs::path> pages() {
  std::vector<fs::path> list = {kProject / "README.md", kProject / "CONTRIBUTING.md", kProject / "samples/README.md"};
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kDocs)) {
    if (entry.path().extension() == ".md") list.push_back(entry.path());
  }
  std::sort(list.begin(), list.end());
  return list;
}

TEST(Pages, every_link_between_them_leads_to_a_file) {
  const std::regex link(R"(\]\(([^)#:]+)(#[^)]*)?\))");
  for (const fs::path& page : pages()) {
    const std::string text = files::read_text(page);
    for (std::sregex_iterator at(text.begin(), text.end(), link), end; at != end; ++at) {
      const fs::path target = page.parent_path() / (*at)[1].str();
      EXPECT_TRUE(fs::exists(target)) << page.lexically_relative(kProject) << " links to " << (*at)[1];
    }
  }
}

TEST(Pages, the_index_names_every_page_for_users) {
  const std::string index = files::read_text(kDocs / "README.md");
  for (const char* folder : {"", "theory/"}) {
    for (const fs::directory_entry& entry : fs::directory_iterator(kDocs / folder)) {
      const std::string name = folder + entry.path().filename().string();
      if (entry.path().extension() != ".md" || name == "README.md") continue;
      EXPECT_NE(index.find("(" + name + ")"), index.npos) << name << " is not in docs/README.md";
    }
  }
}

/// Words of each sentence of the prose: no tables, titles or code.
std::vector<int> sentence_lengths(const fs::path& page) {
  std::istringstream lines(files::read_text(page));
  std::string prose;
  bool is_code = false;
  for (std::string line; std::getline(lines, line);) {
    const bool is_fence = line.find("```") != line.npos;
    if (is_fence) is_code = !is_code;
    const bool is_prose = !is_code && !is_fence && !line.starts_with("|") && !line.starts_with("#") &&
                          !line.starts_with("!") && !line.starts_with("    ");
    if (is_prose && !std::regex_search(line, std::regex(R"(^\s*([-*]|\d+\.)\s)")))
      prose += line.empty() ? ". " : line + " ";
    else
      prose += ". " + (is_prose ? line.substr(line.find_first_of("-*.") + 1) : std::string()) + " ";
  }
  prose = std::regex_replace(prose, std::regex("`[^`]*`"), "code");
  prose = std::regex_replace(prose, std::regex(R"(\[([^\]]*)\]\([^)]*\))"), "$1");
  std::vector<int> lengths;
  int n = 0;
  std::istringstream words(prose);
  for (std::string word; words >> word;) {
    n += std::any_of(word.begin(), word.end(), [](unsigned char c) { return std::isalnum(c); }) ? 1 : 0;
    if (std::string(".!?:;").find(word.back()) == std::string::npos) continue;
    if (n > 1) lengths.push_back(n);
    n = 0;
  }
  std::sort(lengths.begin(), lengths.end());
  return lengths;
}

void expect_short_sentences(const std::string& page, int median, int p90) {
  const std::vector<int> lengths = sentence_lengths(kDocs / page);
  ASSERT_FALSE(lengths.empty()) << page;
  EXPECT_LE(lengths[lengths.size() / 2], median) << page;
  EXPECT_LE(lengths[9 * lengths.size() / 10], p90) << page;
}

/// For readers whose language is another one. The bars are those of guides for plain English: some 15 words a sentence,
/// none that one must read twice.
TEST(Pages, have_short_sentences) {
  struct Bar {
    const char* page;
    int median, p90;
  };
  const Bar bars[] = {{"../README.md", 16, 30}, {"tutorial.md", 16, 30},          {"faq.md", 16, 30},
                      {"acquire.md", 16, 30},   {"correct-by-hand.md", 16, 30},   {"troubleshooting.md", 16, 30},
                      {"limits.md", 16, 30},    {"statistics.md", 16, 30},        {"batches.md", 16, 30},
                      {"install.md", 16, 30},   {"planning.md", 16, 30},          {"../python/README.md", 16, 30},
                      {"sheets.md", 22, 40},    {"effects.md", 22, 40},           {"findings.md", 22, 40},
                      {"formats.md", 22, 40},   {"resolution.md", 22, 40},        {"accuracy-and-cost.md", 22, 40},
                      {"theory.md", 22, 40},    {"validation.md", 22, 40},        {"accuracy.md", 22, 40},
                      {"extending.md", 22, 40}, {"../samples/README.md", 22, 40}, {"../CONTRIBUTING.md", 22, 40}};
  for (const Bar& bar : bars) expect_short_sentences(bar.page, bar.median, bar.p90);
}

TEST(Pages, of_theory_have_short_sentences) {
  for (const fs::directory_entry& entry : fs::directory_iterator(kDocs / "theory"))
    expect_short_sentences("theory/" + entry.path().filename().string(), 22, 40);
}

}  // namespace
}  // namespace mbtfm
