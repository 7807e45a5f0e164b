// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/foreign_manager.h"

#include "stack/nmt/node_control.h"

namespace linegate::diagnosis {
namespace {

constexpr std::uint16_t kFirstOfNegotiation = 0x071;
constexpr std::uint16_t kLastOfNegotiation = 0x076;

}  // namespace

ForeignManager::ForeignManager(can::Dispatch& dispatch, EventLog& events) : events_(events) {
  for (std::uint16_t id = kFirstOfNegotiation; id <= kLastOfNegotiation; ++id) {
    dispatch.add(id, false, can::Service::nmt, id);
  }
}

void ForeignManager::receive(std::uint16_t index, const can::Frame& frame) {
  if (index != 0) {
    report({.evidence = event::ManagerEvidence::flying_master, .identifier = frame.id}, frame.time);
    return;
  }
  if (const auto control = nmt::decode_node_control(frame)) {
    report({.evidence = event::ManagerEvidence::nmt_command,
            .command = control->command,
            .addressee = control->node},
           frame.time);
  }
}

void ForeignManager::report(const event::ForeignManager& what, Instant now) {
  Instant& reported = reported_[static_cast<std::size_t>(what.evidence)];
  if (reported != Instant{} && now - reported < kInterval) {
    return;
  }
  reported = now;
  events_.emit({.time = now, .data = what});
}

}  // namespace linegate::diagnosis
