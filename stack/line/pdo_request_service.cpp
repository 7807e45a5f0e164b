// SPDX-License-Identifier: Apache-2.0
#include "stack/line/pdo_request_service.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/time.h"

namespace linegate::line {

std::span<const CommandKind> PdoRequestService::commands() const {
  static constexpr std::array kCommands{CommandKind::pdo_request};
  return kCommands;
}

// The number of an RPDO of the own node; 0: there is none. The command specifies it directly, or by
// a TPDO of a device.
std::uint16_t PdoRequestService::named_rpdo(const PdoRequest& request) const {
  if (request.node == 0) {
    return request.number;
  }
  const auto found = std::ranges::find_if(plan_.rpdos, [&](const pdo::LinkedPdo& rpdo) {
    return rpdo.node == request.node && rpdo.remote_pdo == request.number;
  });
  return found == plan_.rpdos.end() ? std::uint16_t{0} : found->parameters.number;
}

Refusal PdoRequestService::request(std::uint16_t rpdo) {
  if (flying_.is_passive()) {
    return Refusal::wrong_role;
  }
  if (!host().usable()) {
    return Refusal::line_down;
  }
  if (node_.state() != nmt::State::operational) {
    return Refusal::wrong_state;
  }
  if (rpdo == 0 || rpdo > image_.area(image::Direction::inputs).pdos()) {
    return Refusal::unknown_entry;
  }
  if (requests_.size() >= kMost) {
    return Refusal::busy;
  }
  return node_.pdos().request_rpdo(rpdo) ? Refusal::none : Refusal::bad_request;
}

void PdoRequestService::execute(Command command, Instant now) {
  const std::uint16_t rpdo = named_rpdo(std::get<PdoRequest>(command.request));
  if (const Refusal why = request(rpdo); why != Refusal::none) {
    host().refuse(command, why, now);
    return;
  }
  const Duration timeout = command.timeout > Duration::zero() ? command.timeout : timeout_;
  requests_.push_back(
      {.tag = command.tag, .rpdo = rpdo, .begun = now, .deadline = deadline(now, timeout)});
}

void PdoRequestService::advance(Instant now) {
  const image::Area& inputs = image_.area(image::Direction::inputs);
  std::erase_if(requests_, [&](const Request& request) {
    const bool received = inputs.pdo(request.rpdo - 1U).last >= request.begun;
    if (!received && request.deadline > now) {
      return false;
    }
    host().reply(request.tag, received ? Error{} : to_error(Refusal::timed_out), {});
    return true;
  });
}

Instant PdoRequestService::next_wake() const {
  Instant wake = kNever;
  for (const Request& request : requests_) {
    wake = earlier(wake, request.deadline);
  }
  return wake;
}

void PdoRequestService::end(Refusal why, Instant /*now*/) {
  for (const Request& request : std::exchange(requests_, {})) {
    host().reply(request.tag, to_error(why), {});
  }
}

}  // namespace linegate::line
