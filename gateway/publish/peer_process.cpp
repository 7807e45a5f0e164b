// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/peer_process.h"

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <ctime>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include <pthread.h>
#include <spdlog/spdlog.h>

#include "bridges/dds/address_change.h"
#include "bridges/dds/guard/stall.h"
#include "bridges/dds/security.h"
#include "gateway/edge/edge_end.h"
#include "gateway/edge/edge_process.h"
#include "gateway/edge/stall_time.h"
#include "gateway/exchange/cell.h"
#include "gateway/publish/dds_peers.h"
#include "gateway/publish/dds_process_main.h"
#include "gateway/publish/foreign_text.h"
#include "gateway/publish/library_logger.h"
#include "gateway/publish/peer_server.h"
#include "gateway/publish/remote_peers.h"
#include "gateway/runtime/clock.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/security/files.h"
#include "gateway/security/identity_watch.h"

namespace linegate::gateway {
namespace {

constexpr Duration kPeerTimeToStart = std::chrono::seconds(20);
constexpr Duration kPeerReceive = std::chrono::milliseconds(200);
constexpr Duration kPeerServerPoll = std::chrono::milliseconds(100);
constexpr Duration kPeerFull = std::chrono::milliseconds(2);  // while there is no room
constexpr Duration kPeerStall = std::chrono::milliseconds(100);

// --- the end in the gateway ---------------------------------------------------------------------

void log_peers(Severity severity, std::string_view text) {
  const auto level = severity == Severity::error     ? spdlog::level::err
                     : severity == Severity::warning ? spdlog::level::warn
                                                     : spdlog::level::info;
  spdlog::log(level, "{}", printable(text));
}

class PeerProcessLink final : public PeerLink {
 public:
  PeerProcessLink(const config::Plant& plant, std::shared_ptr<ProcessEnds> ends)
      : ends_(std::move(ends)), process_(options_for(plant)) {}

  std::uint64_t number() const override { return process_.number(); }
  bool send(std::uint64_t number, PeerBytes message) override {
    return process_.send(number, message);
  }
  std::uint64_t receive(PeerMessage& message) override { return process_.receive(message); }
  void wait(Duration timeout) override { process_.wait(timeout); }
  void wake() override { process_.wake(); }
  void reject(std::uint64_t number, std::string_view reason) override {
    process_.reject(number, reason);
  }
  void replace(std::uint64_t number, std::string_view reason) override {
    process_.replace(number, reason);
  }
  void finish(Duration limit) override { process_.finish(limit); }

 private:
  EdgeProcess::Options options_for(const config::Plant& plant) {
    const std::string program = plant.dds_program.empty() ? "/proc/self/exe" : plant.dds_program;
    return {
        .program = program,
        .arguments = {"linegated-peers", std::string(kPeerProcessArgument)},
        .name = "DDS routes",
        .stable = plant.dds_stable,
        .memory = plant.dds_memory,
        .ended =
            [this](EdgeProcess::Options::End end) {
              ends_->note(end.cause, end.detail, end.pause, std::move(end.words), monotonic_now());
            },
        .changed = [this](ProcessEnds::Condition condition,
                          Instant start_due) { ends_->set_condition(condition, start_due); },
        .log = log_peers,
        .output = [this](
                      Severity severity,
                      std::string_view text) { library_.write(severity, text, monotonic_now()); }};
  }

  const std::shared_ptr<ProcessEnds> ends_;  // outlives the process
  LibraryLogger library_;                    // as well
  EdgeProcess process_;
};

// Call it before the process is started.
RemotePeers::Renewal renewal_of(const config::Plant& plant, const PeerSettings& settings) {
  const auto addresses =
      std::make_shared<dds::AddressChange>(dds::AddressWatch(plant.dds_interfaces));
  const auto identity =
      settings.secured
          ? std::make_shared<security::IdentityWatch>(security::files_in(settings.identity))
          : nullptr;
  return {.started = [addresses](Instant now) { addresses->started(now); },
          .due =
              [addresses, identity](Instant now, std::int64_t next_expiry) {
                std::string reason =
                    identity ? identity->due(now, std::time(nullptr), next_expiry) : std::string();
                return reason.empty() ? addresses->due(now) : reason;
              },
          .done =
              [addresses, identity](Instant now) {
                addresses->ends(now);
                if (identity)
                  identity->note_replaced(now);
              },
          .secured = settings.secured};
}

// --- the end in the process ---------------------------------------------------------------------

// Passes messages from the thread that receives them to the thread that has the client.
class PeerInbox {
 public:
  // Returns when the message was handled, or the inbox is closed. wake: ends a poll of the client.
  // progress: called meanwhile.
  void put(PeerBytes message, const std::function<void()>& wake,
           const std::function<void()>& progress) {
    std::unique_lock lock(mutex_);
    message_ = message;
    wake();
    while (!message_.empty() && !closed_) {
      handled_.wait_for(lock, kPeerReceive);
      progress();
    }
  }
  // Calls handle(message) if there is one. Returns its result, or true.
  bool handle(const std::function<bool(PeerBytes message)>& handle) {
    std::unique_lock lock(mutex_);
    const PeerBytes message = message_;
    lock.unlock();
    if (message.empty()) {
      return true;
    }
    const bool more = handle(message);  // put() keeps the message
    lock.lock();
    message_ = {};
    handled_.notify_one();
    return more;
  }
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    handled_.notify_one();
  }

