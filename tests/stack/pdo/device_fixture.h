// SPDX-License-Identifier: Apache-2.0
// A device with an engine; the bus is a function call.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "stack/pdo/engine.h"

#include "tests/stack/pdo/devices.h"

namespace linegate::pdo::test {

inline constexpr std::uint64_t kInvalid = 0x8000'0000;  // bit 31 of a COB-ID

struct RecordingListener : Listener {
  struct WrongLength {
    std::uint16_t number;
    unsigned mapped;
    unsigned received;
    bool operator==(const WrongLength&) const = default;
  };
  void rpdo_received(std::uint16_t number, Instant) override { received.push_back(number); }
  void before_tpdo(std::uint16_t number) override { sampled.push_back(number); }
  void rpdo_wrong_length(std::uint16_t number, unsigned mapped, unsigned got) override {
    wrong_lengths.push_back({number, mapped, got});
  }
  void rpdo_deadline(std::uint16_t number) override { deadlines.push_back(number); }
  struct Unusable {
    od::Address place;
    AbortCode why;
    bool operator==(const Unusable&) const = default;
  };
  void pdo_unusable(od::Address place, AbortCode why) override { unusable.push_back({place, why}); }

  std::vector<std::uint16_t> received;
  std::vector<std::uint16_t> sampled;
  std::vector<std::uint16_t> deadlines;
  std::vector<WrongLength> wrong_lengths;
  std::vector<Unusable> unusable;
};
using Unusable = RecordingListener::Unusable;

// Objects 2000h BOOLEAN, 2001h BOOLEAN, 2002h U8, 2003h U16, 2004h U24, 2005h U32, 2006h U64 (all
// rw), 2010h U16 ro, 2011h U16 wo, 2012h U16 not mappable.
inline od::DeviceDescription plain_device() {
  od::DeviceDescription device;
  device.objects = {value(0x2000, DataType::boolean),
                    value(0x2001, DataType::boolean),
                    value(0x2002, DataType::unsigned8),
                    value(0x2003, DataType::unsigned16),
                    value(0x2004, DataType::unsigned24),
                    value(0x2005, DataType::unsigned32),
                    value(0x2006, DataType::unsigned64),
                    value(0x2010, DataType::unsigned16, Access::ro),
                    value(0x2011, DataType::unsigned16, Access::wo),
                    value(0x2012, DataType::unsigned16)};
  device.objects.back().variables[0].mappable = false;
  return device;
}

struct Device {
  explicit Device(od::DeviceDescription description)
      : dictionary(sorted(std::move(description))),
        engine(std::make_unique<Engine>(dictionary, dispatch, events, nullptr)) {
    engine->set_listener(&listener);
    diagnostics = engine->configure();
  }

  void operational(Instant now = at(0)) { engine->set_operational(true, now); }

  void receive(const can::Frame& frame) {
    for (const can::Target* target = dispatch.find(frame); target != nullptr;
         target = dispatch.next(*target)) {
      if (target->service == can::Service::rpdo) {
        engine->receive(target->index, frame);
      } else if (target->service == can::Service::tpdo_rtr && frame.remote()) {
        engine->remote_request(target->index, frame.time);
      }
    }
  }

  // All frames that are due at `now`.
  std::vector<can::Frame> sent(Instant now) {
    std::vector<can::Frame> frames;
    can::Frame frame;
    bool quiet = engine->quiet();
    while (engine->next_frame(frame, now)) {
      EXPECT_FALSE(quiet) << frame.id;
      frames.push_back(frame);
      quiet = engine->quiet();
    }
    return frames;
  }
  std::vector<std::uint32_t> sent_ids(Instant now) {
    std::vector<std::uint32_t> ids;
    for (const can::Frame& frame : sent(now)) {
      ids.push_back(frame.id);
    }
    return ids;
  }

  std::vector<Event> emitted() {
    std::vector<Event> out(64);
    out.resize(events.take(out));
    return out;
  }

  AbortCode write(std::uint16_t index, std::uint8_t sub, std::uint64_t value) {
    const auto variable = dictionary.find({index, sub});
    std::array<std::byte, 8> raw{};
    store_le(std::span<std::byte>(raw), value);
    return dictionary.write({index, sub},
                            std::span<const std::byte>(raw).first(variable ? variable->size : 4));
  }
  std::uint64_t read(std::uint16_t index, std::uint8_t sub = 0) {
    return dictionary.number({index, sub}).value_or(~std::uint64_t{0});
  }

  od::Dictionary dictionary;
  can::Dispatch dispatch;
  EventLog events;
  RecordingListener listener;
  std::unique_ptr<Engine> engine;
  std::vector<Diagnostic> diagnostics;
};

}  // namespace linegate::pdo::test
