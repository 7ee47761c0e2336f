/// Runs the stability tests and writes what they state and measure into the tables of docs/developers/hard-cases.md:
///   hard_cases_page docs/developers/hard-cases.md [NAME]...
/// All tables or those named. A table of tests/stability/NAME.cpp stands between the lines <!-- NAME --> and <!-- end
/// -->.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>

#include "pipeline/files/text.h"

namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// GoogleTest 1.12 writes each byte beyond ASCII as a character of its own ("\\u00C2\\u00B2" for "²"): the bytes again.
std::string bytes_of(const std::string& text) {
  std::string bytes;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if ((c & 0xFC) != 0xC0) {
      bytes += text[i];
      continue;
    }
    bytes += static_cast<char>((c & 3) << 6 | (static_cast<unsigned char>(text[++i]) & 0x3F));
  }
  return bytes;
}

/// Of a table's cell, and of a name as people read it.
std::string cell_text(std::string text) {
  text = bytes_of(text);
  for (char& c : text)
    if (c == '|' || c == '\n') c = '/';
  return text;
}
std::string words(std::string name) {
  for (char& c : name)
    if (c == '_') c = ' ';
  return name;
}

/// "converges/needles" for an instance of a test that runs over many scenes.
std::string case_name(const ordered_json& test) {
  const std::string name = test.at("name");
  const auto slash = name.find('/');
  if (slash == name.npos) return words(name);
  return words(name.substr(slash + 1)) + ": " + words(name.substr(0, slash));
}

std::string result_of(const ordered_json& test) {
  if (test.contains("failures")) return "**fails**";
  if (test.at("result") == "SKIPPED") return "not run here";
  return test.contains("measured") ? cell_text(test["measured"]) : "so";
}

std::string table_of(const std::string& name) {
  const fs::path file = fs::temp_directory_path() / ("mbtfm-hard-cases-" + name + ".json");
  const std::string command = std::string(MBTFM_BINARY_DIR) + "/tests/stability_" + name +
                              " --gtest_output=json:" + file.string() + " > /dev/null 2>&1";
  if (std::system(command.c_str()) != 0) std::cerr << name << ": some tests fail\n";
  const ordered_json all = ordered_json::parse(mbtfm::files::read_text(file));
  fs::remove(file);
  std::ostringstream table;
  table << "| case | what is hard | what must come out | what comes out |\n|---|---|---|---|\n";
  for (const ordered_json& suite : all.at("testsuites")) {
    for (const ordered_json& test : suite.at("testsuite")) {
      table << "| " << case_name(test) << " | " << cell_text(test.value("physics", "")) << " | "
            << cell_text(test.value("expected", "")) << " | " << result_of(test) << " |\n";
    }
  }
  return table.str();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: hard_cases_page docs/developers/hard-cases.md [NAME]...\n";
    return 2;
  }
  const std::set<std::string> asked(argv + 2, argv + argc);
  std::istringstream page(mbtfm::files::read_text(argv[1]));
  std::ostringstream written;
  bool is_kept = true;
  for (std::string line; std::getline(page, line);) {
    if (line == "<!-- end -->") is_kept = true;
    if (is_kept) written << line << "\n";
    const bool is_marker = line.starts_with("<!-- ") && line.ends_with(" -->") && line != "<!-- end -->";
    const std::string name = is_marker ? line.substr(5, line.size() - 9) : "";
    if (!is_marker || (!asked.empty() && !asked.contains(name))) continue;
    is_kept = false;
    written << "\n" << table_of(name) << "\n";
  }
  mbtfm::files::write_text(argv[1], written.str());
}
