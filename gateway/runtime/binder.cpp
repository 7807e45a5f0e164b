// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/binder.h"

#include <algorithm>
#include <utility>

#include "gateway/runtime/line_runner.h"

namespace linegate::gateway {

namespace {

std::vector<line::Following> parts_of_bindings(const std::vector<config::Binding>& bindings) {
  std::vector<line::Following> out;
  for (const config::Binding& binding : bindings) {
    line::add_parts(binding, binding.bits, out);
  }
  return out;
}

}  // namespace

BoundLink::BoundLink(std::vector<config::Binding> bindings_of_two_lines)
    : bindings(std::move(bindings_of_two_lines)), followings(parts_of_bindings(bindings)) {
  for (auto& buffer : values.buffers()) {
    buffer.resize(followings.size());
  }
}

BoundSource::BoundSource(BoundLink& link) : link_(&link), inputs_(link.followings) {
}

[[gnu::hot]] bool BoundSource::look(const line::Line& line, Instant now) {
  if (!inputs_.look(line)) {
    return false;
  }
  if (link_->runner != nullptr && link_->runner->receive_bound(*link_, inputs_.values(), now)) {
    return true;
  }
  auto draft = link_->values.draft();
  std::copy(inputs_.values().begin(), inputs_.values().end(), draft.value.begin());
  link_->values.publish();
  if (link_->runner != nullptr) {
    return false;
  }
  link_->taker->signal();
  return true;
}

BoundTarget::BoundTarget(BoundLink& link) : link_(&link), outputs_(link.followings) {
}

[[gnu::hot]] bool BoundTarget::take(line::Line& line, Instant now) {
  const std::vector<line::Line::Input>* inputs = link_->values.fetch();
  return inputs != nullptr && outputs_.take(line, *inputs, now);
}

}  // namespace linegate::gateway
