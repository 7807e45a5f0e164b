// SPDX-License-Identifier: Apache-2.0
#include "stack/scan/scanner.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"

namespace linegate::scan {
namespace {

constexpr od::Address kRestoreDefaults{od::objects::kRestoreDefaults, 1};
constexpr std::array kLoad{std::byte{'l'}, std::byte{'o'}, std::byte{'a'}, std::byte{'d'}};

}  // namespace

bool Scanner::begin(const Options& options, Instant now) {
  if (active() || done_) {
    return false;
  }
  LINEGATE_ASSERT(options.first >= can::kMinNodeId && options.last <= can::kMaxNodeId,
                  "node-IDs are 1..127");
  options_ = options;
  next_ = options.first;
  last_ = options.last;
  found_.clear();
  fill(now);
  return true;
}

// Within submit(), a survey can end only by being refused; the list does not grow meanwhile.
void Scanner::fill(Instant now) {
  while (running_.size() < kTogether && next_ <= last_) {
    const std::uint8_t node = next_++;
    if (node != options_.except) {
      running_.push_back({.survey = Survey(node)});
      read_next(running_.back(), now);
    }
  }
  if (!active()) {
    std::ranges::sort(found_, {}, &ScannedNode::id);
    done_ = true;
  }
}

void Scanner::go_on(Running& running, Instant now) {
  if (!running.survey.wanted()) {
    finish(running, now);
  } else if (options_.restore_defaults && running.survey.present() && !running.restored) {
    restore(running, now);
  } else {
    read_next(running, now);
  }
}

void Scanner::read_next(Running& running, Instant now) {
  LINEGATE_ASSERT(running.survey.wanted(), "an object of the node is left to read");
  submit(running,
         {.address = *running.survey.wanted(),
          .timeout = options_.timeout,
          .options = {.repeats = running.survey.present() ? 1U : 0U}},
         now);
}

void Scanner::restore(Running& running, Instant now) {
  running.restored = true;
  submit(running,
         {.address = kRestoreDefaults,
          .write = true,
          .data = {kLoad.begin(), kLoad.end()},
          .timeout = std::max(options_.timeout, kRestoreTime)},
         now);
}

void Scanner::restored(Running& running, AbortCode outcome, Instant now) {
  const std::uint8_t node = running.survey.result().id;
  running.transfer = 0;
  if (outcome == AbortCode::none) {
    running.wake = deadline(now, kResetTime);
    host_.reset_node(node, now);
    return;
  }
  events_.emit(
      {.time = now,
       .node = node,
       .data = event::SdoAbort{
           .abort = outcome, .index = kRestoreDefaults.index, .sub = kRestoreDefaults.sub}});
  go_on(running, now);
}

void Scanner::submit(Running& running, sdo::Request request, Instant now) {
  LINEGATE_ASSERT(running.wake == kNever, "no request is sent to a node that restarts");
  running.asked = now;
  running.transfer = ++transfers_;
  request.owner = &owner_;
  request.number = running.transfer;
  request.node = running.survey.result().id;
  request.priority = sdo::Priority::background;
  request.client = options_.client;
  if (!sdo_.submit(std::move(request), now)) {
    running.survey.give_up(AbortCode::out_of_memory);
    finish(running, now);
  }
}

void Scanner::completed(const sdo::Completion& completion, Instant now) {
  const auto at = std::ranges::find(running_, completion.number, &Running::transfer);
  if (at == running_.end()) {
    return;  // it was cancelled
  }
  const bool timed_out = completion.abort == AbortCode::timeout && !completion.refused;
  host_.asked(completion.node, !timed_out, at->asked, now);
  if (completion.write) {
    restored(*at, completion.abort, now);
    return;
  }
  at->survey.take(completion.abort, completion.data);
  go_on(*at, now);
}

bool Scanner::restarts(std::uint8_t node) const {
  return std::ranges::any_of(running_, [node](const Running& running) {
    return running.wake != kNever && running.survey.result().id == node;
  });
}

void Scanner::boot_up(std::uint8_t node, Instant now) {
  const auto at = std::ranges::find_if(running_, [node](const Running& running) {
    return running.wake != kNever && running.survey.result().id == node;
  });
  if (at != running_.end()) {
    at->wake = kNever;
    go_on(*at, now);
  }
}

void Scanner::advance(Instant now) {
  for (std::size_t i = 0; i < running_.size(); ++i) {
    if (running_[i].wake <= now) {
      running_[i].wake = kNever;
      go_on(running_[i], now);
    }
  }
}

Instant Scanner::next_wake() const {
  Instant wake = kNever;
  for (const Running& running : running_) {
    wake = earlier(wake, running.wake);
  }
  return wake;
}

void Host::asked(std::uint8_t /*node*/, bool /*answered*/, Instant /*asked_at*/, Instant /*now*/) {
}

void Scanner::finish(Running& running, Instant now) {
  if (running.survey.present()) {
    const ScannedNode& node = running.survey.result();
    events_.emit(
        {.time = now,
         .node = node.id,
         .data = event::NodeScanned{.abort = node.end,
                                    .objects = static_cast<std::uint32_t>(node.values.size())}});
    found_.push_back(running.survey.pop_result());
  }
  if (&running != &running_.back()) {
    running = std::move(running_.back());
  }
  running_.pop_back();
  fill(now);
}

void Scanner::cancel(Instant now) {
  next_ = 1;
  last_ = 0;
  while (!running_.empty()) {
    Running& running = running_.back();
    sdo_.cancel(owner_, running.survey.result().id, running.transfer);
    running.survey.give_up(AbortCode::general);
    finish(running, now);
  }
}

std::optional<std::vector<ScannedNode>> Scanner::pop_result() {
  if (!std::exchange(done_, false)) {
    return std::nullopt;
  }
  return std::exchange(found_, {});
}

}  // namespace linegate::scan
