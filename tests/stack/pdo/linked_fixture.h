// SPDX-License-Identifier: Apache-2.0
// A manager whose image is linked to devices.
#pragma once

#include <memory>

#include "stack/image/process_image.h"
#include "stack/pdo/engine.h"
#include "stack/pdo/link.h"

#include "tests/stack/pdo/device_fixture.h"

namespace linegate::pdo::test {

struct Manager {
  explicit Manager(const std::vector<RemoteNode>& nodes) : plan(*plan_links(nodes).value) {
    image = std::make_unique<image::ProcessImage>(plan.inputs, plan.outputs);
    EXPECT_TRUE(add_linked_objects(dictionary, *image, plan).ok());
    engine = std::make_unique<Engine>(dictionary, dispatch, events, image.get());
    engine->link(plan);
    EXPECT_TRUE(engine->configure().empty());
    engine->set_operational(true, at(0));
  }

  // In the same way as node::Node.
  void receive(std::span<const can::Frame> frames) {
    while (!frames.empty()) {
      const std::size_t ordinary = engine->receive_ordinary(frames, traffic);
      by_short_way += ordinary;
      frames = frames.subspan(ordinary);
      if (!frames.empty()) {
        receive_otherwise(frames.front());
        frames = frames.subspan(1);
      }
    }
  }
  void receive(const can::Frame& frame) { receive(std::span(&frame, 1)); }
  void receive_otherwise(const can::Frame& frame) {
    traffic.add(frame);
    for (const can::Target* target = dispatch.find(frame); target != nullptr;
         target = dispatch.next(*target)) {
      engine->receive(target->index, frame);
    }
  }
  image::Snapshot& snapshot(bool merge = false) {
    image->snapshot(image::Direction::inputs, inputs, at(0), merge, 0);
    return inputs;
  }

  LinkPlan plan;
  std::unique_ptr<image::ProcessImage> image;
  od::Dictionary dictionary;
  can::Dispatch dispatch;
  EventLog events;
  std::unique_ptr<Engine> engine;
  image::Snapshot inputs;
  can::Traffic traffic;
  std::uint64_t by_short_way = 0;
};

inline Parameters remote_pdo(std::uint16_t number, std::uint32_t cob_id,
                             const std::vector<std::uint32_t>& mapping, std::uint8_t type = 255) {
  Parameters out;
  out.number = number;
  out.cob_id = {cob_id};
  out.type = type;
  for (const std::uint32_t raw : mapping) {
    out.mapping.push_back(Mapping::from_raw(raw));
  }
  return out;
}

}  // namespace linegate::pdo::test
