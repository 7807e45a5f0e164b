// SPDX-License-Identifier: Apache-2.0
#include "stack/node/sdo_clients.h"

#include <algorithm>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/node/sdo_servers.h"
#include "stack/od/objects.h"
#include "stack/sdo/protocol.h"

namespace linegate::node {
namespace {

constexpr std::uint8_t kServerSub = 3;

bool default_channel(can::CobId cob_id, std::uint32_t base) {
  return !cob_id.extended() && cob_id.id() > base && cob_id.id() <= base + can::kMaxNodeId;
}

}  // namespace

SdoClients::SdoClients(od::Dictionary& dictionary, can::Dispatch& dispatch, EventLog& events,
                       bool of_default_servers)
    : dictionary_(dictionary),
      dispatch_(dispatch),
      events_(events),
      of_default_servers_(of_default_servers) {
  find_objects();
}

// Precondition: the COB-ID is valid.
bool SdoClients::allowed(can::CobId cob_id, std::uint8_t sub) const {
  const std::uint32_t base = sub == kRequestSub ? can::kSdoRequestBase : can::kSdoResponseBase;
  const bool frame_bits = cob_id.extended() || (cob_id.raw & 0x1FFF'FFFFU) == cob_id.id();
  return can::has_allowed_id(cob_id) ||
         (of_default_servers_ && frame_bits && default_channel(cob_id, base));
}

bool SdoClients::usable(can::CobId cob_id, std::uint8_t sub) const {
  return cob_id.valid() && allowed(cob_id, sub);
}

void SdoClients::find_objects() {
  for (std::uint16_t number = 0; number < kSdoClients; ++number) {
    const auto index = static_cast<std::uint16_t>(od::objects::kSdoClient + number);
    if (!dictionary_.has_object(index)) {
      continue;
    }
    LINEGATE_ASSERT(dictionary_.set_hook(index, this).ok(), "the object exists");
    const auto place = std::ranges::lower_bound(entries_, index, {}, &Entry::index);
    if (place == entries_.end() || place->index != index) {
      entries_.insert(place, Entry{index, {}, {}, std::make_unique<sdo::Client>(can::CobId{})});
    }
  }
}

Result<sdo::Client*> SdoClients::client(std::uint16_t number) {
  apply_writes();
  Entry* entry = find(static_cast<std::uint16_t>(od::objects::kSdoClient + number - 1));
  if (entry == nullptr || !entry->request.valid() || entry->client->busy()) {
    return to_error(AbortCode::sdo_connection);
  }
  return entry->client.get();
}

void SdoClients::configure() {
  reset();
  find_objects();
  changed_ = true;
  apply_writes();
}

void SdoClients::reset() {
  for (Entry& entry : entries_) {
    entry.client->configure(entry.request);
  }
}

void SdoClients::receive(std::uint16_t index, const can::Frame& frame, can::TransmitQueue& queue) {
  Entry* entry = find(static_cast<std::uint16_t>(od::objects::kSdoClient + (index & ~kMark)));
  if (entry != nullptr && entry->client->receive(frame, queue) == sdo::Receipt::malformed) {
    ++malformed_;
    const auto server = dictionary_.number({entry->index, kServerSub}).value_or(0);
    sdo::report_malformed(frame, static_cast<std::uint8_t>(server), events_);
  }
}

void SdoClients::apply_writes() {
  if (!changed_) {
    return;
  }
  changed_ = false;
  for (Entry& entry : entries_) {
    configure(entry);
  }
}

void SdoClients::advance(Instant now, can::TransmitQueue& queue) {
  apply_writes();
  for (Entry& entry : entries_) {
    entry.client->advance(now, queue);
  }
}

Instant SdoClients::next_wake() const {
  Instant next = changed_ ? Instant{} : kNever;
  for (const Entry& entry : entries_) {
    next = earlier(next, entry.client->next_wake());
  }
  return next;
}

AbortCode SdoClients::check_write(od::Address address, std::span<const std::byte> value) {
  if (address.sub == kServerSub) {
    return load_le(value) > can::kMaxNodeId ? AbortCode::invalid_value : AbortCode::none;
  }
  const can::CobId wanted{static_cast<std::uint32_t>(load_le(value))};
  if ((address.sub != kRequestSub && address.sub != kResponseSub) || !wanted.valid()) {
    return AbortCode::none;
  }
  const can::CobId present = cob_id(address);
  const bool changed = usable(present, address.sub) && present != wanted;
  const bool taken = has_identifier(dictionary_, od::objects::kSdoClient,
                                    od::objects::kSdoClient + kSdoClients - 1, address, wanted);
  return changed || taken || !allowed(wanted, address.sub) ? AbortCode::invalid_value
                                                           : AbortCode::none;
}

void SdoClients::written(od::Address /*address*/) {
  changed_ = true;
}

SdoClients::Entry* SdoClients::find(std::uint16_t index) {
  const auto entry = std::ranges::lower_bound(entries_, index, {}, &Entry::index);
  return entry == entries_.end() || entry->index != index ? nullptr : &*entry;
}

void SdoClients::configure(Entry& entry) {
  can::CobId request = cob_id({entry.index, kRequestSub});
  can::CobId response = cob_id({entry.index, kResponseSub});
  const auto of_an_earlier_one = [&](std::uint8_t sub, can::CobId cob_id) {
    return has_identifier(dictionary_, od::objects::kSdoClient, entry.index, {entry.index, sub},
                          cob_id);
  };
  if (!usable(request, kRequestSub) || !usable(response, kResponseSub) ||
      of_an_earlier_one(kRequestSub, request) || of_an_earlier_one(kResponseSub, response)) {
    request = can::CobId{};
    response = can::CobId{};
  }
  if (request == entry.request && response == entry.response) {
    return;
  }
  const auto mark = static_cast<std::uint16_t>(kMark | (entry.index - od::objects::kSdoClient));
  if (entry.response.valid()) {
    dispatch_.remove(entry.response.id(), entry.response.extended(), can::Service::sdo_client,
                     mark);
  }
  entry.request = request;
  entry.response = response;
  entry.client->configure(request);
  if (response.valid()) {
    dispatch_.add(response.id(), response.extended(), can::Service::sdo_client, mark);
  }
}

can::CobId SdoClients::cob_id(od::Address address) const {
  return can::CobId{
      static_cast<std::uint32_t>(dictionary_.number(address).value_or(can::CobId::kInvalidBit))};
}

}  // namespace linegate::node
