#include "segment/beads/table_columns.h"

#include <algorithm>
#include <cstring>
#include <map>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/text.h"

namespace mbtfm::beads {

using files::CsvTable;
using files::ForeignTable;

int make_vectors_of_spots(ForeignTable& table, const TrackParameters& parameters) {
  int n_left_out = 0;
  const std::optional<int> relaxed = parameters.relaxed_plane.time, stressed = parameters.stressed_plane.time;
  const auto header = std::ranges::find_if(table.above, [](const CsvTable::Row& row) { return row.fields.size() > 3; });
  const auto column = [&](const char* key) {
    if (header != table.above.end())
      for (std::size_t i = 0; i < header->fields.size(); ++i)
        if (parts_of(header->fields[i]).key == key) return i;
    throw InputError(table.name, "columns TRACK_ID, FRAME, POSITION_X and POSITION_Y", "others",
                     "export the spots of the tracks (in TrackMate: Spots, then Export to CSV)");
  };
  const std::size_t track = column("trackid"), frame = column("frame"), x = column("positionx"),
                    y = column("positiony");
  std::optional<Unit> unit;
  for (const CsvTable::Row& row : table.above)
    if (x < row.fields.size() && !unit) unit = parts_of("_" + row.fields[x]).unit;
  if (!relaxed || !stressed) {
    throw InputError(table.name, "which frames of the tracks are meant", "no word of it",
                     "track.relaxed_time = 1 and track.stressed_time = 2 in cell.toml, or --relaxed_time 1 "
                     "--stressed_time 2 (TrackMate's FRAME 0 is 1)");
  }
  const std::string name = table.name;
  std::vector<std::string> numbers;
  for (std::size_t i = 0; i < table.rows.front().fields.size(); ++i) numbers.push_back(std::to_string(i + 1));
  const CsvTable spots(numbers, table.rows, name);
  const auto named = [](std::size_t i) { return std::to_string(i + 1); };  // which this row may lack
  struct Spots {
    int line = 0;
    std::vector<Vec2> relaxed, stressed;
  };
  std::map<std::string, Spots> tracks;
  for (int row = 0; row < spots.n_rows(); ++row) {
    const std::string id = spots.text(row, named(track));
    if (files::is_missing(id)) continue;
    const double at = spots.number(row, named(frame), Range::not_negative()) + 1;
    if (at != *relaxed && at != *stressed) continue;
    Spots& found = tracks[id];
    found.line = table.rows[static_cast<std::size_t>(row)].line;
    (at == *relaxed ? found.relaxed : found.stressed)
        .push_back({spots.number(row, named(x)), spots.number(row, named(y))});
  }
  table.rows.clear();
  const double scale = unit && unit->um > 0 ? unit->um : 1;  // to um
  for (const auto& [id, t] : tracks) {
    if (t.relaxed.size() != 1 || t.stressed.size() != 1) {
      ++n_left_out;
      continue;
    }
    const Vec2 place = scale * t.relaxed.front(), u = scale * t.stressed.front() - place;
    table.rows.push_back({t.line, {shortest(place.x), shortest(place.y), shortest(u.x), shortest(u.y)}});
  }
  if (table.rows.empty()) {
    throw InputError(
        name,
        "tracks with a spot in frame " + std::to_string(*relaxed) + " and one in frame " + std::to_string(*stressed),
        "none", "track.relaxed_time and track.stressed_time count the frames from 1");
  }
  const std::string in = !unit ? "" : unit->um == 0 ? " [px]" : " [um]";
  table.above = {{1, {"x" + in, "y" + in, "u" + in, "v" + in}}};
  return n_left_out;
}

namespace {

/// A two-dimensional array as numpy.save writes it.
struct Array {
  std::size_t n_rows = 0, n_columns = 0;
  std::vector<double> values;
};

Array array_of(const std::filesystem::path& file) {
  const std::string bytes = files::read_text(file);
  const auto fail = [&](const std::string& found) {
    throw InputError(file.string(), "an array of rows and columns as numpy.save writes it", found);
  };
  constexpr std::size_t kHeader = 10;
  if (bytes.size() < kHeader || !bytes.starts_with("\x93NUMPY\x01")) fail("other bytes");
  const auto byte = [&](std::size_t i) { return static_cast<std::size_t>(static_cast<unsigned char>(bytes[i])); };
  const std::size_t n_header = byte(8) + 256 * byte(9), begin = kHeader + n_header;
  const std::string header = bytes.substr(kHeader, n_header);
  const bool is_double = header.find("'<f8'") != header.npos, is_single = header.find("'<f4'") != header.npos;
  if (!(is_double || is_single)) fail("numbers of another type");
  if (header.find("'fortran_order': False") == header.npos) fail("columns in the place of rows");
  Array array;
  const std::size_t open = header.find('(');
  int read = 0;
  if (open == header.npos || begin > bytes.size() ||
      std::sscanf(header.c_str() + open, "(%zu, %zu)%n", &array.n_rows, &array.n_columns, &read) != 2 || read == 0)
    fail("another shape");
  const std::size_t size = is_double ? sizeof(double) : sizeof(float), n_bytes = bytes.size() - begin;
  if (array.n_rows == 0 || array.n_columns == 0 || array.n_rows > n_bytes || array.n_columns > n_bytes ||
      array.n_rows * array.n_columns * size != n_bytes)
    fail(std::to_string(n_bytes) + " bytes of numbers");
  array.values.resize(array.n_rows * array.n_columns);
  for (std::size_t i = 0; i < array.values.size(); ++i) {
    float single = 0;
    if (is_double)
      std::memcpy(&array.values[i], bytes.data() + begin + i * size, size);
    else
      std::memcpy(&single, bytes.data() + begin + i * size, size), array.values[i] = static_cast<double>(single);
  }
  return array;
}

}  // namespace

ForeignTable read_pytfm(const std::filesystem::path& file, const std::optional<images::ImageField>& picture) {
  std::string name = file.filename().string();
  const std::size_t letter = name.rfind("u.npy");
  if (letter == name.npos || letter + 5 != name.size())
    throw InputError(file.string(), "a file whose name ends on u.npy", name,
                     "name pyTFM's u; its v is read from beside it");
  name[letter] = 'v';
  const Array u = array_of(file), v = array_of(file.parent_path() / name);
  if (u.n_rows != v.n_rows || u.n_columns != v.n_columns)
    throw InputError(file.string(), "as many rows and columns as in " + name, "others");
  if (!picture) {
    throw InputError(file.string(), "the picture whose field it is", "none, and pyTFM does not state its spacing",
                     "mbtfm run takes it from the cell's images; for mbtfm-track give one of them as --cell_image");
  }
  const double step = static_cast<double>(picture->width) / static_cast<double>(u.n_columns);
  ForeignTable table{
      .name = file.string(), .above = {{1, {"x [px]", "y [px]", "u [px]", "v [px]"}}}, .lines_above = {}, .rows = {}};
  for (std::size_t j = 0; j < u.n_rows; ++j)
    for (std::size_t i = 0; i < u.n_columns; ++i) {
      const std::size_t k = j * u.n_columns + i;
      const auto at = [&](std::size_t n) { return shortest(step * (static_cast<double>(n) + 0.5) - 0.5); };
      table.rows.push_back({1, {at(i), at(j), shortest(u.values[k]), shortest(v.values[k])}});
    }
  return table;
}

}  // namespace mbtfm::beads
