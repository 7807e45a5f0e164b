// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/peer_thread.h"

#include <algorithm>
#include <utility>

#include <poll.h>
#include <pthread.h>
#include <spdlog/spdlog.h>

#include "gateway/runtime/clock.h"

namespace linegate::gateway {
namespace {

constexpr Duration kPeerPoll = std::chrono::milliseconds(200);
constexpr Duration kPeerPollWhileWaiting = std::chrono::milliseconds(1);

std::vector<routing::GatewayLine> addressed_by(std::span<const std::unique_ptr<LineHost>> lines) {
  std::vector<routing::GatewayLine> out;
  for (const auto& host : lines) {
    for (const routing::Interface& each : host->plan.config.routing.interfaces) {
      if (each.way != nullptr && host->interface() != 0) {
        out.push_back(each.way->addressed());
      }
    }
  }
  std::ranges::sort(out);
  out.erase(std::unique(out.begin(), out.end()), out.end());
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
  if (!addressed_.empty() && client_ == nullptr) {
    client_ = make_client_();
  } else if (addressed_.empty() && client_ != nullptr) {
    for (const auto& [name, host] : known_) {
      routes_.forget(*client_, name);
    }
    client_ = nullptr;
  }
  if (client_ != nullptr) {
    client_->set_lines(addressed_);
  }
  routes_.set_lines(addressed_, monotonic_now());
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
    client_->poll(routes_.is_waiting() ? kPeerPollWhileWaiting : kPeerPoll, *this);
    take_requests();
    routes_.advance(monotonic_now());
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
                          std::int64_t time) {
  routes_.take_state(line, incarnation, time, monotonic_now());
}

void PeerThread::on_gone(const routing::GatewayLine& line) {
  routes_.take_end(line, monotonic_now());
}

void PeerThread::on_answer(std::uint64_t id, const line::Reply& reply) {
  routes_.take_answer(id, reply);
}

}  // namespace linegate::gateway
