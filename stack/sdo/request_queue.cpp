// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/request_queue.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "stack/base/assert.h"

namespace linegate::sdo {
namespace {

bool is_permitted(const Request& request, const Pace* pace) {
  return pace == nullptr || request.client == 0 || pace->permits(request.client, false);
}

}  // namespace

bool RequestQueue::push(Request&& request) {
  if (waiting_.size() >= capacity_) {
    return false;
  }
  const Turn& current = turn(request);
  const bool had_turn = std::ranges::find(current.served, party(request)) != current.served.end();
  std::uint64_t number = current.number + (had_turn ? 1 : 0);
  for (const Waiting& other : waiting_) {
    if (other.request.priority == request.priority && party(other.request) == party(request)) {
      number = std::max(number, other.turn + 1);
    }
  }
  waiting_.push_back({std::move(request), number});
  return true;
}

bool RequestQueue::pop(Request& out, const Pace* pace) {
  if (waiting_.empty()) {
    return false;
  }
  const bool oldest = (popped_ + 1) % kOldestEvery == 0 && is_permitted(waiting_[0].request, pace);
  const std::size_t position = oldest ? 0 : next(pace);
  if (position == waiting_.size()) {
    return false;
  }
  ++popped_;
  note_served(waiting_[position]);
  take(position, out);
  return true;
}

bool RequestQueue::has_other(std::uint32_t client, const Pace& pace) const {
  return std::ranges::any_of(waiting_, [&](const Waiting& waiting) {
    return waiting.request.client != client && is_permitted(waiting.request, &pace);
  });
}

bool RequestQueue::remove(const RequestOwner& of, std::uint64_t number, Request& out) {
  const auto found = std::ranges::find_if(waiting_, [&](const Waiting& waiting) {
    return owner(waiting.request) == &of && waiting.request.number == number;
  });
  if (found == waiting_.end()) {
    return false;
  }
  take(static_cast<std::size_t>(found - waiting_.begin()), out);
  return true;
}

std::size_t RequestQueue::remove_all(const RequestOwner& of) {
  return std::erase_if(waiting_,
                       [&](const Waiting& waiting) { return owner(waiting.request) == &of; });
}

// size(): the pace permits none.
std::size_t RequestQueue::next(const Pace* pace) const {
  auto first = waiting_.end();
  for (auto it = waiting_.begin(); it != waiting_.end(); ++it) {
    const bool precedes =
        first == waiting_.end() || std::tuple(it->request.priority, it->turn) <
                                       std::tuple(first->request.priority, first->turn);
    if (precedes && is_permitted(it->request, pace)) {
      first = it;
    }
  }
  return static_cast<std::size_t>(first - waiting_.begin());
}

void RequestQueue::note_served(const Waiting& waiting) {
  Turn& current = turn(waiting.request);
  if (waiting.turn > current.number) {
    current.number = waiting.turn;
    current.served.clear();
  }
  if (std::ranges::find(current.served, party(waiting.request)) == current.served.end()) {
    current.served.push_back(party(waiting.request));
  }
}

void RequestQueue::take(std::size_t position, Request& out) {
  LINEGATE_ASSERT(position < waiting_.size(), "the request waits");
  const auto place = waiting_.begin() + static_cast<std::ptrdiff_t>(position);
  out = std::move(place->request);
  waiting_.erase(place);
}

}  // namespace linegate::sdo
