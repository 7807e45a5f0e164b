// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/error_frame.h"

#include <array>

#include <linux/can/error.h>

#include "stack/base/assert.h"

namespace linegate::can_bridge {
namespace {

using can::BusEvent;
using can::BusState;

constexpr std::uint8_t kOverflow = CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW;
constexpr std::uint8_t kPassive = CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE;
constexpr std::uint8_t kWarning = CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING;

struct Row {
  std::uint32_t kernel;
  std::uint32_t ours;
};
constexpr std::array<Row, 7> kRows{{{CAN_ERR_TX_TIMEOUT, can::kTxTimeout},
                                    {CAN_ERR_LOSTARB, can::kLostArbitration},
                                    {CAN_ERR_PROT, can::kProtocol},
                                    {CAN_ERR_BUSERROR, can::kProtocol},
                                    {CAN_ERR_TRX, can::kTransceiver},
                                    {CAN_ERR_ACK, can::kNoAcknowledge},
                                    {CAN_ERR_RESTARTED, can::kRestarted}}};

// The error classes that are independent of the bus state.
std::uint32_t error_bits(const canfd_frame& raw) {
  std::uint32_t bits = 0;
  for (const Row& row : kRows) {
    bits |= (raw.can_id & row.kernel) != 0 ? row.ours : 0U;
  }
  if ((raw.can_id & CAN_ERR_CRTL) != 0 && (raw.data[1] & kOverflow) != 0) {
    bits |= can::kController;
  }
  return bits;
}

BusState reported_state(const canfd_frame& raw, BusState before) {
  if ((raw.can_id & CAN_ERR_BUSOFF) != 0) {
    return BusState::bus_off;
  }
  if ((raw.can_id & CAN_ERR_CRTL) != 0) {
    if ((raw.data[1] & kPassive) != 0) {
      return BusState::error_passive;
    }
    if ((raw.data[1] & kWarning) != 0) {
      return BusState::error_warning;
    }
    if ((raw.data[1] & CAN_ERR_CRTL_ACTIVE) != 0) {
      return BusState::error_active;
    }
  }
  return (raw.can_id & CAN_ERR_RESTARTED) != 0 ? BusState::error_active : before;
}

void encode_state(BusState state, canfd_frame& raw) {
  switch (state) {
    case BusState::bus_off:
      raw.can_id |= CAN_ERR_BUSOFF;
      return;
    case BusState::error_passive:
      raw.data[1] = kPassive;
      break;
    case BusState::error_warning:
      raw.data[1] = kWarning;
      break;
    default:
      raw.data[1] = CAN_ERR_CRTL_ACTIVE;
      break;
  }
  raw.can_id |= CAN_ERR_CRTL;
}

void encode_errors(std::uint32_t errors, canfd_frame& raw) {
  for (const Row& row : kRows) {
    // Where two classes of the kernel map to one class here, the first is used.
    raw.can_id |= (errors & row.ours) != 0 && row.kernel != CAN_ERR_BUSERROR ? row.kernel : 0;
  }
  if ((errors & can::kController) != 0) {
    raw.can_id |= CAN_ERR_CRTL;
    raw.data[1] |= CAN_ERR_CRTL_TX_OVERFLOW;
  }
}

}  // namespace

bool encode_error(const BusEvent& event, canfd_frame& raw) {
  const bool state = event.kind == BusEvent::Kind::state && event.state >= BusState::error_active &&
                     event.state <= BusState::bus_off;
  if (!state && (event.kind != BusEvent::Kind::error || event.errors == 0)) {
    return false;
  }
  raw = {};
  raw.can_id = CAN_ERR_FLAG | CAN_ERR_CNT;
  raw.len = CAN_ERR_DLC;
  raw.data[6] = event.transmit_errors;
  raw.data[7] = event.receive_errors;
  if (state) {
    encode_state(event.state, raw);
  } else {
    encode_errors(event.errors, raw);
  }
  return true;
}

void ErrorDecoder::decode(const canfd_frame& raw, Instant time, BusEvents& events) {
  LINEGATE_ASSERT((raw.can_id & CAN_ERR_FLAG) != 0, "a frame of the bus reports no error");
  // Older drivers fill in the counters with a controller problem without setting the flag.
  if ((raw.can_id & (CAN_ERR_CNT | CAN_ERR_CRTL)) != 0) {
    transmit_errors_ = raw.data[6];
    receive_errors_ = raw.data[7];
  }
  BusEvent event;
  event.time = time;
  event.state = state_;
  event.transmit_errors = transmit_errors_;
  event.receive_errors = receive_errors_;
  event.errors = error_bits(raw);
  event.count = 1;
  if (event.errors != 0) {
    event.kind = BusEvent::Kind::error;
    events.push(event);
  }
  if ((raw.can_id & CAN_ERR_CRTL) != 0 && (raw.data[1] & CAN_ERR_CRTL_RX_OVERFLOW) != 0) {
    event.kind = BusEvent::Kind::frames_lost;
    event.errors = 0;
    events.push(event);
  }
  change(reported_state(raw, state_), time, events);
}

void ErrorDecoder::set_state(BusState state, Instant time, BusEvents& events) {
  if (state != state_) {
    transmit_errors_ = 0;
    receive_errors_ = 0;
  }
  change(state, time, events);
}

void ErrorDecoder::change(BusState state, Instant time, BusEvents& events) {
  if (state == state_) {
    return;
  }
  state_ = state;
  BusEvent event;
  event.kind = BusEvent::Kind::state;
  event.state = state;
  event.transmit_errors = transmit_errors_;
  event.receive_errors = receive_errors_;
  event.time = time;
  events.push(event);
}

}  // namespace linegate::can_bridge
