/// Which code this is: cmake/version.cmake finds it at each build, and one small source holds it.
#pragma once

namespace mbtfm {
extern const char* const kVersion;
}
