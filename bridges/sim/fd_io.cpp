// SPDX-License-Identifier: Apache-2.0
// 64 bytes of digital inputs and outputs (CiA 401), which one PDO of CANopen FD carries:
//   6000h  read input 8-bit: byte 1 counts, the others mirror the output bytes with their number
//   6200h  write output 8-bit
#include "bridges/sim/behaviour.h"
#include "bridges/sim/wave.h"
#include "stack/od/objects.h"

namespace linegate::sim {
namespace {

constexpr std::uint8_t kFdIoBytes = 64;
constexpr Duration kFdIoCount = std::chrono::milliseconds(250);

class FdIo final : public Behaviour {
 public:
  Instant next_step() const override { return next_; }

 private:
  void set_hooks() override { hook(od::objects::cia401::kDigitalOutputs); }
  void power_on() override { next_ = Instant{}; }

  void react() override {
    for (std::uint8_t sub = 2; sub <= kFdIoBytes; ++sub) {
      set({od::objects::cia401::kDigitalInputs, sub},
          static_cast<std::uint8_t>(unsigned_value({od::objects::cia401::kDigitalOutputs, sub})));
    }
  }

  void step() override {
    next_ = next_period(now(), kFdIoCount);
    set({od::objects::cia401::kDigitalInputs, 1},
        static_cast<std::uint8_t>(periods(now(), kFdIoCount)));
    react();
  }

  Instant next_{};
};

}  // namespace

std::unique_ptr<Behaviour> make_fd_io() {
  return std::make_unique<FdIo>();
}

}  // namespace linegate::sim
