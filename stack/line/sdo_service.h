// SPDX-License-Identifier: Apache-2.0
// CommandKind::sdo_read, sdo_write, network_read and network_write: access to objects of other
// nodes by SDO. Access to the own node is local, access to another network is routed (CiA 302-7).
// Private to stack/line.
#pragma once

#include <cstdint>
#include <vector>

#include "stack/diagnosis/control_record.h"
#include "stack/image/process_image.h"
#include "stack/line/config.h"
#include "stack/line/routing_service.h"
#include "stack/line/scan_service.h"
#include "stack/line/service.h"
#include "stack/node/node.h"
#include "stack/sdo/arbiter.h"
#include "stack/sdo/write_rule.h"

namespace linegate::line {

class SdoService final : public Service, sdo::TransferOwner {
 public:
  static constexpr std::size_t kMost = 1024;  // under way, over all nodes of a line

  // The parts that it uses; all must outlive it. local: executes local_read and local_write.
  struct Parts {
    sdo::Arbiter& sdo;
    node::Node& node;
    const image::ProcessImage& image;
    const sdo::WriteRule& rule;
    RoutingService& routing;
    const FlyingMasterService& flying;
    ScanCache& cache;
    Service& local;
    const diagnosis::ControlSettings& settings;
  };
  SdoService(ServiceHost& host, const LineConfig& config, const Parts& parts)
      : Service(host), config_(config), parts_(parts) {}
  ~SdoService() override { parts_.sdo.disown(*this); }

  std::span<const CommandKind> commands() const override;
  bool needs_master() const override { return false; }
  // Answered with the value that was read, or the abort code; an object_write with WrittenBySdo.
  // Refusals: bad_request (no such node or network), wrong_role (the default SDO servers are the
  // master's), image_pdo, identifier_in_use (1005h, 1014h: of a PDO of the image), line_down, busy
  // (kMost are under way, or the queue of the node is full), timed_out. A write that ends at its
  // own time-out or with the line, and that the server may have carried out, is answered with abort
  // 0504 0000h instead of timed_out or the refusal of end().
  void execute(Command command, Instant now) override;
  void advance(Instant now) override;
  Instant next_wake() const override;
  void end(Refusal why, Instant now) override;

 private:
  // A command under way.
  struct Pending {
    std::uint64_t number = 0;  // of the SDO transfer
    std::uint8_t node = 0;     // of the transfer, on this line
    std::uint64_t tag = 0;     // of the command
    Instant deadline = kNever;
    bool is_object_write = false;
  };

  // sdo::TransferOwner
  void completed(sdo::Completion& completion, Instant now) override;

  // Ends the transfer of a command under way, and answers the command.
  void give_up(const Pending& command, Refusal why, Instant now);

  // What the commands have in common.
  struct Transfer {
    std::uint8_t node = 0;
    od::Address address{};
    bool write = false;
    std::vector<std::byte> data{};
    std::uint8_t repeats = 0;
    bool from_scan = false;
  };
  // Into another network, see NetworkRead.
  struct Way {
    std::uint16_t network = 0;
    bool as_device = false;
    std::uint8_t hops = 0;
  };

  bool answer_from_image(std::uint64_t tag, const SdoRead& request);
  bool answer_from_cache(std::uint64_t tag, const Transfer& transfer);
  void access_own(const Command& command, Transfer transfer, Instant now);
  void execute_in_network(Command& command, Instant now);
  void start(const Command& command, Transfer transfer, Instant now);
  void start_in_network(const Command& command, Way way, Transfer transfer, Instant now);
  static Duration share_of(const Command& command, const Transfer& transfer);

  const LineConfig& config_;
  Parts parts_;
  std::vector<Pending> pending_;
  std::uint64_t transfers_ = 0;  // transfer numbers assigned so far
};

}  // namespace linegate::line
