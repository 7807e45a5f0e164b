#include "stack/scan/scanner.h"

#include <algorithm>
#include <utility>

namespace linegate::scan {

bool Scanner::begin(std::uint8_t first, std::uint8_t last, std::uint8_t except, Duration timeout,
                    Instant now) {
  if (active() || done_) {
    return false;
  }
  next_ = first;
  last_ = last;
  except_ = except;
  timeout_ = timeout;
  found_.clear();
  fill(now);
  return true;
}

// A survey ends within submit() at most by being refused; the list does not grow meanwhile.
void Scanner::fill(Instant now) {
  while (running_.size() < kTogether && next_ <= last_) {
    const std::uint8_t node = next_++;
    if (node != except_) {
      running_.push_back({Survey(node), 0});
      read_next(running_.back(), now);
    }
  }
  if (!active()) {
    std::ranges::sort(found_, {}, &ScannedNode::id);
    done_ = true;
  }
}

void Scanner::read_next(Running& running, Instant now) {
  running.token = kScanToken | ++tokens_;
  sdo::Request request{.token = running.token,
                       .node = running.survey.result().id,
                       .address = *running.survey.wanted(),
                       .timeout = timeout_,
                       .priority = sdo::Priority::background,
                       .options = {.repeats = running.survey.present() ? 1U : 0U}};
  if (!sdo_.submit(std::move(request), now)) {
    running.survey.give_up(AbortCode::out_of_memory);
    finish(running, now);
  }
}

void Scanner::completed(const sdo::Completion& completion, Instant now) {
  const auto at = std::ranges::find(running_, completion.token, &Running::token);
  if (at == running_.end()) {
    return;  // it was cancelled
  }
  at->survey.take(completion.abort, completion.data);
  if (at->survey.wanted()) {
    read_next(*at, now);
  } else {
    finish(*at, now);
  }
}

void Scanner::finish(Running& running, Instant now) {
  if (running.survey.present()) {
    const ScannedNode& node = running.survey.result();
    events_.emit({.time = now,
                  .kind = EventKind::node_scanned,
                  .node = node.id,
                  .code = static_cast<std::uint32_t>(node.end),
                  .value = static_cast<std::uint32_t>(node.values.size())});
    found_.push_back(running.survey.take_result());
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
    sdo_.cancel(running.token);
    running.survey.give_up(AbortCode::general);
    finish(running, now);
  }
}

std::optional<std::vector<ScannedNode>> Scanner::take_result() {
  if (!std::exchange(done_, false)) {
    return std::nullopt;
  }
  return std::exchange(found_, {});
}

}  // namespace linegate::scan
