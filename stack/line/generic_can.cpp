// SPDX-License-Identifier: Apache-2.0
#include "stack/line/generic_can.h"

#include <utility>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/lss/message.h"
#include "stack/od/objects.h"

namespace linegate::line {
namespace {

constexpr std::uint32_t kExtendedId = 0x8000'0000;
constexpr std::uint32_t kRemoteId = 0x4000'0000;
constexpr std::uint32_t kIdBits = 0x1FFF'FFFF;
constexpr std::uint32_t kWholeId = kExtendedId | kIdBits;

// Command::sub of can_send: the flags digit of candump.
constexpr std::uint8_t kFdFrame = 4;
constexpr std::uint8_t kSwitchedFd = 5;

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

Error generic_frame(const Command& command, can::Frame& out) {
  const bool extended = (command.entry & kExtendedId) != 0;
  const bool remote = (command.entry & kRemoteId) != 0;
  const bool fd = command.sub != 0;
  const std::size_t size = command.data.size();
  out = {};
  out.id = command.entry & kIdBits;
  const bool known = command.sub == 0 || command.sub == kFdFrame || command.sub == kSwitchedFd;
  const bool fits = (command.entry & ~(kWholeId | kRemoteId)) == 0 && (extended || out.id <= 0x7FF);
  const bool length =
      fd ? size <= can::kMaxFdData && can::fd_length(size) == size : size <= can::kMaxClassicData;
  const bool asks =
      remote ? !fd && size == 0 && command.code <= can::kMaxClassicData : command.code == 0;
  if (!known || !fits || !length || !asks) {
    return to_error(Refusal::bad_request);
  }
  out.length = static_cast<std::uint8_t>(remote ? command.code : size);
  out.flags = static_cast<std::uint8_t>(
      (extended ? can::Frame::kExtended : 0) | (remote ? can::Frame::kRemote : 0) |
      (fd ? can::Frame::kFd : 0) | (command.sub == kSwitchedFd ? can::Frame::kBitRateSwitch : 0));
  std::ranges::copy(command.data, out.data.begin());
  return {};
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
Error Listening::ask(const Command& command, Instant now) {
  const std::size_t size = command.data.size();
  if (command.code > kLongest || (command.entry & ~kWholeId) != 0 ||
      (size != 0 && size != sizeof(std::uint32_t))) {
    return to_error(Refusal::bad_request);
  }
  const std::uint32_t mask =
      size == 0 ? kWholeId : load_le<std::uint32_t>(command.data.data()) & kWholeId;
  const std::uint32_t id = command.entry & mask;
  const auto free = [now](const Filter& filter) { return filter.end <= now; };
  auto place = std::ranges::find_if(filters_, [&](const Filter& filter) {
    return !free(filter) && filter.id == id && filter.mask == mask;
  });
  place = place == filters_.end() ? std::ranges::find_if(filters_, free) : place;
  if (command.code != 0 && place == filters_.end()) {
    return to_error(Refusal::busy);
  }
  if (place != filters_.end()) {
    *place = {id, mask, now + std::chrono::seconds(command.code)};
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
    told_ = 0;
  }
  const bool admitted = told_ < kMostASecond;
  ++(admitted ? told_ : withheld_);
  return admitted;
}

// A frame that is longer than the data of one event is split over several events.
void Listening::report(const can::Frame& frame, EventLog& events) {
  constexpr std::uint32_t kMostWithheld = 0xFFFF;
  const std::span<const std::byte> data =
      frame.remote() ? std::span<const std::byte>() : frame.bytes();
  const std::uint32_t withheld = std::min(std::exchange(withheld_, 0U), kMostWithheld);
  std::size_t piece = 0;
  do {
    const auto part = data.subspan(piece * kBytesAnEvent);
    const auto bytes = part.first(std::min(part.size(), kBytesAnEvent));
    Event event{.time = frame.time,
                .kind = EventKind::can_frame,
                .length = static_cast<std::uint8_t>(bytes.size()),
                .code = marked_id(frame)};
    event.value = frame.length | (frame.remote() ? 0x100U : 0U) | (frame.fd() ? 0x200U : 0U) |
                  (static_cast<std::uint32_t>(piece) << 10U) | (piece == 0 ? withheld << 16U : 0U);
    std::ranges::copy(bytes, event.data.begin());
    events.emit(event);
  } while (++piece * kBytesAnEvent < data.size());
}

}  // namespace linegate::line
