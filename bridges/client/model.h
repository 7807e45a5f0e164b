// SPDX-License-Identifier: Apache-2.0
// What a client has received of each line.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bridges/client/client.h"
#include "bridges/dds/values.h"
#include "stack/base/time.h"
#include "stack/image/layout.h"
#include "stack/image/layout_match.h"
#include "stack/image/snapshot.h"
#include "stack/line/output_state.h"
#include "stack/line/state.h"

namespace linegate::client {

// A gateway publishes the state of each line and group once a second.
inline constexpr linegate::Duration kSilence = std::chrono::seconds(3);

// One direction of the image of a line.
struct Area {
  std::optional<image::Layout> layout;
  std::optional<image::Snapshot> image;
  std::uint64_t layout_incarnation = 0;
  std::uint64_t image_incarnation = 0;
  std::unordered_map<std::string, std::uint32_t> entries;  // by name
  std::vector<Instant> received;                           // by entry: its last PDO
  std::uint64_t lost = 0;                                  // images that were not received

  image::LayoutMatch match;  // of one incarnation

  void take(const image::Layout& from, std::uint64_t incarnation, Instant now);
  void take(const image::Snapshot& from, std::uint64_t incarnation, Instant now);
  bool has_layout(std::uint64_t incarnation) const {
    return layout && layout_incarnation == incarnation;
  }
  // Whether layout and image are of that incarnation and belong together.
  bool complete(std::uint64_t incarnation, Instant now) const;
};

struct LineData {
  std::string gateway;
  std::string line;
  bool seen = false;  // a LineState was received
  bool gone = false;
  Instant heard{};  // of the last LineState, by the clock of the client
  Instant begun{};  // of the first LineState of this incarnation, and of one after it was gone or
                    // silent
  std::uint64_t incarnation = 0;
  std::uint64_t former = 0;         // the incarnation before; 0: none
  bool has_namesake = false;        // another gateway of that name publishes, too
  std::uint64_t gateway_lines = 0;  // number of lines that its gateway has
  std::uint64_t revision = 0;       // increases with each sample and change of status
  std::uint64_t layout_revision = 0;
  std::uint64_t outputs_revision = 0;  // of the names and places of the outputs
  std::uint64_t layout_reported = 0;
  std::uint64_t incarnation_reported = 0;
  LineStatus reported = LineStatus::waiting;
  std::uint64_t events_before = 0;  // events up to this number happened before the client began
  std::uint64_t events_incarnation = 0;
  std::array<Area, 2> areas;  // by image::Direction
  struct Node {
    line::Presence presence = line::Presence::unknown;
    std::uint64_t incarnation = 0;
  };
  std::map<std::uint8_t, Node> nodes;
  // Of the former incarnation, which may be another gateway of that name: with the end of this one
  // it is the present one again, and its layouts come only once.
  std::array<Area, 2> former_areas;
  std::map<std::uint8_t, Node> former_nodes;
  struct Group {
    line::OutputState state;
    std::uint64_t incarnation = 0;
    Instant heard{};  // by the clock of the client
  };
  // For up to kSilence also those that a reload removed while their samples did not arrive
  std::map<std::uint16_t, Group> groups;

  LineStatus status(Instant now) const;
  // Whether the gateway still publishes its state; nullptr is no group.
  bool is_present(const Group* group) const {
    return group != nullptr && group->incarnation == incarnation && heard - group->heard < kSilence;
  }
  bool is_former(std::uint64_t other) const { return other == former && other != 0; }
  // A LineState of that incarnation was received. Returns false if it is the former one, and the
  // present one was heard since.
  bool follow(std::uint64_t other, Instant now);
  // Where a sample of that incarnation goes. If it is of another one than the present area, that is
  // kept for its return.
  Area& area_of(image::Direction direction, std::uint64_t other);
  Area& area(image::Direction direction) { return areas[static_cast<std::size_t>(direction)]; }
  const Area& area(image::Direction direction) const {
    return areas[static_cast<std::size_t>(direction)];
  }
  // Without a quality that `line_quality` states if it is not good.
  Value read(const std::string& name, Quality line_quality, Instant now) const;

 private:
  void follow_areas(std::uint64_t other);
  Value value_of(const Area& area, std::uint32_t entry) const;
};

class Model {
 public:
  static constexpr std::size_t kMaxLines = 4096;

  // nullptr: there are kMaxLines others.
  LineData* find_or_add(const std::string& gateway, const std::string& line);
  const std::map<std::pair<std::string, std::string>, LineData>& lines() const { return lines_; }
  std::map<std::pair<std::string, std::string>, LineData>& lines() { return lines_; }

  struct Found {
    const LineData* line = nullptr;
    bool ambiguous = false;
  };
  // gateway: empty = any, if only one has the line.
  Found find(const std::string& gateway, const std::string& line) const;

 private:
  std::map<std::pair<std::string, std::string>, LineData> lines_;
};

}  // namespace linegate::client
