#include "pipeline/files/columns.h"

#include <algorithm>

#include "pipeline/files/texts.h"

namespace mbtfm::files {

extern const std::string_view kColumnTexts;  // columns.txt

void Way::go(Through through, Function function, bool may_end) {
  pieces_.at(static_cast<std::size_t>(n_++)) = {offset_, through, function};
  offset_ = 0;
  may_end_ = may_end_ || may_end;
}

void Way::go(const Way& on) {
  for (int k = 0; k < on.n_; ++k) {
    const Piece& piece = on.pieces_[k];
    offset_ += piece.offset;
    go(piece.through, piece.function, on.may_end_);
  }
  offset_ += on.offset_;
}

const void* Way::from(const void* row) const {
  for (int k = 0; k < n_; ++k) {
    const Piece& piece = pieces_[k];
    row = piece.through(static_cast<const char*>(row) + piece.offset, piece.function);
    if (!row) return nullptr;
  }
  return static_cast<const char*>(row) + offset_;
}

AnyColumns::AnyColumns(std::string_view name, const Way& way, const FieldType& type, const ColumnOptions& options) {
  AnyColumn& column = all_.emplace_back();
  column.name = name;
  column.options = options;
  column.way = way;
  column.type = &type;
}
AnyColumns::AnyColumns(const AnyColumns&) = default;
AnyColumns& AnyColumns::operator=(const AnyColumns&) = default;
AnyColumns::~AnyColumns() = default;

void AnyColumns::add(const AnyColumns& more, const Way& part) {
  for (const AnyColumn& column : more.all_) {
    Way& way = all_.emplace_back(column).way;
    way = part;
    way.go(column.way);
  }
}

void AnyColumns::keep(const std::vector<std::string>& names, bool are_kept) {
  std::erase_if(all_, [&](const AnyColumn& column) {
    return (std::ranges::find(names, column.name) != names.end()) != are_kept;
  });
}

std::string AnyColumns::text_of(const void* rows, std::size_t n_rows, std::size_t size) const {
  std::vector<std::string> header;
  for (const AnyColumn& column : all_) header.push_back(column.name);
  CsvText csv(header);
  for (std::size_t k = 0; k < n_rows; ++k) {
    for (const AnyColumn& column : all_) {
      const void* part = column.way.from(static_cast<const char*>(rows) + k * size);
      const int digits = column.options.digits;
      csv.add(!part ? std::string() : column.get ? column.get(part, digits) : column.type->field(part, digits));
    }
    csv.end_row();
  }
  return csv.str();
}

void AnyColumns::take(void* rows, std::size_t size, CsvTable& table, const char* label) const {
  for (const AnyColumn& column : all_)
    if (column.is_read() && !column.options.may_lack) table.require({column.name});
  if (*label != 0) table.label_rows_by(all_.front().name, label);
  for (const AnyColumn& column : all_) {
    if (!column.is_read() || !table.has(column.name)) continue;
    for (int row = 0; row < table.n_rows(); ++row) {
      void* part = column.way.from(static_cast<void*>(static_cast<char*>(rows) + static_cast<std::size_t>(row) * size));
      if (column.put)
        column.put(part, table, row, column);
      else
        column.type->take(part, table, row, column.name, column.options.range);
    }
  }
}

std::string AnyColumns::page_of(const char* file) const {
  static const Texts texts(kColumnTexts);
  const std::string row = texts.at(file, "");
  std::string page =
      std::string("\n## `") + file + "`\n\nA row for " + row + ".\n\n| column | is | values |\n|---|---|---|\n";
  for (const AnyColumn& c : all_) {
    std::string kind = c.type->kind(c.options.range);
    if (c.way.may_end() && !kind.ends_with(", or empty")) kind += ", or empty";
    const std::optional<std::string> own = texts.find(file, c.name);
    page += "| `" + c.name + "` | " + (own ? *own : texts.at("any table", c.name)) + " | " + kind +
            (c.options.may_lack ? "; may be missing" : "") + " |\n";
  }
  return page;
}

}  // namespace mbtfm::files
