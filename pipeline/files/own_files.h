/// A folder may come from anyone. What its files name, and what its links point to, must not lead out of it: all that
/// reads or writes a cell folder asks here. Inputs that settings name are free: they may lie anywhere and be links.
#pragma once

#include <cstdint>
#include <string>

#include "pipeline/contract/path.h"

namespace mbtfm::files {

/// A regular file, also through links; false where it cannot be looked at (a loop of links, a name too long).
bool is_file(const fs::path& file);
/// A folder, also through links; false where it cannot be looked at.
bool is_folder(const fs::path& folder);
/// A folder itself: no link.
bool is_own_folder(const fs::path& folder);
/// A regular file itself: no link.
bool is_own_file(const fs::path& file);
/// The largest of the texts of ours that are read whole (records, hashes, reports): some ten MB at most in fact. A file
/// with holes may claim to be of any size.
inline constexpr std::uintmax_t kLargestText_bytes = 256u << 20;
/// The same of such a text: larger ones are not ours.
bool is_own_text(const fs::path& file);

/// Before a file is read whole or hashed: a file that takes no room on the disk may claim to be of any size.
/// @throws InputError where it is large, and nearly all of it a hole
void expect_no_hole(const fs::path& file);

/// Where `name` lies, which a file of the folder states: below the folder, and on no way through a link. The folder
/// itself may be reached through links.
/// @param named_by  for the message: the file that has the name, or the folder
/// @throws InputError where the name is empty, absolute, leads through `..` or a link, or is no name
fs::path inside(const fs::path& folder, const fs::path& name, const std::string& named_by);

/// The folders of a cell that hold what the stages write, and the truth of a simulated one, are folders, and all in
/// them is files and folders: no links, pipes, sockets, devices. Called wherever a cell folder is opened. @throws
/// InputError naming the first that is not so
void check_cell_folder(const fs::path& cell);

/// Before a file is written: what is there and is not a file of this folder alone goes (a link, a second name of a
/// file that may be elsewhere, a pipe), so that whoever opens the name writes here. A device stays, as /dev/full.
/// @throws OutputError where a folder is in the way, or it cannot be removed
void make_way(const fs::path& file);

/// What a file is, as far as its beginning shows: the first column of a table, the first word or bytes of others.
std::string kind_of_file(const fs::path& file);
/// That of an HTML page with our name at the end of its title.
inline constexpr const char* kOwnPage = "a page of mbtfm";

/// No program writes over what it did not make. @param kind  of what is to take the place of `file`
/// @throws OutputError if a file of another kind is there; one without content, or with a hidden name, is nobody's
void expect_own_kind(const fs::path& file, const std::string& kind);

/// Give a file that is whole its name; a link of that name is replaced, not followed.
/// @throws OutputError, also as expect_own_kind
void put_in_place(const fs::path& temporary, const fs::path& file);

}  // namespace mbtfm::files
