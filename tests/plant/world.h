// SPDX-License-Identifier: Apache-2.0
// Whole networks in virtual time: lines, their buses and simulated devices on one thread.
//
// Everything happens in the order (time, line, device): the same world has the same frames at the
// same instants in every run.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bridges/sim/bus.h"
#include "bridges/sim/device.h"
#include "stack/line/following.h"
#include "stack/line/line.h"

#include "tests/plant/answer_model.h"
#include "tests/plant/device_model.h"
#include "tests/plant/foreign_sdo.h"
#include "tests/plant/identity_model.h"
#include "tests/plant/idle_inputs.h"
#include "tests/plant/image_model.h"
#include "tests/plant/output_model.h"
#include "tests/plant/own_answer_model.h"
#include "tests/plant/own_output_model.h"
#include "tests/plant/request_model.h"
#include "tests/plant/silence_model.h"
#include "tests/plant/state_model.h"

namespace linegate::plant {

// The node-ID that a device uses on its bus: 0 = none, or it is off or disconnected. A node-ID that
// was assigned to it for later use counts, too.
struct NodeIdUse {
  std::uint8_t node_id = 0;
  std::uint8_t active = 0;  // without a node-ID that was assigned for later use
  bool alive = false;
  Instant shows = kNever;  // earliest time at which the node-ID can be detected
};

// A device and its endpoint on the bus.
struct DeviceSeat {
  std::unique_ptr<sim::Device> device;
  sim::Bus::Endpoint end = 0;
  // An object whose download makes the device boot instead of answering; 0 = none.
  std::uint16_t reboots_on = 0;
  std::optional<DeviceModel> model{};  // for devices whose guarding or MPDOs are checked
  std::optional<ForeignSdo> sdo{};     // for devices with the SDO server of another manufacturer
  std::optional<RequestModel> requests{};  // for devices with TPDOs that are only sent on request
  NodeIdUse use{};
  bool was_off = false;      // an SDO client has switched off an RPDO of the image
  Duration answers_after{};  // delay of its SDO responses
  // Delayed responses with the times when they are due
  std::deque<std::pair<Instant, can::Frame>> late{};
};

// A line and the stations on its bus, among them an observing line with the same configuration.
struct LineSeat {
  LineSeat(std::unique_ptr<line::Line> the_line, const sim::BusOptions& options);

  DeviceSeat* find(std::uint8_t node);
  // The NMT state of the device with this node-ID; unknown if none is switched on.
  nmt::State real_state(std::uint8_t node_id) const;
  // Determines the fate of the frames on the bus; the models process each frame with its fate.
  void set_disturbance(sim::Bus::Disturbance wanted) { disturbance = std::move(wanted); }
  // Stops the line. From then on it has no obligations to its nodes.
  void stop(Instant now);
  // Puts another line on the same bus; the state of the previous line is discarded.
  void take(std::unique_ptr<line::Line> another);

  std::unique_ptr<line::Line> line;
  bool stopped = false;
  sim::Bus bus;
  sim::Bus::Endpoint end = 0;
  sim::Bus::Endpoint witness_end = 0;
  std::unique_ptr<line::Line> observer;
  sim::Bus::Endpoint observer_end = 0;
  std::vector<Event> observed;  // all events of the observer, in order
  std::vector<DeviceSeat> devices;
  std::unique_ptr<line::Line> ours;  // a line of own devices, if there is one
  sim::Bus::Endpoint ours_end = 0;
  std::vector<Event> ours_events;                         // all of its events, in order
  std::map<std::uint8_t, RequestModel> requests_of_ours;  // by node-ID
  std::optional<OwnAnswerModel> answers_of_ours;
  std::optional<ImageModel> model;
  std::optional<StateModel> states;
  std::optional<OutputModel> outputs;
  std::optional<OwnOutputModel> own_outputs;
  std::optional<AnswerModel> answers;
  sim::Bus::Disturbance disturbance;
  SilenceModel silence;
  IdleInputs idle_inputs;
  SilenceModel silence_of_ours;
  std::vector<Event> events;                     // all events of the line, in order
  std::map<std::uint64_t, line::Reply> replies;  // by tag
  std::set<std::uint64_t>
      reports;  // tags of LSS commands, whose bytes are not the value of an object
  std::uint64_t duplicate_replies = 0;
  std::vector<can::Frame> frames;  // all frames on the bus, in order
  IdentityModel identities;
};

// Values of one line that another line follows; they are handed over after a delay.
struct Joint {
  LineSeat* from = nullptr;
  LineSeat* to = nullptr;
  line::FollowedInputs inputs;
  line::FollowingOutputs outputs;
  std::vector<line::Line::Input> waiting;
  Instant due = kNever;
};

class World {
 public:
  // The first failure of a check by the world itself; empty if there was none.
  const std::string& failure() const { return failure_; }
  void fail(const std::string& text);

  LineSeat& add_line(std::unique_ptr<line::Line> line, const sim::BusOptions& options);
  DeviceSeat& add_device(LineSeat& seat, std::unique_ptr<sim::Device> device);
  void add_ours(LineSeat& seat, std::unique_ptr<line::Line> devices);
  void join(LineSeat& from, LineSeat& to, std::span<const line::Following> what);
  std::vector<std::unique_ptr<LineSeat>>& lines() { return lines_; }
  LineSeat* find(const std::string& name);

  Instant now() const { return now_; }
  // Powers the devices on, then starts the lines.
  void start();
  // Executes what is due next, at most until `until`; false if nothing is due until then (now() is
  // `until` then).
  bool step(Instant until);
  void run(Instant until);
  unsigned long steps() const { return steps_; }
  // Stops a line and starts it again with that configuration after the pause, at least 10 ms.
  void restart(LineSeat& seat, line::LineConfig config, Duration pause);
  // Processes frames and events that remain after a call from outside.
  void settle();

 private:
  Instant next_wake() const;
  std::string busy_participants() const;
  void hand_over();
  void turn(LineSeat& seat);
  void turn_device(LineSeat& seat, DeviceSeat& device);
  void follow_node_id(LineSeat& seat, DeviceSeat& device);
  void check_given(LineSeat& seat, const DeviceSeat& device);
  void receive_alone(LineSeat& seat, DeviceSeat& device, const can::Frame& frame);
  void turn_line(LineSeat& seat);
  void turn_ours(LineSeat& seat);
  void check_requests(const std::string& text);
  void turn_observer(LineSeat& seat);
  void collect(LineSeat& seat);
  // Before the frames of the same moment are submitted: the replies were given before them.
  void judge_replies(LineSeat& seat);
  void judge_replies_of_ours(LineSeat& seat);
  void collect_of_ours(LineSeat& seat);
  std::span<const Event> pop_events(LineSeat& seat);
  void judge(const LineSeat& seat, std::span<const Event> events);
  void transmit(LineSeat& seat, DeviceSeat& device);
  // Delivers the messages between the lines.
  void carry();

  std::vector<std::unique_ptr<LineSeat>> lines_;
  std::vector<Joint> joints_;
  std::minstd_rand delays_{1};  // delay of the hand-over, in us
  Instant now_{std::chrono::seconds(1)};
  unsigned steps_at_now_ = 0;
  unsigned long steps_ = 0;
  // Buffers for frames and events that are taken out of a bus or a line; members, because a step
  // should not initialise them for every device.
  std::array<can::Frame, 16> batch_;
  std::array<Event, 16> told_;
  std::string failure_;
};

}  // namespace linegate::plant
