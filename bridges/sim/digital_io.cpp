// SPDX-License-Identifier: Apache-2.0
// Digital inputs and outputs (CiA 401):
//   6000h  read input 8-bit: byte 1 counts, 2 mirrors output byte 1, 3 is random, 4 a running light
//   6020h  read input bit: the bits of input byte 1
//   6200h  write output 8-bit
//   6206h, 6207h  error mode and value: what outputs become when the node leaves Operational
#include <utility>

#include "bridges/sim/behaviour.h"
#include "bridges/sim/wave.h"
#include "stack/od/objects.h"

namespace linegate::sim {
namespace {

namespace cia401 = od::objects::cia401;
using std::chrono::milliseconds;

constexpr std::uint8_t kOutputBytes = 2;

constexpr Duration kCount = milliseconds(250);
constexpr Duration kRandom = milliseconds(1000);
constexpr Duration kLight = milliseconds(500);

class DigitalIo final : public Behaviour {
 public:
  Instant next_step() const override { return next_; }

  void state_changed(nmt::State state, Instant now) override {
    const bool operational = state == nmt::State::operational;
    if (std::exchange(operational_, operational) && !operational) {
      set_time(now);
      outputs_to_error_value();
    }
  }

 private:
  void set_hooks() override { hook(cia401::kDigitalOutputs); }

  void power_on() override {
    operational_ = false;
    next_ = Instant{};
  }

  void react() override {
    set({cia401::kDigitalInputs, 2},
        static_cast<std::uint8_t>(unsigned_value({cia401::kDigitalOutputs, 1})));
  }

  void step() override {
    next_ = next_period(now(), kCount);
    const auto offset = static_cast<std::int64_t>(mix(seed(), 1) & 0xFFU);
    set_counter(static_cast<std::uint8_t>(periods(now(), kCount) + offset));
    const auto round = static_cast<std::uint64_t>(periods(now(), kRandom));
    set({cia401::kDigitalInputs, 3}, static_cast<std::uint8_t>(mix(seed(), round)));
    set({cia401::kDigitalInputs, 4}, static_cast<std::uint8_t>(1U << (periods(now(), kLight) % 8)));
    react();
  }

  void set_counter(std::uint8_t value) {
    set({cia401::kDigitalInputs, 1}, value);
    for (std::uint8_t bit = 0; bit < 8; ++bit) {
      set({cia401::kDigitalInputBits, static_cast<std::uint8_t>(bit + 1)},
          static_cast<std::uint8_t>((unsigned{value} >> bit) & 1U));
    }
  }

  void outputs_to_error_value() {
    for (std::uint8_t sub = 1; sub <= kOutputBytes; ++sub) {
      const std::uint64_t mode = unsigned_value({cia401::kDigitalErrorMode, sub});
      const std::uint64_t value = unsigned_value({cia401::kDigitalErrorValue, sub});
      const std::uint64_t output = unsigned_value({cia401::kDigitalOutputs, sub});
      quiet_set({cia401::kDigitalOutputs, sub},
                static_cast<std::uint8_t>((output & ~mode) | (value & mode)));
    }
    react();
  }

  Instant next_{};
  bool operational_ = false;
};

}  // namespace

std::unique_ptr<Behaviour> make_digital_io() {
  return std::make_unique<DigitalIo>();
}

}  // namespace linegate::sim
