// SPDX-License-Identifier: Apache-2.0
// Lines that are flying masters on one bus with simulated devices, and a flying master of another
// manufacturer, in virtual time. Stations are switched off and on, cut off and joined, and frames
// are lost.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridges/sim/bus.h"
#include "bridges/sim/device.h"
#include "stack/line/line.h"

#include "tests/plant/foreign_master.h"

namespace linegate::plant {

// What a line notices while its end of the bus is cut off.
enum class CutEnd : std::uint8_t {
  nothing,          // its frames count as sent when they are handed out
  acknowledgement,  // the lack of it
  bus_off,          // and the frames that it has handed out are lost
};

struct FlyingPlan {
  struct Master {
    std::uint8_t node = 0;
    std::uint8_t priority = 0;
    bool forces = false;  // FlyingMasterConfig::forces_each_cycle
  };
  std::vector<Master> lines;
  std::optional<Master> foreign;
  bool keep_alive = false;  // device 6 is kept alive
  bool fd = false;          // CANopen FD
  bool sync = false;        // the active master produces SYNC
  bool defaults = false;    // each output has one
  CutEnd cut = CutEnd::nothing;
  Duration master_heartbeat{};  // the consumer heartbeat time; 0: twice the heartbeat
  bool connects = false;  // SDO connections: the lines have CAN-IDs, the devices one channel each
};

class FlyingWorld {
 public:
  static constexpr std::uint8_t kDevices[] = {5, 6};
  static constexpr std::uint16_t kClientChannel = 0x1280;
  static constexpr std::uint16_t kServerChannel = 0x1201;

  // Switches all stations on.
  explicit FlyingWorld(FlyingPlan plan);

  // Stations are the lines, then the foreign master.
  std::size_t stations() const { return stations_.size(); }
  bool alive(std::size_t station) const { return stations_[station].alive(); }
  bool is_foreign(std::size_t station) const { return stations_[station].is_foreign; }
  void kill(std::size_t station);
  void revive(std::size_t station);
  void connect(std::size_t station, bool connected);
  // The process of a line has no processor for that time.
  void pause(std::size_t station, Duration time) { stations_[station].runs_from = now_ + time; }
  bool connected(std::size_t station) const { return bus_.connected(stations_[station].end); }
  void set_disturbance(sim::Bus::Disturbance wanted) { bus_.set_disturbance(std::move(wanted)); }

  Instant now() const { return now_; }
  void run(Instant until);
  void pass(Duration time) { run(now_ + time); }

  line::Line& line(std::size_t station) { return *stations_[station].line; }
  sim::Device& device(std::size_t place) { return *devices_[place].device; }
  // Resets of all devices.
  std::uint64_t resets() const;
  // The first violation of a rule that holds at any time; empty if there was none.
  const std::string& failure() const { return failure_; }
  // Whether the station is the active master.
  bool is_master(std::size_t station) const;
  // What is wrong with the number of masters in each part of the bus; empty if nothing.
  std::string wrong_masters() const;
  // One detect cycle and one election after the last fault.
  Duration bound() const;
  std::string describe() const;

 private:
  struct Station {
    FlyingPlan::Master plan;
    bool is_foreign = false;
    sim::Bus::Endpoint end = 0;
    std::unique_ptr<line::Line> line;
    std::unique_ptr<ForeignMaster> foreign;
    std::uint64_t sent_before{};  // frames of this end before the line was switched on
    Instant runs_from{};

    bool alive() const { return line != nullptr || foreign != nullptr; }
  };
  struct Seat {
    std::unique_ptr<sim::Device> device;
    sim::Bus::Endpoint end = 0;
  };

  std::string profile() const { return plan_.fd ? "fd-io" : "digital-io"; }
  line::LineConfig config_of(const FlyingPlan::Master& master) const;
  Instant next_event() const;
  void step();
  void turn(Station& station);
  void report_cut(Station& station);
  void turn(Seat& seat);
  void check_sent(const Station& station, const can::Frame& frame);

  FlyingPlan plan_;
  sim::Bus bus_;
  std::vector<Station> stations_;
  std::vector<Seat> devices_;
  Instant now_{std::chrono::seconds(1)};
  std::uint32_t outputs_ = 0;  // entries of the layout
  std::string failure_;
};

}  // namespace linegate::plant
