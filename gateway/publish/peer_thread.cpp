// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/peer_thread.h"

#include <algorithm>
#include <utility>

#include <poll.h>
#include <pthread.h>
#include <spdlog/spdlog.h>

#include "gateway/runtime/clock.h"
#include "stack/base/byte_order.h"
#include "stack/base/events.h"
#include "stack/routing/post.h"

namespace linegate::gateway {
namespace {

constexpr Duration kPeerPoll = std::chrono::milliseconds(200);
constexpr Duration kPeerPollWhileWaiting = std::chrono::milliseconds(1);

// Between two events about losses.
constexpr Duration kLossPeriod = std::chrono::seconds(1);
constexpr Duration kExcessPeriod = std::chrono::seconds(10);

std::vector<routing::GatewayLine> sorted(std::vector<routing::GatewayLine> lines) {
  std::ranges::sort(lines);
  lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
  return lines;
}

std::vector<routing::GatewayLine> addressed_by(std::span<const std::unique_ptr<LineHost>> lines) {
  std::vector<routing::GatewayLine> out;
  for (const auto& host : lines) {
    for (const routing::Interface& each : host->plan.config.routing.interfaces) {
      if (each.way != nullptr && host->interface() != 0) {
        out.push_back(each.way->addressed());
      }
    }
  }
  return sorted(std::move(out));
}

std::vector<routing::GatewayLine> emcy_lines_of(std::span<const std::unique_ptr<LineHost>> lines) {
  std::vector<routing::GatewayLine> out;
  for (const auto& host : lines) {
    for (const config::RemoteEmcys& each : host->plan.remote_emcys) {
      out.push_back(each.from);
    }
  }
  return sorted(std::move(out));
}

// Of a line that sends the EMCY, and permits it to enter: it would report each other one as
// refused. nullptr: the line does not.
const config::RemoteEmcys* way_of(const routing::GatewayLine& from,
                                  const routing::ForwardedEmcy& emcy, const LineHost& to) {
  const line::LineConfig& config = to.plan.config;
  const auto& wanted = to.plan.remote_emcys;
  const auto way = std::ranges::find_if(wanted, [&](const config::RemoteEmcys& each) {
    return each.from == from && each.first <= emcy.network && emcy.network <= each.last;
  });
  const bool is_permitted =
      std::ranges::any_of(config.routing.access, [&](const routing::AccessRule& rule) {
        return rule.emcy && rule.first <= emcy.network && emcy.network <= rule.last;
      });
  const bool is_sent = way != wanted.end() && is_permitted && emcy.hops <= config.routing.hop_limit;
  return is_sent ? &*way : nullptr;
}

// As a message of the line that has the interface of the way.
routing::Message message_of(const routing::ForwardedEmcy& emcy, std::uint8_t way,
                            const LineHost& to) {
  const emcy::Message content = routing::encode(emcy);
  routing::Message out{.from = way,
                       .to = to.interface(),
                       .kind = routing::MessageKind::emcy,
                       .hops = emcy.hops,
                       .network = to.plan.config.network_id,
                       .source = emcy.network,
                       .node = emcy.node};
  store_le(out.data.data(), content.code);
  out.data[2] = std::byte{content.error_register};
  std::ranges::copy(content.info, out.data.begin() + 3);
  return out;
}

}  // namespace

PeerThread::~PeerThread() {
  stop();
}

void PeerThread::set_lines(std::span<const std::unique_ptr<LineHost>> lines) {
  lines_ = lines;
  for (const auto& [name, host] : known_) {
    const bool stays =
        std::ranges::any_of(lines, [host = host](const auto& each) { return each.get() == host; });
    if (!stays && client_ != nullptr) {
      routes_.forget(*client_, name);
    }
  }
  known_.clear();
  for (const auto& host : lines) {
    known_.emplace_back(host->name(), host.get());
  }
  addressed_ = addressed_by(lines);
  emcy_lines_ = emcy_lines_of(lines);
  choose_client();
  std::vector<routing::GatewayLine> all = addressed_;
  all.insert(all.end(), emcy_lines_.begin(), emcy_lines_.end());
  if (client_ != nullptr) {
    client_->set_lines(addressed_, emcy_lines_);
  }
  emcys_.set_lines(emcy_lines_);
  std::erase_if(losses_, [&](const Loss& loss) {
    return std::ranges::none_of(lines, [&](const auto& host) { return host->name() == loss.line; });
  });
  routes_.set_lines(sorted(std::move(all)), monotonic_now());
}

// Events are received only if a line sends EMCYs of other gateways.
void PeerThread::choose_client() {
  const bool with_events = !emcy_lines_.empty();
  if (client_ != nullptr && (addressed_.empty() || with_events != with_events_)) {
    routes_.end_requests(*client_);  // of lines that stay
    client_ = nullptr;
  }
  if (client_ == nullptr && !addressed_.empty()) {
    client_ = make_client_(with_events);
    with_events_ = with_events;
  }
}

void PeerThread::start() {
  if (client_ == nullptr || thread_.joinable()) {
    return;
  }
  stop_.lower();
  thread_ = std::thread([this] { run(); });
  relay_ = std::thread([this] { relay(); });
}

void PeerThread::stop() {
  if (!thread_.joinable()) {
    return;
  }
  stop_.raise();
  wakeup_.signal();
  client_->wake();
  thread_.join();
  relay_.join();
}

void PeerThread::run() {
  pthread_setname_np(pthread_self(), "peers");
  while (!stop_.raised()) {
    const Duration pause = routes_.is_waiting() ? kPeerPollWhileWaiting : kPeerPoll;
    const Instant wake = emcys_.next_wake(monotonic_now());
    client_->poll(wake == kNever ? pause : std::clamp(wake - monotonic_now(), Duration{}, pause),
                  *this);
    take_requests();
    const Instant now = monotonic_now();
    routes_.advance(now);
    emcys_.advance([&](const routing::GatewayLine& of) { return routes_.publisher_of(of, now); },
                   now);
    report_losses(now);
  }
}

// The executors signal a descriptor, because waking the client could wait for a lock of DDS.
void PeerThread::relay() {
  pthread_setname_np(pthread_self(), "peers-wake");
  while (!stop_.raised()) {
    pollfd descriptor{.fd = wakeup_.descriptor(), .events = POLLIN, .revents = 0};
    (void)::poll(&descriptor, 1, -1);
    wakeup_.clear();
    client_->wake();
  }
}

// A line that filled the ring continues when it is signalled.
void PeerThread::take_requests() {
  for (const auto& host : lines_) {
    auto& ring = host->port.gateway_requests;
    routing::GatewayRequest request;
    for (std::size_t taken = 0; taken < ring.capacity() && ring.pop(request); ++taken) {
      routes_.take(*client_, host->name(), std::move(request), monotonic_now());
      request = {};
      if (taken + 1 == ring.capacity() / 2) {
        host->executor->wakeup().signal();
      }
    }
  }
}

bool PeerThread::answer(const std::string& line, routing::GatewayAnswer& answer) {
  const auto host =
      std::ranges::find_if(lines_, [&](const auto& each) { return each->name() == line; });
  if (host == lines_.end()) {
    return true;
  }
  const bool pushed = (*host)->port.gateway_answers.push(answer);
  (*host)->executor->wakeup().signal();
  return pushed;
}

void PeerThread::set_present(const std::vector<routing::GatewayLine>& present) {
  log_present(present);
  for (const auto& host : lines_) {
    if (host->interface() == 0) {
      continue;
    }
    host->port.gateways_present.draft().value = present;
    host->port.gateways_present.publish();
    host->executor->wakeup().signal();
  }
}

void PeerThread::log_present(const std::vector<routing::GatewayLine>& present) {
  const auto has = [](const std::vector<routing::GatewayLine>& all,
                      const routing::GatewayLine& line) {
    return std::ranges::find(all, line) != all.end();
  };
  for (const routing::GatewayLine& line : addressed_) {
    if (has(present, line) != has(present_, line)) {
      spdlog::info(
          "routes over gateway {}, line {}: {}", line.gateway, line.line,
          has(present, line) ? "it is there" : "it is not there, or there are two of them");
    }
  }
  present_ = present;
}

void PeerThread::on_state(const routing::GatewayLine& line, std::uint64_t incarnation,
                          std::int64_t time, std::uint16_t network) {
  const Instant now = monotonic_now();
  routes_.take_state(line, incarnation, time, now);
  emcys_.take_state(line, incarnation, time, network, now);
}

void PeerThread::on_event(const routing::GatewayLine& line, std::uint64_t incarnation,
                          const PeerEvent& event) {
  emcys_.take_event(line, incarnation, event, monotonic_now());
}

// --- EMCYs --------------------------------------------------------------------------------------

bool PeerThread::is_wanted(const routing::GatewayLine& from,
                           const routing::ForwardedEmcy& emcy) const {
  return std::ranges::any_of(
      lines_, [&](const auto& host) { return way_of(from, emcy, *host) != nullptr; });
}

void PeerThread::take_emcy(const routing::GatewayLine& from, const routing::ForwardedEmcy& emcy) {
  for (const auto& host : lines_) {
    if (!pass_on(*host, from, emcy)) {
      take_loss(from, emcy.network, 1);
    }
  }
}

// Returns false if there is no room.
bool PeerThread::pass_on(LineHost& host, const routing::GatewayLine& from,
                         const routing::ForwardedEmcy& emcy) {
  const config::RemoteEmcys* const way = way_of(from, emcy, host);
  if (way == nullptr) {
    return true;
  }
  const bool has_room = host.port.gateway_emcys.push(message_of(emcy, way->interface, host));
  host.executor->wakeup().signal();
  return has_room;
}

void PeerThread::take_loss(const routing::GatewayLine& from, std::uint16_t network,
                           std::uint64_t count) {
  emcys_lost_.add(count);
  for (const auto& host : lines_) {
    const auto wanted =
        std::ranges::find(host->plan.remote_emcys, from, &config::RemoteEmcys::from);
    if (wanted != host->plan.remote_emcys.end()) {
      note_loss(*host, {.from = from,
                        .why = AbortCode::timeout,
                        .network = network == 0 ? wanted->first : network,
                        .count = count});
    }
  }
}

void PeerThread::take_excess(const routing::GatewayLine& from, const routing::ForwardedEmcy& emcy) {
  emcys_lost_.add();
  for (const auto& host : lines_) {
    if (way_of(from, emcy, *host) != nullptr) {
      note_loss(*host, {.from = from,
                        .why = AbortCode::out_of_memory,
                        .network = emcy.network,
                        .node = emcy.node,
                        .count = 1});
    }
  }
}

void PeerThread::note_loss(const LineHost& host, Loss loss) {
  loss.line = host.name();
  const auto known = std::ranges::find_if(losses_, [&](const Loss& each) {
    return each.line == loss.line && each.from == loss.from && each.why == loss.why;
  });
  if (known == losses_.end()) {
    losses_.push_back(std::move(loss));
    return;
  }
  known->network = loss.network;
  known->node = loss.node;
  known->count += loss.count;
}

// At most one event for each line, reason and period.
void PeerThread::report_losses(Instant now) {
  for (Loss& loss : losses_) {
    const auto host =
        std::ranges::find_if(lines_, [&](const auto& each) { return each->name() == loss.line; });
    const bool is_excess = loss.why == AbortCode::out_of_memory;
    const Duration period = is_excess ? kExcessPeriod : kLossPeriod;
    if (loss.count == 0 || now < loss.reported + period || host == lines_.end()) {
      continue;
    }
    if (is_excess) {
      spdlog::warn(
          "line {}: {} EMCYs of gateway {}, line {} exceed their rate and are not sent, the last "
          "one of node {} of network {}",
          loss.line, loss.count, loss.from.gateway, loss.from.line, loss.node, loss.network);
    }
    loss.count = 0;
    loss.reported = now;
    Event notice{.data = event::RoutingRefused{.abort = loss.why,
                                               .source = loss.network,
                                               .target = (*host)->plan.config.network_id,
                                               .service = routing::RoutedService::emcy}};
    (*host)->port.gateway_notices.push(notice);
    (*host)->executor->wakeup().signal();
  }
}

void PeerThread::on_gone(const routing::GatewayLine& line) {
  routes_.take_end(line, monotonic_now());
}

void PeerThread::on_answer(std::uint64_t id, const line::Reply& reply) {
  routes_.take_answer(id, reply);
}

}  // namespace linegate::gateway
