// SPDX-License-Identifier: Apache-2.0
// SDO transfers of other nodes: reports them, and learns PDO mappings from them.
#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/line/build.h"
#include "stack/line/observer_line.h"
#include "stack/line/srdo_plan.h"
#include "stack/od/objects.h"

namespace linegate::line {
namespace {

using image::Direction;
using observer::KnownPdo;

// A node is configured write by write, followed by its NMT start or its first PDO. If neither
// comes, the configuration counts as finished this long after the last write.
constexpr Duration kConfigured = std::chrono::seconds(1);

bool same_pdo(const pdo::Parameters& a, const pdo::Parameters& b) {
  return a.number == b.number && a.cob_id.raw == b.cob_id.raw && a.type == b.type &&
         std::ranges::equal(a.mapping, b.mapping, {}, &pdo::Mapping::raw, &pdo::Mapping::raw);
}

bool has(const std::vector<KnownPdo>& pdos, const KnownPdo& wanted) {
  return std::ranges::any_of(pdos, [&](const KnownPdo& known) {
    return known.kind == wanted.kind && known.complete == wanted.complete &&
           same_pdo(known.parameters, wanted.parameters);
  });
}

bool has_number(const std::vector<KnownPdo>& pdos, const KnownPdo& wanted) {
  return std::ranges::any_of(pdos, [&](const KnownPdo& known) {
    return known.kind == wanted.kind && known.parameters.number == wanted.parameters.number;
  });
}

observer::LearnedParameters::Seen seen_in(const observer::Transfer& transfer) {
  using Seen = observer::LearnedParameters::Seen;
  return transfer.download ? Seen::written : Seen::read;
}

// The COB-ID of EMCY, or one of an SDO server other than the default one.
bool is_identifier(od::Address address) {
  constexpr od::Address kEmcy{od::objects::kEmcyCobId, 0};
  return address == kEmcy ||
         (address.index > od::objects::kSdoServer && address.index <= od::objects::kLastSdoServer &&
          (address.sub == 1 || address.sub == 2));
}

Event mapping_event(std::uint8_t node, const KnownPdo& pdo, bool complete, Instant now) {
  return {.time = now,
          .node = node,
          .data = event::PdoMapping{
              .number = pdo.parameters.number, .kind = pdo.kind, .complete = complete}};
}

pdo::RemoteNode remote(const NodeConfig& node, const observer::PdoKnowledge& known,
                       std::vector<KnownPdo> pdos) {
  pdo::RemoteNode out{.id = node.id,
                      .name = node.name,
                      .pdos = {},
                      .device = &known.device(),
                      .deadline = node.pdo_deadline,
                      .srdos = transmitted_srdos(node)};
  for (KnownPdo& pdo : pdos) {
    (pdo.kind == pdo::PdoKind::tpdo ? out.pdos.tpdos : out.pdos.rpdos)
        .push_back(std::move(pdo.parameters));
  }
  set_inhibit_times(node, out.pdos);
  return out;
}

}  // namespace

ObserverLine::Device* ObserverLine::find(std::uint8_t id) {
  const auto it = std::ranges::find(devices, id, [](const Device& d) { return d.pdos.node(); });
  return it == devices.end() ? nullptr : &*it;
}

// On a line of CANopen FD the identifier has the node-ID of the sender. What is learned is of the
// server.
void ObserverLine::receive_usdo(std::uint16_t index, const can::Frame& frame) {
  const auto sender = static_cast<std::uint8_t>(index & ~kSdoRequest);
  if (!usdo::well_formed(frame)) {
    malformed(frame, sender);
    return;
  }
  if (!usdo::has_fields(frame)) {
    if (usdo::is_known(usdo::command_of(frame))) {
      malformed(frame, sender);
    } else {
      ++counters_.frames_unused;  // of a transfer that Linegate does not use
    }
    return;
  }
  const auto ended =
      (index & kSdoRequest) != 0 ? usdo.request(sender, frame) : usdo.answer(sender, frame);
  if (ended && ended->server >= can::kMinNodeId && ended->server <= can::kMaxNodeId) {
    report_transfer(ended->server, ended->transfer, frame.time);
    learn(ended->server, ended->transfer, frame.time);
  }
}

void ObserverLine::receive_sdo(std::uint16_t index, const can::Frame& frame) {
  if (config_.canopen_fd) {
    receive_usdo(index, frame);
    return;
  }
  const bool further = (index & observer::SdoChannels::kFurther) != 0;
  const auto id =
      further ? channels.node_of(index) : static_cast<std::uint8_t>(index & ~kSdoRequest);
  if (frame.length != can::kMaxClassicData || frame.remote()) {
    if (further || !channels.hears(frame)) {  // report a frame on two channels only once
      malformed(frame, id);
    }
    return;
  }
  if (const auto ended = further ? channels.receive(index, frame) : follow(index, frame)) {
    report_transfer(id, *ended, frame.time);
    learn(id, *ended, frame.time);
  }
}

std::optional<observer::Transfer> ObserverLine::follow(std::uint16_t index,
                                                       const can::Frame& frame) {
  observer::SdoFollower& follower = transfers[index & (kSdoRequest - 1U)];
  return (index & kSdoRequest) != 0 ? follower.request(frame) : follower.answer(frame);
}

void ObserverLine::report_transfer(std::uint8_t id, const observer::Transfer& transfer,
                                   Instant now) {
  if (transfer.aborted) {
    events_.emit({.time = now,
                  .node = id,
                  .data = event::SdoAbort{.abort = transfer.abort,
                                          .index = transfer.address.index,
                                          .sub = transfer.address.sub}});
    return;
  }
  event::SdoTransfer out{.size = static_cast<std::uint32_t>(transfer.size),
                         .index = transfer.address.index,
                         .sub = transfer.address.sub,
                         .download = transfer.download};
  std::ranges::copy(transfer.kept().first(std::min(transfer.kept().size(), out.data.size())),
                    out.data.begin());
  events_.emit({.time = now, .node = id, .data = out});
}

// After an upload as well as a download the device has this value.
void ObserverLine::learn(std::uint8_t id, const observer::Transfer& transfer, Instant now) {
  if (!transfer.complete()) {
    return;
  }
  const bool is_number = transfer.size > 0 && transfer.size <= sizeof(std::uint32_t);
  const auto number =
      is_number ? static_cast<std::uint32_t>(load_le(transfer.kept())) : std::uint32_t{0};
  if (is_number && !transfer.download) {
    nodes.identity(id, transfer.address, number);
  }
  learn_identifier(id, transfer);
  srdos.learn(id, transfer.address, transfer.kept());
  if (transfer.address.index == od::objects::kSrdoSignature &&
      transfer.size == sizeof(std::uint16_t)) {
    srdos.check_signature(id, transfer.address.sub, static_cast<std::uint16_t>(number), now);
  }
  Device* device = find(id);
  if (device != nullptr &&
      device->pdos.learn(transfer.address, transfer.kept(), seen_in(transfer)) &&
      device->written_until != kNever) {
    relink_at = now + kConfigured;
    device->written_until = relink_at;
  }
}

void ObserverLine::learn_identifier(std::uint8_t id, const observer::Transfer& transfer) {
  identifiers.at(id).follow_storage(transfer.address, transfer.kept(), seen_in(transfer));
  if (!is_identifier(transfer.address) || transfer.size != sizeof(std::uint32_t)) {
    return;
  }
  (void)identifiers.at(id).learn(transfer.address, transfer.kept(),
                                 described_identifier(id, transfer.address), seen_in(transfer));
  set_identifier(id, transfer.address, transfer.kept());
}

// value: empty if the node does not have it.
void ObserverLine::set_identifier(std::uint8_t id, od::Address address,
                                  std::span<const std::byte> value) {
  const can::CobId cob_id{value.size() == sizeof(std::uint32_t)
                              ? load_le<std::uint32_t>(value.data())
                              : can::CobId::kInvalidBit};
  if (address.index == od::objects::kEmcyCobId) {
    nodes.listen_emcy(id, cob_id);
  } else if (!config_.canopen_fd) {
    channels.learn(id, address, cob_id.raw);
  }
}

// The COB-ID according to the configuration, and to the device file.
std::vector<std::byte> ObserverLine::described_identifier(std::uint8_t id,
                                                          od::Address address) const {
  const auto node = std::ranges::find(config_.nodes, id, &NodeConfig::id);
  if (address.index == od::objects::kEmcyCobId) {
    std::vector<std::byte> out(sizeof(std::uint32_t));
    const can::CobId cob_id =
        node == config_.nodes.end() ? can::CobId{can::kEmcyBase + id} : emcy_cob_id(*node);
    store_le(std::span(out), std::uint64_t{cob_id.raw});
    return out;
  }
  if (node == config_.nodes.end()) {
    return {};
  }
  const auto set = std::ranges::find(node->objects, address, &ObjectValue::address);
  if (set != node->objects.end()) {
    return set->data;
  }
  const od::VariableDescription* const described = node->device.find(address);
  return described == nullptr ? std::vector<std::byte>() : described->value;
}

// The node has its stored COB-IDs. What is not known to be stored, or not, remains.
void ObserverLine::follow_boot_up(std::uint8_t id) {
  identifiers.at(id).boot_up();
  identifiers.at(id).for_each(
      [this, id](od::Address address, const observer::LearnedParameters::Value& value) {
        set_identifier(id, address, value);
      });
}

// The layout changes only if the configuration that follows is another one: mostly, a master writes
// the same values after each reset. Until then, no frame is shown with a mapping that has ended.
void ObserverLine::follow_reset(Device& device, bool booted) {
  const std::vector<KnownPdo> known = device.pdos.pdos();
  listen(device, true);
  device.ended.clear();
  std::ranges::copy_if(device.used, std::back_inserter(device.ended),
                       [&](const KnownPdo& pdo) { return !has(known, pdo); });
  const bool same = device.ended.empty() && known.size() == device.used.size();
  device.written_until = same ? Instant{} : kNever;
  device.resetting = !same && !booted;
  if (!device.ended.empty()) {
    node_data_invalid(device.pdos.node());
    listen(device, false);
  }
}

// Whether frames of its PDOs that a reset has ended are received.
void ObserverLine::listen(const Device& device, bool on) {
  for (const KnownPdo& ended : device.ended) {
    (ended.kind == pdo::PdoKind::tpdo ? inputs : outputs)
        ->listen(device.pdos.node(), ended.parameters.number, on);
  }
}

// A PDO is invalid while it is written: a relink for another node meanwhile keeps the PDOs in use.
std::vector<KnownPdo> ObserverLine::known_pdos(const Device& device, Instant now) {
  return device.written_until > now ? device.used : device.pdos.pdos();
}

Loaded<pdo::LinkPlan> ObserverLine::plan_of_what_is_known(Instant now) const {
  std::vector<pdo::RemoteNode> remotes;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    remotes.push_back(remote(config_.nodes[i], devices[i].pdos, known_pdos(devices[i], now)));
  }
  Loaded<pdo::LinkPlan> plan = pdo::plan_links(remotes);
  if (plan.value) {
    set_queues(config_, *plan.value);
  }
  return plan;
}

