/// What every program does with its terminal: what it prints, and the signals that reach it.
#pragma once

#include <string_view>

namespace mbtfm::stage {

/// Write all of it to standard output: lists, tables, help. Where its reader has gone (`| head`), the program ends as
/// SIGPIPE ends any other.
/// @throws OutputError where it cannot be written (a full disk)
void print(std::string_view text);

enum class SecondSignal { ends_at_once, is_noted };

/// From now on Ctrl-C, SIGTERM and a closed terminal (SIGHUP, but under nohup) are noted, and the work is asked to
/// stop. Nobody who reads our messages (SIGPIPE) is no reason to: the work goes on.
void watch_signals(SecondSignal second);
bool is_stop_asked();

}  // namespace mbtfm::stage
