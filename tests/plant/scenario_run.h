// SPDX-License-Identifier: Apache-2.0
// A running scenario. Private to the scenario_*.cpp files.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/plant/words.h"
#include "tests/plant/world.h"

namespace linegate::plant {

// A network as described so far; it is built at the first `at`.
struct NetworkPlan {
  line::LineConfig config;
  sim::BusOptions bus;
  std::vector<sim::DeviceOptions> devices;
  std::vector<line::DeviceConfig> ours;  // devices of a line in the role device
  std::set<std::uint8_t> domains;        // nodes with an object for long values
  std::map<std::uint8_t, ForeignSdo::Blocks> foreign_sdos;
  std::map<std::uint8_t, Duration> answers_after;
  std::map<std::uint8_t, std::uint16_t> reboots_on;  // nodes that boot when this object is written
  std::set<std::uint8_t> on_request;  // nodes with TPDOs that are only sent on request
  // Nodes with MPDOs, and the node whose MPDOs they receive, 0 = none
  std::map<std::uint8_t, std::uint8_t> mpdos;
};

// The content of a statement `device`.
struct DeviceStatement {
  sim::DeviceOptions device;
  line::NodeConfig node;
  bool listed = true;
  bool present = true;
  bool ours = false;
  bool no_cob_ids = false;
  bool text = false;
  bool twice = false;
  std::optional<Duration> heartbeat{};
  std::vector<std::pair<od::Address, std::uint64_t>> expected{};
  std::vector<std::pair<std::uint16_t, Duration>> inhibit_times{};    // by communication record
  std::vector<std::pair<std::uint16_t, std::uint64_t>> on_request{};  // TPDO, transmission type
  std::vector<std::uint16_t> swapped{};                               // mapping records
};

// The content of a statement `forward`.
struct ForwardRule {
  std::string from;
  std::string to;
  line::Following::Object input;
  line::Following::Object output;
  line::WhenLost when_lost = line::WhenLost::hold;
};

class Scenario {
 public:
  explicit Scenario(unsigned long seed) : seed_(seed), chance_(seed) {}

  void statement(Words words);
  void finish();
  bool waits_for_replies();
  World& world() { return world_; }
  unsigned expectations() const { return expectations_; }

 private:
  void describe_line(Words& words);
  void describe_device(Words& words);
  bool device_property(const std::string& key, Words& words, DeviceStatement& said);
  bool object_property(const std::string& key, Words& words, DeviceStatement& said);
  void list_device(DeviceStatement& said);
  void seat_device(LineSeat& seat, const NetworkPlan& plan, const sim::DeviceOptions& options);
  void describe_route(Words& words);
  void describe_access(Words& words);
  void describe_forward(Words& words);
  void plan_forwards();
  NetworkPlan& plan_of(const std::string& line);
  void build();
  void act(Words& words);
  void expect(Words& words);
  void node_action(Words& words);
  void switch_off(DeviceSeat& device);
  void restart(Words& words);
  void blink(DeviceSeat& device);
  void sdo_action(Words& words);
  void data_action(const std::string& verb, Words& words);
  void nmt_action(Words& words);
  void group_write(Words& words);
  void ours_action(Words& words);
  bool ours_bus_action(const std::string& verb, Words& words);
  void lose_frames_of_ours();
  void inject(Words& words);
  void set_disturbance();
  void bus_action(Words& words);
  can::BusEvent connect(sim::Bus::Endpoint end, bool on);
  void acknowledge(bool on);
  std::function<bool()> condition(Words& words);
  std::function<bool()> event_condition(Words& words, std::vector<Event> LineSeat::*told);
  line::ReplyData reply_data(Words& words);
  std::function<bool()> reply_condition(Words& words);
  std::function<bool()> observer_condition(Words& words);
  std::function<bool()> image_condition(Words& words, line::Line& line, image::Direction direction);
  std::function<bool()> ours_condition(Words& words);
  std::function<bool()> routing_condition(Words& words);
  std::function<bool()> boot_condition(Words& words);
  void boot_action(Words& words);
  static bool startup_property(Words& words, const std::string& key, line::LineConfig& config);
  static bool boot_property(Words& words, const std::string& key, line::NodeConfig& node);
  static void expect_value(od::DeviceDescription& device, od::Address address, std::uint64_t value);
  static std::vector<std::uint32_t> output_entries(const line::Line& line, const std::string& text);
  static std::uint32_t output_entry(const line::Line& line, const std::string& text) {
    return output_entries(line, text).front();
  }
  // The entry NODE.INDEX:SUB in the image.
  struct Shown {
    bool valid = false;
    bool known = false;
    std::uint64_t value = 0;
  };
  Shown shown(line::Line& line, image::Direction direction, const std::string& text);
  line::Line& ours();
  void command(line::Command request, const std::string& name);
  void check_always_all();
  LineSeat& seat();

  unsigned long seed_;
  std::mt19937_64 chance_;
  World world_;
  std::vector<NetworkPlan> plans_;
  std::vector<ForwardRule> forwards_;
  std::map<std::pair<std::string, std::string>, std::vector<line::Following>> followings_;
  bool built_ = false;
  LineSeat* current_ = nullptr;
  std::size_t event_cursor_ = 0;  // events before the last `at` are ignored
  std::size_t observed_cursor_ = 0;
  std::size_t ours_cursor_ = 0;
  std::size_t frame_cursor_ = 0;
  std::map<std::string, std::uint64_t> tags_;
  std::map<LineSeat*, std::uint64_t> commands_;
  std::uint64_t next_tag_ = 1;
  unsigned expectations_ = 0;
  std::uint64_t losses_ = 0;   // per thousand frames
  std::uint64_t doubles_ = 0;  // per thousand frames
  bool is_silent_ = false;     // no station acknowledges
  Instant silent_since_{};
  // By identifier: number of frames that no station receives
  std::map<std::uint32_t, std::uint64_t> swallowed_;
};

inline constexpr Instant kStart{std::chrono::seconds(1)};

}  // namespace linegate::plant
