// SPDX-License-Identifier: Apache-2.0
// Shared by the targets `line` and `observer`, classical and FD: a line whose promises
// (stack/line/line.h) are checked with every call, the devices of its configuration, and the
// encoding of frames, bus events and commands in an input.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "stack/line/line.h"
#include "stack/od/description.h"

#include "tests/fuzz/input.h"

namespace linegate::fuzz {

// The nodes of the lines: 5, 6 and 7.
struct Member {
  std::uint8_t id;
  std::string_view profile;
};
inline constexpr std::array<Member, 3> kMembers{{{5, "drive"}, {6, "digital-io"}, {7, "encoder"}}};
// Read only once, because thousands of inputs use the same device files. On a line of CANopen FD
// all are of the profile fd-io.
const od::DeviceDescription& description(std::size_t member, bool fd = false);
// The second node has no heartbeat. The TPDOs of the third have a deadline.
line::NodeConfig member_node(std::size_t member, bool fd = false);

// --- forms of the input -------------------------------------------------------------------------

// Reads length and data (no data of a remote frame). The caller has set id and flags.
void read_rest(Input& input, can::Frame& frame);
// Identifier (4, LE) and flags: extended, remote, FD.
can::Frame read_strange_head(Input& input);
// Kind, state or class, counter.
can::BusEvent read_bus_event(Input& input, Instant now);
// --- the line
// -------------------------------------------------------------------------------------

class WatchedLine {
 public:
  explicit WatchedLine(line::LineConfig config);

  line::Line& line() { return *line_; }
  const line::Line& line() const { return *line_; }

  void hear(std::span<const can::Frame> frames, Instant now);
  // Sets a tag.
  void execute(line::Command command, Instant now);
  // Processes everything that is due. Expired commands must have their replies.
  void advance(Instant now);
  bool next_frame(can::Frame& out, Instant now);
  void pop_events(std::size_t count);
  void check_replies();
  void snapshot(image::Direction direction, bool merge, Instant now);
  // Call it after a stop: every command was answered, no event is missing, and all frames were
  // counted.
  void expect_end();

  // What the last scan found; empty if there was none.
  const std::vector<scan::ScannedNode>& found() const { return found_; }

 private:
  struct Asked {
    line::CommandKind kind;
    Instant deadline;
  };

  void check_event(const Event& event);
  void check_reply(const Asked& asked, const line::Reply& reply);
  void check_overdue(Instant now);

  std::unique_ptr<line::Line> line_;
  std::map<std::uint64_t, Asked> open_;  // commands without a reply yet, by tag
  std::array<image::Snapshot, 2> snapshots_;
  std::vector<scan::ScannedNode> found_;
  std::uint64_t next_tag_ = 1;
  std::uint64_t next_event_ = 1;
  std::uint64_t heard_ = 0;
  std::uint64_t sent_ = 0;
};

}  // namespace linegate::fuzz
