#include "bridges/console/model.h"

#include <algorithm>

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

Line& Model::line(const LineId& id) {
  ++revision_;
  Line& found = lines_[id];
  found.id = id;
  return found;
}

void Model::on_line(const LineId& id, const LineView& view) {
  Line& target = line(id);
  target.gone = false;
  target.view = view;
}

void Model::on_line_gone(const LineId& id) {
  line(id).gone = true;
}

void Model::on_node(const LineId& id, const NodeView& node) {
  line(id).nodes[node.state.node] = node;
}

void Model::on_layout(const LineId& id, const image::Layout& layout) {
  line(id).areas[static_cast<std::size_t>(layout.direction)].layout = layout;
}

void Model::on_image(const LineId& id, const image::Snapshot& image) {
  Line& target = line(id);
  ++target.images;
  target.areas[static_cast<std::size_t>(image.direction)].image = image;
}

void Model::on_event(const LineId& id, const EventView& event) {
  (void)line(id);
  ++events_seen_;
  events_.push_back({id, event});
  if (events_.size() > kKeptEvents) {
    events_.pop_front();
  }
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
