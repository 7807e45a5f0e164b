// SPDX-License-Identifier: Apache-2.0
// The samples that a DDS client of a gateway received: the newest of each kind, and every event.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridges/dds/client.h"

namespace linegate::gateway {

class GatewayListener : public dds::ClientListener {
 public:
  void on_line(const dds::Source& source, const dds::LineInfo& info, const line::LineState& state,
               const std::vector<dds::Property>& properties) override {
    for (const dds::Property& property : properties) {
      line_properties[property.name] = property.value;
      if (property.name == "routes-1") {
        routes[source.line] = property.value;
      }
    }
    incarnation = source.incarnation;
    lines[source.line] = state;
    infos[source.line] = info;
  }
  void on_node(const dds::Source& source, const dds::NodeInfo& info, const line::NodeState& state,
               const std::vector<dds::Property>&) override {
    nodes[source.line + "/" + info.name] = state;
  }
  void on_output_state(const dds::Source& source, const line::OutputState& state) override {
    output_states[source.line] = state;
  }
  void on_layout(const dds::Source& source, const image::Layout& layout) override {
    layouts[source.line + "/" + std::string(image::name(layout.direction))] = layout;
  }
  void on_image(const dds::Source& source, const image::Snapshot& snapshot) override {
    auto& last = images[source.line + "/" + std::string(image::name(snapshot.direction))];
    images_back += source.line == "open" && snapshot.sequence <= last.sequence ? 1 : 0;
    last = snapshot;
  }
  void on_pdo(const dds::Source& source, const dds::PdoUpdate& update) override {
    pdos[source.line] = update;
  }
  void on_reception(const dds::Source& source, const dds::PdoReception& reception) override {
    receptions[source.line].push_back(reception);
  }
  void on_event(const dds::Source& source, const dds::ReceivedEvent& event, std::string_view text,
                const std::vector<dds::Property>&) override {
    auto& numbers = events[source.line];
    gaps += !numbers.empty() && event.number != numbers.rbegin()->first + 1 ? 1 : 0;
    numbers[event.number] = event;
    texts.emplace_back(text);
  }

  void on_reply(const dds::Target&, const dds::CommandResult& result) override {
    replies.push_back(result.reply.error);
  }
  void on_line_gone(std::string_view /*gateway*/, std::string_view line) override {
    lines_gone.emplace_back(line);
  }

  bool happened(const std::string& line, EventKind kind) const {
    const auto it = events.find(line);
    if (it != events.end()) {
      for (const auto& [number, event] : it->second) {
        if (event.kind == kind) {
          return true;
        }
      }
    }
    return false;
  }

  std::uint64_t incarnation = 0;
  std::map<std::string, line::LineState> lines;
  std::map<std::string, line::OutputState> output_states;
  std::map<std::string, dds::LineInfo> infos;
  std::map<std::string, std::string> line_properties;
  std::map<std::string, std::string> routes;
  std::map<std::string, line::NodeState> nodes;
  std::map<std::string, image::Layout> layouts;
  std::map<std::string, image::Snapshot> images;
  std::map<std::string, dds::PdoUpdate> pdos;
  std::map<std::string, std::vector<dds::PdoReception>> receptions;
  std::map<std::string, std::map<std::uint64_t, dds::ReceivedEvent>> events;
  std::vector<std::string> texts;
  std::vector<std::string> lines_gone;
  std::vector<Error> replies;
  int gaps = 0;
  // Number of samples of line open with an older number than the sample before.
  int images_back = 0;
};

}  // namespace linegate::gateway
