/// The pages for users do what they say: their commands run, their links lead somewhere, their sentences are short.
#include <cctype>
#include <regex>

#include "docs/pages.h"
#include "tests/support/plain_words.h"
#include "tests/support/program.h"

namespace mbtfm {
namespace {

const fs::path kProject = test::source_folder(), kDocs = kProject / "docs";

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
  fs::create_directory_symlink(test::build_folder(), folder / "build");
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
  EXPECT_TRUE(fs::is_regular_file(folder / "study/cell_1/report.html"));
}

bool has(const char* program) {
  return std::system(("command -v " + std::string(program) + " >/dev/null").c_str()) == 0;
}

/// The tutorial's cell as README shows it. Half as large, so that how letters are drawn matters little: the same cell
/// with another noise is 0.042 away, the same fit with other labels 0.035, the same program 0.
void expect_picture_of_readme(const fs::path& report) {
  if (!has("chromium") || !has("convert")) return;
  const test::TemporaryFolder folder;
  const std::string made = (folder / "made.png").string(), shown = (kDocs / "images/result.png").string();
  const std::string script = "sh '" + (kDocs / "make_images.sh").string() + "' '" + report.string() + "' '" + made +
                             "' && convert '" + made + "' '" + shown +
                             "' -resize '690x320!' -metric RMSE -compare -format '%[distortion]' info: > '" +
                             (folder / "distance").string() + "'";
  ASSERT_EQ(std::system(script.c_str()), 0);
  EXPECT_LT(std::stod(files::read_text(folder / "distance")), 0.03)
      << "README shows another result: docs/make_images.sh tutorial/cell_1/report.html";
}

/// The tables of the study again, by R.
void expect_as_in_r(const fs::path& study) {
  if (!has("Rscript")) return;
  const std::string log = (study / "r.log").string();
  const int status = std::system(("cd / && Rscript '" + (study / "statistics/study.R").string() + "' > '" + log +
                                  "' 2>&1 && Rscript -e 'source(\"" + (kDocs / "recipes/study.R").string() +
                                  "\"); stopifnot(nrow(mbtfm_study(\"" + study.string() + "\", conditions = \"" +
                                  (study / "conditions.csv").string() + "\")) > 40)' >> '" + log + "' 2>&1")
                                     .c_str());
  EXPECT_EQ(status, 0) << files::read_text(log);
}

TEST(Tutorial, every_command_runs) {
  const test::TemporaryFolder folder;
  run_commands_of(kDocs / "tutorial.md", folder.path());
  for (const char* file : {"tutorial/cell_1/report.html", "tutorial/cell_1/1_segment/overlay.png",
                           "tutorial/cell_4/report.html", "tutorial/statistics/report.html"})
    EXPECT_TRUE(fs::is_regular_file(folder / file)) << file;
  expect_picture_of_readme(folder / "tutorial/cell_1/report.html");
  expect_as_in_r(folder / "tutorial");
}

/// What the blocks `console` of a page show: commands after a "$", and beneath them what they print. Numbers agree to
/// 2 %, as other processors round and draw other meshes; all else to the letter.
void expect_consoles_of(const fs::path& page, const fs::path& folder) {
  const std::string text = files::read_text(page);
  const std::regex fence("```console\n([^`]*)```"), number(R"([-+]?\d[\d.]*(e[-+]\d+)?)"), blanks(" +");
  std::string printed, log;
  int n_lines = 0;
  for (std::sregex_iterator at(text.begin(), text.end(), fence), end; at != end; ++at) {
    std::istringstream lines((*at)[1].str());
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("$ ")) {
        log = (folder / "log").string();
        const int status = std::system(("cd '" + folder.string() + "' && PATH='" + test::build_folder().string() +
                                        "/bin':$PATH && (" + line.substr(2) + ") > log 2>&1")
                                           .c_str());
        printed = std::regex_replace(files::read_text(log), blanks, " ");
        EXPECT_EQ(status, 0) << line << "\n" << printed;
        continue;
      }
      ++n_lines;
      const std::string shown = std::regex_replace(line, blanks, " ");
      std::istringstream all(printed);
      std::string found;
      while (std::getline(all, found) &&
             std::regex_replace(found, number, "#") != std::regex_replace(shown, number, "#")) {
      }
      ASSERT_TRUE(all) << page << ": '" << line << "' is not in\n" << printed;
      for (std::sregex_iterator a(shown.begin(), shown.end(), number), b(found.begin(), found.end(), number); a != end;
           ++a, ++b)
        EXPECT_NEAR(std::stod(a->str()), std::stod(b->str()), 0.02 * std::abs(std::stod(a->str()))) << line << "\n"
                                                                                                    << found;
    }
  }
  EXPECT_GT(n_lines, 0) << page;
}

