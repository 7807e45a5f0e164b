// SPDX-License-Identifier: Apache-2.0
#include "stack/node/node.h"

#include <algorithm>
#include <utility>

#include "stack/node/impl.h"

namespace linegate::node {

void MasterServices::consumer_lost(std::uint8_t /*node*/, Instant /*deadline*/) {
}
void MasterServices::unwanted(const can::Frame& /*frame*/) {
}

void MasterServices::before_boot(Instant /*now*/) {
}

void MasterServices::state_changed(nmt::State /*state*/, Instant /*now*/) {
}

void MasterServices::tpdo_transmitted(std::uint16_t /*number*/,
                                      std::span<const std::byte> /*differs*/) {
}

void MasterServices::mpdo_transmitted(od::Address /*source*/) {
}

void Application::state_changed(nmt::State /*state*/, Instant /*now*/) {
}
bool Application::may_send_emcy(std::uint16_t /*code*/, std::span<std::byte, 5> /*info*/) {
  return true;
}
bool Application::may_operate(Instant /*now*/) {
  return true;
}
void Application::time_received(const time::TimeOfDay& /*time*/, Instant /*now*/) {
}
void Application::reset(bool /*whole_node*/, Instant /*now*/) {
}

Node::Node(od::Dictionary dictionary, Options options, EventLog& events, image::ProcessImage* image)
    : impl_(std::make_unique<Impl>(std::move(dictionary), options, events, image)) {
}
Node::~Node() = default;

void Node::set_master_services(MasterServices* master_services) {
  impl_->master_services = master_services;
}
void Node::set_application(Application* application) {
  impl_->application = application;
  impl_->pdos.set_listener(impl_.get(), application != nullptr);
}

void Node::set_stored_adjustment(std::function<void(storage::StoredValue& value)> adjustment) {
  impl_->storage.set_adjustment(std::move(adjustment));
}

void Node::set_medium(storage::Medium* medium) {
  impl_->storage.set_medium(medium);
}

void Node::medium_done(bool good) {
  impl_->storage.done(good);
}

void Node::start(Instant now) {
  impl_->start(now);
}
void Node::command(nmt::Command command, Instant now) {
  impl_->command(command, now);
}
emcy::SendResult Node::set_error(std::uint16_t code, std::span<const std::byte> info, Instant now) {
  impl_->now = now;
  return impl_->set_error(code, info);
}
bool Node::reset_error(std::uint16_t code, std::span<const std::byte> info, Instant now) {
  impl_->now = now;
  return impl_->reset_error(code, info);
}
emcy::SendResult Node::report_error(std::uint16_t code, std::uint8_t bits,
                                    std::span<const std::byte> info, Instant now) {
  impl_->now = now;
  return impl_->report_error(code, bits, info);
}
void Node::end_reported(std::uint16_t code, Instant now) {
  impl_->now = now;
  impl_->end_reported(code);
}
bool Node::error_free() const {
  return impl_->errors.error_free();
}
void Node::bus_event(const can::BusEvent& event) {
  impl_->bus_event(event);
}
Indicators Node::indicators() const {
  return impl_->indicators();
}
void Node::set_error_bits(std::uint8_t temporary, std::uint8_t sticky) {
  impl_->set_error_bits(temporary, sticky);
}

void Node::device_error(std::uint8_t error_class, Instant now) {
  impl_->now = now;
  impl_->obey_error_behaviour(error_class);
}
[[gnu::hot]] void Node::receive(std::span<const can::Frame> frames) {
  impl_->receive(frames);
}
void Node::suspend(Instant now) {
  impl_->suspend(now);
}
void Node::resume() {
  impl_->resume();
}
void Node::advance(Instant now) {
  impl_->advance(now);
}
Instant Node::next_wake() const {
  return impl_->next_wake();
}

[[gnu::hot]] std::uint64_t Node::served() const {
  return impl_->attended + impl_->counters.sent.frames - impl_->pdos.counters().sent;
}
Instant Node::next_service() const {
  return impl_->next_service();
}
void Node::pass_time(Instant now) {
  impl_->now = std::max(impl_->now, now);
  impl_->pdos.pass_time(now);
}

// PDOs rank between the classes of the queue.
[[gnu::hot]] bool Node::Impl::next_frame(can::Frame& out, Instant time, std::uint64_t number) {
  const std::size_t syncs = transmit.queued(can::TransmitClass::sync);
  if (transmit.pop_urgent(out)) {
    if (transmit.queued(can::TransmitClass::sync) != syncs && time > sync_queued) [[unlikely]] {
      pdos.sync_handed_out(time);
    }
  } else if (!pdos.next_frame(out, time, number) && !transmit.pop_rest(out)) {
    return false;
  }
  counters.sent.add(out);
  return true;
}

[[gnu::hot]] bool Node::next_frame(can::Frame& out, Instant now, std::uint64_t number) {
  Impl& node = *impl_;
  if (node.transmit.empty()) {
    return !node.pdos.quiet() && node.pdos.next_frame(out, now, number, node.counters.sent);
  }
  if (!node.pdos.quiet() || node.transmit.queued(can::TransmitClass::sync) != 0) {
    return node.next_frame(out, now, number);
  }
  return node.transmit.pop(out, node.counters.sent);
}

bool Node::peek(can::Frame& out, Instant now) {
  const can::Frame* first = impl_->transmit.first_urgent();
  if (first == nullptr && impl_->pdos.peek(out, now)) {
    return true;
  }
  first = first != nullptr ? first : impl_->transmit.first_rest();
  if (first == nullptr) {
    return false;
  }
  out.id = first->id;
  out.flags = first->flags;
  return true;
}

bool Node::wants_to_send(Instant now) const {
  return !impl_->transmit.empty() || impl_->pdos.wants_to_send(now);
}

nmt::State Node::state() const {
  return impl_->slave.state();
}
std::uint8_t Node::node_id() const {
  return impl_->options.node_id;
}
[[gnu::hot]] od::Dictionary& Node::dictionary() {
  return impl_->dictionary;
}
[[gnu::hot]] const od::Dictionary& Node::dictionary() const {
  return impl_->dictionary;
}
[[gnu::hot]] pdo::Engine& Node::pdos() {
  return impl_->pdos;
}
[[gnu::hot]] const pdo::Engine& Node::pdos() const {
  return impl_->pdos;
}
emcy::Producer& Node::emcy() {
  return impl_->emcy;
}
const emcy::Producer& Node::emcy() const {
  return impl_->emcy;
}
SdoClients& Node::sdo_clients() {
  return impl_->sdo_clients;
}
void Node::set_nmt_slave(bool slave) {
  impl_->options.nmt_slave = slave;
  impl_->keep_early_pdos();
}

void Node::set_sdo_network_handler(sdo::NetworkHandler* handler) {
  impl_->sdo.set_network_handler(handler);
}
time::Service& Node::clock() {
  return impl_->clock;
}
const time::Service& Node::clock() const {
  return impl_->clock;
}
void Node::show_monitored(const nmt::HeartbeatConsumer* consumer) {
  impl_->heartbeat_times.show(consumer);
  if (consumer != nullptr) {
    impl_->heartbeats.leave_states_to_another();
  }
}
can::Dispatch& Node::dispatch() {
  return impl_->dispatch;
}
can::TransmitQueue& Node::transmit() {
  return impl_->transmit;
}
const can::TransmitQueue& Node::transmit() const {
  return impl_->transmit;
}
[[gnu::hot]] const NodeCounters& Node::counters() const {
  return impl_->counters;
}

}  // namespace linegate::node
