
#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/files/json.h"
#include "pipeline/files/text.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm {
namespace {

TEST(Findings, every_kind_has_an_identity_of_its_own_a_reason_and_a_remedy) {
  std::set<std::string> ids;
  for (const KindOfFinding& k : kinds_of_findings()) {
    EXPECT_TRUE(ids.insert(k.id).second) << k.id;
    EXPECT_EQ(std::string(k.id).find_first_not_of("abcdefghijklmnopqrstuvwxyz-"), std::string::npos) << k.id;
    for (const char* text : {k.stage, k.number, k.reason, k.remedy}) EXPECT_FALSE(std::string(text).empty()) << k.id;
    EXPECT_EQ(&properties_of(k.kind), &k);
  }
}

TEST(Findings, are_noticed_above_their_threshold_and_where_the_number_is_none) {
  const double threshold = properties_of(FindingKind::moves_outward).threshold;
  EXPECT_FALSE(noticed(FindingKind::moves_outward, threshold, "x"));
  EXPECT_TRUE(noticed(FindingKind::moves_outward, threshold + 1e-9, "x"));
  const auto unknown = noticed(FindingKind::moves_outward, std::numeric_limits<double>::quiet_NaN(), "x");
  ASSERT_TRUE(unknown);
  EXPECT_FALSE(unknown->number);
}

TEST(Findings, notes_are_not_open) {
  const Finding note = *noticed(FindingKind::wide_interval, 1, "x");
  const Finding caution = *noticed(FindingKind::missing_fibre, 1, "y");
  EXPECT_FALSE(has_open({note}));
  EXPECT_TRUE(has_open({note, caution}));
  EXPECT_EQ(open_ids({note, caution, caution}), "missing-fibre");
  EXPECT_EQ(line_of(note), "note (wide-interval): x");
  EXPECT_EQ(line_of(caution), "caution (missing-fibre): y " + caution.remedy);
}

TEST(Findings, pass_through_a_record_unchanged) {
  const test::TemporaryFolder folder;
  const Finding there = *noticed(FindingKind::not_identifiable, 2, "of \"two\"\n");
  nlohmann::ordered_json json;
  json["findings"] = {files::json_of(there)};
  files::write_text(folder / "a.json", files::json_text(json));
  const std::vector<Finding> back = files::findings_of(files::JsonRecord(folder / "a.json", "a record"));
  ASSERT_EQ(back.size(), 1u);
  EXPECT_EQ(files::json_of(back.front()), files::json_of(there));
  files::write_text(folder / "b.json", R"({"findings": [{"id": "a", "severity": "loud", "text": "b"}]})");
  EXPECT_THROW(files::findings_of(files::JsonRecord(folder / "b.json", "a record")), InputError);
  files::write_text(folder / "c.json", "{}");  // as older versions wrote it
  EXPECT_TRUE(files::findings_of(files::JsonRecord(folder / "c.json", "a record")).empty());
}

TEST(WithError, a_number_ends_where_its_error_does) {
  EXPECT_EQ(with_error(2.3512, 0.4231), "2.35 +- 0.42");
  EXPECT_EQ(with_error(2.3512, 0.0996), "2.35 +- 0.10");
  EXPECT_EQ(with_error(-0.0004, 0.023), "0.000 +- 0.023");
  EXPECT_EQ(with_error(1234.5, 0.37), "1234.50 +- 0.37");
  EXPECT_EQ(with_error(1234.5, 37), "1235 +- 37");
  EXPECT_EQ(with_error(1234.5, 372), "1230 +- 370");
  EXPECT_EQ(with_error(1234.5, 999), "1200 +- 1000");
  EXPECT_EQ(with_error(Vec2{0.3021, -0.2456}, Vec2{0.0181, 0.2}), "(0.302, -0.25) +- (0.018, 0.20)");
  // without an error to go by
  EXPECT_EQ(with_error(2.3512, 0), "2.35 +- 0");
  EXPECT_EQ(with_error(2.3512, std::numeric_limits<double>::infinity()), "2.35 +- inf");
  EXPECT_EQ(with_error(2e9, 1e7), "2e+09 +- 1e+07");
}

}  // namespace
}  // namespace mbtfm
