#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/report.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/json.h"
#include "pipeline/files/names.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/memory.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm {
namespace {

using Names = test::InFolder;

TEST_F(Names, characters_of_utf8_have_their_lengths_and_nothing_else_has_one) {
  for (const auto& [text, length] : std::vector<std::pair<std::string, std::size_t>>{{"a", 1},
                                                                                     {"\xC3\xA9", 2},
                                                                                     {"\xE2\x82\xAC", 3},
                                                                                     {"\xED\x9F\xBF", 3},
                                                                                     {"\xF0\x9F\x98\x80", 4},
                                                                                     {"\xF4\x8F\xBF\xBF", 4},
                                                                                     {"", 0},
                                                                                     {"\x80", 0},
                                                                                     {"\xC3", 0},
                                                                                     {"\xC3(", 0},
                                                                                     {"\xC0\x80", 0},
                                                                                     {"\xE0\x9F\xBF", 0},
                                                                                     {"\xED\xA0\x80", 0},
                                                                                     {"\xF0\x8F\xBF\xBF", 0},
                                                                                     {"\xF4\x90\x80\x80", 0},
                                                                                     {"\xF5\x80\x80\x80", 0},
                                                                                     {"\xFF", 0}})
    EXPECT_EQ(files::utf8_length(text), length) << files::shown_name(text);
}

TEST_F(Names, numbers_count_as_numbers_and_a_point_in_front_hides) {
  const std::vector<fs::path> ordered = {"a",
                                         "b 2/z",
                                         "b 10/a",
                                         "b10",
                                         "t1.tif",
                                         "t01",
                                         "t2.tif",
                                         "t10.tif",
                                         "t12",
                                         "u1v2",
                                         "u1v10",
                                         "u2v1",
                                         "v9",
                                         "v0010",
                                         "v99999999999999999999",
                                         "v100000000000000000000"};
  std::vector<fs::path> shuffled = ordered;
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(1));
  std::ranges::sort(shuffled, files::is_before);
  for (std::size_t i = 0; i + 1 < shuffled.size(); ++i) {
    EXPECT_TRUE(files::is_before(shuffled[i], shuffled[i + 1])) << shuffled[i] << shuffled[i + 1];
    EXPECT_FALSE(files::is_before(shuffled[i + 1], shuffled[i])) << shuffled[i] << shuffled[i + 1];
  }
  const auto place = [&](const char* name) { return std::ranges::find(shuffled, name) - shuffled.begin(); };
  for (const auto& [first, second] :
       std::vector<std::pair<const char*, const char*>>{{"t2.tif", "t10.tif"},
                                                        {"b 2/z", "b 10/a"},
                                                        {"u1v10", "u2v1"},
                                                        {"v9", "v0010"},
                                                        {"v99999999999999999999", "v100000000000000000000"}})
    EXPECT_LT(place(first), place(second)) << first << " " << second;
  for (const char* name : {"t10.tif", "t2.tif", "._t2.tif", ".snapshot", "t1.tif"})
    files::write_text(folder / name, "x");
  EXPECT_EQ(files::visible_in(folder.path()),
            (std::vector<fs::path>{folder / "t1.tif", folder / "t2.tif", folder / "t10.tif"}));
  std::error_code error;
  EXPECT_TRUE(files::visible_in(folder / "nowhere", error).empty());
  EXPECT_TRUE(error);
}

TEST_F(Names, a_name_of_any_bytes_is_shown_as_utf8_and_shown_again_stays_as_it_is) {
  EXPECT_EQ(files::shown_name("Zelle 3, caf\xC3\xA9"), "Zelle 3, caf\xC3\xA9");
  EXPECT_EQ(files::shown_name("caf\xE9.tif"), "caf\\xE9.tif");
  std::mt19937_64 random(5);
  for (int round = 0; round < 1000; ++round) {
    std::string bytes;
    for (int i = 0; i < 12; ++i) bytes += static_cast<char>(1 + random() % 255);
    const std::string shown = files::shown_name(bytes);
    EXPECT_TRUE(files::is_utf8(shown));
    EXPECT_EQ(files::shown_name(shown), shown);
    EXPECT_EQ(files::file_shown_as("", shown).string().size(), bytes.size()) << shown;
  }
}

