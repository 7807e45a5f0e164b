// SPDX-License-Identifier: Apache-2.0
#include "stack/pdo/engine.h"

#include "stack/base/assert.h"
#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {

void Listener::rpdo_received(std::uint16_t /*number*/, Instant /*now*/) {
}
void Listener::before_tpdo(std::uint16_t /*number*/) {
}
void Listener::tpdo_transmitted(std::uint16_t /*number*/, std::span<const std::byte> /*differs*/) {
}
void Listener::mpdo_transmitted(od::Address /*source*/) {
}
void Listener::rpdo_wrong_length(std::uint16_t /*number*/, unsigned /*mapped*/,
                                 unsigned /*received*/) {
}
void Listener::rpdo_deadline(std::uint16_t /*number*/) {
}
void Listener::rpdo_recovered(std::uint16_t /*number*/) {
}
void Listener::mpdo_received(std::uint16_t /*number*/, od::Address /*place*/, Instant /*now*/) {
}
void Listener::mpdo_refused(std::uint16_t /*number*/, MpdoMode /*mode*/, od::Address /*place*/,
                            AbortCode /*why*/) {
}
void Listener::mpdo_malformed(const can::Frame& /*frame*/) {
}
void Listener::rpdo_in_order(std::uint16_t /*number*/) {
}
void Listener::pdo_unusable(od::Address /*place*/, AbortCode /*why*/) {
}

Engine::Impl::Impl(od::Dictionary& d, can::Dispatch& p, EventLog& e, image::ProcessImage* i,
                   std::uint64_t& sending, std::uint64_t& asking)
    : dictionary(d),
      dispatch(p),
      events(e),
      own_image(i == nullptr ? std::make_unique<image::ProcessImage>() : nullptr),
      image(i == nullptr ? *own_image : *i),
      pending(sending),
      asked(asking) {
  inputs = &image.area(image::Direction::inputs);
  outputs = &image.area(image::Direction::outputs);
  dictionary.add_observer(*this);
}

Engine::Impl::~Impl() {
  listener = nullptr;  // the listener may be partly destroyed
  hears_frames = false;
  auto_notify.reset();
  follow_sources();
  stop_all();
  dictionary.remove_observer(*this);
  hook_records(nullptr);
}

Engine::Engine(od::Dictionary& dictionary, can::Dispatch& dispatch, EventLog& events,
               image::ProcessImage* image)
    : impl_(std::make_unique<Impl>(dictionary, dispatch, events, image, sending_, asking_)) {
}

Engine::~Engine() = default;

void Engine::set_listener(Listener* listener, bool every_frame) {
  impl_->listener = listener;
  impl_->hears_frames = listener != nullptr && every_frame;
  impl_->follow_mode();
}

void Engine::link(const LinkPlan& plan) {
  impl_->linked_rpdos = plan.rpdos;
  impl_->linked_tpdos = plan.tpdos;
  impl_->assign_queues();
  if (!plan.tpdos.empty()) {
    impl_->image.follow_transmission();
  }
}

void Engine::follow_transmission() {
  impl_->reports_transmission = true;
}

void Engine::forget_transmission() {
  impl_->forget_transmission();
}

bool Engine::pop_reception(Reception& out) {
  return impl_->pop_reception(out);
}

void Engine::drop_receptions() {
  impl_->assign_queues();
}

void Engine::set_node_id(std::uint8_t node_id) {
  impl_->node_id = node_id;
}

void Engine::set_max_length(std::size_t bytes) {
  LINEGATE_ASSERT(bytes == can::kMaxClassicData || bytes == can::kMaxFdData,
                  "a PDO has up to 8 bytes, or up to 64 in an FD frame");
  impl_->max_bytes = bytes;
}

std::vector<Diagnostic> Engine::configure() {
  return impl_->configure();
}

void Engine::set_operational(bool operational, Instant now) {
  impl_->set_operational(operational, now);
}

// A SYNC that no PDO waits for costs no call.
[[gnu::hot]] void Engine::sync(std::uint8_t counter, Instant now) {
  Impl& engine = *impl_;
  engine.latest = now;
  if (!engine.operational) {
    return;
  }
  if (engine.shadows.size() != 0) {
    engine.commit_rpdos();
  }
  if (engine.window > Duration::zero()) {
    engine.open_window(now);
  }
  // The listener may have left Operational within rpdo_received().
  if (engine.operational && !engine.sync_tpdos.empty()) {
    engine.sample_tpdos(counter);
  }
}

void Engine::sync_handed_out(Instant now) {
  if (impl_->operational) {
    impl_->open_window(now);
    impl_->sample_again();
  }
}

bool Engine::any_unusable() const {
  const auto is_problem = [](const Impl::ReportedProblem& reported) {
    return reported.why != AbortCode::none;
  };
  return std::ranges::any_of(impl_->reported_rpdos, is_problem) ||
         std::ranges::any_of(impl_->reported_tpdos, is_problem);
}

void Engine::set_sync_window(Duration window) {
  if (impl_->window != window) {
    impl_->window = window;
    impl_->window_end = kNever;
    impl_->window_open = false;
    impl_->open_rpdos();
  }
}

void Engine::drop_waiting(std::uint8_t node) {
  for (const Shadow& shadow : impl_->shadows.from(0)) {
    const auto number = static_cast<std::uint16_t>(shadow.slot + 1U);
    if (impl_->image.node_of(image::Direction::inputs, number) == node) {
      impl_->shadows.remove(shadow.slot);
    }
  }
}

void Engine::pass_time(Instant now) {
  impl_->latest = std::max(impl_->latest, now);
}

void Engine::advance(Instant now) {
  impl_->latest = now;
  impl_->close_window(now);
  if (now >= impl_->next_release) {
    impl_->release(now);
  }
  while (const std::optional<std::size_t> timer = impl_->timers.pop_due(now)) {
    const std::size_t rpdos = impl_->rpdos.size();
    if (*timer < rpdos) {
      impl_->check_deadline(static_cast<std::uint16_t>(*timer), now);
    } else {
      impl_->on_event_timer(static_cast<std::uint16_t>(*timer - rpdos), now);
    }
  }
}

[[gnu::hot]] Instant Engine::next_wake() const {
  const Instant next = earlier(impl_->timers.next(), impl_->next_sending());
  return impl_->window_open ? earlier(next, impl_->window_end) : next;
}

bool Engine::peek(can::Frame& out, Instant now) {
  return impl_->peek(out, now);
}

bool Engine::wants_to_send(Instant now) const {
  return impl_->wants_to_send(now);
}

std::uint64_t Engine::revision() const {
  return impl_->revision;
}

[[gnu::hot]] const EngineCounters& Engine::counters() const {
  return impl_->counters;
}

}  // namespace linegate::pdo
