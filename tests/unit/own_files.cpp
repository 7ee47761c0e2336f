#include <sys/stat.h>
#include <sys/sysmacros.h>

#include "pipeline/contract/errors.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/text.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm {
namespace {

class OwnFiles : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(cell_ / "4_fit/deep");
    files::write_text(folder_ / "outside", "precious");
  }
  TemporaryFolder folder_;
  const fs::path cell_ = folder_ / "cell";
};

TEST_F(OwnFiles, a_name_stays_inside_of_its_folder) {
  EXPECT_EQ(files::inside(cell_, "4_fit/a.csv", "x"), cell_ / "4_fit/a.csv");
  EXPECT_EQ(files::inside(cell_, "not/there/yet", "x"), cell_ / "not/there/yet");
  EXPECT_EQ(files::inside(cell_, "..hidden", "x"), cell_ / "..hidden");
  for (const std::string& name :
       {std::string(), std::string("/etc/passwd"), std::string(".."), std::string("../a"),
        std::string("4_fit/../../outside"), std::string("4_fit/deep/.."), std::string("4_fit/a\0.csv", 12)})
    EXPECT_THROW(files::inside(cell_, name, "x"), InputError) << name;
}

TEST_F(OwnFiles, a_name_leads_through_no_link) {
  fs::create_symlink(folder_.path(), cell_ / "4_fit/link");
  fs::create_symlink("nowhere", cell_ / "dangling");
  for (const char* name : {"4_fit/link", "4_fit/link/outside", "dangling", "dangling/a"})
    EXPECT_THROW(files::inside(cell_, name, "x"), InputError) << name;
  fs::create_symlink("cell", folder_ / "alias");
  EXPECT_EQ(files::inside(folder_ / "alias", "4_fit/deep", "x"),
            folder_ / "alias/4_fit/deep");  // the folder itself may be one
}

TEST_F(OwnFiles, what_stages_write_is_files_in_folders) {
  EXPECT_NO_THROW(files::check_cell_folder(cell_));
  fs::create_symlink(folder_ / "outside", cell_ / "4_fit/tensions.csv");
  EXPECT_THROW(files::check_cell_folder(cell_), InputError);
  fs::remove(cell_ / "4_fit/tensions.csv");
  ASSERT_EQ(mkfifo((cell_ / "4_fit/tensions.csv").c_str(), 0600), 0);
  EXPECT_THROW(files::check_cell_folder(cell_), InputError);
  fs::remove_all(cell_ / "4_fit");
  files::write_text(cell_ / "4_fit", "");
  EXPECT_THROW(files::check_cell_folder(cell_), InputError);
  fs::remove(cell_ / "4_fit");
  fs::create_symlink("loop", cell_ / "loop");
  EXPECT_NO_THROW(files::check_cell_folder(cell_));  // no folder of a stage
  for (const char* of_stage : {"truth", "2_track", "3_sheet", "3_surface", "4_traction"}) {
    fs::create_symlink(of_stage, cell_ / of_stage);
    EXPECT_THROW(files::check_cell_folder(cell_), InputError) << of_stage;
    fs::remove(cell_ / of_stage);
  }
}

TEST_F(OwnFiles, writing_replaces_a_link_and_a_second_name_and_a_pipe) {
  const fs::path file = cell_ / "run.log";
  const std::vector<std::function<void()>> others = {
      [&] { fs::create_symlink("../outside", file); }, [&] { fs::create_hard_link(folder_ / "outside", file); },
      [&] { fs::create_symlink("../new", file); }, [&] { ASSERT_EQ(mkfifo(file.c_str(), 0600), 0); }};
  for (const auto& put : others)
    for (const auto& write : {files::write_text, files::write_whole}) {
      fs::remove(file);
      put();
      write(file, "precious, ours");
      EXPECT_TRUE(files::is_own_file(file));
      EXPECT_EQ(files::read_text(file), "precious, ours");
      EXPECT_EQ(files::read_text(folder_ / "outside"), "precious");
      EXPECT_FALSE(fs::exists(folder_ / "new"));
    }
  EXPECT_THROW(files::write_text(cell_ / "4_fit", ""), OutputError);
}

/// Only root can make one, and root alone could replace it: --out /dev/null once took it away from the machine.
TEST_F(OwnFiles, a_device_is_not_replaced) {
  const fs::path device = folder_ / "null";
  if (mknod(device.c_str(), S_IFCHR | 0666, makedev(1, 3)) != 0) GTEST_SKIP() << "no right to make a device";
  files::write_text(folder_ / "new", "text");
  EXPECT_THROW(files::put_in_place(folder_ / "new", device), OutputError);
  EXPECT_THROW(files::write_whole(device, "text"), OutputError);
  EXPECT_TRUE(fs::is_character_file(device));
}

