#include "pipeline/contract/kinds_of_findings.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm {

extern const std::vector<std::pair<const char*, const char*>> kFormerIds;  // findings.txt: of now; before, with commas
extern const std::string_view kFindingsPage;                               // findings.md

namespace {

struct Known {
  const KindOfFinding* kind;
  const KnownSymptom* symptom;
};

Known known(Symptom symptom) {
  static const std::map<Symptom, Known> all = [] {
    std::map<Symptom, Known> of;
    for (const KindOfFinding& kind : kinds_of_findings())
      for (const KnownSymptom& s : kind.symptoms) of[s.symptom] = {&kind, &s};
    return of;
  }();
  const auto found = all.find(symptom);
  MBTFM_ASSERT(found != all.end());
  return found->second;
}

void replace(std::string& text, const std::string& what, const std::string& by) {
  if (const auto at = text.find(what); at != text.npos) text.replace(at, what.size(), by);
}

}  // namespace

const KindOfFinding& kind_of(Symptom symptom) { return *known(symptom).kind; }

const KnownSymptom& properties_of(Symptom symptom) { return *known(symptom).symptom; }

std::string present_id(const std::string& id) {
  for (const auto& [present, former] : kFormerIds)
    if ((" " + std::string(former) + ",").find(" " + id + ",") != std::string::npos) return present;
  return id;
}

bool is_open(const Finding& finding) { return finding.severity != Severity::note; }

bool spoils_cell(const Finding& finding) {
  return finding.severity == Severity::bad && finding.id != std::string_view(kind_of(Symptom::not_identifiable).id);
}

const Finding* worst_of(const std::vector<Finding>& findings) {
  const auto at = std::ranges::find_if(findings, spoils_cell), open = std::ranges::find_if(findings, is_open);
  return at != findings.end() ? &*at : open != findings.end() ? &*open : nullptr;
}

bool has_open(const std::vector<Finding>& findings) { return std::ranges::any_of(findings, is_open); }

std::optional<Finding> noticed(Symptom symptom, double number, const Shown& shown) {
  const auto [kind, s] = known(symptom);
  if (number <= s->threshold) return std::nullopt;
  Finding finding{.id = kind->id,
                  .severity = shown.severity.value_or(s->severity),
                  .text = s->sentence,
                  .number = std::isfinite(number) ? std::optional(number) : std::nullopt,
                  .threshold = s->threshold,
                  .number_is = s->number,
                  .reason = s->reason,
                  .remedy = kind->remedy};
  replace(finding.text, "{%}", brief(100 * number) + " %");
  replace(finding.text, "{}", shown.value.empty() ? brief(number) : shown.value);
  replace(finding.text, "{at}", shown.at);
  return finding;
}

std::string line_of(const Finding& finding) {
  return std::string(name_of(finding.severity)) + " (" + finding.id + "): " + finding.text +
         (is_open(finding) ? " " + finding.remedy : "");
}

std::string open_ids(const std::vector<Finding>& findings) {
  std::set<std::string> seen;
  std::string ids;
  for (const Finding& finding : findings)
    if (is_open(finding) && seen.insert(finding.id).second) ids += (ids.empty() ? "" : "; ") + finding.id;
  return ids;
}

std::string findings_page() {
  std::string page(kFindingsPage), kinds, numbers;
  for (const KindOfFinding& kind : kinds_of_findings()) {
    const std::string id = "| `" + std::string(kind.id) + "` | ";
    kinds += id + kind.meaning + " | " + kind.remedy + " | " + kind.false_alarms + " |\n";
    for (const KnownSymptom& s : kind.symptoms)
      numbers += id + s.stage + " | " + name_of(s.severity) + " | " + s.number + " | " + brief(s.threshold) + " | " +
                 s.reason + " |\n";
  }
  replace(page, "{kinds}\n", kinds);
  replace(page, "{numbers}\n", numbers);
  return page;
}

}  // namespace mbtfm
