// SPDX-License-Identifier: Apache-2.0
#include "stack/line/generic_can.h"

#include <utility>

#include "stack/can/cob_id.h"
#include "stack/lss/message.h"
#include "stack/od/objects.h"

namespace linegate::line {
namespace {

constexpr std::uint32_t kExtendedId = 0x8000'0000;
constexpr std::uint32_t kIdBits = 0x1FFF'FFFF;
constexpr std::uint32_t kStandardIdBits = 0x7FF;

std::uint32_t marked_id(const can::Frame& frame) {
  return frame.id | (frame.extended() ? kExtendedId : 0U);
}

bool of_default_service(std::uint32_t id) {
  const auto of_node = [id](std::uint32_t base) {
    return id >= base + can::kMinNodeId && id <= base + can::kMaxNodeId;
  };
  return id == can::kNmtId || id == lss::kMasterId || id == lss::kSlaveId ||
         of_node(can::kSdoResponseBase) || of_node(can::kSdoRequestBase) ||
         of_node(can::kErrorControlBase);
}

bool is(can::CobId cob_id, const can::Frame& frame) {
  return cob_id.id() == frame.id && cob_id.extended() == frame.extended();
}

bool between(std::uint16_t index, std::uint16_t first, std::uint16_t last) {
  return index >= first && index <= last;
}

// The sub-indices of an object that hold COB-IDs: the first and their number.
struct CobIdSubs {
  std::uint8_t first = 0;
  std::uint8_t count = 0;
};
CobIdSubs cob_ids_of(std::uint16_t index) {
  if (index == od::objects::kSyncCobId || index == od::objects::kTimeCobId ||
      index == od::objects::kEmcyCobId) {
    return {0, 1};
  }
  if (between(index, od::objects::kSdoServer, od::objects::kLastSdoClient)) {
    return {1, 2};
  }
  const bool pdo = od::objects::is_pdo_communication(index);
  return pdo ? CobIdSubs{1, 1} : CobIdSubs{};
}

// Bit 31 of 1005h and 1012h has another meaning.
bool exists(std::uint16_t index, can::CobId cob_id) {
  return cob_id.valid() || index == od::objects::kSyncCobId || index == od::objects::kTimeCobId;
}

bool in_dictionary(const od::Dictionary& dictionary, const can::Frame& frame) {
  for (const std::uint16_t index : dictionary.indices()) {
    const CobIdSubs subs = cob_ids_of(index);
    for (unsigned sub = subs.first; sub < unsigned{subs.first} + subs.count; ++sub) {
      const auto raw = dictionary.number({index, static_cast<std::uint8_t>(sub)});
      const can::CobId cob_id{static_cast<std::uint32_t>(raw.value_or(can::CobId::kInvalidBit))};
      if (raw && exists(index, cob_id) && is(cob_id, frame)) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace

Error check_frame(const can::Frame& frame) {
  constexpr unsigned kKnown =
      can::Frame::kExtended | can::Frame::kRemote | can::Frame::kFd | can::Frame::kBitRateSwitch;
  const bool switches = (frame.flags & can::Frame::kBitRateSwitch) != 0;
  const bool flags = (frame.flags & ~kKnown) == 0 && (frame.fd() ? !frame.remote() : !switches);
  const bool identifier = frame.id <= (frame.extended() ? kIdBits : kStandardIdBits);
  const bool length =
      frame.fd() ? frame.length <= can::kMaxFdData && can::fd_length(frame.length) == frame.length
                 : frame.length <= can::kMaxClassicData;
  return flags && identifier && length ? Error{} : to_error(Refusal::bad_request);
}

bool uses_identifier(node::Node& node, std::span<const pdo::LinkedPdo> linked,
                     const can::Frame& frame) {
  if ((!frame.extended() && of_default_service(frame.id)) ||
      node.dispatch().find(frame) != nullptr) {
    return true;
  }
  const auto sends = [&frame](const pdo::LinkedPdo& pdo) {
    return pdo.parameters.cob_id.valid() && is(pdo.parameters.cob_id, frame);
  };
  return std::ranges::any_of(linked, sends) || in_dictionary(node.dictionary(), frame);
}

Error send_generic(node::Node& node, const can::Frame& frame) {
  const bool taken = node.transmit().push(can::TransmitClass::error_control, frame);
  return taken ? Error{} : to_error(Refusal::busy);
}

// A filter that exists already gets the new end; with 0 seconds it ends now.
Error Listening::ask(const CanListen& request, Instant now) {
  if (request.duration < std::chrono::seconds(0) ||
      request.duration > std::chrono::seconds(kLongest) || request.identifier > kIdBits) {
    return to_error(Refusal::bad_request);
  }
  const std::uint32_t mask = (request.mask & kIdBits) | (request.extended ? kExtendedId : 0U);
  const std::uint32_t format = request.extended.value_or(false) ? kExtendedId : 0U;
  const std::uint32_t id = (request.identifier | format) & mask;
  const auto free = [now](const Filter& filter) { return filter.end <= now; };
  auto place = std::ranges::find_if(filters_, [&](const Filter& filter) {
    return !free(filter) && filter.id == id && filter.mask == mask;
  });
  place = place == filters_.end() ? std::ranges::find_if(filters_, free) : place;
  if (request.duration > std::chrono::seconds(0) && place == filters_.end()) {
    return to_error(Refusal::busy);
  }
  if (place != filters_.end()) {
    *place = {id, mask, now + request.duration};
  }
  end_ = std::ranges::max(filters_, {}, &Filter::end).end;
  return {};
}

void Listening::match(const can::Frame& frame, bool all, EventLog& events) {
  const std::uint32_t id = marked_id(frame);
  const bool wanted = all || std::ranges::any_of(filters_, [&](const Filter& filter) {
                        return frame.time < filter.end && (id & filter.mask) == filter.id;
                      });
  if (wanted && admit(frame.time)) {
    report(frame, events);
  }
}

bool Listening::admit(Instant now) {
  if (now >= second_ + std::chrono::seconds(1)) {
    second_ = now;
    reported_ = 0;
  }
  const bool admitted = reported_ < kMostASecond;
  ++(admitted ? reported_ : withheld_);
  return admitted;
}

// A frame that is longer than the data of one event is split over several events.
void Listening::report(const can::Frame& frame, EventLog& events) {
  constexpr std::uint32_t kMostWithheld = 0xFFFF;
  const std::span<const std::byte> data =
      frame.remote() ? std::span<const std::byte>() : frame.bytes();
  const auto withheld =
      static_cast<std::uint16_t>(std::min(std::exchange(withheld_, 0U), kMostWithheld));
  std::size_t piece = 0;
  do {
    const auto part = data.subspan(piece * kBytesAnEvent);
    const auto bytes = part.first(std::min(part.size(), kBytesAnEvent));
    event::CanFrame out{.identifier = frame.id,
                        .suppressed = piece == 0 ? withheld : std::uint16_t{0},
                        .length = frame.length,
                        .extended = frame.extended(),
                        .remote = frame.remote(),
                        .fd = frame.fd(),
                        .piece = static_cast<std::uint8_t>(piece & 3U)};
    std::ranges::copy(bytes, out.data.begin());
    events.emit({.time = frame.time, .data = out});
  } while (++piece * kBytesAnEvent < data.size());
}

}  // namespace linegate::line
