// SPDX-License-Identifier: Apache-2.0
// A servo drive (CiA 402): the state automaton, and an axis that moves towards its target.
//   6040h controlword, 6041h statusword, 6060h/6061h modes of operation: 1 profile position,
//   3 profile velocity, 8 and 9 cyclic synchronous position and velocity
//   607Ah target position, 60FFh target velocity, 6064h position, 606Ch velocity
//   6081h profile velocity, 6083h profile acceleration, 605Ah quick stop, 6007h abort connection
//   603Fh error code; 2000h (ours): writing an error code causes that fault
#include <cmath>
#include <utility>

#include "bridges/sim/behaviour.h"
#include "bridges/sim/drive_motion.h"
#include "bridges/sim/drive_state.h"
#include "bridges/sim/wave.h"
#include "stack/emcy/producer.h"
#include "stack/od/objects.h"

namespace linegate::sim {
namespace {

constexpr od::Address kSimulatedFault{0x2000, 0};
constexpr od::Address kAbortConnection{od::objects::cia402::kAbortConnectionOption, 0};
constexpr od::Address kErrorCode{od::objects::cia402::kErrorCode, 0};
constexpr od::Address kControlword{od::objects::cia402::kControlword, 0};
constexpr od::Address kStatusword{od::objects::cia402::kStatusword, 0};
constexpr od::Address kQuickStopOption{od::objects::cia402::kQuickStopOption, 0};
constexpr od::Address kMode{od::objects::cia402::kMode, 0};
constexpr od::Address kModeDisplay{od::objects::cia402::kModeDisplay, 0};
constexpr od::Address kPosition{od::objects::cia402::kPosition, 0};
constexpr od::Address kVelocity{od::objects::cia402::kVelocity, 0};
constexpr od::Address kTargetPosition{od::objects::cia402::kTargetPosition, 0};
constexpr od::Address kProfileVelocity{od::objects::cia402::kProfileVelocity, 0};
constexpr od::Address kProfileAcceleration{od::objects::cia402::kProfileAcceleration, 0};
constexpr od::Address kTargetVelocity{od::objects::cia402::kTargetVelocity, 0};

enum class Mode : std::int8_t {
  none = 0,
  profile_position = 1,
  profile_velocity = 3,
  cyclic_position = 8,
  cyclic_velocity = 9,
};

// Controlword
constexpr std::uint16_t kNewSetPoint = 0x0010;
constexpr std::uint16_t kRelative = 0x0040;
constexpr std::uint16_t kHalt = 0x0100;
// Statusword
constexpr std::uint16_t kRemote = 0x0200;
constexpr std::uint16_t kTargetReached = 0x0400;
constexpr std::uint16_t kModeSpecific = 1U << 12U;

// Quick stop option codes up to this one lead to switch on disabled; greater ones stay in quick
// stop active.
constexpr std::int64_t kLastQuickStopThatDisables = 4;
// If run() is called later than this, the axis stands still in between.
constexpr int kMostStepsAtOnce = 100;

constexpr std::uint16_t kConnectionLost = 0x8130;

// The error register for an error code (CiA 301 7.5.2.2): its class bit and the generic one.
std::uint8_t error_register(std::uint16_t code) {
  switch (code >> 12U) {
    case 0x2:
      return 0x03;
    case 0x3:
      return 0x05;
    case 0x4:
      return 0x09;
    case 0x8:
      return 0x11;
    default:
      return 0x01;
  }
}

class Drive final : public Behaviour {
 public:
  Instant next_step() const override { return next_; }

  void state_changed(nmt::State state, Instant now) override {
    const bool operational = state == nmt::State::operational;
    if (std::exchange(operational_, operational) && !operational) {
      set_time(now);
      connection_aborted();
    }
  }

 private:
  void set_hooks() override {
    for (const od::Address address :
         {kSimulatedFault, kControlword, kMode, kTargetPosition, kTargetVelocity}) {
      hook(address.index);
    }
  }

  void power_on() override {
    state_ = DriveState::switch_on_disabled;
    motion_ = DriveMotion{};
    control_ = 0;
    operational_ = false;
    target_ = 0;
    acknowledged_ = false;
    next_ = kNever;
    apply_mode();
    show();
  }

  void react() override {
    const auto code = static_cast<std::uint16_t>(unsigned_value(kSimulatedFault));
    if (code != 0) {
      quiet_set(kSimulatedFault, std::uint16_t{0});
      fault(code);
    }
    apply_mode();
    const auto control = static_cast<std::uint16_t>(unsigned_value(kControlword));
    const std::uint16_t before = std::exchange(control_, control);
    command(drive_command(control, before));
    apply_set_point((control & kNewSetPoint) != 0 && (before & kNewSetPoint) == 0);
    show();
  }

  void step() override {
    for (int i = 0; i < kMostStepsAtOnce && next_ <= now(); ++i) {
      move();
      next_ = powered() ? next_ + DriveMotion::kStep : kNever;
    }
    if (next_ <= now()) {
      next_ = next_period(now(), DriveMotion::kStep);
    }
    show();
  }

  // --- states -----------------------------------------------------------------------------------

  bool powered() const {
    return state_ == DriveState::operation_enabled || state_ == DriveState::quick_stop_active;
  }

