// SPDX-License-Identifier: Apache-2.0
#include "stack/lss/slave.h"

#include <utility>

#include "stack/base/assert.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"

namespace linegate::lss {
namespace {

constexpr std::uint8_t kBitTimingTable = 0;  // standard bit timing table of CiA 305
constexpr std::uint8_t kHighestBit = 31;
constexpr unsigned kIdentifyFields = 6;

void answer(can::TransmitQueue& out, Command command, std::uint32_t number = 0) {
  // The lowest transmit class, because 7E4h has the lowest priority on the bus.
  (void)out.push(can::TransmitClass::error_control,
                 encode(kSlaveId, {.command = command, .number = number}));
}

bool is_valid_node_id(std::uint8_t id) {
  return (id >= can::kMinNodeId && id <= can::kMaxNodeId) || id == kNoNodeId;
}

}  // namespace

StoreResult SlaveHost::store(const Settings& /*settings*/) {
  return StoreResult::unsupported;
}
bool SlaveHost::has_bit_timing(std::uint8_t /*index*/) const {
  return false;
}
void SlaveHost::use_bit_timing(std::uint8_t /*index*/, Instant /*now*/) {
}

void Slave::power_on(const Settings& kept) {
  LINEGATE_ASSERT(host_ != nullptr || kept.bit_timing == kNoBitTiming,
                  "a device that keeps a bit timing can switch to it");
  persistent_ = kept;
  state_ = SlaveState::waiting;
  selected_ = identified_ = position_ = 0;
  reset_wanted_ = storing_ = false;
  phase_ = Phase::none;
  wake_ = kNever;
  reset(true);
}

std::uint8_t Slave::reset(bool whole_node) {
  if (whole_node) {
    pending_ = persistent_;
  }
  active_ = pending_.node_id;
  reset_wanted_ = false;
  return active_;
}

bool Slave::pop_reset() {
  return std::exchange(reset_wanted_, false);
}

bool Slave::receive(const can::Frame& frame, can::TransmitQueue& out) {
  if (silent()) {
    return true;  // ignored, as if the bit rate were already different
  }
  const auto request = decode(frame);
  const bool good = request && serve(*request, frame.time, out);
  malformed_ += good ? 0U : 1U;
  return good;
}

bool Slave::serve(const Message& request, Instant now, can::TransmitQueue& out) {
  switch (request.command) {
    case Command::switch_global:
      return switch_global(request.byte1());
    case Command::select_vendor:
    case Command::select_product:
    case Command::select_revision:
    case Command::select_serial:
      select(request, out);
      return true;
    case Command::identify_vendor:
    case Command::identify_product:
    case Command::identify_revision_low:
    case Command::identify_revision_high:
    case Command::identify_serial_low:
    case Command::identify_serial_high:
      identify(request, out);
      return true;
    case Command::identify_unconfigured:
      if (unconfigured()) {
        answer(out, Command::unconfigured);
      }
      return true;
    case Command::fastscan:
      return fastscan(request, out);
    default:
      return state_ != SlaveState::configuration || serve_configuration(request, now, out);
  }
}

bool Slave::serve_configuration(const Message& request, Instant now, can::TransmitQueue& out) {
  switch (request.command) {
    case Command::configure_node_id:
      configure_node_id(request.byte1(), out);
      return true;
    case Command::configure_bit_timing:
      configure_bit_timing(request, out);
      return true;
    case Command::activate_bit_timing:
      activate(static_cast<std::uint16_t>(request.number), now);
      return true;
    case Command::store:
      store(out);
      return true;
    case Command::inquire_vendor:
    case Command::inquire_product:
    case Command::inquire_revision:
    case Command::inquire_serial:
      answer(out, request.command,
             address_[static_cast<std::size_t>(request.command) -
                      static_cast<std::size_t>(Command::inquire_vendor)]);
      return true;
    case Command::inquire_node_id:
      answer(out, request.command, active_);
      return true;
    default:
      return true;
  }
}

bool Slave::switch_global(std::uint8_t mode) {
  if (mode > 1) {
    return false;
  }
  const SlaveState before =
      std::exchange(state_, mode == 0 ? SlaveState::waiting : SlaveState::configuration);
  selected_ = identified_ = 0;
  if (mode == 0 && before == SlaveState::configuration && active_ == kNoNodeId &&
      pending_.node_id != kNoNodeId) {
    reset_wanted_ = !faults_.boots_at_reset;
  }
  return true;
}

// The four parts must arrive in order.
void Slave::select(const Message& request, can::TransmitQueue& out) {
  const auto part = static_cast<std::uint8_t>(static_cast<unsigned>(request.command) -
                                              static_cast<unsigned>(Command::select_vendor));
  if (state_ != SlaveState::waiting) {
    return;
  }
  const bool expected = part == 0 || selected_ == part;
  selected_ = expected && request.number == address_[part] ? static_cast<std::uint8_t>(part + 1)
                                                           : std::uint8_t{0};
  if (selected_ == kParts) {
    selected_ = 0;
    state_ = SlaveState::configuration;
    answer(out, Command::selected);
  }
}

// The six parts must arrive in order.
void Slave::identify(const Message& request, can::TransmitQueue& out) {
  const auto field = static_cast<std::uint8_t>(static_cast<unsigned>(request.command) -
                                               static_cast<unsigned>(Command::identify_vendor));
  bool fits = false;
  switch (request.command) {
    case Command::identify_vendor:
      fits = request.number == address_[kVendor];
      break;
    case Command::identify_product:
      fits = request.number == address_[kProduct];
      break;
    case Command::identify_revision_low:
      fits = request.number <= address_[kRevision];
      break;
    case Command::identify_revision_high:
      fits = request.number >= address_[kRevision];
      break;
    case Command::identify_serial_low:
      fits = request.number <= address_[kSerial];
      break;
    default:
      fits = request.number >= address_[kSerial];
      break;
  }
  const bool expected = field == 0 || identified_ == field;
  identified_ = expected && fits ? static_cast<std::uint8_t>(field + 1) : std::uint8_t{0};
  if (identified_ == kIdentifyFields) {
    identified_ = 0;
    answer(out, Command::identified);
  }
}

bool Slave::fastscan(const Message& request, can::TransmitQueue& out) {
  const auto [bit_check, sub, next_sub] = request.rest;
  if ((bit_check > kHighestBit && bit_check != kScanBegins) || sub >= kParts ||
      next_sub >= kParts) {
    return false;
  }
  const bool answers = state_ == SlaveState::waiting || faults_.answers_in_configuration;
  if (!answers || !unconfigured()) {
    return true;
  }
  if (bit_check == kScanBegins) {
    position_ = 0;
    answer(out, Command::identified);
    return true;
  }
  if (position_ != sub || ((request.number ^ address_[sub]) >> bit_check) != 0) {
    return true;
  }
  position_ = next_sub;
  answer(out, Command::identified);
  if (bit_check == 0 && next_sub < sub) {
    state_ = SlaveState::configuration;
  }
  return true;
}

void Slave::configure_node_id(std::uint8_t node_id, can::TransmitQueue& out) {
  if (faults_.takes_no_node_id) {
    return;
  }
  if (!is_valid_node_id(node_id)) {
    answer(out, Command::configure_node_id, kRefused);
    return;
  }
  pending_.node_id = node_id;
  answer(out, Command::configure_node_id, kDone);
}

void Slave::configure_bit_timing(const Message& request, can::TransmitQueue& out) {
  const bool known = request.byte1() == kBitTimingTable && host_ != nullptr &&
                     host_->has_bit_timing(request.byte2());
  if (known) {
    pending_.bit_timing = request.byte2();
  }
  answer(out, Command::configure_bit_timing, known ? kDone : kRefused);
}

void Slave::activate(std::uint16_t delay_ms, Instant now) {
  if (pending_.bit_timing == kNoBitTiming) {
    return;  // no bit timing was configured
  }
  activated_ = pending_.bit_timing;
  delay_ = std::chrono::milliseconds(delay_ms);
  phase_ = Phase::before_switch;
  wake_ = deadline(now, delay_);
}

void Slave::advance(Instant now) {
  if (now < wake_) {
    return;
  }
  LINEGATE_ASSERT(silent(), "the bit rate is being switched");
  if (phase_ == Phase::before_switch) {
    phase_ = Phase::after_switch;
    host_->use_bit_timing(activated_, now);
    wake_ = deadline(now, delay_);
    return;
  }
  phase_ = Phase::none;
  wake_ = kNever;
}

void Slave::store(can::TransmitQueue& out) {
  if (storing_) {
    return;  // CiA 305 has no error code for it: the answer to the first request serves both
  }
  to_store_ = pending_;
  const StoreResult result = host_ != nullptr ? host_->store(to_store_) : StoreResult::unsupported;
  if (result == StoreResult::later) {
    storing_ = true;
  } else if (result == StoreResult::unsupported) {
    answer(out, Command::store, kRefused);
  } else {
    storing_ = true;
    stored(result == StoreResult::stored, out);
  }
}

void Slave::stored(bool good, can::TransmitQueue& out) {
  if (!std::exchange(storing_, false)) {
    return;
  }
  if (good) {
    persistent_ = to_store_;
  }
  answer(out, Command::store, good ? kDone : kMediumFailed);
}

}  // namespace linegate::lss
