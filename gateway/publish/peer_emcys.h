// SPDX-License-Identifier: Apache-2.0
// EMCYs of networks of other gateways (`routes:` with `emcy: true`), from the events of their
// lines.
//
// Invariants:
// 1. Each EMCY is passed on once: events have numbers, and a number that was seen is ignored. Each
//    incarnation has numbers of its own, which begin with its state: whatever another writer
//    numbers, no event of the incarnation that publishes the line counts as seen.
// 2. An EMCY that is older than kOldest is never passed on, however it was delayed, nor one from so
//    far in the future. Its age is counted by the clock of its gateway, between the event and the
//    newest state of the line, and by the clock of this gateway since that state. So the clocks
//    need not agree.
// 3. An EMCY that is too old, and each event whose number was left out, is counted as lost, except
//    those from before the line was followed, however many DDS repeats of them.
// 4. Nothing is passed on while two gateways publish the line at the same time.
// 5. An EMCY that a gateway on that bus forwarded is passed on as that of its source, with one more
//    hop. The event of its frame comes before, so each is held for kForRouted: the order remains.
// 6. However many EMCYs a node or a line sends, no more than PeerEmcyLimit permits are passed on,
//    those of other lines pass, and those of other nodes of the line while its share is not used
//    up. Each of the others is counted. EMCYs that no line here sends do not count.
//
// All samples are foreign. No DDS, thread or clock here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "gateway/publish/peer_emcy_limit.h"
#include "gateway/publish/peer_routes.h"
#include "stack/base/time.h"
#include "stack/routing/emcy_frame.h"
#include "stack/routing/gateway_request.h"

namespace linegate::gateway {

class PeerEmcys {
 public:
  class Sink {
   public:
    virtual ~Sink() = default;
    // Whether a line of this gateway sends it.
    virtual bool is_wanted(const routing::GatewayLine& from,
                           const routing::ForwardedEmcy& emcy) const = 0;
    // Only of wanted ones.
    virtual void take_emcy(const routing::GatewayLine& from,
                           const routing::ForwardedEmcy& emcy) = 0;
    // A wanted one that PeerEmcyLimit does not permit.
    virtual void take_excess(const routing::GatewayLine& from,
                             const routing::ForwardedEmcy& emcy) = 0;
    // So many EMCYs at most of that line were lost. network: that of the line.
    virtual void take_loss(const routing::GatewayLine& from, std::uint16_t network,
                           std::uint64_t count) = 0;
  };

  static constexpr Duration kOldest = std::chrono::seconds(2);
  static constexpr Duration kForRouted = std::chrono::milliseconds(50);
  static constexpr std::size_t kMostHeld = 256;    // of one line; as many before its first state
  static constexpr std::size_t kMostNumbered = 8;  // incarnations of one line
  // A gap of more events is none of a working gateway, and counts as that many losses.
  static constexpr std::uint64_t kMostLostAtOnce = 1'000'000;

  // sink must outlive it.
  explicit PeerEmcys(Sink& sink) : sink_(sink) {}

  // What is known of lines that remain is kept.
  void set_lines(const std::vector<routing::GatewayLine>& lines);
  // Lines that are not in set_lines() are ignored.
  void take_state(const routing::GatewayLine& line, std::uint64_t incarnation, std::int64_t time,
                  std::uint16_t network, Instant now);
  void take_event(const routing::GatewayLine& line, std::uint64_t incarnation,
                  const PeerEvent& event, Instant now);
  // Call it after samples were taken, and at next_wake(). publisher: the incarnation that publishes
  // a line now, if there is exactly one.
  using Publisher = std::function<std::optional<std::uint64_t>(const routing::GatewayLine& line)>;
  void advance(const Publisher& publisher, Instant now);
  // After now; kNever if nothing is held.
  Instant next_wake(Instant now) const;

 private:
  struct Held {
    std::uint64_t incarnation = 0;
    std::int64_t time = 0;
    Instant received{};
    std::uint8_t node = 0;  // the sender on that bus
    bool routed = false;
    routing::ForwardedEmcy emcy;  // network 0: that of the line
  };
  // Before the first state of its incarnation.
  struct Early {
    std::uint64_t incarnation = 0;
    Instant received{};
    PeerEvent event;
  };
  // The last event of an incarnation.
  struct Numbered {
    std::uint64_t incarnation = 0;
    std::uint64_t stream = 0;
    std::uint64_t number = 0;
  };
  struct Line {
    // The newest state.
    std::uint64_t incarnation = 0;  // 0: none
    std::int64_t time = 0;
    Instant received{};
    Instant followed{};  // since when, in this incarnation
    std::uint16_t network = 0;
    std::deque<Numbered> numbered;  // those that began last
    std::deque<Early> early;
    std::deque<Held> held;
    PeerEmcyLimit limit;
  };

  // Of the incarnation of the newest state.
  void accept(const routing::GatewayLine& name, Line& line, const PeerEvent& event,
              Instant received, Instant now);
  bool count_number(const routing::GatewayLine& name, Line& line, const PeerEvent& event);
  void hold(const routing::GatewayLine& name, Line& line, Held held, Instant now);
  static std::deque<Held>::iterator surplus(std::deque<Held>& held);
  void end_early(const routing::GatewayLine& name, Line& line, Instant now);
  static Duration age_of(const Line& line, const Held& held, Instant now);
  void take_loss_of(const routing::GatewayLine& name, const Line& line, const Held& held,
                    Instant now);
  void pass_on(const routing::GatewayLine& name, Line& line, const Held& held, Instant now);

  Sink& sink_;
  std::map<routing::GatewayLine, Line> lines_;
};

}  // namespace linegate::gateway
