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
    report(kForeignNegotiation, frame.id, 0, frame.time);
    return;
  }
  if (const auto control = nmt::decode_node_control(frame)) {
    report(kForeignCommand, static_cast<std::uint32_t>(control->command), control->node,
           frame.time);
  }
}

void ForeignManager::report(std::uint32_t code, std::uint32_t value, std::uint8_t addressed,
                            Instant now) {
  Instant& reported = told_[code];
  if (reported != Instant{} && now - reported < kInterval) {
    return;
  }
  reported = now;
  Event event{
      .time = now, .kind = EventKind::foreign_manager, .length = 1, .code = code, .value = value};
  event.data[0] = std::byte{addressed};
  events_.emit(event);
}

}  // namespace linegate::diagnosis
