// SPDX-License-Identifier: Apache-2.0
// The input is a sequence of steps: frames to a node that has every service of CiA 301 except the
// manager's, transfers of its clients, calls of its application, time. Promises: no crash, time
// advances, events have no gaps, every sent frame is a valid classical CAN frame, every transfer
// ends once, and after power-on the node answers.
#include "stack/node/node.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/node/sdo_clients.h"
#include "stack/sdo/client.h"
#include "stack/storage/medium.h"
#include "stack/storage/parameters.h"

#include "tests/fuzz/expect.h"
#include "tests/fuzz/input.h"
#include "tests/stack/node/objects.h"

namespace {

using namespace linegate;
using enum od::DataType;
using fuzz::Input;
using std::chrono::milliseconds;
using testing::array;
using testing::object;
using testing::record;
using testing::sub;

constexpr std::uint8_t kNode = 5;
constexpr unsigned kMostSteps = 2000;
// A larger number of calls at one instant means that the node never becomes idle.
constexpr unsigned kMostTurns = 1000;

// The first byte of a step, modulo the number of steps.
enum class Step : std::uint8_t {
  frame,     // which identifier, length, data
  strange,   // identifier (4, LE), flags, length, data: extended, remote
  remote,    // which identifier
  download,  // index (2, LE), sub, length (1 to 4), data: expedited, by SDO
  pass,      // milliseconds
  send,      // number of frames
  client,    // number of the client, index (2, LE), sub, size; 0: a read
  trigger,   // kind, number
  error,     // code (2, LE), whether it begins or ends
  bus,       // kind, state, count
  hold,      // on or off
  refuse,    // whether the application permits state operational
  power_on,
};
constexpr unsigned kSteps = 13;

// Identifiers that the node receives. Those of PDOs and SDO servers are as in the dictionary.
constexpr std::array<std::uint32_t, 24> kIds{
    0x000, 0x080, 0x081, 0x085, 0x087, 0x100, 0x185, 0x187, 0x201, 0x205, 0x285, 0x301,
    0x305, 0x401, 0x501, 0x583, 0x587, 0x605, 0x607, 0x6C0, 0x705, 0x707, 0x708, 0x77F};

od::ObjectDescription communication(std::uint16_t index, std::uint32_t cob_id, std::uint8_t type) {
  return record(index, {sub(0, unsigned8, 6, od::Access::constant), sub(1, unsigned32, cob_id),
                        sub(2, unsigned8, type), sub(3, unsigned16, 0), sub(5, unsigned16, 0),
                        sub(6, unsigned8, 0)});
}

od::ObjectDescription mapping(std::uint16_t index, std::uint8_t count,
                              std::array<std::uint32_t, 4> entries) {
  return record(index, {sub(0, unsigned8, count), sub(1, unsigned32, entries[0]),
                        sub(2, unsigned32, entries[1]), sub(3, unsigned32, entries[2]),
                        sub(4, unsigned32, entries[3])});
}

od::ObjectDescription sdo_parameter(std::uint16_t index, std::uint32_t request,
                                    std::uint32_t response) {
  return record(index, {sub(0, unsigned8, 3, od::Access::constant), sub(1, unsigned32, request),
                        sub(2, unsigned32, response), sub(3, unsigned8, 7)});
}

void add_communication(od::DeviceDescription& device) {
  device.objects = {
      array(0x1003, unsigned32, 4, 0, sub(0, unsigned8, 0)),
      object(0x1005, unsigned32, 0x80),
      object(0x1006, unsigned32, 0),
      object(0x1007, unsigned32, 0),
      object(0x100C, unsigned16, 100),
      object(0x100D, unsigned8, 3),
      array(0x1010, unsigned32, 4),
      array(0x1011, unsigned32, 4),
      object(0x1012, unsigned32, 0x8000'0100),
      object(0x1013, unsigned32, 0),
      object(0x1014, unsigned32, 0x85),
      object(0x1015, unsigned16, 0),
      record(0x1016, {sub(0, unsigned8, 2, od::Access::constant), sub(1, unsigned32, 0x0007'0064),
                      sub(2, unsigned32, 0)}),
      object(0x1017, unsigned16, 0),
      object(0x1019, unsigned8, 0),
      array(0x1020, unsigned32, 2),
      record(0x1028, {sub(0, unsigned8, 2, od::Access::constant), sub(1, unsigned32, 0x87),
                      sub(2, unsigned32, 0x8000'0000)}),
      array(0x1029, unsigned8, 2),
      sdo_parameter(0x1200, 0x605, 0x585),
      sdo_parameter(0x1201, 0x6C0, 0x5C0 - 0x100),
      sdo_parameter(0x1202, 0x8000'0000, 0x8000'0000),
      sdo_parameter(0x1280, 0x603, 0x583),
      sdo_parameter(0x1281, 0x607, 0x587),
  };
}

// RPDOs: event-driven, synchronous, and MPDOs in destination and source address mode. TPDOs:
// event-driven, cyclic, on request, and an MPDO in each mode.
void add_pdos(od::DeviceDescription& device) {
  const std::vector<od::ObjectDescription> pdos = {
      communication(0x1400, 0x205, 255),
      communication(0x1401, 0x305, 1),
      communication(0x1402, 0x401, 255),
      communication(0x1403, 0x501, 255),
      mapping(0x1600, 2, {0x2000'0110, 0x0005'0008, 0, 0}),
      mapping(0x1601, 1, {0x2000'0210, 0, 0, 0}),
      mapping(0x1602, 255, {}),
      mapping(0x1603, 254, {}),
      communication(0x1800, 0x185, 255),
      communication(0x1801, 0x285, 1),
      communication(0x1802, 0x4000'0385, 253),
      communication(0x1803, 0x485, 255),
      communication(0x1804, 0x2123'4567, 254),
      mapping(0x1A00, 2, {0x2001'0110, 0x2002'0001, 0, 0}),
      mapping(0x1A01, 1, {0x2001'0210, 0, 0, 0}),
      mapping(0x1A02, 1, {0x2001'0310, 0, 0, 0}),
      mapping(0x1A03, 255, {0x2001'0110, 0, 0, 0}),
      mapping(0x1A04, 254, {})};
  device.objects.insert(device.objects.end(), pdos.begin(), pdos.end());
  device.objects.push_back(object(0x1F80, unsigned32, 0));
  device.objects.push_back(array(0x1FA0, unsigned32, 4, 0x02'2001'01));
  device.objects.push_back(array(0x1FD0, unsigned64, 2, 0x02'2000'01'3000'01'07));
}

od::DeviceDescription description() {
  od::DeviceDescription device;
  add_communication(device);
  add_pdos(device);
  const auto values = [](std::uint16_t index, od::Access access) {
    od::ObjectDescription out = array(index, unsigned16, 3);
    for (od::VariableDescription& variable : out.variables) {
      variable.access = variable.sub == 0 ? od::Access::constant : access;
      variable.mappable = variable.sub != 0;
    }
    return out;
  };
  device.objects.push_back(values(0x2000, od::Access::rww));
  device.objects.push_back(values(0x2001, od::Access::rwr));
  device.objects.push_back(object(0x2002, boolean, 0, od::Access::rw, true));
  device.objects.push_back(object(0x2003, visible_string, 0));
  device.objects.push_back(object(0x2004, domain, 0));
  storage::mark_parameters(device);
  return device;
}

struct Careful final : node::Application {
  bool may_operate(Instant /*now*/) override { return operates; }
  bool operates = true;
};

class Run {
 public:
  explicit Run(Input input) : input_(input) {
    node_.set_application(&application_);
    node_.set_medium(&medium_);
    node_.start(now_);
  }

  void all() {
    for (unsigned steps = 0; !input_.empty() && steps < kMostSteps; ++steps) {
      step(static_cast<Step>(input_.byte() % kSteps));
      check_outcomes();
      pop_events();
    }
    finish();
  }

 private:
  void step(Step step) {
    switch (step) {
      case Step::frame:
        return hear(data_frame(identifier()));
      case Step::strange:
        return strange();
      case Step::remote:
        return remote();
      case Step::download:
        return download();
      case Step::pass:
        return pass(milliseconds(input_.byte()));
      case Step::send:
        send(input_.byte());
        return;
      case Step::client:
        return client();
      case Step::trigger:
        return trigger();
      case Step::error:
        return error();
      case Step::bus:
        return bus();
      case Step::hold:
        input_.flag() ? node_.pdos().hold() : node_.pdos().release(now_);
        return;
      case Step::refuse:
        application_.operates = input_.flag();
        return;
      case Step::power_on:
        node_.start(now_);
        return;
    }
  }

  std::uint32_t identifier() { return kIds[input_.byte() % kIds.size()]; }

  void hear(can::Frame frame) {
    frame.time = now_;
    node_.receive(std::span(&frame, 1));
  }

  can::Frame data_frame(std::uint32_t id) {
    can::Frame frame;
    frame.id = id;
    frame.length = input_.byte() % 9;
    const auto bytes = input_.bytes(frame.length);
    std::ranges::copy(bytes, frame.data.begin());
    return frame;
  }

  void strange() {
    const std::uint32_t low = input_.word();
    const std::uint32_t id = low | static_cast<std::uint32_t>(input_.word()) << 16U;
    const std::uint8_t flags = input_.byte();
    can::Frame frame = data_frame(0);
    frame.flags = flags & (can::Frame::kExtended | can::Frame::kRemote);
    frame.id = id & (frame.extended() ? 0x1FFF'FFFFU : 0x7FFU);
    hear(frame);
  }

  void remote() {
    can::Frame frame;
    frame.id = identifier();
    frame.flags = can::Frame::kRemote;
    hear(frame);
  }

  void download() {
    can::Frame frame;
    frame.id = can::kSdoRequestBase + kNode;
    frame.length = can::kMaxClassicData;
    const std::uint16_t index = input_.word();
    const std::uint8_t sub_index = input_.byte();
    const unsigned size = 1U + input_.byte() % 4U;
    frame.data[0] = static_cast<std::byte>(0x23U | (4 - size) << 2U);
    frame.data[1] = static_cast<std::byte>(index);
    frame.data[2] = static_cast<std::byte>(index >> 8U);
    frame.data[3] = std::byte{sub_index};
    const auto bytes = input_.bytes(size);
    std::ranges::copy(bytes, frame.data.begin() + 4);
    hear(frame);
  }

  // A transfer of the client of 1280h or 1281h.
  void client() {
    const unsigned which = input_.byte() % kClients;
    const std::uint16_t index = input_.word();
    const od::Address address{index, input_.byte()};
    std::vector<std::byte> value(input_.byte());
    const auto client = node_.sdo_clients().client(static_cast<std::uint16_t>(which + 1));
    if (!client.ok() || open_[which]) {
      return;
    }
    open_[which] = true;
    if (value.empty()) {
      (*client)->read(address, kTimeout, now_, node_.transmit());
    } else {
      (*client)->write(address, std::move(value), kTimeout, now_, node_.transmit());
    }
  }

  // Each transfer ends once: there is never an outcome without a transfer.
  void check_outcomes() {
    for (unsigned which = 0; which < kClients; ++which) {
      const auto client = node_.sdo_clients().client(static_cast<std::uint16_t>(which + 1));
      if (client.ok() && (*client)->take()) {
        LINEGATE_EXPECT(open_[which]);
        open_[which] = false;
      }
    }
  }

  void trigger() {
    const std::uint8_t what = input_.byte() % 5;
    const std::uint8_t number = input_.byte();
    switch (what) {
      case 0:
        (void)node_.pdos().trigger(number, now_);
        return;
      case 1:
        (void)node_.pdos().request_rpdo(number);
        return;
      case 2:
        (void)node_.pdos().send_mpdo(number, kNode + 1, {0x3000, 1});
        return;
      case 3:
        (void)node_.pdos().send_mpdo({0x2001, number});
        return;
      default:
        (void)node_.dictionary().set({0x2001, number}, input_.word());
        node_.pdos().value_changed({0x2001, number}, now_);
        return;
    }
  }

  void bus() {
    can::BusEvent event;
    event.kind = static_cast<can::BusEvent::Kind>(input_.byte() % 5);
    event.state = static_cast<can::BusState>(input_.byte() % 7);
    event.count = input_.byte();
    event.time = now_;
    node_.bus_event(event);
  }

  void error() {
    const std::uint16_t code = input_.word();
    if (input_.flag()) {
      (void)node_.set_error(code, input_.bytes(3), now_);
    } else {
      (void)node_.reset_error(code, {}, now_);
    }
  }

  void advance() {
    for (unsigned turns = 0; turns == 0 || node_.next_wake() <= now_; ++turns) {
      LINEGATE_EXPECT(turns < kMostTurns);
      node_.advance(now_);
    }
  }

  void pass(Duration time) {
    const Instant until = now_ + time;
    advance();
    send(~0U);
    while (node_.next_wake() <= until) {
      now_ = std::max(now_, node_.next_wake());
      advance();
      send(~0U);
    }
    now_ = until;
    advance();
  }

  // Sends at most `frames` frames. Returns whether one of them had the identifier `wanted`.
  bool send(unsigned frames, std::uint32_t wanted = ~0U) {
    bool seen = false;
    can::Frame frame;
    for (unsigned i = 0; i < frames; ++i) {
      const bool announced = node_.wants_to_send(now_);
      const bool given = node_.next_frame(frame, now_);
      LINEGATE_EXPECT(announced == given);
      if (!given) {
        break;
      }
      LINEGATE_EXPECT(i < 100 * kMostTurns && !frame.fd() && frame.length <= can::kMaxClassicData);
      LINEGATE_EXPECT(frame.id <= (frame.extended() ? 0x1FFF'FFFFU : 0x7FFU));
      seen = seen || frame.id == wanted;
    }
    return seen;
  }

  void pop_events() {
    std::array<Event, 16> events;
    while (const std::size_t count = log_.take(events)) {
      for (const Event& event : std::span(events).first(count)) {
        LINEGATE_EXPECT(static_cast<std::size_t>(event.kind()) < kEventKinds);
        LINEGATE_EXPECT(event.node < 128);
        LINEGATE_EXPECT(event.number >= next_event_);
        next_event_ = event.number + 1;
      }
    }
  }

  // Stored parameters may have any value. Without them the node has its factory settings.
  void finish() {
    pass(std::chrono::seconds(2));
    check_outcomes();
    node_.set_medium(nullptr);
    node_.start(now_);
    send(~0U);
    can::Frame frame = can::make_frame(can::kSdoRequestBase + kNode,
                                       {0x40, 0x00, 0x10, 0x00, 0x00, 0x00, 0x00, 0x00});
    hear(frame);
    LINEGATE_EXPECT(send(~0U, can::kSdoResponseBase + kNode));
  }

  static constexpr unsigned kClients = 2;
  static constexpr Duration kTimeout = milliseconds(50);

  EventLog log_{64};
  storage::MemoryMedium medium_;
  Careful application_;
  node::Node node_{od::Dictionary(description()), node::Options{.node_id = kNode}, log_, nullptr};
  Input input_;
  Instant now_{std::chrono::seconds(1)};
  std::array<bool, kClients> open_{};
  std::uint64_t next_event_ = 1;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Run(Input({data, size})).all();
  return 0;
}
