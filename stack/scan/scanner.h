// SPDX-License-Identifier: Apache-2.0
// Reads what a line's devices say about themselves and their PDOs, many at once. It writes nothing
// to a device unless it is asked to restore their defaults first. Transfers have the lowest
// priority (sdo::Priority::background): whoever else wants a device comes first.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/scan/scanned_node.h"
#include "stack/scan/survey.h"
#include "stack/sdo/arbiter.h"

namespace linegate::scan {

// What a scan asks of the line it belongs to.
class Host {
 public:
  virtual ~Host() = default;
  // Sends NMT reset node, so that restored defaults come into force (CiA 301, 1011h).
  virtual void reset_node(std::uint8_t node, Instant now) = 0;
  // The node answered what it was asked at asked_at, or did not. Does nothing unless it is
  // overridden.
  virtual void asked(std::uint8_t node, bool answered, Instant asked_at, Instant now);
};

struct Options {
  std::uint8_t first = 1;  // node-IDs 1..127
  std::uint8_t last = 127;
  std::uint8_t except = 0;  // the own one
  Duration timeout{};       // for each answer; it is asked a second time
  // Before a node is read, 1011h:1 is written and the node reset. One that refuses (it has no
  // 1011h) is an event sdo_abort, and is read as it is.
  bool restore_defaults = false;
};

class Scanner {
 public:
  // Nodes that are read at the same time.
  static constexpr std::size_t kTogether = 32;
  // A device may take so long to answer that its defaults are restored, and so long from its reset
  // to its boot-up message; then it is read all the same.
  static constexpr Duration kRestoreTime = std::chrono::seconds(3);
  static constexpr Duration kResetTime = std::chrono::seconds(3);

  // owner: of its transfers; hands on their ends. All must outlive it.
  Scanner(sdo::Arbiter& sdo, sdo::TransferOwner& owner, EventLog& events, Host& host)
      : sdo_(sdo), owner_(owner), events_(events), host_(host) {}

  // False if a scan is under way.
  bool begin(const Options& options, Instant now);
  bool active() const { return !running_.empty() || next_ <= last_; }
  // Ends it: what was read of nodes that were not ready counts as broken off (0800 0000h).
  void cancel(Instant now);

  // The end of a transfer.
  void completed(const sdo::Completion& completion, Instant now);

  // The node's boot-up message came.
  void boot_up(std::uint8_t node, Instant now);
  void advance(Instant now);
  Instant next_wake() const;

  // Once when a scan has ended: the nodes that answered, ascending. Each was an event before,
  // EventKind::node_scanned.
  std::optional<std::vector<ScannedNode>> take_result();

 private:
  struct Running {
    Survey survey;
    std::uint64_t transfer = 0;  // under way; 0 = none
    bool restored = false;       // it was tried
    Instant asked{};             // the last question
    Instant wake = kNever;       // when waiting for the boot-up message ends
  };

  void fill(Instant now);
  void go_on(Running& running, Instant now);
  void restore(Running& running, Instant now);
  void restored(Running& running, AbortCode outcome, Instant now);
  void submit(Running& running, sdo::Request request, Instant now);
  void read_next(Running& running, Instant now);
  void finish(Running& running, Instant now);

  sdo::Arbiter& sdo_;
  sdo::TransferOwner& owner_;
  EventLog& events_;
  Host& host_;
  std::vector<Running> running_;
  std::vector<ScannedNode> found_;
  Options options_;
  std::uint8_t next_ = 1;
  std::uint8_t last_ = 0;
  std::uint64_t transfers_ = 0;
  bool done_ = false;
};

}  // namespace linegate::scan
