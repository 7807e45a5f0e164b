// SPDX-License-Identifier: Apache-2.0
// Analogue inputs and outputs (CiA 401):
//   6401h  read analogue input 16-bit: 1 is a sine, 2 a ramp, 3 follows output 1, 4 is noise
//   6403h  read analogue input float: inputs 1 and 2 in volts, +-10 V being the whole range
//   6411h  write analogue output 16-bit
//   6423h  global interrupt enable: without it changes do not request a TPDO
//   6443h, 6444h  error mode and value: what outputs become when the node leaves Operational
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

#include "bridges/sim/behaviour.h"
#include "bridges/sim/wave.h"
#include "stack/od/objects.h"

namespace linegate::sim {
namespace {

namespace cia401 = od::objects::cia401;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr od::Address kInterruptEnable{cia401::kAnalogueInterrupts, 0};
constexpr std::uint8_t kOutputs = 2;

constexpr Duration kStep = milliseconds(50);
constexpr double kFullScale = 32767;
constexpr double kFullScaleVolts = 10;
// In each step, input 3 covers this fraction of its distance to output 1.
constexpr std::int64_t kLag = 4;

class AnalogIo final : public Behaviour {
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
  void power_on() override {
    operational_ = false;
    next_ = Instant{};
  }

  void step() override {
    next_ = next_period(now(), kStep);
    // Aligned to the grid, so that a device that runs late computes the same values.
    const Instant t = next_ - kStep;
    const std::array waves{sine(t, seconds(10), mix(seed(), 1)),
                           ramp(t, seconds(4), mix(seed(), 2))};
    for (std::uint8_t i = 0; i < waves.size(); ++i) {
      const auto sub = static_cast<std::uint8_t>(i + 1);
      set_input(sub, std::lround(waves[i] * kFullScale));
      update({cia401::kAnalogueInputFloats, sub},
             std::bit_cast<std::uint32_t>(static_cast<float>(waves[i] * kFullScaleVolts)));
    }
    set_input(3, follow(signed_value({cia401::kAnalogueInputs, 3}),
                        signed_value({cia401::kAnalogueOutputs, 1})));
    set_input(4, std::lround(noise(t, milliseconds(200), mix(seed(), 4)) * kFullScale / 16));
  }

  static std::int64_t follow(std::int64_t from, std::int64_t to) {
    const std::int64_t distance = to - from;
    const std::int64_t part = distance / kLag;
    return part != 0 ? from + part : to;
  }

  void set_input(std::uint8_t sub, std::int64_t value) {
    update({cia401::kAnalogueInputs, sub}, static_cast<std::int16_t>(value));
  }

  template <class T>
  void update(od::Address address, T value) {
    if (unsigned_value(kInterruptEnable) != 0) {
      set(address, value);
    } else {
      quiet_set(address, value);
    }
  }

  void outputs_to_error_value() {
    for (std::uint8_t sub = 1; sub <= kOutputs; ++sub) {
      if (unsigned_value({cia401::kAnalogueErrorMode, sub}) != 0) {
        // CiA 401 left-adjusts the error value in 32 bits for all widths.
        const std::int64_t value = signed_value({cia401::kAnalogueErrorValue, sub}) >> 16;
        quiet_set({cia401::kAnalogueOutputs, sub}, static_cast<std::int16_t>(value));
      }
    }
  }

  Instant next_{};
  bool operational_ = false;
};

}  // namespace

std::unique_ptr<Behaviour> make_analog_io() {
  return std::make_unique<AnalogIo>();
}

}  // namespace linegate::sim
