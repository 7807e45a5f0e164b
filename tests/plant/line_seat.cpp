// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "tests/plant/world.h"

namespace linegate::plant {
namespace {

std::unique_ptr<line::Line> observer_of(const line::Line& line) {
  line::LineConfig config = line.config();
  config.role = line::Role::observer;
  return *line::Line::make(std::move(config)).value;
}

}  // namespace

LineSeat::LineSeat(std::unique_ptr<line::Line> the_line, const sim::BusOptions& options)
    : line(std::move(the_line)),
      bus(options),
      observer(observer_of(*line)),
      silence(line->config()) {
  line->expect_acknowledgements();
  model.emplace(*line);
  states.emplace(*line);
  outputs.emplace(*line);
  own_outputs.emplace(*line);
  answers.emplace(*line);
  end = bus.attach();
  witness_end = bus.attach();
  observer_end = bus.attach();
  bus.set_disturbance([this](const can::Frame& frame, sim::Bus::Endpoint sender) {
    const sim::Fate fate = disturbance ? disturbance(frame, sender) : sim::Fate::delivered;
    outputs->ended(*this, frame, sender, fate);
    const bool reached = fate != sim::Fate::lost;
    if (fate != sim::Fate::disturbed && (sender == end || (reached && bus.connected(end)))) {
      states->ended(frame, sender == end, fate);
    }
    return fate;
  });
}

DeviceSeat* LineSeat::find(std::uint8_t node) {
  for (DeviceSeat& seat : devices) {
    if (seat.device->options().node_id == node) {
      return &seat;
    }
  }
  return nullptr;
}

nmt::State LineSeat::real_state(std::uint8_t node_id) const {
  for (const DeviceSeat& seat : devices) {
    if (seat.device->alive() && bus.connected(seat.end) && seat.device->node_id() == node_id) {
      return seat.device->node().state();
    }
  }
  return ours != nullptr && bus.connected(ours_end) ? ours->node_state(node_id).state
                                                    : nmt::State::unknown;
}

void LineSeat::stop(Instant now) {
  stopped = true;
  states->stopped();
  line->stop(now);
}

void LineSeat::take(std::unique_ptr<line::Line> another) {
  stopped = false;
  model.reset();
  states.reset();
  outputs.reset();
  own_outputs.reset();
  answers.reset();
  line = std::move(another);
  line->expect_acknowledgements();
  observer = observer_of(*line);
  silence = SilenceModel(line->config());
  model.emplace(*line);
  states.emplace(*line);
  outputs.emplace(*line);
  own_outputs.emplace(*line);
  answers.emplace(*line);
  bus.detach(end);
  end = bus.attach();
  bus.detach(observer_end);
  observer_end = bus.attach();
  events.clear();
  observed.clear();
  replies.clear();
  reports.clear();
}

}  // namespace linegate::plant
