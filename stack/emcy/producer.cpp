// SPDX-License-Identifier: Apache-2.0
#include "stack/emcy/producer.h"

#include <algorithm>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"

namespace linegate::emcy {
namespace {

constexpr Duration kInhibitUnit = std::chrono::microseconds(100);

}  // namespace

Producer::Producer(od::Dictionary& dictionary, can::TransmitQueue& transmit, EventLog& events,
                   std::uint8_t node_id)
    : dictionary_(dictionary),
      transmit_(transmit),
      events_(events),
      node_id_(node_id),
      history_(dictionary) {
}

void Producer::listen_for_others(can::Dispatch& dispatch, std::uint16_t index) {
  dispatch_ = &dispatch;
  index_ = index;
  follow_cob_id();
}

void Producer::configure() {
  follow_cob_id();
  waiting_ = 0;
  inhibited_until_ = Instant{};
}

SendResult Producer::send(std::uint16_t code, std::uint8_t error_register,
                          std::span<const std::byte> info, Instant now) {
  Message message{code, error_register, {}, {}};
  if (time_of_day_) {
    message.fd = fd_fields(code, now);
  }
  std::ranges::copy(info.first(std::min(info.size(), message.info.size())), message.info.begin());
  dictionary_.set({od::objects::kErrorRegister, 0}, error_register);
  if (code != kErrorReset) {
    history_.add(message);
  }
  return relay(message, now);
}

event::FdEmcy Producer::fd_fields(std::uint16_t code, Instant now) const {
  const std::uint64_t device_type = dictionary_.number({od::objects::kDeviceType, 0}).value_or(0);
  return {.any = true,
          .status = code == kErrorReset ? std::uint8_t{0} : kStatusActive,
          .profile = static_cast<std::uint16_t>(device_type),
          .time_of_day = time_of_day_(now)};
}

SendResult Producer::relay(const Message& message, Instant now) {
  if (!active_ || !can::is_usable(cob_id())) {
    return SendResult::disabled;
  }
  advance(now);
  newest_ = encode(message, cob_id());
  if (waiting_ == 0 && now >= inhibited_until_) {
    return transmit(message, now) ? SendResult::sent : SendResult::inhibited;
  }
  if (waiting_ == ring_.size()) {
    return SendResult::inhibited;
  }
  ring_[(head_ + waiting_) % ring_.size()] = message;
  ++waiting_;
  return SendResult::queued;
}

bool Producer::waits(const can::Frame& frame) const {
  for (std::size_t i = 0; i < waiting_; ++i) {
    if (can::same_content(encode(ring_[(head_ + i) % ring_.size()], cob_id()), frame)) {
      return true;
    }
  }
  return false;
}

std::uint8_t Producer::error_register() const {
  return static_cast<std::uint8_t>(
      dictionary_.number({od::objects::kErrorRegister, 0}).value_or(0));
}

void Producer::set_error_register(std::uint8_t value) {
  dictionary_.set({od::objects::kErrorRegister, 0}, value);
}

void Producer::advance(Instant now) {
  while (active_ && waiting_ > 0 && now >= inhibited_until_) {
    const Message message = ring_[head_];
    head_ = (head_ + 1) % ring_.size();
    --waiting_;
    transmit(message, now);
  }
}

AbortCode Producer::check_write(od::Address address, std::span<const std::byte> value) {
  if (address.index != od::objects::kEmcyCobId) {
    return AbortCode::none;
  }
  return can::check_cob_id(cob_id(), can::CobId{static_cast<std::uint32_t>(load_le(value))});
}

void Producer::written(od::Address address) {
  if (address.index != od::objects::kEmcyCobId) {
    return;
  }
  follow_cob_id();
  if (!can::is_usable(cob_id())) {
    waiting_ = 0;
  }
}

void Producer::follow_cob_id() {
  const can::CobId wanted = can::is_usable(cob_id()) ? cob_id() : can::CobId{};
  if (dispatch_ == nullptr || wanted == listened_) {
    return;
  }
  if (listened_.valid()) {
    dispatch_->remove(listened_.id(), listened_.extended(), can::Service::emcy, index_);
  }
  listened_ = wanted;
  if (listened_.valid()) {
    dispatch_->add(listened_.id(), listened_.extended(), can::Service::emcy, index_);
  }
}

can::CobId Producer::cob_id() const {
  const auto raw = dictionary_.number({od::objects::kEmcyCobId, 0});
  return can::CobId{static_cast<std::uint32_t>(raw.value_or(can::CobId::kInvalidBit))};
}

bool Producer::transmit(const Message& message, Instant now) {
  const can::Frame frame = encode(message, cob_id());
  if (!transmit_.push(can::TransmitClass::emcy, frame)) {
    return false;
  }
  inhibited_until_ =
      now + kInhibitUnit * static_cast<std::int64_t>(
                               dictionary_.number({od::objects::kEmcyInhibitTime, 0}).value_or(0));
  const Event sent{.time = now, .node = node_id_, .data = to_event<event::EmcySent>(message)};
  if (reporter_ != nullptr) {
    reporter_->emcy_queued(frame, sent, events_);
  } else {
    events_.emit(sent);
  }
  return true;
}

}  // namespace linegate::emcy
