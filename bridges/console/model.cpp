// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/model.h"

#include <algorithm>
#include <utility>

#include "bridges/console/table.h"

namespace linegate::console {

std::vector<std::byte> Area::value(std::size_t entry) const {
  if (!complete() || entry >= layout->entries.size()) {
    return {};
  }
  const image::Entry& place = layout->entries[entry];
  std::vector<std::byte> out((place.bit_length + 7U) / 8U);
  for (std::uint32_t bit = 0; bit < place.bit_length; ++bit) {
    const std::uint32_t from = place.bit_offset + bit;
    if (from / 8 < image->bytes.size() &&
        (image->bytes[from / 8] >> (from % 8) & std::byte{1}) != std::byte{0}) {
      out[bit / 8] |= std::byte{1} << (bit % 8);
    }
  }
  return out;
}

std::optional<Duration> Area::age(std::size_t entry) const {
  if (!image || entry >= received.size() || received[entry] == Instant{} ||
      received[entry] > image->acquired) {
    return std::nullopt;
  }
  return image->acquired - received[entry];
}

void Area::take(const image::Layout& fresh, Instant now) {
  match_.take(layout, fresh, now);
  at(now);
  if (!layout || layout->id != fresh.id) {
    received.assign(fresh.entries.size(), Instant{});
  }
  layout = fresh;
}

void Area::take(const image::Snapshot& fresh, Instant now) {
  if (match_.is_overtaken(image, fresh, now)) {
    return;
  }
  match_.take(image, fresh, now);
  at(now);
  image = fresh;
  if (!fits()) {
    return;
  }
  for (const image::PdoMark& mark : fresh.marks) {
    for (std::size_t i = mark.first_entry;
         i < received.size() && i - mark.first_entry < mark.entries; ++i) {
      received[i] = mark.time;
    }
  }
}

namespace {

std::optional<double> frames_a_second(std::uint64_t before, std::uint64_t now, Duration passed) {
  return static_cast<double>(now - before) / std::chrono::duration<double>(passed).count();
}

}  // namespace

void Model::at(Instant now) {
  now_ = now;
  for (auto& [id, line] : lines_) {
    for (Area& area : line.areas) {
      area.at(now);
    }
  }
}

Freshness Model::freshness(const Line& line) const {
  if (line.gone) {
    return Freshness::gone;
  }
  if (!line.view) {
    return Freshness::unheard;
  }
  return silence(line) > kSilence ? Freshness::silent : Freshness::live;
}

Line* Model::line(const LineId& id) {
  if (lines_.size() >= kMaxLines && !lines_.contains(id)) {
    ++left_out_;
    return nullptr;
  }
  ++revision_;
  Line& found = lines_[id];
  found.id = id;
  return &found;
}

void Model::on_gateway(const std::string& name, const GatewayView& gateway) {
  if (gateways_.size() >= kMaxLines && !gateways_.contains(name)) {
    ++left_out_;
    return;
  }
  ++revision_;
  gateways_[name] = gateway;
}

void Model::on_line(const LineId& id, const LineView& view) {
  if (Line* const target = line(id)) {
    if (!target->view || target->view->incarnation != view.incarnation)
      target->begun = now_;
    target->gone = false;
    target->view = view;
    target->heard = now_;
    count_rates(*target);
    if (has_namesake(view)) {
      namesakes_.try_emplace(id.gateway, false);
    } else if (now_ - target->begun >= kSilence) {
      // The states of the new start may come before its LineState. Two gateways of one name publish
      // by turns before they know of each other, and a late LineState is not a start.
      const auto is_former = [&view](const auto& one) {
        return one.second.incarnation != view.incarnation;
      };
      std::erase_if(target->nodes, is_former);
      std::erase_if(target->groups, is_former);
    }
  }
}

// LineState comes once a second and on change; a shorter interval would make the rate jump.
void Model::count_rates(Line& line) {
  constexpr Duration kLeast = std::chrono::milliseconds(900);
  const LineView& view = *line.view;
  const line::Counters& now = view.state.counters;
  const bool anew = !line.baseline_ || view.time < line.baseline_->time ||
                    now.frames_received < line.baseline_->state.counters.frames_received ||
                    now.frames_sent < line.baseline_->state.counters.frames_sent;
  if (anew) {
    line.received_per_second.reset();
    line.sent_per_second.reset();
  } else if (const Duration passed = view.time - line.baseline_->time; passed >= kLeast) {
    const line::Counters& before = line.baseline_->state.counters;
    line.received_per_second = frames_a_second(before.frames_received, now.frames_received, passed);
    line.sent_per_second = frames_a_second(before.frames_sent, now.frames_sent, passed);
  } else {
    return;
  }
  line.baseline_ = view;
}

void Model::on_line_gone(const LineId& id) {
  if (Line* const target = line(id)) {
    target->gone = true;
  }
}

void Model::on_node(const LineId& id, const NodeView& node) {
  if (Line* const target = line(id)) {
    target->nodes[node.state.node] = node;
  }
}

void Model::on_output_state(const LineId& id, const OutputStateView& state) {
  if (Line* const target = line(id)) {
    target->groups[state.state.group] = state;
  }
}

void Model::on_node_gone(const LineId& id, std::uint8_t node) {
  if (const auto found = lines_.find(id); found != lines_.end()) {
    revision_ += found->second.nodes.erase(node);
  }
}

void Model::on_output_state_gone(const LineId& id, std::uint16_t group) {
  if (const auto found = lines_.find(id); found != lines_.end()) {
    revision_ += found->second.groups.erase(group);
  }
}

void Model::on_layout(const LineId& id, const image::Layout& layout) {
  if (Line* const target = line(id)) {
    target->areas[static_cast<std::size_t>(layout.direction)].take(layout, now_);
  }
}

void Model::on_image(const LineId& id, const image::Snapshot& image) {
  if (Line* const target = line(id)) {
    ++target->images;
    target->areas[static_cast<std::size_t>(image.direction)].take(image, now_);
  }
}

void Model::on_event(const LineId& id, const EventView& event) {
  if (!id.line.empty() && line(id) == nullptr) {  // an empty line name: the gateway itself
    return;
  }
  ++events_seen_;
  events_.push_back({id, event});
  if (events_.size() > kKeptEvents) {
    events_.pop_front();
  }
}

std::vector<std::string> Model::pop_warnings() {
  std::vector<std::string> out;
  if (unreadable_ > 0 && !std::exchange(unreadable_reported_, true)) {
    out.emplace_back("damaged samples were received and dropped");
  }
  if (left_out_ > 0 && !std::exchange(left_out_reported_, true)) {
    out.push_back("more than " + std::to_string(kMaxLines) +
                  " lines are published; further lines are ignored");
  }
  for (auto& [gateway, warned] : namesakes_) {
    if (!std::exchange(warned, true)) {
      out.push_back("more than one gateway is called '" + printable(gateway) +
                    "': values of all of them are mixed, and all execute commands");
    }
  }
  return out;
}

bool Model::has_namesake(const LineView& view) {
  return std::ranges::any_of(view.properties,
                             [](const auto& property) { return property.first == "namesakes"; });
}

std::vector<const Line*> Model::find(const std::string& text) const {
  const std::size_t slash = text.find('/');
  const std::string gateway = slash == std::string::npos ? "" : text.substr(0, slash);
  const std::string name = slash == std::string::npos ? text : text.substr(slash + 1);
  const bool number = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
    return c >= '0' && c <= '9';
  });
  std::vector<const Line*> out;
  for (const auto& [id, line] : lines_) {
    const bool network = number && line.view && std::to_string(line.view->state.network_id) == name;
    const bool here = slash == std::string::npos || id.gateway == gateway;
    if (text.empty() || (here && (id.line == name || network))) {
      out.push_back(&line);
    }
  }
  return out;
}

}  // namespace linegate::console
