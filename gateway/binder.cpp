#include "gateway/binder.h"

#include <algorithm>
#include <utility>

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

void BoundSource::look(const line::Line& line) {
  if (std::exchange(revision_, line.layout_revision()) != line.layout_revision() ||
      std::exchange(first_, false)) {
    find_entries(line);
  }
  bool changed = false;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    line::Line::Input now{last_[i].value, false};
    if (entries_[i] != kNone) {
      now = line.input(entries_[i]);
    }
    changed = changed || now.value != last_[i].value || now.valid != last_[i].valid;
    last_[i] = now;
  }
  if (changed) {
    auto draft = link_->values.draft();
    std::copy(last_.begin(), last_.end(), draft.value.begin());
    link_->values.publish();
    link_->taker->signal();
  }
}

BoundTarget::BoundTarget(BoundLink& link) : link_(&link), written_(link.bindings.size()) {
  changed_.reserve(link.bindings.size());
}

void BoundTarget::take(line::Line& line, Instant now) {
  const std::vector<line::Line::Input>* inputs = link_->values.fetch();
  if (inputs == nullptr) {
    return;
  }
  changed_.clear();
  for (std::size_t i = 0; i < inputs->size(); ++i) {
    const config::Binding& binding = link_->bindings[i];
    const line::Line::Input& input = (*inputs)[i];
    Written& written = written_[i];
    if (!input.valid && !written.any) {
      continue;
    }
    const std::uint64_t value = !input.valid && binding.zero_when_lost ? 0 : input.value;
    if (!std::exchange(written.any, true) || written.value != value) {
      written.value = value;
      changed_.push_back({binding.output_entry, value});
    }
  }
  if (!changed_.empty()) {
    line.write_bound(changed_, now);
  }
}

}  // namespace linegate::gateway