TEST_F(OwnFiles, what_is_replaced_is_of_the_same_kind) {
  const std::map<std::string, std::string> written = {{"a table", "cell,state\nc1,fine\n"},
                                                      {"a longer one", "cell,condition,state\n"},
                                                      {"a page", "<!DOCTYPE html>\n<title>cell 1 – mbtfm</title>"},
                                                      {"a record", "{\"stage\": 1}"},
                                                      {"a record on lines", "{\n}\n"},
                                                      {"a grid", "<?xml version=\"1.0\"?>\n<VTKFile>"},
                                                      {"a picture", std::string("\x89PNG\r\n\x1A\n", 8)}};
  const std::map<std::string, std::string> users = {{"another table", "x,y\n1,2\n"},
                                                    {"a page of theirs", "<!DOCTYPE html>\n<title>mine</title>"},
                                                    {"settings", "pixel_size_um = 0.1\n"},
                                                    {"a TIFF", std::string("II*\0\x10", 5)},
                                                    {"notes", "to do"}};
  const auto is_replaced = [&](const std::string& before, const std::string& by) {
    files::write_text(cell_ / "output", before);
    try {
      files::write_whole(cell_ / "output", by);
    } catch (const OutputError& error) {
      EXPECT_TRUE(has_words(error.what(), (cell_ / "output").string()));
      EXPECT_EQ(files::read_text(cell_ / "output"), before);
      return false;
    }
    return true;
  };
  for (const auto& [ours, text] : written) {
    EXPECT_TRUE(is_replaced(text, text + "\n")) << ours;
    EXPECT_TRUE(is_replaced("", text)) << ours;
    for (const auto& [theirs, other] : users) EXPECT_FALSE(is_replaced(other, text)) << theirs << " by " << ours;
  }
  EXPECT_TRUE(is_replaced(written.at("a table"), written.at("a longer one"))) << "of an older version";
}

TEST_F(OwnFiles, a_link_under_the_temporary_name_is_not_followed) {
  fs::create_symlink("../outside", files::temporary_name(cell_ / "run.json"));
  files::write_whole(cell_ / "run.json", "ours");
  EXPECT_EQ(files::read_text(folder_ / "outside"), "precious");
  EXPECT_TRUE(files::is_own_file(cell_ / "run.json"));
}

TEST_F(OwnFiles, looking_at_a_loop_or_a_name_too_long_is_no_error) {
  fs::create_symlink("loop", cell_ / "loop");
  for (const fs::path& name : {cell_ / "loop", cell_ / std::string(5000, 'a')}) {
    EXPECT_FALSE(files::is_file(name));
    EXPECT_FALSE(files::is_folder(name));
    EXPECT_FALSE(files::is_own_file(name));
    EXPECT_THROW(files::read_text(name), InputError);
  }
}

TEST_F(OwnFiles, a_hole_is_not_read) {
  files::write_text(cell_ / "hole", "x");
  EXPECT_NO_THROW(files::expect_no_hole(cell_ / "hole"));
  fs::resize_file(cell_ / "hole", std::uintmax_t{1} << 40);
  EXPECT_THROW(files::read_text(cell_ / "hole"), InputError);
  EXPECT_FALSE(files::is_own_text(cell_ / "hole"));
}

class Records : public testing::Test {
 protected:
  files::JsonRecord record(const std::string& text) {
    files::write_text(folder_ / "a.json", text);
    return {folder_ / "a.json", "a record"};
  }
  TemporaryFolder folder_;
};

TEST_F(Records, answer_what_they_hold) {
  const files::JsonRecord r = record(R"({"a": {"b": [1, 2.5, true, "x", null]}, "none": null})");
  const std::vector<files::JsonRecord> list = r.at("a").at("b").list();
  EXPECT_EQ(list[0].integer(), 1);
  EXPECT_EQ(list[1].number(), 2.5);
  EXPECT_TRUE(list[2].is_true());
  EXPECT_EQ(list[3].text(), "x");
  EXPECT_FALSE(r.find("none"));
  EXPECT_EQ(r.text_or("c", "else"), "else");
}

TEST_F(Records, say_place_and_finding_of_what_is_otherwise) {
  const files::JsonRecord r = record(R"({"a": {"b": [1, "x"]}})");
  const InputError error = test::thrown<InputError>([&] { r.at("a").at("b").list()[1].number(); });
  EXPECT_EQ(error.expected, "'a.b.1' of a record to be a number");
  EXPECT_EQ(error.found, "\"x\"");
  EXPECT_THROW(r.at("b"), InputError);
  EXPECT_THROW(r.at("a").list(), InputError);
  EXPECT_THROW(r.at("a").at("b").members(), InputError);
}

TEST_F(Records, hold_no_integer_beyond_the_range) {
  const files::JsonRecord r =
      record(R"({"list": [2147483648, -2147483649, 18446744073709551615, 1e300, 1.5, 2147483647]})");
  const std::vector<files::JsonRecord> list = r.at("list").list();
  for (std::size_t i = 0; i + 1 < list.size(); ++i) EXPECT_THROW(list[i].integer(), InputError) << i;
  EXPECT_EQ(list.back().integer(), 2147483647);
  EXPECT_EQ(std::get<double>(list[2].figure()), 18446744073709551615.0);
}

TEST_F(Records, that_are_none_are_refused) {
  for (const std::string& text :
       {std::string(), std::string("[]"), std::string("3"), std::string("{"), std::string("{\"a\": 1e999}"),
        std::string("{\"a\": \"\xff\"}"), "{\"a\": " + std::string(1000000, '[') + std::string(1000000, ']') + "}",
        std::string("{\"a\": \"\\ud800\"}"), std::string("{} {}"), std::string("{\0}", 3)})
    EXPECT_THROW(record(text), InputError) << text.substr(0, 40);
  EXPECT_THROW(files::JsonRecord(folder_ / "nothing.json", "a record"), InputError);
}

TEST_F(Records, of_any_size_are_refused_unread) {
  files::write_text(folder_ / "a.json", "{}");
  fs::resize_file(folder_ / "a.json", std::uintmax_t{1} << 40);
  EXPECT_THROW(files::JsonRecord(folder_ / "a.json", "a record"), InputError);
}

}  // namespace
}  // namespace mbtfm
