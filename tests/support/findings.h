/// Which kinds of finding (pipeline/contract/findings.cpp) somebody has noticed. tests/architecture/findings.cpp asks
/// of each kind that a test sees it fire, and sees it silent.
#pragma once

#include "pipeline/contract/findings.h"
#include "tests/support/test.h"

namespace mbtfm::test {

/// @throws std::invalid_argument where the table has no such kind: it would be silent for ever
inline void require_kind(const std::string& id) {
  const auto is_it = [&](const KindOfFinding& k) { return k.id == id; };
  if (std::ranges::none_of(kinds_of_findings(), is_it)) throw std::invalid_argument("no kind of finding: " + id);
}

inline bool fires(const std::string& id, const std::vector<Finding>& found) {
  require_kind(id);
  return std::ranges::any_of(found, [&](const Finding& f) { return f.id == id; });
}

inline bool fires(const std::string& id, const std::optional<Finding>& found) {
  require_kind(id);
  return found && found->id == id;
}

inline bool fires(const std::string& id, const std::vector<std::optional<Finding>>& found) {
  require_kind(id);
  return std::ranges::any_of(found, [&](const auto& f) { return f && f->id == id; });
}

/// @param said  by a program: "caution (id): …" where it prints, "id": "…" in its record
inline bool fires(const std::string& id, const std::string& said) {
  require_kind(id);
  return said.find(" (" + id + "): ") != said.npos || said.find("\"id\": \"" + id + "\"") != said.npos;
}

/// By the symptom whose sentence has these words.
inline bool fires(const std::string& id, const std::string& words, const std::optional<Finding>& found) {
  return fires(id, found) && found->text.find(words) != words.npos;
}
template <class Found>
bool fires(const std::string& id, const std::string& words, const std::vector<Found>& found) {
  return std::ranges::any_of(found, [&](const std::optional<Finding>& f) { return fires(id, words, f); });
}
inline bool fires(const std::string& id, const std::string& words, const std::string& said) {
  return fires(id, said) && said.find(words) != said.npos;
}

/// Of these kinds none.
template <class Found>
void expect_silent(const std::vector<std::string>& ids, const Found& found) {
  for (const std::string& id : ids) EXPECT_FALSE(fires(id, found)) << id;
}

/// "id, id": for what a test says where it fails.
inline std::string ids_of(const std::vector<Finding>& found) {
  std::string ids;
  for (const Finding& f : found) ids += (ids.empty() ? "" : ", ") + f.id;
  return ids;
}

}  // namespace mbtfm::test
