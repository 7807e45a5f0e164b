// SPDX-License-Identifier: Apache-2.0
#include "stack/line/line.h"

#include <utility>

#include "stack/line/build.h"
#include "stack/line/devices.h"
#include "stack/line/line_impl.h"
#include "stack/line/observer.h"

namespace linegate::line {

Loaded<std::unique_ptr<Line>> Line::make(LineConfig config) {
  Loaded<std::unique_ptr<Line>> out;
  out.diagnostics = check(config);
  if (has_errors(out.diagnostics)) {
    return out;
  }
  const bool has_devices = !config.devices.empty();
  Loaded<pdo::LinkPlan> plan = has_devices ? device_plan(config) : link_plan(config);
  out.diagnostics.insert(out.diagnostics.end(), plan.diagnostics.begin(), plan.diagnostics.end());
  if (!plan.ok()) {
    return out;
  }
  if (has_devices || config.role == Role::observer) {
    config.own_objects.clear();  // they have no such dictionary
  } else if (!place_own_objects(config, *plan.value)) {
    out.diagnostics.push_back({Severity::error, config.name, 0, 0,
                               "own objects in the image: an area would have more than " +
                                   std::to_string(image::kMaxAreaBytes) + " bytes"});
    return out;
  }
  const std::vector<Diagnostic> wrong = check_outputs(config, plan.value->outputs);
  out.diagnostics.insert(out.diagnostics.end(), wrong.begin(), wrong.end());
  if (has_errors(out.diagnostics)) {
    return out;
  }
  if (has_devices || config.role == Role::observer) {
    config.forwarding = {};  // they have no dictionary for it
  } else {
    const auto faults = routing::check(config.forwarding, *plan.value, config.name);
    out.diagnostics.insert(out.diagnostics.end(), faults.begin(), faults.end());
    if (has_errors(faults)) {
      return out;
    }
    routing::show_in_records(config.forwarding, *plan.value);
  }
  std::unique_ptr<Base> role;
  if (has_devices) {
    role = std::make_unique<Devices>(std::move(config), *std::move(plan.value));
  } else if (config.role == Role::observer) {
    role = std::make_unique<Observer>(std::move(config), *std::move(plan.value));
  } else {
    role = std::make_unique<Impl>(std::move(config), *std::move(plan.value));
  }
  out.value.emplace(new Line(std::move(role)));
  return out;
}

Line::Line(std::unique_ptr<Base> impl) : impl_(std::move(impl)) {
}
Line::~Line() = default;

const LineConfig& Line::config() const {
  return impl_->config;
}
const image::Layout& Line::layout(image::Direction direction) const {
  return impl_->layout(direction);
}

std::uint64_t Line::layout_revision() const {
  return impl_->layout_revision();
}

void Line::start(Instant now) {
  impl_->stir(now);
  impl_->start(now);
}

[[gnu::hot]] void Line::receive(std::span<const can::Frame> frames, Instant /*now*/) {
  if (impl_->load.wants_fast()) [[unlikely]] {
    impl_->receive_counted(frames);
  } else {
    impl_->receive(frames);
  }
}

void Line::set_bit_rates(std::uint32_t bit_rate, std::uint32_t data_bit_rate) {
  const std::uint32_t configured = impl_->config.bit_rate;
  impl_->load.set_bit_rates(configured != 0 ? configured : bit_rate, data_bit_rate);
}

void Line::bus_event(const can::BusEvent& event) {
  impl_->stir();
  impl_->bus_event(event);
}
void Line::report(const Event& event) {
  impl_->events.emit(event);
  if (event.kind == EventKind::output_refused) {
    impl_->note_refused(static_cast<std::uint16_t>(event.value),
                        static_cast<OutputRefusal>(event.code), event.time);
  }
}
std::size_t Line::output_groups() const {
  return impl_->output_groups();
}
void Line::output_state(std::size_t position, OutputState& out) const {
  impl_->output_state(position, out);
}
void Line::set_medium(storage::Medium* medium, std::uint8_t device) {
  impl_->stir();
  impl_->set_medium(medium, device);
}
void Line::medium_done(bool good, std::uint8_t device) {
  impl_->stir();
  impl_->medium_done(good, device);
}
[[gnu::hot]] void Line::advance(Instant now) {
  impl_->advance(now);
}
void Line::execute(Command command, Instant now) {
  impl_->stir(now);
  impl_->execute(std::move(command), now);
}

OutputRefusal Line::write_outputs(const OutputWrite& write, Instant now) {
  impl_->stir(now);
  return impl_->write_outputs(write, now);
}

[[gnu::hot]] void Line::write_bound(std::span<const BoundValue> values, Instant now) {
  impl_->write_bound(values, now);
}
[[gnu::hot]] Line::Input Line::input(std::uint32_t entry) const {
  return impl_->input(entry);
}

void Line::deliver(const routing::Message& message, Instant now) {
  impl_->stir(now);
  impl_->deliver(message, now);
}
void Line::set_routes(const routing::Config& wanted, Instant now) {
  impl_->stir(now);
  impl_->set_routes(wanted);
}
bool Line::take_message(routing::Message& out) {
  return impl_->messages.pop(out);
}

void Line::stop(Instant now) {
  impl_->stir(now);
  impl_->stop(now);
}

[[gnu::hot]] Instant Line::next_wake() const {
  return impl_->next_wake();
}
[[gnu::hot]] bool Line::next_frame(can::Frame& out, Instant now) {
  return impl_->load.wants_fast() ? impl_->next_counted(out, now) : impl_->next_frame(out, now);
}
bool Line::wants_to_send(Instant now) const {
  return impl_->wants_to_send(now);
}
[[gnu::hot]] bool Line::has_news() const {
  return !impl_->events.empty() || !impl_->replies.empty();
}
std::size_t Line::take_events(std::span<Event> out) {
  return impl_->events.take(out);
}

bool Line::take_reply(Reply& out) {
  if (impl_->replies.empty()) {
    return false;
  }
  out = std::move(impl_->replies.front());
  impl_->replies.pop_front();
  return true;
}

void Line::snapshot(image::Direction direction, image::Snapshot& into, Instant now, bool merge) {
  impl_->snapshot(direction, into, now, merge);
}

bool Line::request_pdo(std::uint16_t rpdo) {
  impl_->stir();
  return impl_->request_pdo(rpdo);
}
[[gnu::hot]] bool Line::image_changed(image::Direction direction) const {
  return impl_->image_changed(direction);
}
[[gnu::hot]] bool Line::image_touched(image::Direction direction) const {
  return impl_->image_touched(direction);
}
std::optional<OwnDevice> Line::own_device(std::uint8_t node) const {
  return impl_->own_device(node);
}
node::Indicators Line::indicators() const {
  return impl_->indicators();
}
void Line::set_utc(Duration offset) {
  impl_->set_utc(offset);
}
std::optional<Duration> Line::network_utc(Instant now) const {
  return impl_->network_utc(now);
}
std::uint32_t Line::sync_count() const {
  return impl_->syncs;
}

void Line::routes(std::vector<routing::Route>& out) const {
  impl_->routes(out);
}

LineState Line::state() const {
  LineState out = impl_->state();
  out.routing = impl_->routed;
  return out;
}
std::uint64_t Line::node_revision(std::uint8_t node) const {
  return node < 128 ? impl_->node_revision(node) : 0;
}
NodeState Line::node_state(std::uint8_t node) const {
  return node < 128 ? impl_->node_state(node) : NodeState{};
}
od::Dictionary& Line::dictionary() {
  impl_->stir();  // whoever asks may write
  return impl_->dictionary();
}
const od::Dictionary& Line::dictionary() const {
  return impl_->dictionary();
}

}  // namespace linegate::line
