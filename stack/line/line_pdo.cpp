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

// The value becomes that of the object which the TPDO maps: it is what such a TPDO sends.
Error Line::Impl::write_by_mpdo(const Command& command, std::vector<std::byte>& by) {
  constexpr std::uint16_t kMapping = 0x1A00;
  od::Dictionary& dictionary = node.dictionary();
  std::uint16_t number = command.code;
  for (const pdo::Parameters& own : config.forwarding.tpdos) {
    if (number == 0 && pdo::read_mpdo_mode(dictionary, pdo::PdoKind::tpdo, own.number) ==
                           pdo::MpdoMode::destination) {
      number = own.number;
    }
  }
  if (number == 0 || number > pdo::kMaxPdo ||
      pdo::read_mpdo_mode(dictionary, pdo::PdoKind::tpdo, number) != pdo::MpdoMode::destination) {
    return to_error(Refusal::unknown_entry);
  }
  if (node.state() != nmt::State::operational) {
    return to_error(Refusal::wrong_state);
  }
  const auto mapped = static_cast<std::uint32_t>(
      dictionary.number({static_cast<std::uint16_t>(kMapping + number - 1), 1}).value_or(0));
  const od::Address sent = pdo::Mapping::from_raw(mapped).address;
  const auto variable = dictionary.find(sent);
  if (!variable || command.data.empty() || command.data.size() > variable->size) {
    return to_error(Refusal::bad_request);
  }
  std::vector<std::byte> value = command.data;
  value.resize(variable->size);
  const OwnObjects::OwnWrites by_itself(own_objects);
  AbortCode why = dictionary.write(sent, value);
  if (why == AbortCode::none) {
    why = node.pdos().send_mpdo(number, command.node, {command.index, command.sub});
  }
  by.resize(sizeof number);
  store_le(by.data(), number);
  return why == AbortCode::out_of_memory ? to_error(Refusal::busy)
         : why == AbortCode::none        ? Error{}
                                         : to_error(why);
}

}  // namespace linegate::line
