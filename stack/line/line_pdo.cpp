// SPDX-License-Identifier: Apache-2.0
// Values that go by MPDO.
#include "stack/base/byte_order.h"
#include "stack/line/line_impl.h"
#include "stack/od/objects.h"
#include "stack/pdo/record.h"

namespace linegate::line {

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
  od::Dictionary& dictionary = node.dictionary();
  const auto mapped = static_cast<std::uint32_t>(
      dictionary.number({static_cast<std::uint16_t>(od::objects::kTpdoMapping + number - 1), 1})
          .value_or(0));
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
  const auto record = static_cast<std::uint16_t>(od::objects::kTpdoCommunication + number - 1);
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