 private:
  std::mutex mutex_;
  std::condition_variable handled_;
  PeerBytes message_;
  bool closed_ = false;
};

void receive_messages(EdgeEnd& end, PeerInbox& inbox, PeerClient& client,
                      const exchange::Flag& stop, exchange::Flag& broken) {
  pthread_setname_np(pthread_self(), "peers receiver");
  while (!stop.raised() && !end.broken()) {
    const PeerBytes message = end.receive(kPeerReceive);
    end.add_receiver_progress();
    if (!message.empty()) {
      inbox.put(
          message, [&] { client.wake(); }, [&] { end.add_receiver_progress(); });
      end.done();
    }
  }
  broken.raise();
}

// Returns when the parent asks for the end.
void serve_peers(LocalPeers& client, EdgeEnd& end, const dds::Security& security) {
  PeerServer server(client, monotonic_now);
  PeerInbox inbox;
  exchange::Flag stop;
  exchange::Flag broken;
  std::thread receiver([&] { receive_messages(end, inbox, client, stop, broken); });
  StallTime stalls;
  bool more = true;
  while (more && !broken.raised()) {
    const bool room =
        server.poll(kPeerServerPoll, [&](PeerBytes message) { return end.send(message); });
    more = inbox.handle([&](PeerBytes message) { return server.handle(message); });
    if (security.next_expiry) {
      server.report_expiry(security.next_expiry());
    }
    if (!room) {
      std::this_thread::sleep_for(kPeerFull);
    }
    const dds::guard::Stall longest = client.longest_stall();
    if (stalls.count(longest.thread, longest.time, monotonic_now()) < kPeerStall) {
      end.add_sender_progress();
    }
  }
  stop.raise();
  inbox.close();
  end.wake();
  receiver.join();
}

int run_peers() {
  if (!enter_dds_process()) {
    return kExitFailed;
  }
  EdgeEnd end;
  const PeerBytes configure = end.receive(kPeerTimeToStart);
  const bool is_first = kind_of(configure) == static_cast<std::uint8_t>(ToPeers::configure);
  const auto settings = is_first ? decode_settings(configure) : std::nullopt;
  if (!settings) {
    return kExitFailed;
  }
  end.done();
  dds::Security security;
  auto made = make_local_peers(*settings, [&security](dds::Security& to) {
    add_security_functions(to);
    security = to;
  });
  for (const Diagnostic& diagnostic : made.diagnostics) {
    write_line(diagnostic.severity, "routes over other gateways: " + to_string(diagnostic));
  }
  if (!made.value) {
    return kExitFailed;
  }
  (*made.value)->watch_timers();
  serve_peers(**made.value, end, security);
  made.value->reset();
  return kExitOk;
}

}  // namespace

std::unique_ptr<PeerClient> make_peer_process(const config::Plant& plant,
                                              const PeerSettings& settings,
                                              std::shared_ptr<ProcessEnds> ends) {
  try {
    RemotePeers::Renewal renewal = renewal_of(plant, settings);
    return std::make_unique<RemotePeers>(std::make_unique<PeerProcessLink>(plant, std::move(ends)),
                                         settings, monotonic_now, std::move(renewal));
  } catch (const std::exception& error) {
    spdlog::error("routes over other gateways do not work: their process cannot be started: {}",
                  error.what());
    return nullptr;
  }
}

void run_peer_process() {
  run_process("linegated-peers", run_peers);
}

}  // namespace linegate::gateway
