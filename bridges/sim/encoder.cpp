// SPDX-License-Identifier: Apache-2.0
// A multi-turn absolute encoder (CiA 406) on a shaft that turns now faster, now slower:
//   6002h  total measuring range; 6003h preset: the position becomes this value
//   6004h  position, 0..6002h - 1; 6030h sub 1 speed in units per second
// Position and speed are those of the very moment in which a PDO is sampled or an SDO reads them.
#include <cmath>
#include <numbers>

#include "bridges/sim/behaviour.h"
#include "bridges/sim/wave.h"
#include "stack/od/objects.h"

namespace linegate::sim {
namespace {

constexpr od::Address kRange{od::objects::cia406::kRange, 0};
constexpr od::Address kPreset{od::objects::cia406::kPreset, 0};
constexpr od::Address kPositionValue{od::objects::cia406::kPositionValue, 0};
constexpr od::Address kSpeed{od::objects::cia406::kSpeed, 1};

constexpr double kMeanSpeed = 2048;  // units a second: half a turn
constexpr double kSwing = 1500;
constexpr Duration kPeriod = std::chrono::seconds(8);

class Encoder final : public Behaviour {
 public:
  void before_tpdo(std::uint16_t /*number*/) override { refresh(); }

  AbortCode before_read(od::Address /*address*/, const od::Variable& /*variable*/) override {
    refresh();
    return AbortCode::none;
  }

 private:
  void set_hooks() override {
    hook(kPreset.index);
    hook(kPositionValue.index);
    hook(kSpeed.index);
  }

  void power_on() override { offset_ = 0; }

  // SDO can write 6003h alone; writing the same value presets the position again.
  void written(od::Address address) override {
    if (address == kPreset) {
      offset_ = static_cast<std::int64_t>(unsigned_value(kPreset)) - travelled();
    }
  }

  void refresh() {
    const auto range = static_cast<std::int64_t>(unsigned_value(kRange));
    const std::int64_t position = range > 0 ? (travelled() + offset_) % range : 0;
    quiet_set(kPositionValue,
              static_cast<std::uint32_t>(position < 0 ? position + range : position));
    const double speed = kMeanSpeed + kSwing * std::sin(angle());
    quiet_set(kSpeed, static_cast<std::int16_t>(std::lround(speed)));
  }

  double angle() { return 2 * std::numbers::pi * phase(now(), kPeriod, seed()); }

  // The distance: the integral of the speed.
  std::int64_t travelled() {
    const double seconds = std::chrono::duration<double>(now().time_since_epoch()).count();
    const double period = std::chrono::duration<double>(kPeriod).count();
    const double swung = -kSwing * period / (2 * std::numbers::pi) * std::cos(angle());
    return std::llround(kMeanSpeed * seconds + swung);
  }

  std::int64_t offset_ = 0;
};

}  // namespace

std::unique_ptr<Behaviour> make_encoder() {
  return std::make_unique<Encoder>();
}

}  // namespace linegate::sim
