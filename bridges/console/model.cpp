#include "bridges/console/model.h"

#include <algorithm>
#include <utility>

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

void Model::on_line(const LineId& id, const LineView& view) {
  if (Line* const target = line(id)) {
    target->gone = false;
    target->view = view;
  }
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

void Model::on_layout(const LineId& id, const image::Layout& layout) {
  if (Line* const target = line(id)) {
    target->areas[static_cast<std::size_t>(layout.direction)].layout = layout;
  }
}

void Model::on_image(const LineId& id, const image::Snapshot& image) {
  if (Line* const target = line(id)) {
    ++target->images;
    target->areas[static_cast<std::size_t>(image.direction)].image = image;
  }
}

void Model::on_event(const LineId& id, const EventView& event) {
  if (line(id) == nullptr) {
    return;
  }
  ++events_seen_;
  events_.push_back({id, event});
  if (events_.size() > kKeptEvents) {
    events_.pop_front();
  }
}

std::vector<std::string> Model::take_warnings() {
  std::vector<std::string> out;
  if (unreadable_ > 0 && !std::exchange(unreadable_told_, true)) {
    out.emplace_back("damaged samples were received and dropped");
  }
  if (left_out_ > 0 && !std::exchange(left_out_told_, true)) {
    out.push_back("more than " + std::to_string(kMaxLines) +
                  " lines are published: the others are left out");
  }
  return out;
}

std::vector<const Line*> Model::find(const std::string& text) const {
  const bool number = !text.empty() && std::ranges::all_of(text, [](unsigned char c) {
    return c >= '0' && c <= '9';
  });
  std::vector<const Line*> out;
  for (const auto& [id, line] : lines_) {
    const bool network = number && line.view && std::to_string(line.view->state.network_id) == text;
    if (text.empty() || id.line == text || network) {
      out.push_back(&line);
    }
  }
  return out;
}

}  // namespace linegate::console
