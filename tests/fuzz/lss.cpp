// SPDX-License-Identifier: Apache-2.0
// A bus with two LSS slaves, and a master that assigns node-IDs and receives requests for services.
// Forged frames reach either side, answers are lost, and devices are reset and switched off.
// Promises: no crash, no device has an invalid node-ID, only requests are answered, the master
// waits no longer than its time-out, and every procedure ends.
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/lss/assigner.h"
#include "stack/lss/procedure.h"
#include "stack/lss/slave.h"

#include "tests/fuzz/expect.h"
#include "tests/fuzz/input.h"

namespace {

using namespace linegate;

constexpr std::size_t kSteps = 400;         // largest number of steps of an input
constexpr unsigned kMostServices = 60'000;  // of a course or a round
constexpr lss::Address kFirst{0x4C47, 0x4020, 0x10000, 501};
constexpr lss::Address kSecond{0x4C47, 0x4060, 0x10000, 0x8000'0001};

struct Device final : lss::SlaveHost {
  explicit Device(const lss::Address& address) : slave(address, this) { slave.power_on(kept); }
  lss::StoreResult store(const lss::Settings& settings) override {
    if (result == lss::StoreResult::stored) {
      kept = settings;
    }
    return result;
  }
  bool has_bit_timing(std::uint8_t index) const override {
    return lss::bit_rate(index).has_value();
  }
  void use_bit_timing(std::uint8_t index, Instant) override {
    LINEGATE_EXPECT(has_bit_timing(index));
  }

  lss::Settings kept;
  lss::StoreResult result = lss::StoreResult::stored;
  lss::Slave slave;
  can::TransmitQueue answers{8};
};

bool is_node_id(std::uint8_t id) {
  return (id >= can::kMinNodeId && id <= can::kMaxNodeId) || id == lss::kNoNodeId;
}

class Bus final : lss::AssignerHost {
 public:
  explicit Bus(std::span<const std::uint8_t> bytes)
      : input_(bytes),
        assigner_({{.node = 5, .address = {kFirst[0], kFirst[1], kFirst[2], kFirst[3]}},
                   {.node = 6, .address = {kSecond[0], kSecond[1], std::nullopt, std::nullopt}},
                   {.node = 7, .address = {kSecond[0], kSecond[1], std::nullopt, 9}}},
                  {.store = true, .bit_timing = 3}, *this) {}

  void run() {
    for (std::size_t i = 0; i < kSteps && !input_.empty(); ++i) {
      step();
      check();
    }
    finish();
  }

 private:
  bool is_present(std::uint8_t node) const override { return (present_ >> (node % 8U) & 1U) != 0; }
  bool is_watched(std::uint8_t node) const override { return (present_ >> (node % 8U) & 2U) != 0; }

  void step() {
    const std::uint8_t what = input_.byte();
    Device& device = devices_[what >> 7U];
    switch (what & 0x0FU) {
      case 0:
        (void)device.slave.receive(stranger(lss::kMasterId), device.answers);
        break;
      case 1:
        (void)master_.receive(stranger(lss::kSlaveId));
        break;
      case 2:
        begin_course();
        break;
      case 3:
        assigner_.begin();
        break;
      case 4:
        assigner_.end_early();
        break;
      case 5:
        (void)device.slave.reset(input_.flag());
        break;
      case 6:
        device.slave.power_on(device.kept);
        break;
      case 7:
        device.result = static_cast<lss::StoreResult>(input_.byte() % 4U);
        break;
      case 8:
        device.slave.stored(input_.flag(), device.answers);
        break;
      case 9:
        present_ = input_.byte();
        break;
      default:
        service(input_.byte());
        break;
    }
  }

  can::Frame stranger(std::uint32_t id) {
    can::Frame frame;
    frame.id = id;
    frame.time = now_;
    const std::uint8_t shape = input_.byte();
    frame.length = shape == 0xFF ? std::uint8_t{7} : std::uint8_t{8};
    frame.data[0] = std::byte{shape};
    for (std::size_t i = 1; i < frame.length; ++i) {
      frame.data[i] = std::byte{input_.byte()};
    }
    return frame;
  }

  void begin_course() {
    const auto procedure = static_cast<lss::Procedure>(input_.byte() % lss::kProcedures);
    const std::vector<std::byte> arguments = input_.bytes(input_.byte() % 32U);
    auto made = lss::Course::make(procedure, arguments);
    if (made && !assigner_.active()) {
      course_ = std::move(made);
    }
  }

  // Runs the next service of the procedure in progress, if there is one. lost: bit mask of the
  // devices whose frames are lost; its highest bit: whether the node-ID to check is in use.
  void service(std::uint8_t lost) {
    if (course_ && course_->over()) {
      LINEGATE_EXPECT(course_->reply().size() >= lss::kReplyHead);
      course_.reset();
    }
    if (!course_ && !assigner_.active()) {
      return;
    }
    if (!course_ && assigner_.node_to_check()) {
      LINEGATE_EXPECT(*assigner_.node_to_check() >= 5 && *assigner_.node_to_check() <= 7);
      assigner_.checked((lost & 0x80U) == 0);
      return;
    }
    LINEGATE_EXPECT(master_.start(course_ ? course_->request() : assigner_.request()));
    exchange(lost);
    const auto answer = master_.take();
    LINEGATE_EXPECT(answer.has_value() && !master_.busy());
    if (course_) {
      course_->answered(*answer);
    } else {
      assigner_.answered(*answer);
    }
    while (const auto finding = assigner_.take()) {
      LINEGATE_EXPECT(finding->address || finding->verdict == lss::Verdict::nobody_found);
    }
  }

  void exchange(std::uint8_t lost) {
    can::Frame frame;
    while (master_.next_frame(frame, now_)) {
      frame.time = now_;
      for (std::size_t i = 0; i < devices_.size(); ++i) {
        if ((lost >> i & 1U) == 0) {
          (void)devices_[i].slave.receive(frame, devices_[i].answers);
        }
      }
    }
    for (std::size_t i = 0; i < devices_.size(); ++i) {
      while (devices_[i].answers.pop(frame)) {
        LINEGATE_EXPECT(frame.id == lss::kSlaveId && frame.length == 8);
        if ((lost >> (2 + i) & 1U) == 0) {
          LINEGATE_EXPECT(master_.receive(frame));
        }
      }
    }
    if (master_.busy()) {
      LINEGATE_EXPECT(master_.next_wake() != kNever &&
                      master_.next_wake() <= now_ + lss::kStoreTime);
      now_ = master_.next_wake();
      master_.advance(now_);
    }
    for (Device& device : devices_) {
      device.slave.advance(now_);
      if (device.slave.pop_reset()) {
        (void)device.slave.reset(false);
      }
    }
  }

  void check() const {
    for (const Device& device : devices_) {
      LINEGATE_EXPECT(is_node_id(device.slave.active_node_id()));
      LINEGATE_EXPECT(is_node_id(device.slave.pending().node_id));
      LINEGATE_EXPECT(is_node_id(device.slave.persistent().node_id));
    }
  }

  // On a bus without losses every procedure ends.
  void finish() {
    for (unsigned i = 0; course_ || assigner_.active(); ++i) {
      LINEGATE_EXPECT(i < kMostServices);
      service(0);
      check();
    }
  }

  fuzz::Input input_;
  std::array<Device, 2> devices_{Device(kFirst), Device(kSecond)};
  lss::Master master_;
  lss::Assigner assigner_;
  std::optional<lss::Course> course_;
  Instant now_{std::chrono::seconds(1)};
  std::uint8_t present_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bus({data, size}).run();
  return 0;
}
