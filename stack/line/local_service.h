// SPDX-License-Identifier: Apache-2.0
// CommandKind::local_read, local_write and object_create: the own dictionary, accessed by an
// application of this process. Private to stack/line.
#pragma once

#include <cstdint>
#include <vector>

#include "stack/line/config.h"
#include "stack/line/own_objects.h"
#include "stack/line/service.h"
#include "stack/od/dictionary.h"

namespace linegate::line {

class LocalService final : public Service {
 public:
  // dictionary: of the own node. All must outlive the service.
  LocalService(ServiceHost& host, od::Dictionary& dictionary, OwnObjects& own_objects,
               const LineConfig& config)
      : Service(host), dictionary_(dictionary), own_objects_(own_objects), config_(config) {}

  std::span<const CommandKind> commands() const override;
  bool needs_master() const override { return false; }
  // local_read and local_write: answered with the SDO abort code of the dictionary. A write to an
  // object whose owner answers later is answered then. Refusals: bad_request (the node has no
  // list), and those of OwnObjects.
  void execute(Command command, Instant now) override;
  void advance(Instant now) override;
  // The owners of the objects finish waiting writes, with an event or a write.
  Instant next_wake() const override { return kNever; }
  void end(Refusal why, Instant now) override;

 private:
  // A write that the owner of the object answers later.
  struct Write {
    od::Ticket ticket = 0;
    std::uint64_t tag = 0;  // of the command
    std::vector<std::byte> data;
  };

  void read(std::uint64_t tag, const LocalRead& request);
  void write(std::uint64_t tag, LocalWrite request);
  Error create_object(ObjectCreate request);
  Error list_device_file(std::uint8_t node, ObjectRange range, ReplyData& data) const;

  od::Dictionary& dictionary_;
  OwnObjects& own_objects_;
  const LineConfig& config_;
  std::vector<Write> writes_;
};

}  // namespace linegate::line
