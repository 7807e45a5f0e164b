// SPDX-License-Identifier: Apache-2.0
#include "flying_network.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "stack/can/cob_id.h"

namespace linegate::nmt {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr Duration kLatest = milliseconds(3);  // of a thread

}  // namespace

struct FlyingNetwork::Node final : FlyingMasterHost {
  Node(FlyingNetwork& network, std::uint8_t node_id)
      : of(network), id(node_id), machine(*this, node_id) {}

  void send_master_message(const can::Frame& frame, Instant now) override {
    of.send(*this, frame, now);
  }
  bool reset_all(Instant now) override {
    if (!of.keeps_alive_) {
      of.send(*this, encode({Command::reset_communication, 0}), now);
    }
    return !of.keeps_alive_;
  }
  bool monitors_master() const override { return monitored != 0; }
  void flying_master_changed(FlyingMasterState before, Instant now) override {
    monitored = machine.state() == FlyingMasterState::slave ? machine.active_master() : 0;
    lost_at = kNever;
    if (machine.is_master() && before != FlyingMasterState::master) {
      reset_all(now);  // as a manager that starts the network
    }
  }
  void receive(const can::Frame& frame) {
    if (frame.id == can::kNmtId) {
      const auto control = decode_node_control(frame);
      if (!machine.is_master() && is_reset(control->command)) {
        boot_up_at = frame.time + milliseconds(1 + of.below(20));
      }
      machine.node_control(*control, frame.time);
    } else if (frame.id > can::kErrorControlBase) {
      const auto sender = static_cast<std::uint8_t>(frame.id - can::kErrorControlBase);
      if (frame.data[0] == std::byte{}) {
        machine.boot_up(frame.time);
      }
      machine.heartbeat(sender, frame.time);
      if (sender == monitored) {
        lost_at = frame.time + consumer_time;
      }
    } else {
      machine.receive(frame);
    }
  }
  void power_on(Instant now) {
    alive = true;
    lost_at = kNever;
    monitored = 0;
    boot_up_at = now;
    beat_at = now + heartbeat;
    machine.start(true, now);
  }
  Instant wake() const {
    if (!alive) {
      return kNever;
    }
    const Instant machine_due = machine.next_wake() == kNever ? kNever : machine.next_wake() + late;
    return earlier(earlier(machine_due, lost_at), earlier(beat_at, boot_up_at));
  }
  void advance(Instant now) {
    if (boot_up_at <= now) {
      boot_up_at = kNever;
      of.send(*this, can::make_frame(can::kErrorControlBase + id, {0}), now);
    }
    if (beat_at <= now) {
      beat_at += heartbeat;
      of.send(*this, can::make_frame(can::kErrorControlBase + id, {5}), now);
    }
    if (lost_at <= now) {
      lost_at = kNever;
      machine.heartbeat_lost(monitored, now);
    }
    if (machine.next_wake() != kNever && machine.next_wake() + late <= now) {
      late = microseconds(of.below(static_cast<std::uint64_t>(kLatest / microseconds(1))));
      machine.advance(now);
    }
  }

  FlyingNetwork& of;
  std::uint8_t id;
  FlyingMaster machine;
  bool alive = false;
  unsigned part = 0;
  Duration heartbeat{};
  Duration consumer_time{};
  Duration late{};
  std::uint8_t monitored = 0;
  Instant lost_at = kNever;
  Instant beat_at = kNever;
  Instant boot_up_at = kNever;
};

FlyingNetwork::FlyingNetwork(std::uint64_t seed) : random_(seed) {
  make_nodes();
  loss_ = static_cast<unsigned>(below(3) == 0 ? 0 : below(300));
  keeps_alive_ = below(3) == 0;
  faults_until_ = now_ + between(0, 30000);
  next_fault_ = now_;
  last_fault_ = now_;
  for (const auto& node : nodes_) {
    if (below(4) != 0) {
      node->power_on(now_);
    }
  }
}

FlyingNetwork::~FlyingNetwork() = default;

void FlyingNetwork::make_nodes() {
  FlyingMasterTimes times;
  times.master_timeout = between(50, 200);
  times.negotiation_delay = between(100, 1000);
  times.device_slot = between(8, 15);
  times.priority_slot = 128 * times.device_slot;
  const Duration cycle = between(2000, 5000);
  const Duration heartbeat = between(100, 500);
  const bool same_delays = below(4) != 0;
  forces_ = below(3) == 0;
  std::vector<std::uint8_t> ids(127);
  std::iota(ids.begin(), ids.end(), std::uint8_t{1});
  std::ranges::shuffle(ids, random_);
  Duration longest_cycle{};
  Duration longest_wait{};
  const std::size_t count = 1 + below(6);
  for (std::size_t i = 0; i < count; ++i) {
    FlyingMasterTimes own = times;
    own.priority = static_cast<std::uint8_t>(below(3));
    own.detect_cycle = cycle + ids[i] * milliseconds(10);
    if (!same_delays) {
      own.negotiation_delay += between(0, 300);
      own.master_timeout += between(0, 50);
    }
    auto node = std::make_unique<Node>(*this, ids[i]);
    node->heartbeat = heartbeat;
    node->consumer_time = heartbeat * 2;
    node->machine.set_times(own);
    node->machine.set_detection(forces_ ? MasterDetection::force : MasterDetection::ask);
    longest_cycle = std::max(longest_cycle, own.detect_cycle);
    longest_wait = std::max(longest_wait, own.negotiation_delay + own.master_timeout);
    nodes_.push_back(std::move(node));
  }
  // One detect cycle and one election: the questions of a slave, detection, reset and detection
  // again, negotiation; and the delays of frames and threads.
  bound_ = longest_cycle + 3 * (times.master_timeout + milliseconds(50) + heartbeat) +
           2 * longest_wait + 2 * times.priority_slot + 127 * times.device_slot + milliseconds(100);
}