bool ObserverLine::nothing_new(Instant now) const {
  return std::ranges::all_of(devices, [now](const Device& device) {
    const std::vector<KnownPdo> known = known_pdos(device, now);
    return known.size() == device.used.size() &&
           std::ranges::all_of(known, [&](const KnownPdo& pdo) { return has(device.used, pdo); });
  });
}

// PDOs that cannot be linked (two on one COB-ID, temporarily or permanently) leave the image
// unchanged: the next write may correct them.
void ObserverLine::relink(Instant now) {
  if (std::exchange(relink_at, kNever) == kNever) {
    return;
  }
  for (const Device& device : devices) {
    relink_at = device.written_until > now ? earlier(relink_at, device.written_until) : relink_at;
  }
  const bool is_hidden = std::ranges::any_of(devices, [now](const Device& device) {
    return !device.ended.empty() && device.written_until <= now;
  });
  if (nothing_new(now) && !is_hidden) {
    return;
  }
  Loaded<pdo::LinkPlan> plan = plan_of_what_is_known(now);
  if (!plan.value) {
    emit(now, event::ConfigurationError{.abort = AbortCode::parameter_incompatible,
                                        .index = od::objects::kTpdoCommunication});
    return;
  }
  const std::uint64_t before[] = {inputs->layout().id, outputs->layout().id};
  for (Device& device : devices) {
    report_mappings(device, now);
    if (device.written_until <= now) {
      device.ended.clear();
    }
  }
  const std::vector<pdo::LinkedPdo> rpdos = plan.value->rpdos;
  replace(Direction::inputs, plan.value->inputs, std::move(plan.value->rpdos), now);
  srdos.connect(inputs->engine, inputs->image, rpdos);
  replace(Direction::outputs, plan.value->outputs, as_received(std::move(plan.value->tpdos)), now);
  for (const Device& device : devices) {
    listen(device, false);
  }
  if (before[0] == inputs->layout().id && before[1] == outputs->layout().id) {
    return;
  }
  ++revision;
  emit(now, event::LayoutChanged{.inputs = inputs->layout().id, .outputs = outputs->layout().id});
}