TEST(Documents, examples_of_sheets_and_means_print_what_the_pages_show) {
  const test::TemporaryFolder folder;
  for (const char* page : {"sheets.md", "batches.md"}) expect_consoles_of(kDocs / page, folder.path());
}

TEST(CurvedGels, every_command_prints_what_the_page_shows) {
  const test::TemporaryFolder folder;
  expect_consoles_of(kDocs / "curved-gels.md", folder.path());
  for (const char* file : {"curved/cell_1/report.html", "curved/cell_1/4_traction/traction.csv"})
    EXPECT_TRUE(fs::is_regular_file(folder / file)) << file;
}

/// A page by its name from the root; those that are made lie in the build.
fs::path file_of(const fs::path& page) {
  return fs::exists(kProject / page) ? kProject / page : test::build_folder() / page;
}

/// Names from the root.
std::vector<fs::path> all_pages() {
  std::vector<fs::path> list = {"README.md", "CONTRIBUTING.md", "python/README.md", "samples/README.md"};
  for (const char* name : pages::kMade) list.push_back(fs::path("docs") / name);
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kDocs))
    if (entry.path().extension() == ".md") list.push_back(entry.path().lexically_relative(kProject));
  std::sort(list.begin(), list.end());
  return list;
}

/// What GitHub calls a title in links: small letters, "-" for a space, and no punctuation.
std::string slug_of(const std::string& title) {
  std::string slug;
  for (std::size_t i = 0; i < title.size(); ++i) {
    const auto c = static_cast<unsigned char>(title[i]), next = static_cast<unsigned char>(title.c_str()[i + 1]);
    if (c == ' ' || c == '-')
      slug += '-';
    else if (c == '_' || std::isalnum(c) != 0)
      slug += static_cast<char>(std::tolower(c));
    else if (c == 0xE2)  // U+2000 to U+2FFF: dashes, quotes, signs, three bytes each
      i += 2;
    else if (c == 0xC2 && next != 0xB5)  // U+0080 to U+00BF: signs, but for the micro sign, which is a letter
      i += 1;
    else if (c >= 0x80)
      slug += title[i];
  }
  return slug;
}

/// The second of two alike gets "-1".
std::set<std::string> anchors_of(const fs::path& page) {
  std::istringstream lines(files::read_text(page));
  std::map<std::string, int> n_alike;
  std::set<std::string> anchors;
  bool is_code = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.find("```") != line.npos) is_code = !is_code;
    const auto begin = line.find_first_not_of('#');
    if (is_code || begin == 0 || begin == line.npos || line[begin] != ' ') continue;
    const std::string title = std::regex_replace(line.substr(begin + 1), std::regex(R"(\[([^\]]*)\]\([^)]*\))"), "$1");
    const std::string slug = slug_of(title);
    const int n = n_alike[slug]++;
    anchors.insert(n == 0 ? slug : slug + "-" + std::to_string(n));
  }
  return anchors;
}

TEST(DocumentPages, every_link_between_them_leads_to_a_file_and_a_title_in_it) {
  const std::regex link(R"(\]\(([^)#:]*)(#[^)]*)?\))");
  std::vector<fs::path> linking = all_pages();
  for (const fs::directory_entry& entry : fs::directory_iterator(kProject / "notes"))
    if (entry.path().extension() == ".md") linking.push_back(entry.path().lexically_relative(kProject));
  for (const fs::path& page : linking) {
    const std::string text = files::read_text(file_of(page));
    for (std::sregex_iterator at(text.begin(), text.end(), link), end; at != end; ++at) {
      const std::string file = (*at)[1], anchor = (*at)[2];
      const fs::path target = file_of(file.empty() ? page : (page.parent_path() / file).lexically_normal());
      EXPECT_TRUE(fs::exists(target)) << page << " links to " << file;
      if (anchor.empty() || target.extension() != ".md" || !fs::exists(target)) continue;
      EXPECT_TRUE(anchors_of(target).contains(anchor.substr(1))) << page << " links to " << file << anchor;
    }
  }
}

