// SPDX-License-Identifier: Apache-2.0
// Hooks of a Dictionary, and accesses that wait for a hook.
#include <algorithm>
#include <utility>

#include "stack/base/assert.h"
#include "stack/od/deferrals.h"
#include "stack/od/object_table.h"

namespace linegate::od {

void Dictionary::point_at(std::uint16_t index, Hook* hook) {
  LINEGATE_ASSERT(objects_->find(index) != nullptr, "there is an object");
  Slot& slot = *objects_->find(index);
  const HookChain* chain = objects_->details(slot).hooks.get();
  const bool watched = hook != nullptr && hook == chain && chain->watches_rpdos();
  const bool changed = slot.variables[0].watched != watched;
  const unsigned count = slot.kind == Slot::Kind::window ? 2U : slot.highest + 1U;
  for (unsigned i = 0; i < count; ++i) {
    slot.variables[i].hook = hook;
    slot.variables[i].watched = watched;
  }
  objects_->look_at(index);
  if (changed) {
    notify_observers(index);
  }
}

Result<void> Dictionary::set_hook(std::uint16_t index, Hook* hook) {
  const Slot* slot = objects_->find(index);
  if (slot == nullptr) {
    return to_error(AbortCode::no_object);
  }
  HookChain* chain = objects_->details(*slot).hooks.get();
  const Hook* before = chain == nullptr ? slot->variables[0].hook : chain->first();
  if (chain == nullptr) {
    point_at(index, hook);
  } else {
    chain->set_first(hook);
  }
  if (before != nullptr && before != hook) {
    deferrals_->refuse(index, before, AbortCode::device_state);
  }
  return {};
}

Result<void> Dictionary::add_hook(std::uint16_t index, Hook& hook, Watch watch) {
  const Slot* slot = objects_->find(index);
  if (slot == nullptr) {
    return to_error(AbortCode::no_object);
  }
  std::unique_ptr<HookChain>& chain = objects_->details(*slot).hooks;
  if (chain == nullptr) {
    chain = std::make_unique<HookChain>(slot->variables[0].hook);
  }
  chain->add(&hook, watch);
  point_at(index, chain.get());
  return {};
}

void Dictionary::remove_hook(std::uint16_t index, Hook& hook) {
  const Slot* slot = objects_->find(index);
  HookChain* chain = slot == nullptr ? nullptr : objects_->details(*slot).hooks.get();
  if (chain == nullptr || !chain->remove(&hook)) {
    return;
  }
  deferrals_->refuse(index, &hook, AbortCode::device_state);
  if (chain->has_others()) {
    point_at(index, chain);
    return;
  }
  point_at(index, chain->first());
  objects_->details(*slot).hooks.reset();
}

void Dictionary::came_by_rpdo(Address address) {
  const std::optional<Variable> variable = find(address);
  if (variable && variable->watched) {
    variable->hook->came_by_rpdo(address);
  }
}

void Dictionary::add_observer(Observer& observer) {
  LINEGATE_ASSERT(std::ranges::find(observers_, &observer) == observers_.end(),
                  "an observer is added once");
  observers_.push_back(&observer);
}

void Dictionary::remove_observer(Observer& observer) {
  std::erase(observers_, &observer);
}

Result<void> Dictionary::follow(Address address, FollowMark mark) {
  Variable element;
  AbortCode why = AbortCode::none;
  Variable* variable = objects_->find(address, element, why);
  if (variable == nullptr) {
    return to_error(why);
  }
  if (variable == &element) {
    objects_->find(address.index)->variables[1].followed = mark == 0 ? mark : kSharedMark;
  } else {
    variable->followed = mark;
  }
  return {};
}

// Called after the hooks, which may have changed the mark of the value or removed the value.
void Dictionary::notify_changed(Address address) {
  Variable element;
  AbortCode why = AbortCode::none;
  const Variable* const variable = objects_->find(address, element, why);
  if (variable != nullptr && variable->followed != 0) {
    notify_changed(address, variable->followed);
  }
}

[[gnu::hot]] void Dictionary::notify_changed(Address address, FollowMark mark) {
  if (observers_.size() == 1) [[likely]] {  // the PDOs alone: a call as the last step
    observers_.front()->changed(address, mark);
    return;
  }
  for (std::size_t i = 0; i < observers_.size(); ++i) {
    observers_[i]->changed(address, mark);
  }
}

void Dictionary::notify_observers(std::uint16_t index) {
  for (std::size_t i = 0; i < observers_.size(); ++i) {
    observers_[i]->reshaped(index);
  }
}

Ticket Dictionary::put_off(Address address) {
  const Slot* slot = objects_->find(address.index);
  LINEGATE_ASSERT(slot != nullptr, "an object whose hook put the access off is still there");
  const HookChain* chain = objects_->details(*slot).hooks.get();
  Hook* hook = chain == nullptr ? slot->variables[0].hook : chain->deferring();
  LINEGATE_ASSERT(hook != nullptr, "an access waits for a hook");
  return deferrals_->begin(address, *hook);
}

Ticket Dictionary::put_off_stream(Address address, bool writing) {
  const Slot* slot = objects_->find(address.index);
  if (slot == nullptr) {
    return 0;
  }
  const HookChain* chain = objects_->details(*slot).hooks.get();
  Hook* hook = chain == nullptr ? slot->variables[0].hook : chain->opener(writing);
  return hook == nullptr ? 0 : deferrals_->begin(address, *hook);
}

AbortCode Dictionary::finish(Ticket ticket) {
  const auto waiting = deferrals_->take(ticket);
  return waiting ? waiting->outcome.value_or(AbortCode::device_state) : AbortCode::no_data;
}

bool Dictionary::complete(Ticket ticket, AbortCode why) {
  return deferrals_->complete(ticket, why);
}

std::optional<AbortCode> Dictionary::outcome(Ticket ticket) const {
  return deferrals_->outcome(ticket);
}

Result<std::span<const std::byte>> Dictionary::finish_read(Ticket ticket) {
  const auto waiting = deferrals_->take(ticket);
  AbortCode why = waiting ? waiting->outcome.value_or(AbortCode::device_state) : AbortCode::no_data;
  Variable element;
  const Variable* variable =
      why == AbortCode::none ? objects_->find(waiting->address, element, why) : nullptr;
  if (variable != nullptr && !readable(variable->access)) {
    why = AbortCode::write_only;
  }
  if (why != AbortCode::none) {
    return to_error(why);
  }
  return variable->bytes();
}

void Dictionary::cancel(Ticket ticket) {
  const auto waiting = deferrals_->take(ticket);
  if (waiting && !waiting->outcome) {
    waiting->hook->cancelled(ticket);
  }
}

}  // namespace linegate::od