void ObserverLine::replace(Direction direction, const image::Layout& layout,
                           std::vector<pdo::LinkedPdo> pdos, Instant now) {
  const bool in = direction == Direction::inputs;
  std::unique_ptr<Overheard>& side = in ? inputs : outputs;
  if (side->layout().id == layout.id) {
    side->link(std::move(pdos));
    return;
  }
  auto next = std::make_unique<Overheard>(events_, in ? dispatch : output_dispatch, layout,
                                          std::vector<pdo::LinkedPdo>{}, longest_pdo_bytes());
  next->copy_values(*side);
  side->engine.drop_receptions();
  add(in ? inputs_before : outputs_before, side->engine.counters());
  side = nullptr;  // releases its identifiers
  next->link(std::move(pdos));
  next->engine.set_operational(running_ && !sleep.sleeps(), now);
  side = std::move(next);
}

void ObserverLine::report_mappings(Device& device, Instant now) {
  std::vector<KnownPdo> known = known_pdos(device, now);
  for (const KnownPdo& pdo : known) {
    if (!has(device.used, pdo)) {
      events_.emit(mapping_event(device.pdos.node(), pdo, pdo.complete, now));
    }
  }
  for (const KnownPdo& pdo : device.used) {
    if (!has_number(known, pdo)) {
      events_.emit(mapping_event(device.pdos.node(), pdo, false, now));
    }
  }
  device.used = std::move(known);
}

}  // namespace linegate::line
