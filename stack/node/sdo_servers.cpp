// SPDX-License-Identifier: Apache-2.0
#include "stack/node/sdo_servers.h"

#include <algorithm>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"

namespace linegate::node {
namespace {

constexpr std::uint8_t kClientSub = 3;

}  // namespace

SdoServers::SdoServers(od::Dictionary& dictionary, can::Dispatch& dispatch, EventLog& events,
                       std::uint8_t node_id)
    : dictionary_(dictionary), dispatch_(dispatch), events_(events), node_id_(node_id) {
  find_objects();
  default_server_ = entries_.front().server.get();
}

// The largest DOMAIN of a dictionary, in bytes.
constexpr std::size_t kLongestValue = std::size_t{16} * 1024 * 1024;

void SdoServers::find_objects() {
  for (std::uint16_t number = 0; number < kSdoServers; ++number) {
    const auto index = static_cast<std::uint16_t>(od::objects::kSdoServer + number);
    if (number != 0 && !dictionary_.has_object(index)) {
      continue;
    }
    const bool hooked = dictionary_.set_hook(index, this).ok();
    LINEGATE_ASSERT(hooked || number == 0, "the object exists");  // 1200h is optional
    const auto place = std::ranges::lower_bound(entries_, number, {}, &Entry::number);
    if (place == entries_.end() || place->number != number) {
      entries_
          .insert(place, Entry{number, can::CobId{},
                               std::make_unique<sdo::Server>(
                                   dictionary_, can::CobId{}, can::CobId{}, events_,
                                   sdo::ServerOptions{.max_transfer = kLongestValue})})
          ->server->set_network_handler(network_handler_);
    }
  }
}

void SdoServers::configure() {
  find_objects();
  show_default_server();
  changed_ = false;
  for (Entry& entry : entries_) {
    entry.server->reset();
    configure(entry);
  }
}

void SdoServers::show_default_server() {
  for (const std::uint8_t sub : {kRequestSub, kResponseSub}) {
    (void)dictionary_.set({od::objects::kSdoServer, sub}, cob_id(0, sub).raw);
  }
}

void SdoServers::set_network_handler(sdo::NetworkHandler* handler) {
  network_handler_ = handler;
  for (Entry& entry : entries_) {
    entry.server->set_network_handler(handler);
  }
}

void SdoServers::reset() {
  for (Entry& entry : entries_) {
    entry.server->reset();
  }
}

sdo::Server* SdoServers::find_other(std::uint16_t number) {
  const auto entry = std::ranges::lower_bound(entries_, number, {}, &Entry::number);
  return entry == entries_.end() || entry->number != number ? nullptr : entry->server.get();
}

void SdoServers::apply_writes() {
  if (!changed_) {
    return;
  }
  changed_ = false;
  for (Entry& entry : entries_) {
    configure(entry);
  }
}

void SdoServers::advance(Instant now, can::TransmitQueue& queue) {
  apply_writes();
  // The first server fills the free space of the queue: rotate, so that each server is first once.
  first_ = first_ + 1 < entries_.size() ? first_ + 1 : 0;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    entries_[(first_ + i) % entries_.size()].server->advance(now, queue);
  }
}

Instant SdoServers::next_wake() const {
  Instant next = changed_ ? Instant{} : kNever;
  for (const Entry& entry : entries_) {
    next = earlier(next, entry.server->next_wake());
  }
  return next;
}

std::uint64_t SdoServers::malformed() const {
  std::uint64_t sum = 0;
  for (const Entry& entry : entries_) {
    sum += entry.server->counters().malformed;
  }
  return sum;
}

AbortCode SdoServers::check_write(od::Address address, std::span<const std::byte> value) {
  if (address.index == od::objects::kSdoServer) {
    return AbortCode::read_only;
  }
  if (address.sub == kClientSub) {
    return load_le(value) > can::kMaxNodeId ? AbortCode::invalid_value : AbortCode::none;
  }
  if (address.sub != kRequestSub && address.sub != kResponseSub) {
    return AbortCode::none;
  }
  const auto number = static_cast<std::uint16_t>(address.index - od::objects::kSdoServer);
  const can::CobId wanted{static_cast<std::uint32_t>(load_le(value))};
  const AbortCode why = can::check_cob_id(cob_id(number, address.sub), wanted);
  const bool taken = why == AbortCode::none &&
                     has_identifier(dictionary_, od::objects::kSdoServer,
                                    od::objects::kSdoServer + kSdoServers - 1, address, wanted);
  return taken ? AbortCode::invalid_value : why;
}

void SdoServers::written(od::Address /*address*/) {
  changed_ = true;
}

void SdoServers::configure(Entry& entry) {
  const can::CobId response = cob_id(entry.number, kResponseSub);
  can::CobId request = cob_id(entry.number, kRequestSub);
  // The identifiers of the default server are restricted for other channels.
  if (entry.number != 0 && (!can::is_usable(request) || !can::is_usable(response) ||
                            of_an_earlier_one(entry.number, request, response))) {
    request = can::CobId{};
  }
  if (request == entry.request && response == entry.server->response_id()) {
    return;
  }
  if (entry.request.valid()) {
    dispatch_.remove(entry.request.id(), entry.request.extended(), can::Service::sdo_server,
                     entry.number);
  }
  entry.request = request;
  entry.server->configure(request, response);
  if (request.valid()) {
    dispatch_.add(request.id(), request.extended(), can::Service::sdo_server, entry.number);
  }
}

bool SdoServers::of_an_earlier_one(std::uint16_t number, can::CobId request,
                                   can::CobId response) const {
  const auto index = static_cast<std::uint16_t>(od::objects::kSdoServer + number);
  return has_identifier(dictionary_, od::objects::kSdoServer, index, {index, kRequestSub},
                        request) ||
         has_identifier(dictionary_, od::objects::kSdoServer, index, {index, kResponseSub},
                        response);
}

can::CobId SdoServers::cob_id(std::uint16_t number, std::uint8_t sub) const {
  if (number == 0) {
    return can::CobId{(sub == kRequestSub ? can::kSdoRequestBase : can::kSdoResponseBase) +
                      node_id_};
  }
  const auto index = static_cast<std::uint16_t>(od::objects::kSdoServer + number);
  const auto raw = dictionary_.number({index, sub});
  return can::CobId{static_cast<std::uint32_t>(raw.value_or(can::CobId::kInvalidBit))};
}

}  // namespace linegate::node