TEST(DocumentPages, the_index_names_every_page) {
  const std::string index = files::read_text(kDocs / "README.md");
  for (const fs::path& page : all_pages()) {
    const std::string name = page.lexically_relative("docs").generic_string();
    if (name.starts_with("..") || name == "README.md") continue;
    EXPECT_TRUE(has_words(index, "(" + name + ")")) << name << " is not in docs/README.md";
  }
}

/// Commands as pipeline/commands/table.cpp has them, programs as they were built, codes as the sources name them.
TEST(DocumentPages, every_command_and_exit_code_is_on_its_page) {
  const std::string commands = files::read_text(kDocs / "commands.md");
  const std::string source = files::read_text(kProject / "pipeline/commands/table.cpp");
  const std::regex added(R"re(\n +\{"([a-z]+)",)re");
  int n_commands = 0;
  for (std::sregex_iterator at(source.begin(), source.end(), added), end; at != end; ++at, ++n_commands)
    EXPECT_TRUE(has_words(commands, "| `mbtfm " + (*at)[1].str())) << (*at)[1];
  EXPECT_GE(n_commands, 12);
  for (const fs::directory_entry& entry : fs::directory_iterator(test::build_folder() / "bin")) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("mbtfm-")) continue;
    EXPECT_TRUE(has_words(commands, "`" + name + "`")) << name;
  }
  const std::string errors = files::read_text(kProject / "pipeline/contract/errors.h");
  const std::regex code(R"(inline constexpr int k\w+ = (\d+);)");
  for (const char* name : {"commands.md", "troubleshooting.md"}) {
    const std::string page = files::read_text(kDocs / name);
    for (std::sregex_iterator at(errors.begin(), errors.end(), code), end; at != end; ++at)
      EXPECT_TRUE(has_words(page, "\n| " + (*at)[1].str() + " |")) << name << ": " << (*at)[1];
  }
}

/// Those of theory are for readers of equations.
TEST(DocumentPages, for_users_have_plain_words) {
  for (const fs::path& page : all_pages()) {
    const std::string name = page.generic_string();
    if (name.starts_with("docs/theory") || name == "CONTRIBUTING.md") continue;
    for (const std::string& line : test::lines_of_prose(files::read_text(file_of(page))))
      for (const std::string& found : test::unplain_words_in(line)) ADD_FAILURE() << name << ": " << found;
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
    if (std::string(".!?").find(word.back()) == std::string::npos) continue;
    if (n > 1) lengths.push_back(n);
    n = 0;
  }
  std::sort(lengths.begin(), lengths.end());
  return lengths;
}

void expect_short_sentences(const std::string& page, int median, int p90) {
  const std::vector<int> lengths = sentence_lengths(file_of((fs::path("docs") / page).lexically_normal()));
  ASSERT_FALSE(lengths.empty()) << page;
  EXPECT_LE(lengths[lengths.size() / 2], median) << page;
  EXPECT_LE(lengths[9 * lengths.size() / 10], p90) << page;
}

/// For readers whose language is another one. The bars are those of guides for plain English: some 15 words a sentence,
/// none that one must read twice. What one reads from begin to end has the lower bars, what one looks up the others.
TEST(DocumentPages, have_short_sentences) {
  struct Bar {
    int median, p90;
    std::vector<const char*> pages;
  };
  const std::vector<Bar> bars = {
      {16,
       30,
       {"../README.md", "tutorial.md", "faq.md", "glossary.md", "acquire.md", "correct-by-hand.md",
        "troubleshooting.md", "limits.md", "statistics.md", "batches.md", "install.md", "planning.md", "curved-gels.md",
        "sheets.md", "how-good.md", "paraview.md", "../python/README.md"}},
      {22,
       40,
       {"README.md", "commands.md", "parameters.md", "columns.md", "plausible.md", "effects.md", "findings.md",
        "formats/cell-folder.md", "formats/tables.md", "formats/other-programs.md", "formats/json.md", "theory.md",
        "accuracy.md", "extending.md", "../samples/README.md", "../CONTRIBUTING.md"}}};
  for (const Bar& bar : bars)
    for (const char* page : bar.pages) expect_short_sentences(page, bar.median, bar.p90);
}

TEST(DocumentPages, of_theory_have_short_sentences) {
  for (const fs::directory_entry& entry : fs::directory_iterator(kDocs / "theory"))
    expect_short_sentences("theory/" + entry.path().filename().string(), 22, 40);
}

}  // namespace
}  // namespace mbtfm
