// SPDX-License-Identifier: Apache-2.0
// The channel "replay:FILE": the frames of a candump log, received now.
//
//   replay:press.log                       with the timing of the log
//   replay:press.log?speed=max             as fast as they can be read; also speed=0.1 to
//   speed=1000 replay:press.log?interface=can0        frames of one interface, from a log of
//   several
//
// The first frame is received when the channel is ready. Error frames become bus events. Frames
// sent to such a channel are discarded. At the end of the log the interface fails permanently with
// ENODATA.
#pragma once

#include <memory>
#include <string>

#include "bridges/can/channel.h"
#include "bridges/can/interface_uri.h"

namespace linegate::can_bridge {

struct ReplayOptions {
  double speed = 1;       // times as fast as recorded; 0 = as fast as possible
  std::string interface;  // replay only frames of this interface; empty = all
};

struct ParsedReplay {
  ReplayOptions options;
  std::string error;  // empty, or an error message
};
ParsedReplay replay_options(const InterfaceUri& uri);

// Never fails: the first read() reports a file that cannot be opened, and it is retried. Malformed
// lines are skipped and counted as malformed; check_log() finds them beforehand. read() may block
// on the disk.
std::unique_ptr<Channel> open_replay(std::string path, const ReplayOptions& options);

}  // namespace linegate::can_bridge
