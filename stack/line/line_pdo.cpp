// SPDX-License-Identifier: Apache-2.0
// PDOs that a command asks for with a remote frame, and values that go by MPDO.
#include <algorithm>

#include "stack/base/byte_order.h"
#include "stack/base/deadline.h"
#include "stack/line/line_impl.h"
#include "stack/pdo/record.h"

namespace linegate::line {
namespace {

constexpr std::size_t kMostRequests = 256;  // under way

}  // namespace

// A local number, 0 = none: of the node's TPDO, or as it is for node 0.
std::uint16_t Line::Impl::named_rpdo(const Command& command) const {
  if (command.node == 0) {
    return command.code;
  }
  const auto found = std::ranges::find_if(plan.rpdos, [&](const pdo::LinkedPdo& rpdo) {
    return rpdo.node == command.node && rpdo.remote_pdo == command.code;
  });
  return found == plan.rpdos.end() ? std::uint16_t{0} : found->parameters.number;
}

// Answered when the PDO has come.
void Line::Impl::request_pdo(const Command& command, Instant now) {
  const std::uint16_t rpdo = named_rpdo(command);
  Refusal refusal = Refusal::none;
  if (!usable()) {
    refusal = Refusal::line_down;
  } else if (node.state() != nmt::State::operational) {
    refusal = Refusal::wrong_state;
  } else if (rpdo == 0 || rpdo > image.area(image::Direction::inputs).pdos()) {
    refusal = Refusal::unknown_entry;
  } else if (pdo_requests.size() >= kMostRequests) {
    refusal = Refusal::busy;
  } else if (!node.pdos().request_rpdo(rpdo)) {
    refusal = Refusal::bad_request;
  }
  if (refusal != Refusal::none) {
    refuse(command, refusal, now);
    return;
  }
  const Duration timeout =
      command.timeout > Duration::zero() ? command.timeout : config.sdo_timeout;
  pdo_requests.push_back(
      {.tag = command.tag, .rpdo = rpdo, .asked = now, .deadline = deadline(now, timeout)});
}

void Line::Impl::finish_pdo_requests(Instant now) {
  const image::Area& inputs = image.area(image::Direction::inputs);
  std::erase_if(pdo_requests, [&](const PdoRequest& request) {
    const bool came = inputs.pdo(request.rpdo - 1U).last >= request.asked;
    if (!came && request.deadline > now) {
      return false;
    }
    reply(request.tag, came ? Error{} : to_error(Refusal::timed_out));
    return true;
  });
}

void Line::Impl::cancel_pdo_requests() {
  for (const PdoRequest& request : pdo_requests) {
    reply(request.tag, to_error(Refusal::cancelled));
  }
  pdo_requests.clear();
}

// 0 if there is none in destination address mode.
std::uint16_t Line::Impl::named_mpdo(const Command& command) const {
  const auto& dictionary = node.dictionary();
  const auto is_one = [&dictionary](std::uint16_t number) {
    return number != 0 && number <= pdo::kMaxPdo &&
           pdo::read_mpdo_mode(dictionary, pdo::PdoKind::tpdo, number) ==
               pdo::MpdoMode::destination;
  };
  if (command.code != 0) {
    return is_one(command.code) ? command.code : std::uint16_t{0};
  }
  std::uint16_t number = 0;
  for (const pdo::Parameters& own : config.forwarding.tpdos) {
    number = number == 0 && is_one(own.number) ? own.number : number;
  }
  return number;
}

// The value becomes that of the object which the TPDO maps: it is what such a TPDO sends.
AbortCode Line::Impl::queue_mpdo(const Command& command, std::uint16_t number) {
  constexpr std::uint16_t kMapping = 0x1A00;
  od::Dictionary& dictionary = node.dictionary();
  const auto mapped = static_cast<std::uint32_t>(
      dictionary.number({static_cast<std::uint16_t>(kMapping + number - 1), 1}).value_or(0));
  const od::Address sent = pdo::Mapping::from_raw(mapped).address;
  const auto variable = dictionary.find(sent);
  if (!variable || command.data.empty() || command.data.size() > variable->size) {
    return AbortCode::length_mismatch;
  }
  std::vector<std::byte> value = command.data;
  value.resize(variable->size);
  const OwnObjects::OwnWrites by_itself(own_objects);
  const AbortCode why = dictionary.write(sent, value);
  return why != AbortCode::none
             ? why
             : node.pdos().send_mpdo(number, command.node, {command.index, command.sub});
}

can::Frame Line::Impl::mpdo_frame(std::uint16_t number, const pdo::MpdoData& data) const {
  constexpr std::uint16_t kRecord = 0x1800;
  const auto record = static_cast<std::uint16_t>(kRecord + number - 1);
  const can::CobId cob_id{
      static_cast<std::uint32_t>(node.dictionary().number({record, 1}).value_or(0))};
  can::Frame frame = can::make_frame(cob_id.id(), data);
  if (cob_id.extended()) {
    frame.flags = can::Frame::kExtended;
  }
  return frame;
}

void Line::Impl::write_by_mpdo(const Command& command, Instant now) {
  follow_own_state(now);  // what comes now is not of before its start
  const std::uint16_t number = named_mpdo(command);
  if (number == 0 || node.state() != nmt::State::operational) {
    refuse(command, number == 0 ? Refusal::unknown_entry : Refusal::wrong_state, now);
    return;
  }
  const AbortCode why = queue_mpdo(command, number);
  if (why != AbortCode::none) {
    const bool full = why == AbortCode::out_of_memory;
    const bool bad = why == AbortCode::length_mismatch;
    answer(command,
           full  ? to_error(Refusal::busy)
           : bad ? to_error(Refusal::bad_request)
                 : to_error(why),
           {}, now);
    return;
  }
  const pdo::MpdoData head = pdo::encode({.mode = pdo::MpdoMode::destination,
                                          .node = command.node,
                                          .address = {command.index, command.sub}});
  const FramesUnderWay::Awaited awaited{.frame = mpdo_frame(number, head), .any_value = true};
  std::vector<std::byte> by(sizeof number);
  store_le(by.data(), number);
  answer_when_sent({.command = command, .frames = {awaited}, .data = std::move(by)}, now);
}

}  // namespace linegate::line
