// SPDX-License-Identifier: Apache-2.0
#include "stack/lss/master.h"

#include "stack/base/assert.h"
#include "stack/base/time.h"

namespace linegate::lss {
namespace {

bool is_answer(Command command) {
  switch (command) {
    case Command::configure_node_id:
    case Command::configure_bit_timing:
    case Command::store:
    case Command::selected:
    case Command::identified:
    case Command::unconfigured:
    case Command::inquire_vendor:
    case Command::inquire_product:
    case Command::inquire_revision:
    case Command::inquire_serial:
    case Command::inquire_node_id:
      return true;
    default:
      return false;
  }
}

// Several devices may send these answers to one request.
bool may_be_of_many(Command command) {
  return command == Command::identified || command == Command::unconfigured;
}

bool has_error(Service service) {
  return service == Service::configure_node_id || service == Service::configure_bit_timing ||
         service == Service::store;
}

bool is_inquiry(Service service) {
  return service == Service::inquire_part || service == Service::inquire_node_id;
}

Command answer_to(const Request& request) {
  switch (request.service) {
    case Service::switch_global:
    case Service::activate_bit_timing:
      return Command::switch_global;
    case Service::switch_selective:
      return Command::selected;
    case Service::configure_node_id:
      return Command::configure_node_id;
    case Service::configure_bit_timing:
      return Command::configure_bit_timing;
    case Service::store:
      return Command::store;
    case Service::inquire_part:
      return next(Command::inquire_vendor, request.part);
    case Service::inquire_node_id:
      return Command::inquire_node_id;
    case Service::identify:
    case Service::question:
      return Command::identified;
    case Service::identify_unconfigured:
    case Service::anybody:
      return Command::unconfigured;
  }
  return Command::switch_global;
}

}  // namespace

void Master::push(Command command, std::uint32_t number) {
  frames_.push_back(encode(kMasterId, {.command = command, .number = number}));
}

bool Master::start(const Request& request) {
  if (busy_) {
    return false;
  }
  busy_ = true;
  service_ = request.service;
  expected_ = answer_to(request);
  patience_ = request.timeout > Duration::zero() ? request.timeout : timeout_;
  of_one_ = request.of_one && is_inquiry(request.service);
  answer_.reset();
  switch (request.service) {
    case Service::switch_global:
      push(Command::switch_global, request.configuration ? 1 : 0);
      break;
    case Service::switch_selective:
      for (unsigned i = 0; i < kParts; ++i) {
        push(lss::next(Command::select_vendor, i), request.address[i]);
      }
      break;
    case Service::configure_node_id:
      push(Command::configure_node_id, request.node_id);
      break;
    case Service::configure_bit_timing:
      push(Command::configure_bit_timing, request.table | static_cast<std::uint32_t>(request.index)
                                                              << 8U);
      break;
    case Service::activate_bit_timing:
      push(Command::activate_bit_timing, request.delay_ms);
      break;
    case Service::store:
      push(Command::store);
      break;
    case Service::inquire_part:
    case Service::inquire_node_id:
      push(expected_);
      break;
    case Service::identify:
      push(Command::identify_vendor, request.address[kVendor]);
      push(Command::identify_product, request.address[kProduct]);
      push(Command::identify_revision_low, request.address[kRevision]);
      push(Command::identify_revision_high, request.highest_revision);
      push(Command::identify_serial_low, request.address[kSerial]);
      push(Command::identify_serial_high, request.highest_serial);
      break;
    case Service::identify_unconfigured:
      push(Command::identify_unconfigured);
      break;
    case Service::question:
      frames_.push_back(encode(kMasterId, request.message));
      break;
    case Service::anybody:
      // In this order, a late answer to the second question is not mistaken for one to the next
      // fastscan question.
      frames_.push_back(
          encode(kMasterId, {.command = Command::fastscan, .rest = {kScanBegins, 0, 0}}));
      push(Command::identify_unconfigured);
      break;
  }
  return true;
}

void Master::cancel() {
  busy_ = false;
  frames_.clear();
  deadline_ = kNever;
  held_.reset();
  answer_.reset();
}

bool Master::next_frame(can::Frame& out, Instant now, bool awaits_sent) {
  if (frames_.empty()) {
    return false;
  }
  out = frames_.front();
  frames_.pop_front();
  if (!frames_.empty()) {
    return true;
  }
  if (expected_ == Command::switch_global) {
    finish({.service = service_});
  } else if (!awaits_sent) {
    sent(now);
  }
  return true;
}

void Master::sent(Instant now) {
  if (busy_ && frames_.empty() && deadline_ == kNever) {
    deadline_ = deadline(now, patience_);
  }
}

bool Master::receive(const can::Frame& frame) {
  const auto message = decode(frame);
  if (!message || !is_answer(message->command)) {
    ++malformed_;
    return false;
  }
  // An answer before the last frame was handed out belongs to an earlier service.
  if (busy_ && frames_.empty() && is_awaited(message->command)) {
    answered(*message, frame.time);
    return true;
  }
  ++unexpected_;
  if (message->command == last_ && !may_be_of_many(last_)) {
    ++doubled_;
  }
  return true;
}

bool Master::is_awaited(Command command) const {
  return command == expected_ || (service_ == Service::anybody && command == Command::identified);
}

void Master::answered(const Message& message, Instant now) {
  last_ = message.command;
  Answer answer{.service = service_};
  if (has_error(service_)) {
    answer.error = message.byte1();
    answer.specific = message.byte2();
    answer.outcome = answer.error == kDone ? Outcome::done : Outcome::refused;
  } else if (service_ == Service::inquire_part) {
    answer.value = message.number;
  } else if (service_ == Service::inquire_node_id) {
    answer.value = message.byte1();
  }
  if (!of_one_ && !may_be_of_many(message.command)) {
    finish(answer);
  } else if (held_ && of_one_) {
    held_->outcome = Outcome::several;
    ++doubled_;
  } else if (!held_) {
    held_ = answer;
    deadline_ = of_one_ ? deadline_ : deadline(now, patience_ / kSettleShare);
  }
}

void Master::advance(Instant now) {
  if (now >= deadline_) {
    finish(held_.value_or(Answer{.service = service_, .outcome = Outcome::no_answer}));
  }
}

void Master::finish(const Answer& answer) {
  LINEGATE_ASSERT(busy_ && frames_.empty(), "a service ends behind its last frame");
  busy_ = false;
  deadline_ = kNever;
  held_.reset();
  answer_ = answer;
}

std::optional<Answer> Master::take() {
  std::optional<Answer> out;
  out.swap(answer_);
  return out;
}

}  // namespace linegate::lss
