// Reads what a line's devices say about themselves and their PDOs, many at once. It writes nothing
// to a device. Transfers have the lowest priority (sdo::Priority::background): whoever else wants a
// device comes first.
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

// Tokens of the scanner's transfers have this bit set and bit 63 not; others' must not.
inline constexpr std::uint64_t kScanToken = std::uint64_t{1} << 62U;

class Scanner {
 public:
  // Nodes that are read at the same time.
  static constexpr std::size_t kTogether = 32;

  // Both must outlive it.
  Scanner(sdo::Arbiter& sdo, EventLog& events) : sdo_(sdo), events_(events) {}

  // Nodes first..last (1..127) but for `except`, the own one. timeout: for each answer; it is asked
  // a second time. False if a scan is under way.
  bool begin(std::uint8_t first, std::uint8_t last, std::uint8_t except, Duration timeout,
             Instant now);
  bool active() const { return !running_.empty() || next_ <= last_; }
  // Ends it: what was read of nodes that were not ready counts as broken off (0800 0000h).
  void cancel(Instant now);

  // The end of a transfer with kScanToken in its token.
  void completed(const sdo::Completion& completion, Instant now);

  // Once when a scan has ended: the nodes that answered, ascending. Each was an event before,
  // EventKind::node_scanned.
  std::optional<std::vector<ScannedNode>> take_result();

 private:
  struct Running {
    Survey survey;
    std::uint64_t token = 0;
  };

  void fill(Instant now);
  void read_next(Running& running, Instant now);
  void finish(Running& running, Instant now);

  sdo::Arbiter& sdo_;
  EventLog& events_;
  std::vector<Running> running_;
  std::vector<ScannedNode> found_;
  std::uint8_t next_ = 1;
  std::uint8_t last_ = 0;
  std::uint8_t except_ = 0;
  Duration timeout_{};
  std::uint64_t tokens_ = 0;
  bool done_ = false;
};

}  // namespace linegate::scan