  void command(DriveCommand command) {
    const DriveState before = state_;
    state_ = after(state_, command);
    if (state_ == DriveState::quick_stop_active && signed_value(kQuickStopOption) == 0) {
      state_ = DriveState::switch_on_disabled;
    }
    if (state_ == before) {
      return;
    }
    if (before == DriveState::fault) {
      quiet_set(kErrorCode, std::uint16_t{0});
      node().emcy().send(0, 0, {}, now());
    }
    if (state_ == DriveState::operation_enabled) {
      hold_position();
    }
    update_motion();
  }

  // No step without voltage; the first step follows one period after power-up.
  void update_motion() {
    if (!powered()) {
      motion_.halt();
      next_ = kNever;
    } else if (next_ == kNever) {
      next_ = now() + DriveMotion::kStep;
    }
  }

  void fault(std::uint16_t code) {
    if (state_ == DriveState::fault) {
      return;
    }
    state_ = DriveState::fault;
    set(kErrorCode, code);
    node().emcy().send(code, error_register(code), {}, now());
    update_motion();
  }

  void connection_aborted() {
    switch (signed_value(kAbortConnection)) {
      case 1:
        fault(kConnectionLost);
        break;
      case 2:
        command(DriveCommand::disable_voltage);
        break;
      case 3:
        command(DriveCommand::quick_stop);
        break;
      default:
        break;
    }
    show();
  }

  // --- modes and motion -------------------------------------------------------------------------

  void apply_mode() {
    const auto wanted = static_cast<Mode>(signed_value(kMode));
    switch (wanted) {
      case Mode::none:
      case Mode::profile_position:
      case Mode::profile_velocity:
      case Mode::cyclic_position:
      case Mode::cyclic_velocity:
        if (wanted != mode_) {
          mode_ = wanted;
          hold_position();
        }
        break;
    }
  }

  void hold_position() { target_ = std::round(motion_.position()); }

  void apply_set_point(bool rising) {
    if ((control_ & kNewSetPoint) == 0) {
      acknowledged_ = false;
    }
    if (rising && mode_ == Mode::profile_position && state_ == DriveState::operation_enabled) {
      const auto value = static_cast<double>(signed_value(kTargetPosition));
      target_ = (control_ & kRelative) != 0 ? target_ + value : value;
      acknowledged_ = true;
    }
  }

  void move() {
    const DriveMotion::Limits limits{static_cast<double>(unsigned_value(kProfileVelocity)),
                                     static_cast<double>(unsigned_value(kProfileAcceleration))};
    if (state_ == DriveState::quick_stop_active) {
      motion_.step_to_velocity(0, limits);
      if (motion_.velocity() == 0 && signed_value(kQuickStopOption) <= kLastQuickStopThatDisables) {
        state_ = DriveState::switch_on_disabled;
      }
      return;
    }
    if ((control_ & kHalt) != 0 || mode_ == Mode::none) {
      motion_.step_to_velocity(0, limits);
      return;
    }
    if (mode_ == Mode::profile_velocity || mode_ == Mode::cyclic_velocity) {
      motion_.step_to_velocity(static_cast<double>(signed_value(kTargetVelocity)), limits);
      return;
    }
    if (mode_ == Mode::cyclic_position) {
      target_ = static_cast<double>(signed_value(kTargetPosition));
    }
    motion_.step_to_position(target_, limits);
  }

  // --- published values -------------------------------------------------------------------------

  bool reached() {
    if (state_ != DriveState::operation_enabled) {
      return false;
    }
    switch (mode_) {
      case Mode::profile_position:
      case Mode::cyclic_position:
        return motion_.position() == target_;
      case Mode::profile_velocity:
      case Mode::cyclic_velocity:
        return motion_.velocity() == static_cast<double>(signed_value(kTargetVelocity));
      case Mode::none:
        break;
    }
    return false;
  }

  bool mode_specific() const {
    switch (mode_) {
      case Mode::profile_position:
        return acknowledged_;
      case Mode::profile_velocity:
        return motion_.velocity() == 0;
      case Mode::cyclic_position:
      case Mode::cyclic_velocity:
        return state_ == DriveState::operation_enabled;
      case Mode::none:
        break;
    }
    return false;
  }

  void show() {
    std::uint32_t status = status_bits(state_) | kRemote;
    status |= reached() ? kTargetReached : 0U;
    status |= powered() && mode_specific() ? kModeSpecific : 0U;
    set(position_, static_cast<std::int32_t>(std::llround(motion_.position())));
    set(velocity_, static_cast<std::int32_t>(std::llround(motion_.velocity())));
    set(mode_display_, static_cast<std::int8_t>(mode_));
    set(statusword_, static_cast<std::uint16_t>(status));
  }

  DriveState state_ = DriveState::switch_on_disabled;
  DriveMotion motion_;
  Mode mode_ = Mode::none;
  std::uint16_t control_ = 0;
  double target_ = 0;
  bool acknowledged_ = false;
  bool operational_ = false;
  Instant next_ = kNever;
  FrequentValue position_{kPosition};
  FrequentValue velocity_{kVelocity};
  FrequentValue mode_display_{kModeDisplay};
  FrequentValue statusword_{kStatusword};
};

}  // namespace

std::unique_ptr<Behaviour> make_drive() {
  return std::make_unique<Drive>();
}

}  // namespace linegate::sim
