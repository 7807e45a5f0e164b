// SPDX-License-Identifier: Apache-2.0
// Reads identity, settings and PDO parameters of a line's devices, many at once. It writes to a
// device only if its defaults are to be restored first. Transfers have the lowest priority
// (sdo::Priority::background), so every other transfer with a device precedes them.
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

// The services that a scan needs from its line.
class Host {
 public:
  virtual ~Host() = default;
  // Sends NMT reset node, so that restored defaults take effect (CiA 301, 1011h).
  virtual void reset_node(std::uint8_t node, Instant now) = 0;
  // Reports whether the node answered the request that was sent at asked_at. The default does
  // nothing.
  virtual void asked(std::uint8_t node, bool answered, Instant asked_at, Instant now);
};

struct Options {
  std::uint8_t first = 1;  // node-IDs 1..127
  std::uint8_t last = 127;
  std::uint8_t except = 0;  // the own node-ID, which is skipped
  Duration timeout{};       // for each answer; a request that times out is repeated once
  // Before a node is read, 1011h:1 is written and the node is reset. A refusal (the node has no
  // 1011h) is reported as event sdo_abort, and the node is read unchanged.
  bool restore_defaults = false;
  std::uint32_t client = 0;  // see sdo::Request::client
};

class Scanner {
 public:
  // Number of nodes that are read at the same time.
  static constexpr std::size_t kTogether = 32;
  // The time limit for a device's answer that its defaults are restored, and again for the time
  // from its reset to its boot-up message. The node is read even if it is exceeded.
  static constexpr Duration kRestoreTime = std::chrono::seconds(3);
  static constexpr Duration kResetTime = std::chrono::seconds(3);

  // owner: of the scanner's transfers; it forwards their completions. All references must outlive
  // the scanner.
  Scanner(sdo::Arbiter& sdo, sdo::TransferOwner& owner, EventLog& events, Host& host)
      : sdo_(sdo), owner_(owner), events_(events), host_(host) {}

  // False if a scan is in progress.
  bool begin(const Options& options, Instant now);
  bool active() const { return !running_.empty() || next_ <= last_; }
  // Ends the scan: nodes that were not read completely get 0800 0000h as their result.
  void cancel(Instant now);

  // A transfer of the scan has ended.
  void completed(const sdo::Completion& completion, Instant now);

  // The node sent its boot-up message.
  void boot_up(std::uint8_t node, Instant now);
  // Whether the scan has reset the node and waits for that message.
  bool restarts(std::uint8_t node) const;
  void advance(Instant now);
  Instant next_wake() const;

  // Returns the nodes that answered, ascending, once after a scan has ended. Each was reported
  // before as event::NodeScanned.
  std::optional<std::vector<ScannedNode>> pop_result();

 private:
  struct Running {
    Survey survey;
    std::uint64_t transfer = 0;  // in progress; 0 = none
    bool restored = false;       // the restore was attempted
    Instant asked{};             // time of the last request
    Instant wake = kNever;       // when the wait for the boot-up message ends
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
