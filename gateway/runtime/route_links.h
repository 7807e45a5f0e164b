// SPDX-License-Identifier: Apache-2.0
// What lines of this process hand each other on behalf of the networks they join (CiA 302-7),
// across executors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gateway/exchange/ring.h"
#include "gateway/exchange/wakeup.h"
#include "stack/routing/message.h"

namespace linegate::gateway {

// From one line to another.
struct RouteLink {
  static constexpr std::size_t kPlaces = 256;

  RouteLink(std::uint8_t from_interface, std::uint8_t to_interface)
      : from(from_interface), to(to_interface) {}

  const std::uint8_t from;  // interfaces, 1..255
  const std::uint8_t to;
  exchange::Ring<routing::Message> messages{kPlaces};
  // The executor of `to`; nullptr if it is that of `from` too, which looks by itself.
  exchange::Wakeup* taker = nullptr;
};

// All links of one line. Of the thread that runs the line.
class RouteEnd {
 public:
  // One from this line, or to it.
  void add_out(RouteLink& link) {
    out_[link.to] = &link;
    touched_.reserve(touched_.capacity() + 1);
  }
  void add_in(RouteLink& link) { in_.push_back(&link); }
  // The line with that interface is gone, and nobody else looks at its links: nothing is given to
  // it or taken from it any more. What it said last has been taken before; what it did not take
  // itself goes back, as in give().
  template <class ReturnTo>
  void remove(std::uint8_t interface, ReturnTo&& return_to) {
    if (RouteLink* const link = out_[interface]) {
      for (routing::Message message; link->messages.pop(message);) {
        bring_back(message, return_to);
      }
    }
    forget(interface);
  }

  // deliver(message) for what has arrived.
  template <class Deliver>
  void take(Deliver&& deliver) {
    for (RouteLink* const link : in_) {
      routing::Message message;
      // What comes meanwhile waits for the next turn.
      for (std::size_t i = 0; i < RouteLink::kPlaces && link->messages.pop(message); ++i) {
        deliver(message);
      }
    }
  }
  // Something has arrived that take() has not taken.
  bool arrived() const;

  // next(message) gives what the line has for others, or false; return_to(message) gets what is to
  // be delivered to the line instead of an answer, where there is nobody to hand it to. A message
  // whose link is full is held, and what comes after it stays in the line.
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
  // It waits for room in a link.
  bool held() const { return held_; }
  // Times that a link was full.
  std::uint64_t stalls() const { return stalls_; }
  // Messages for lines that there are not.
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
  // False if it is full: the message is held.
  bool put(RouteLink& link);
  void wake_takers();

  std::array<RouteLink*, 256> out_{};  // by interface
  std::vector<RouteLink*> touched_;    // whose takers sleep, maybe
  std::vector<RouteLink*> in_;
  routing::Message message_;
  bool held_ = false;
  std::uint64_t stalls_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace linegate::gateway
