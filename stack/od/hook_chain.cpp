// SPDX-License-Identifier: Apache-2.0
#include "stack/od/hook_chain.h"

#include <algorithm>

namespace linegate::od {

AbortCode Hook::before_read(Address /*address*/, const Variable& /*variable*/) {
  return AbortCode::none;
}
AbortCode Hook::check_write(Address /*address*/, std::span<const std::byte> /*value*/) {
  return AbortCode::none;
}
AbortCode Hook::execute_write(Address /*address*/, std::span<const std::byte> /*value*/) {
  return AbortCode::none;
}
void Hook::written(Address /*address*/) {
}
void Observer::changed(Address /*address*/, FollowMark /*mark*/) {
}
void Hook::came_by_rpdo(Address /*address*/) {
}
void Hook::put_off(Address /*address*/, Ticket /*ticket*/) {
}
void Hook::cancelled(Ticket /*ticket*/) {
}

void HookChain::set_first(Hook* hook) {
  if (hook != first_) {
    forget(first_);
  }
  first_ = hook;
}

bool HookChain::remove(Hook* hook) {
  const auto at = std::ranges::find(others_, hook, &Other::hook);
  if (at == others_.end()) {
    return false;
  }
  others_.erase(at);
  forget(hook);
  return true;
}

void HookChain::forget(const Hook* hook) {
  source_opener_ = source_opener_ == hook ? nullptr : source_opener_;
  sink_opener_ = sink_opener_ == hook ? nullptr : sink_opener_;
}

// A stream that was opened before there were several hooks belongs to the first one.
Hook* HookChain::opener(bool of_sink) const {
  Hook* known = of_sink ? sink_opener_ : source_opener_;
  return known != nullptr ? known : first_;
}

template <class Ask>
AbortCode HookChain::ask_all(Ask ask) {
  deferring_ = nullptr;
  bool twice = false;
  const auto refusal = [&](Hook* hook) {
    const AbortCode answer = hook == nullptr ? AbortCode::none : ask(*hook);
    if (answer != kLater) {
      return answer;
    }
    twice = deferring_ != nullptr;
    deferring_ = hook;
    return AbortCode::none;
  };
  AbortCode why = refusal(first_);
  for (std::size_t i = 0; i < others_.size() && why == AbortCode::none; ++i) {
    why = refusal(others_[i].hook);
  }
  if (why != AbortCode::none) {
    return why;
  }
  if (twice) {
    return AbortCode::device_incompatible;
  }
  return deferring_ == nullptr ? AbortCode::none : kLater;
}

AbortCode HookChain::before_read(Address address, const Variable& variable) {
  return ask_all([&](Hook& hook) { return hook.before_read(address, variable); });
}

AbortCode HookChain::check_write(Address address, std::span<const std::byte> value) {
  return ask_all([&](Hook& hook) { return hook.check_write(address, value); });
}

AbortCode HookChain::execute_write(Address address, std::span<const std::byte> value) {
  AbortCode why = first_ == nullptr ? AbortCode::none : first_->execute_write(address, value);
  for (std::size_t i = 0; i < others_.size() && why == AbortCode::none; ++i) {
    why = others_[i].hook->execute_write(address, value);
  }
  return why;
}

void HookChain::written(Address address) {
  if (first_ != nullptr) {
    first_->written(address);
  }
  for (std::size_t i = 0; i < others_.size(); ++i) {
    others_[i].hook->written(address);
  }
}

void HookChain::came_by_rpdo(Address address) {
  for (std::size_t i = 0; i < others_.size(); ++i) {
    if (others_[i].watch == Watch::rpdos) {
      others_[i].hook->came_by_rpdo(address);
    }
  }
}

template <class Stream, class Open>
Result<Stream*> HookChain::first_stream(Hook*& opener, Open open) {
  opener = first_;
  Result<Stream*> found = first_ == nullptr ? nullptr : open(*first_);
  for (std::size_t i = 0; i < others_.size() && found.ok() && *found == nullptr; ++i) {
    opener = others_[i].hook;
    found = open(*opener);
  }
  return found;
}

Result<ByteSource*> HookChain::open_source(Address address) {
  return first_stream<ByteSource>(source_opener_,
                                  [&](Hook& hook) { return hook.open_source(address); });
}

Result<ByteSink*> HookChain::open_sink(Address address, std::optional<std::uint32_t> size) {
  return first_stream<ByteSink>(sink_opener_,
                                [&](Hook& hook) { return hook.open_sink(address, size); });
}

bool HookChain::watches_rpdos() const {
  return std::ranges::find(others_, Watch::rpdos, &Other::watch) != others_.end();
}

}  // namespace linegate::od
