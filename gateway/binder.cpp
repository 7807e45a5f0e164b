#include "gateway/binder.h"

#include <algorithm>
#include <utility>

#include "gateway/line_runner.h"

namespace linegate::gateway {

BoundLink::BoundLink(std::vector<config::Binding> bindings_of_two_lines)
    : bindings(std::move(bindings_of_two_lines)) {
  for (auto& buffer : values.buffers()) {
    buffer.resize(bindings.size());
  }
}

BoundSource::BoundSource(BoundLink& link)
    : link_(&link), entries_(link.bindings.size(), kNone), last_(link.bindings.size()) {
}

// Objects are the same in every layout, their entries are not.
void BoundSource::find_entries(const line::Line& line) {
  const auto& entries = line.layout(image::Direction::inputs).entries;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const config::Binding::Object& wanted = link_->bindings[i].input;
    const auto found = std::find_if(entries.begin(), entries.end(), [&](const image::Entry& entry) {
      return entry.node == wanted.node && entry.index == wanted.address.index &&
             entry.sub == wanted.address.sub;
    });
    entries_[i] =
        found == entries.end() ? kNone : static_cast<std::uint32_t>(found - entries.begin());
  }
}

void BoundSource::look(const line::Line& line, Instant now) {
  if (std::exchange(revision_, line.layout_revision()) != line.layout_revision() ||
      std::exchange(first_, false)) {
    find_entries(line);
  }
  bool changed = false;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    line::Line::Input next = last_[i];
    next.valid = false;
    if (entries_[i] != kNone) {
      next = line.input(entries_[i]);
    }
    changed = changed || next.value != last_[i].value || next.valid != last_[i].valid ||
              (link_->bindings[i].forwarded &&
               (next.received != last_[i].received || next.late != last_[i].late));
    last_[i] = next;
  }
  if (!changed) {
    return;
  }
  auto draft = link_->values.draft();
  std::copy(last_.begin(), last_.end(), draft.value.begin());
  link_->values.publish();
  if (link_->runner != nullptr) {
    link_->runner->take_bound(*link_, now);
  } else {
    link_->taker->signal();
  }
}

BoundTarget::BoundTarget(BoundLink& link) : link_(&link), written_(link.bindings.size()) {
  changed_.reserve(link.bindings.size());
}

bool BoundTarget::take(line::Line& line, Instant now) {
  const std::vector<line::Line::Input>* inputs = link_->values.fetch();
  if (inputs == nullptr) {
    return false;
  }
  changed_.clear();
  for (std::size_t i = 0; i < inputs->size(); ++i) {
    consider(link_->bindings[i], (*inputs)[i], written_[i]);
  }
  if (!changed_.empty()) {
    line.write_bound(changed_, now);
  }
  return !changed_.empty();
}

void BoundTarget::consider(const config::Binding& binding, const line::Line::Input& input,
                           Written& written) {
  const bool lost = !input.valid || (binding.forwarded && input.late);
  if (lost && !written.any) {
    return;
  }
  const bool again = binding.forwarded && !lost && input.received != written.received;
  const bool valid = !lost || binding.when_lost != config::WhenLost::stop;
  const bool zero = lost && binding.when_lost == config::WhenLost::zero;
  const std::uint64_t value = zero ? 0 : lost && binding.forwarded ? written.value : input.value;
  if (written.any && !again && written.value == value && written.valid == valid) {
    return;
  }
  written = {.value = value,
             .received = lost ? written.received : input.received,
             .any = true,
             .valid = valid};
  changed_.push_back({binding.output_entry, value, again, valid});
}

}  // namespace linegate::gateway
