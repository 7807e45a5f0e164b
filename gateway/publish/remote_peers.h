// SPDX-License-Identifier: Apache-2.0
// The client of other gateways in a process of its own: the end in the gateway.
//
// Invariants:
// 1. A request is passed to one process, in one message, so that the process that replaces it never
//    carries it out again. Nothing is kept for another process.
// 2. Each request that was passed on has one answer at most. When its process has ended, or its
//    time has passed, the answer is Refusal::timed_out: it may have been carried out.
// 3. While no process runs, no line of another gateway is there.
// 4. A process that was asked to end carries out nothing more: it receives no further requests.
//
// The process is not trusted (peer_messages.h). No DDS, thread or clock here.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/publish/peer_messages.h"
#include "gateway/publish/peer_routes.h"

namespace linegate::gateway {

// Messages to and from the process; as EdgeProcess.
class PeerLink {
 public:
  virtual ~PeerLink() = default;
  // 1, 2, 3, ... for each start of the process; 0: it does not run.
  virtual std::uint64_t number() const = 0;
  // Returns false if there is no room, or another process runs. Never waits.
  virtual bool send(std::uint64_t number, PeerBytes message) = 0;
  // Returns the number of the process, or 0 without a message.
  virtual std::uint64_t receive(PeerMessage& message) = 0;
  virtual void wait(Duration timeout) = 0;
  virtual void wake() = 0;
  // The process has sent what no working process sends: it is replaced.
  virtual void reject(std::uint64_t number, std::string_view reason) = 0;
  // The process was asked to end, and is then replaced.
  virtual void replace(std::uint64_t number, std::string_view reason) = 0;
  virtual void finish(Duration limit) = 0;
};

// Why the process is to be replaced: identities that are revoked or expire (IdentityWatch), or
// another address of the host (AddressChange).
struct PeerRenewal {
  // A process was started since the last call of due().
  std::function<void(Instant now)> started = [](Instant) {};
  std::function<std::string(Instant now, std::int64_t next_expiry)> due;
  // It was asked to end.
  std::function<void(Instant now)> done;
  bool secured = true;  // also lines that are absent, see RemotePeers::kFirstAbsence
};

class RemotePeers final : public PeerClient {
 public:
  using Renewal = PeerRenewal;
  // So long a replacement waits for requests that are under way.
  static constexpr Duration kForRequests = std::chrono::seconds(5);
  // Fast DDS 2.9.1 does not authenticate every participant that joins late, and does not try again.
  // So with DDS-Security the process is replaced when a line was not there for that long; the time
  // doubles until all lines are there.
  static constexpr Duration kFirstAbsence = std::chrono::minutes(1);
  static constexpr Duration kLongestAbsence = std::chrono::minutes(32);
  static constexpr Duration kToEnd = std::chrono::seconds(1);
  static constexpr int kMostMessages = 1'024;  // in one poll()

  // now: the time, by the monotonic clock of both processes. renewal: without functions the process
  // is never replaced.
  RemotePeers(std::unique_ptr<PeerLink> link, PeerSettings settings, std::function<Instant()> now,
              Renewal renewal = {});
  ~RemotePeers() override;

  void set_lines(const std::vector<routing::GatewayLine>& addressed,
                 const std::vector<routing::GatewayLine>& emcys) override;
  std::uint64_t send(const routing::GatewayLine& to, std::uint64_t incarnation,
                     const line::Request& request, Duration timeout) override;
  void cancel(std::uint64_t id) override;
  void poll(Duration timeout, PeerHandler& handler) override;
  void wake() override { link_->wake(); }

 private:
  bool is_running() const { return process_ != 0 && link_->number() == process_; }
  void follow_process(PeerHandler& handler);
  bool receive(PeerHandler& handler);
  bool take(PeerBytes message, PeerHandler& handler);
  bool take_state(PeerBytes message, PeerHandler& handler);
  bool take_event(PeerBytes message, PeerHandler& handler);
  bool take_gone(PeerBytes message, PeerHandler& handler);
  bool take_answer(PeerBytes message, PeerHandler& handler);
  void end_requests(Instant until, PeerHandler& handler);
  void renew();
  std::string absence(Instant now);

  const std::unique_ptr<PeerLink> link_;
  const PeerSettings settings_;
  const std::function<Instant()> now_;
  const Renewal renewal_;
  PeerLines lines_;
  std::set<routing::GatewayLine> wanted_;    // lines of both kinds
  std::uint64_t process_ = 0;                // that has the settings; 0: none
  bool has_lines_ = false;                   // it has the present ones
  std::uint64_t ending_ = 0;                 // the process that was asked to end
  std::set<routing::GatewayLine> reported_;  // states of them
  std::uint64_t next_id_ = 1;
  std::map<std::uint64_t, Instant> under_way_;  // deadlines by ID
  std::int64_t next_expiry_ = 0;
  std::string renewal_due_;  // why; empty: it is not due
  Instant renewal_limit_{};
  Instant absent_since_ = kNever;  // at least one of the lines
  Duration patience_ = kFirstAbsence;
};

}  // namespace linegate::gateway