TEST_F(Names, the_file_shown_by_a_name_is_found) {
  files::write_text(folder / "caf\xE9", "");
  EXPECT_EQ(files::file_shown_as(folder.path(), "caf\\xE9"), folder / "caf\xE9");
  files::write_text(folder / "caf\\xE9", "");
  EXPECT_EQ(files::file_shown_as(folder.path(), "caf\\xE9"), folder / "caf\\xE9")
      << "one of just that name comes first";
}

TEST_F(Names, letters_with_marks_are_the_same_as_one_character_or_as_two) {
  files::write_text(folder / "Zellko\u0308rper e\u0301.tif", "");
  EXPECT_EQ(files::file_shown_as(folder.path(), "Zellk\u00F6rper \u00E9.tif"), folder / "Zellko\u0308rper e\u0301.tif");
  files::write_text(folder / "Fl\u00E4che.tif", "");
  EXPECT_EQ(files::file_shown_as(folder.path(), "Fla\u0308che.tif"), folder / "Fl\u00E4che.tif");
  EXPECT_EQ(files::file_shown_as(folder.path(), "Flache.tif"), folder / "Flache.tif") << "another name";
  files::write_text(folder / "\u1112\u1161\u11AB.tif", "");
  EXPECT_EQ(files::file_shown_as(folder.path(), "\uD55C.tif"), folder / "\u1112\u1161\u11AB.tif") << "Hangul";
  files::write_text(folder / "\u304B\u3099.tif", "");
  EXPECT_EQ(files::file_shown_as(folder.path(), "\u304C.tif"), folder / "\u304B\u3099.tif") << "Hiragana";
  EXPECT_EQ(files::folded("ZELLE 3\u00DC"), files::folded("Zelle 3u\u0308"));
  EXPECT_EQ(files::folded("caf\xE9"), "caf\xE9") << "no UTF-8: as it is";
}

TEST_F(Names, no_shown_name_leads_out_of_its_folder) {
  EXPECT_EQ(files::file_shown_as("cell", "\\x2E\\x2E\\x2Fetc"), "cell/\\x2E\\x2E\\x2Fetc");
}

TEST_F(Names, json_and_tables_are_utf8_whatever_a_name_is) {
  const nlohmann::ordered_json json = {{"caf\xE9", {"a\xFF", 3, nullptr, {{"k", "\xC3\xA9"}}}}};
  EXPECT_EQ(files::json_text(json), "{\"caf\\\\xE9\":[\"a\\\\xFF\",3,null,{\"k\":\"\xC3\xA9\"}]}");
  files::CsvText csv({"cell"});
  csv.add("caf\xE9").end_row();
  EXPECT_EQ(csv.str(), "cell\ncaf\\xE9\n");
}

TEST(Memory, what_does_not_fit_is_refused_with_its_count_and_memory_before_it_is_made) {
  const numerics::Demand small = {
      .what = "the mesh", .count = 1000, .parts = "vertices", .bytes_each = 100, .remedy = "choose a larger edge"};
  EXPECT_NO_THROW(numerics::expect_room_for(small));
  numerics::Demand large = small;
  large.count = 1e15;
  const OutOfMemory error = test::thrown<OutOfMemory>([&] { numerics::expect_room_for(large); });
  EXPECT_EQ(error.report->reason.find("the mesh would have 1e+15 vertices, which take 1e+08 GB of memory"), 0u)
      << error.report->reason;
  EXPECT_TRUE(error.report->reason.ends_with(": choose a larger edge")) << error.report->reason;
}

}  // namespace
}  // namespace mbtfm
