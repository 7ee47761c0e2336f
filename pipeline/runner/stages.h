/// The stages of a cell, in the order they run: what each reads, writes and depends on.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace mbtfm::runner {

/// An input image: a key of [images] in cell.toml, given to the stage as --flag.
struct ImageInput {
  enum class Need { always, where_there };
  std::string flag;
  std::string key;
  Need need = Need::always;  ///< where_there: a file of the default name may lack
};

/// A file or folder of the cell folder, given to the stage as --flag.
struct PathArgument {
  enum class Given { always, if_there, if_series };
  std::string flag;
  std::string path;
  Given given = Given::always;  ///< if_series: a folder, if the list of a time series' frames is in it

  /// The file without which it is not given; none: it always is.
  std::optional<std::string> condition() const;
};

/// A key of cell.toml and its value, as a flag spells it.
struct Setting {
  std::string table, key, value;
  bool operator==(const Setting&) const = default;
};

struct Stage {
  std::string name;    ///< the executable is mbtfm-NAME
  std::string folder;  ///< of its outputs and its record
  std::vector<ImageInput> images = {};
  std::optional<ImageInput> instead = {};        ///< of the images, where [images] names it
  std::vector<ImageInput> optional_images = {};  ///< used where they are there
  std::vector<ImageInput> beside = {};       ///< of others, which it looks at where they are there before anything runs
  std::vector<PathArgument> arguments = {};  ///< further inputs that earlier stages write
  PathArgument output;
  std::vector<std::string> reads = {};              ///< files behind `arguments`, relative to the cell folder
  std::vector<std::string> reads_where_there = {};  ///< further ones, which the stage before writes in some cases only
  std::vector<std::string> writes;                  ///< files without which the stage is not done
  std::vector<std::string> series = {};   ///< globs: files that it writes in some cases only, as of a time series
  std::vector<std::string> tables;        ///< of cell.toml that its result depends on; empty: above the first table
  std::vector<std::string> effects = {};  ///< keys of [effects] that it depends on
  std::vector<Setting> settings = {};     ///< that hold whatever cell.toml says
  bool explains = false;                  ///< what is off would change: it takes --explain
  bool keeps_frames = false;              ///< of a time series, those that still hold: it takes --kept
};

/// Of a cell on a flat gel; those of others: cell_stages.h.
const std::vector<Stage>& stages();

/// Is the file, relative to the cell folder, one that this stage writes of a time series?
bool is_of_series(const Stage& stage, const std::string& file);

/// Is the stage among those named? @param only  empty: all are
bool is_asked(const Stage& stage, const std::vector<std::string>& only);

// Values that take the place of defaults, where cell.toml's own win, or of those in cell.toml.

/// Those that cell.toml does not set itself. @throws InputError where it is no TOML
std::vector<Setting> unset_in(const std::filesystem::path& toml_file, const std::vector<Setting>& settings);

/// A value in place of cell.toml's: "gel.youngs_modulus_kPa=4", "pixel_size_um=0.1".
/// @throws UsageError where it is no such text, or no stage has a table of that name
Setting parse_setting(const std::string& text);

/// Both, and where they set the same the second.
std::vector<Setting> with(std::vector<Setting> settings, const std::vector<Setting>& second);

/// The flags that give a stage those of its tables.
std::vector<std::string> flags_of(const Stage& stage, const std::vector<Setting>& settings);

}  // namespace mbtfm::runner
