// SPDX-License-Identifier: Apache-2.0
#include "stack/line/mpdo_service.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/od/objects.h"
#include "stack/pdo/record.h"

namespace linegate::line {

can::Frame mpdo_frame(const od::Dictionary& dictionary, std::uint16_t tpdo,
                      const pdo::MpdoData& data) {
  const auto record = static_cast<std::uint16_t>(od::objects::kTpdoCommunication + tpdo - 1);
  const can::CobId cob_id{static_cast<std::uint32_t>(dictionary.number({record, 1}).value_or(0))};
  can::Frame frame = can::make_frame(cob_id.id(), data);
  if (cob_id.extended()) {
    frame.flags = can::Frame::kExtended;
  }
  return frame;
}

can::Frame mpdo_frame(const od::Dictionary& dictionary, std::uint16_t tpdo, std::uint8_t node,
                      od::Address source) {
  return mpdo_frame(
      dictionary, tpdo,
      pdo::encode({.mode = pdo::MpdoMode::source, .node = node, .address = source, .value = {}}));
}

Refusal why_unsent(const FramesUnderWay::Sending& sending, nmt::State own, bool stuck) {
  const bool waits = std::ranges::any_of(
      sending.frames, [](const FramesUnderWay::Awaited& awaited) { return awaited.number == 0; });
  if (!waits || stuck) {
    return Refusal::no_acknowledge;
  }
  return own == nmt::State::operational ? Refusal::awaits_turn : Refusal::wrong_state;
}

std::span<const CommandKind> MpdoService::commands() const {
  static constexpr std::array kCommands{CommandKind::mpdo_write};
  return kCommands;
}

void MpdoService::execute(Command command, Instant now) {
  if (config_.canopen_fd) {
    host().refuse(command, Refusal::wrong_interface, now);  // its frames are not defined
    return;
  }
  if (flying_.is_passive()) {
    host().refuse(command, Refusal::wrong_role, now);
    return;
  }
  advance(now);  // processes a restart of the own node before this command is queued
  const auto& request = std::get<MpdoWrite>(command.request);
  const std::uint16_t tpdo = named_tpdo(request);
  if (tpdo == 0 || node_.state() != nmt::State::operational) {
    host().refuse(command, tpdo == 0 ? Refusal::unknown_entry : Refusal::wrong_state, now);
    return;
  }
  if (const AbortCode why = queue(request, tpdo); why != AbortCode::none) {
    const bool full = why == AbortCode::out_of_memory;
    const bool bad = why == AbortCode::length_mismatch;
    const Error error = full  ? to_error(Refusal::busy)
                        : bad ? to_error(Refusal::bad_request)
                              : to_error(why);
    host().answer(command, error, {}, now);
    return;
  }
  const pdo::MpdoData head = pdo::encode(
      {.mode = pdo::MpdoMode::destination, .node = request.node, .address = request.address});
  const FramesUnderWay::Awaited awaited{.frame = mpdo_frame(node_.dictionary(), tpdo, head),
                                        .any_value = true};
  host().answer_when_sent(
      {.command = std::move(command), .frames = {awaited}, .data = SentByMpdo{tpdo}}, now);
}

// Returns 0 if there is no such TPDO in destination address mode.
std::uint16_t MpdoService::named_tpdo(const MpdoWrite& request) const {
  const od::Dictionary& dictionary = node_.dictionary();
  const auto is_one = [&dictionary](std::uint16_t number) {
    return number != 0 && number <= pdo::kMaxPdo &&
           pdo::read_mpdo_mode(dictionary, pdo::PdoKind::tpdo, number) ==
               pdo::MpdoMode::destination;
  };
  if (request.tpdo != 0) {
    return is_one(request.tpdo) ? request.tpdo : std::uint16_t{0};
  }
  const auto own = std::ranges::find_if(config_.forwarding.tpdos,
                                        [&](const auto& tpdo) { return is_one(tpdo.number); });
  return own == config_.forwarding.tpdos.end() ? std::uint16_t{0} : own->number;
}

// Writes the value to the object that the TPDO maps: the TPDO sends the value of that object.
AbortCode MpdoService::queue(const MpdoWrite& request, std::uint16_t tpdo) {
  od::Dictionary& dictionary = node_.dictionary();
  const auto mapped = static_cast<std::uint32_t>(
      dictionary.number({static_cast<std::uint16_t>(od::objects::kTpdoMapping + tpdo - 1), 1})
          .value_or(0));
  const od::Address sent = pdo::Mapping::from_raw(mapped).address;
  const auto variable = dictionary.find(sent);
  if (!variable || request.data.empty() || request.data.size() > variable->size) {
    return AbortCode::length_mismatch;
  }
  std::vector<std::byte> value = request.data;
  value.resize(variable->size);
  const OwnObjects::OwnWrites by_itself(own_objects_);
  const AbortCode why = dictionary.write(sent, value);
  return why != AbortCode::none ? why : node_.pdos().send_mpdo(tpdo, request.node, request.address);
}

void MpdoService::advance(Instant now) {
  const std::uint64_t starts = node_.counters().starts;
  const bool is_new = std::exchange(starts_, starts) != starts;
  if (is_new || node_.state() != nmt::State::operational) {
    host().refuse_unsent(CommandKind::mpdo_write, Refusal::wrong_state, now);
  }
}

void MpdoService::answer_unsent(FramesUnderWay::Sending& sending, Instant now) {
  host().refuse(sending.command, why_unsent(sending, node_.state(), host().bus_is_stuck(now)), now);
}

void MpdoService::before_boot(Instant now) {
  host().refuse_unsent(CommandKind::mpdo_write, Refusal::wrong_state, now);
}

}  // namespace linegate::line