void FlyingNetwork::send(const Node& from, const can::Frame& frame, Instant now) {
  Instant at = now + microseconds(100 + below(1900));
  if (!bus_.empty()) {
    at = std::max(at, bus_.back().at);  // one after the other
  }
  bus_.push_back({at, &from, frame});
}

void FlyingNetwork::deliver(const Sent& sent) {
  const bool faulty = now_ < faults_until_;
  if (faulty && below(1000) < loss_) {
    last_fault_ = now_;
    return;
  }
  can::Frame frame = sent.frame;
  frame.time = sent.at;
  const unsigned part = sent.from->part;
  for (const auto& node : nodes_) {
    if (node.get() == sent.from || !node->alive || node->part != part) {
      continue;
    }
    if (faulty && below(1000) < loss_) {
      last_fault_ = now_;
    } else {
      node->receive(frame);
    }
  }
}

void FlyingNetwork::fault() {
  last_fault_ = now_;
  next_fault_ = now_ + (below(2) == 0 ? between(0, 300) : between(0, 8000));
  Node& node = *nodes_[below(nodes_.size())];
  switch (below(6)) {
    case 0:
      node.alive = false;
      return;
    case 1:
      if (!node.alive) {
        node.power_on(now_);
      }
      return;
    case 2:
      for (const auto& each : nodes_) {
        each->part = static_cast<unsigned>(below(2));
      }
      return;
    case 3:
      node.part = static_cast<unsigned>(below(3));
      return;
    case 4:  // the master is lost
      for (const auto& each : nodes_) {
        each->alive = each->alive && !each->machine.is_master();
      }
      return;
    default:
      for (const auto& each : nodes_) {
        each->part = 0;
      }
      return;
  }
}

Instant FlyingNetwork::next_event() const {
  Instant out = next_fault_;
  if (!bus_.empty()) {
    out = earlier(out, bus_.front().at);
  }
  for (const auto& node : nodes_) {
    out = earlier(out, node->wake());
  }
  return out;
}

void FlyingNetwork::step() {
  if (next_fault_ <= now_) {
    if (now_ >= faults_until_) {
      next_fault_ = kNever;
    } else {
      fault();
    }
  }
  while (!bus_.empty() && bus_.front().at <= now_) {
    const Sent sent = bus_.front();
    bus_.pop_front();
    deliver(sent);
  }
  for (const auto& node : nodes_) {
    if (node->wake() <= now_) {
      node->advance(now_);
    }
  }
}

// What is wrong with the masters, empty if each part has exactly one.
std::string FlyingNetwork::wrong() const {
  std::map<unsigned, unsigned> masters;  // number, by part
  for (const auto& node : nodes_) {
    if (node->alive) {
      masters[node->part] += node->machine.is_master() ? 1U : 0U;
    }
  }
  for (const auto& [part, number] : masters) {
    if (number != 1) {
      return "part " + std::to_string(part) + " has " + std::to_string(number) + " masters";
    }
  }
  return {};
}

std::string FlyingNetwork::describe() const {
  std::string out;
  for (const auto& node : nodes_) {
    out += "\n  node " + std::to_string(node->id) + (node->alive ? "" : " dead") + " part " +
           std::to_string(node->part) + " priority " +
           std::to_string(node->machine.own_rank().priority) + " state " +
           std::to_string(static_cast<int>(node->machine.state())) + " master " +
           std::to_string(node->machine.active_master());
  }
  return out;
}

std::string FlyingNetwork::run() {
  while (now_ < faults_until_) {
    now_ = std::min(next_event(), faults_until_);
    step();
  }
  const Instant settled_by = last_fault_ + bound_;
  const Instant end = settled_by + 2 * bound_;
  bool was_wrong = !wrong().empty();
  settled_ = {};
  while (now_ < end) {
    now_ = std::min(next_event(), end);
    step();
    const std::string what = wrong();
    if (!what.empty() && now_ > settled_by) {
      return what + ", " + std::to_string((now_ - last_fault_) / milliseconds(1)) +
             " ms after the last fault, the bound is " + std::to_string(bound_ / milliseconds(1)) +
             " ms" + describe();
    }
    if (was_wrong && what.empty()) {
      settled_ = now_ - last_fault_;
    }
    was_wrong = !what.empty();
  }
  // Each node names the master of its part, unless it has to search for it each cycle.
  for (const auto& node : nodes_) {
    const bool right = std::ranges::any_of(nodes_, [&](const auto& each) {
      return each->alive && each->part == node->part && each->machine.is_master() &&
             each->id == node->machine.active_master();
    });
    const bool searches = forces_ && node->machine.active_master() == 0;
    if (node->alive && !right && !searches) {
      return "a node has another master" + describe();
    }
  }
  return {};
}

}  // namespace linegate::nmt
