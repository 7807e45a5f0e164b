// SPDX-License-Identifier: Apache-2.0
// CommandKind::scan and scan_apply: reads the identity and the PDOs of devices by SDO, and keeps
// the results for later reads. One scan at a time. Private to stack/line.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/line/config.h"
#include "stack/line/service.h"
#include "stack/manager/manager.h"
#include "stack/scan/scanner.h"

namespace linegate::line {

class DiagnosisService;
class RecordService;

// The values that scans read from other nodes, for services that may answer with them.
class ScanCache {
 public:
  ScanCache() = default;
  ScanCache(const ScanCache&) = delete;
  ScanCache& operator=(const ScanCache&) = delete;
  virtual ~ScanCache() = default;

  // The value of the object that a scan read; nullptr if there is none.
  virtual const std::vector<std::byte>* cached(std::uint8_t node, od::Address address) const = 0;
  // The object was written: its value is discarded.
  virtual void forget_cached(std::uint8_t node, od::Address address) = 0;
};

class ScanService final : public Service, public ScanCache, sdo::TransferOwner, scan::Host {
 public:
  // The parts that it uses; all must outlive it. The services are not used before the first call.
  struct Parts {
    sdo::Arbiter& sdo;
    manager::Manager& manager;
    manager::Host& nmt;            // sends NMT commands
    DiagnosisService& diagnosing;  // is notified when a scan begins and ends
    const RecordService& records;  // settings
    EventLog& events;
  };
  // config must outlive it.
  ScanService(ServiceHost& host, const LineConfig& config, const Parts& parts);
  ~ScanService() override { parts_.sdo.disown(*this); }

  std::span<const CommandKind> commands() const override;
  // Answered with a scan::ScannedNode of each node. Refusals: bad_request (no such node, or the own
  // node), wrong_role, wrong_state (scan_apply: nodes are configured that no scan found),
  // line_down, busy (another scan is under way), timed_out.
  void execute(Command command, Instant now) override;
  void advance(Instant now) override;
  Instant next_wake() const override;
  void end(Refusal why, Instant now) override;

  // Begins a scan without a command, whose results are only cached. node: 0 = all except the own
  // node. client: as Command::client. Returns false if a scan is under way.
  bool begin(std::uint8_t node, Instant now, std::uint32_t client = 0);
  bool active() const { return scanner_.active(); }
  // Whether a scan of all nodes is under way.
  bool scans_all() const { return of_all_ && scanner_.active(); }
  // The boot-up message of a node was received.
  void boot_up(std::uint8_t node, Instant now) { scanner_.boot_up(node, now); }
  // Whether the scan has reset the node and waits for its boot-up message.
  bool restarts(std::uint8_t node) const { return scanner_.restarts(node); }
  // Whose command the scan is, see sdo::Pace; 0 = nobody's.
  std::uint32_t client() const { return client_; }

  const std::vector<std::byte>* cached(std::uint8_t node, od::Address address) const override;
  void forget_cached(std::uint8_t node, od::Address address) override;

 private:
  // sdo::TransferOwner
  void completed(sdo::Completion& completion, Instant now) override;
  // scan::Host
  void reset_node(std::uint8_t node, Instant now) override;
  void asked(std::uint8_t node, bool answered, Instant asked_at, Instant now) override;

  Refusal check(const Command& command) const;
  bool begin(const ScanApply& request, std::uint32_t client, Instant now);
  void conclude();
  void cache(std::vector<scan::ScannedNode> found);
  void expire(Instant now);

  const LineConfig& config_;
  Parts parts_;
  scan::Scanner scanner_;
  std::optional<std::uint64_t> tag_;  // of the command under way
  std::uint32_t client_ = 0;          // whose command it is
  bool of_all_ = false;
  bool sets_up_ = false;  // ScanApply::set_up
  Instant deadline_ = kNever;
  std::vector<scan::ScannedNode> cache_;  // ascending by id
};

}  // namespace linegate::line
