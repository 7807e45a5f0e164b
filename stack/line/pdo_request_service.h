// SPDX-License-Identifier: Apache-2.0
// CommandKind::pdo_request: PDOs that are requested with a remote frame (CiA 301 7.2.2.3.2), each
// answered when the PDO was received. Private to stack/line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stack/image/process_image.h"
#include "stack/line/flying_master_service.h"
#include "stack/line/service.h"
#include "stack/node/node.h"
#include "stack/pdo/link.h"

namespace linegate::line {

class PdoRequestService final : public Service {
 public:
  static constexpr std::size_t kMost = 256;  // requests under way

  // timeout: of a command that has none. All must outlive the service.
  PdoRequestService(ServiceHost& host, node::Node& node, const image::ProcessImage& image,
                    const pdo::LinkPlan& plan, const FlyingMasterService& flying, Duration timeout)
      : Service(host),
        node_(node),
        image_(image),
        plan_(plan),
        flying_(flying),
        timeout_(timeout) {}

  std::span<const CommandKind> commands() const override;
  bool needs_master() const override { return false; }
  // Refusals: line_down, wrong_state (the own node is not Operational), unknown_entry (no such
  // PDO), busy (kMost are under way), bad_request (it cannot be requested), timed_out, wrong_role
  // (another flying master is active).
  void execute(Command command, Instant now) override;
  void advance(Instant now) override;
  Instant next_wake() const override;
  void end(Refusal why, Instant now) override;

  // Whether requests are under way. The reception of a PDO does not mark the services of a line as
  // dirty, so advance() is called in each round while this is true.
  bool active() const { return !requests_.empty(); }

 private:
  struct Request {
    std::uint64_t tag = 0;  // of the command
    std::uint16_t rpdo = 0;
    Instant begun{};
    Instant deadline = kNever;
  };

  std::uint16_t named_rpdo(const PdoRequest& request) const;
  Refusal request(std::uint16_t rpdo);

  node::Node& node_;
  const image::ProcessImage& image_;
  const pdo::LinkPlan& plan_;
  const FlyingMasterService& flying_;
  const Duration timeout_;
  std::vector<Request> requests_;
};

}  // namespace linegate::line
