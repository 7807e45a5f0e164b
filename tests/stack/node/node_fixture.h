// SPDX-License-Identifier: Apache-2.0
// A whole node in virtual time.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "stack/emcy/producer.h"
#include "stack/node/node.h"

#include "tests/stack/node/objects.h"

namespace linegate::node {

using namespace std::chrono_literals;
using testing::at;
using testing::frame_at;

inline constexpr std::uint8_t kNodeId = 5;

struct Sent {
  Instant time;
  std::uint32_t id = 0;
  std::vector<int> data;

  friend bool operator==(const Sent&, const Sent&) = default;
};

inline void PrintTo(const Sent& sent, std::ostream* out) {
  *out << std::chrono::duration_cast<std::chrono::microseconds>(sent.time - at(0us)).count()
       << "us " << std::hex << sent.id << " [";
  for (const int byte : sent.data) {
    *out << ' ' << byte;
  }
  *out << " ]" << std::dec;
}

// 2000h and 2001h are application values. RPDO 1 (205h, type 255) and RPDO 2 (305h, type 1) fill
// 2000h:1 and 2; TPDO 1 (185h, type 1) sends 2001h:1, TPDO 2 (285h, type 255) sends 2001h:2.
inline od::Dictionary example_dictionary() {
  using enum od::DataType;
  const auto pdo = [](std::uint16_t index, std::uint32_t cob_id, std::uint8_t type) {
    return testing::record(index,
                           {testing::sub(0, unsigned8, 5, od::Access::constant),
                            testing::sub(1, unsigned32, cob_id), testing::sub(2, unsigned8, type),
                            testing::sub(3, unsigned16, 0), testing::sub(5, unsigned16, 0)});
  };
  const auto mapping = [](std::uint16_t index, std::uint32_t entry) {
    return testing::record(index,
                           {testing::sub(0, unsigned8, 1), testing::sub(1, unsigned32, entry)});
  };
  const auto values = [](std::uint16_t index, od::Access access) {
    return testing::record(index, {testing::sub(0, unsigned8, 2, od::Access::constant),
                                   testing::sub(1, unsigned16, 0x1111, access, true),
                                   testing::sub(2, unsigned16, 0x2222, access, true)});
  };
  return testing::dictionary_of(
      {testing::array(0x1003, unsigned32, 4, 0, testing::sub(0, unsigned8, 0)),
       testing::object(0x1005, unsigned32, 0x80),
       testing::object(0x1006, unsigned32, 0),
       testing::object(0x1007, unsigned32, 0),
       testing::object(0x1012, unsigned32, 0x8000'0100),
       testing::object(0x1014, unsigned32, 0x80 + kNodeId),
       testing::object(0x1015, unsigned16, 0),
       testing::array(0x1016, unsigned32, 3),
       testing::object(0x1017, unsigned16, 0),
       testing::object(0x1019, unsigned8, 0),
       testing::array(0x1028, unsigned32, 10, 0x8000'0000),
       testing::array(0x1029, unsigned8, 1),
       pdo(0x1400, 0x205, 255),
       pdo(0x1401, 0x305, 1),
       mapping(0x1600, 0x2000'0110),
       mapping(0x1601, 0x2000'0210),
       pdo(0x1800, 0x4000'0185, 1),
       pdo(0x1801, 0x0000'0285, 255),
       mapping(0x1A00, 0x2001'0110),
       mapping(0x1A01, 0x2001'0210),
       values(0x2000, od::Access::rww),
       values(0x2001, od::Access::rwr)});
}

class NodeTest : public ::testing::Test {
 protected:
  explicit NodeTest(Options options = {kNodeId, false, true})
      : node(std::make_unique<Node>(example_dictionary(), options, events, nullptr)) {}

  // Boots at at(0); the boot-up message has been sent.
  void boot() {
    node->start(at(0ms));
    drain(at(0ms));
    testing::pop_events(events);
  }
  void boot_and_start() {
    boot();
    nmt(0x01);
    drain(at(0ms));
    testing::pop_events(events);
  }

  void hear(Duration when, std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    const can::Frame frame = frame_at(at(when), id, data);
    node->receive({&frame, 1});
  }
  void nmt(std::uint8_t specifier, std::uint8_t target = kNodeId, Duration when = 0ms) {
    hear(when, 0x000, {specifier, target});
  }
  // Expedited SDO download of 1 to 4 bytes. Returns the abort code of the response, 0 if confirmed,
  // nothing if there was no response.
  std::optional<std::uint32_t> sdo_write(od::Address address, std::uint8_t bytes,
                                         std::uint32_t value, Duration when = 0ms) {
    hear(when, 0x600 + kNodeId,
         {static_cast<std::uint8_t>(0x23 | (4 - bytes) << 2),
          static_cast<std::uint8_t>(address.index), static_cast<std::uint8_t>(address.index >> 8),
          address.sub, static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8),
          static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 24)});
    std::optional<std::uint32_t> result;
    for (const Sent& sent : drain(at(when))) {
      if (sent.id != 0x580 + kNodeId) {
        others.push_back(sent);
        continue;
      }
      std::uint32_t code = 0;
      for (std::size_t i = 8; i > 4; --i) {
        code = code << 8 | static_cast<std::uint32_t>(sent.data[i - 1]);
      }
      result = sent.data[0] == 0x60 ? 0 : code;
    }
    return result;
  }

  std::vector<Sent> drain(Instant now) {
    std::vector<Sent> out;
    can::Frame frame;
    while (node->next_frame(frame, now)) {
      out.push_back({now, frame.id, testing::data_of(frame)});
    }
    return out;
  }
  std::vector<Sent> advance(Duration when) {
    node->advance(at(when));
    return drain(at(when));
  }

  std::vector<EventKind> kinds() {
    std::vector<EventKind> out;
    for (const Event& event : testing::pop_events(events)) {
      out.push_back(event.kind());
    }
    return out;
  }
  std::uint64_t number(std::uint16_t index, std::uint8_t sub) {
    return node->dictionary().number({index, sub}).value_or(~std::uint64_t{0});
  }

  EventLog events;
  std::unique_ptr<Node> node;
  std::vector<Sent> others;  // frames sent along with the responses to sdo_write()
};

}  // namespace linegate::node
