// SPDX-License-Identifier: Apache-2.0
// Passes routed messages between lines of this process (CiA 302-7), across executors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gateway/exchange/ring.h"
#include "gateway/exchange/wakeup.h"
#include "stack/routing/message.h"

namespace linegate::gateway {

// A link from one line to another.
struct RouteLink {
  static constexpr std::size_t kPlaces = 256;

  RouteLink(std::uint8_t from_interface, std::uint8_t to_interface)
      : from(from_interface), to(to_interface) {}

  const std::uint8_t from;  // interfaces, 1..255
  const std::uint8_t to;
  exchange::Ring<routing::Message> messages{kPlaces};
  // The executor of `to`; nullptr if `from` has the same executor, which polls the link itself.
  exchange::Wakeup* taker = nullptr;
};

// All links of one line. Used by the thread that runs the line.
class RouteEnd {
 public:
  // Adds a link from this line, or to it.
  void add_out(RouteLink& link) {
    out_[link.to] = &link;
    touched_.reserve(touched_.capacity() + 1);
  }
  void add_in(RouteLink& link) { in_.push_back(&link); }
  // The line with that interface was removed, and no other thread uses its links: they are removed.
  // Its last messages were taken earlier; messages that it did not take are returned, as in give().
  template <class ReturnTo>
  void remove(std::uint8_t interface, ReturnTo&& return_to) {
    if (RouteLink* const link = out_[interface]) {
      for (routing::Message message; link->messages.pop(message);) {
        bring_back(message, return_to);
      }
    }
    forget(interface);
  }

  // Calls deliver(message) for each message that has arrived.
  template <class Deliver>
  void take(Deliver&& deliver) {
    for (RouteLink* const link : in_) {
      routing::Message message;
      // Messages that arrive meanwhile wait for the next round.
      for (std::size_t i = 0; i < RouteLink::kPlaces && link->messages.pop(message); ++i) {
        deliver(message);
      }
    }
  }
  // Whether messages have arrived that take() has not taken.
  bool arrived() const;

  // next(message) fills in the line's next message to other lines, or returns false. If a message
  // has no receiver, return_to(message) is called with the response that is to be delivered to the
  // line instead. A message whose link is full is held, and later ones stay in the line.
  template <class Next, class ReturnTo>
  void give(Next&& next, ReturnTo&& return_to) {
    while (held_ || next(message_)) {
      RouteLink* const link = out_[message_.to];
      held_ = false;
      if (link == nullptr) {
        bring_back(message_, return_to);
      } else if (!put(*link)) {
        held_ = true;
        ++stalls_;
        break;
      }
    }
    wake_takers();
  }
  // Whether a message waits for room in a link.
  bool held() const { return held_; }
  // Number of times that a link was full.
  std::uint64_t stalls() const { return stalls_; }
  // Number of messages for lines that do not exist.
  std::uint64_t lost() const { return lost_; }

 private:
  template <class ReturnTo>
  void bring_back(const routing::Message& message, ReturnTo& return_to) {
    ++lost_;
    if (const auto answer = routing::undeliverable(message)) {
      return_to(*answer);
    }
  }
  void forget(std::uint8_t interface);
  // Returns false if the link is full: the message is held.
  bool put(RouteLink& link);
  void wake_takers();

  std::array<RouteLink*, 256> out_{};  // by interface
  std::vector<RouteLink*> touched_;    // whose executors must be woken
  std::vector<RouteLink*> in_;
  routing::Message message_;
  bool held_ = false;
  std::uint64_t stalls_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace linegate::gateway
