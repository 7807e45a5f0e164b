// SPDX-License-Identifier: Apache-2.0
// Statements that describe the network, and its construction.
#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"
#include "stack/pdo/mpdo.h"
#include "stack/pdo/parameters.h"

#include "tests/plant/scenario_run.h"

namespace linegate::plant {

using image::Direction;

namespace {

// 2F00h, which is not in the EDS of the device.
od::ObjectDescription domain_object() {
  od::VariableDescription domain;
  domain.type = od::DataType::domain;
  domain.access = od::Access::rw;
  od::ObjectDescription out;
  out.index = 0x2F00;
  out.name = "Program";
  out.variables.push_back(std::move(domain));
  return out;
}

od::VariableDescription variable(std::uint8_t sub, od::DataType type, std::uint64_t value) {
  od::VariableDescription out{
      .sub = sub, .name = "Value", .type = type, .access = od::Access::rw, .mappable = true};
  out.value.resize(od::byte_size(type));
  store_le(std::span(out.value), value);
  return out;
}

od::ObjectDescription object(std::uint16_t index, std::vector<od::VariableDescription> variables) {
  od::ObjectDescription out;
  out.index = index;
  out.name = "MPDO";
  out.type = variables.size() == 1 ? od::ObjectType::variable : od::ObjectType::record;
  out.variables = std::move(variables);
  return out;
}

// Adds 2300h, a string of four characters, behind the mapped objects of TPDO 1.
void map_text(od::DeviceDescription& device) {
  constexpr std::uint16_t kFirstMapping = 0x1A00;
  constexpr std::uint16_t kText = 0x2300;
  constexpr std::uint8_t kBits = 32;
  const auto mapping =
      std::ranges::find(device.objects, kFirstMapping, &od::ObjectDescription::index);
  if (mapping == device.objects.end()) {
    throw BadStatement("the device file has no TPDO 1");
  }
  auto& count = mapping->variables.front().value;
  const auto sub = static_cast<std::uint8_t>(load_le<std::uint8_t>(count.data()) + 1);
  store_le(std::span(count), std::uint64_t{sub});
  const auto place =
      std::ranges::find_if(mapping->variables, [&](const auto& v) { return v.sub >= sub; });
  const auto entry = variable(sub, od::DataType::unsigned32, std::uint64_t{kText} << 16U | kBits);
  if (place != mapping->variables.end() && place->sub == sub) {
    *place = entry;
  } else {
    mapping->variables.insert(place, entry);
  }
  od::VariableDescription text{.name = "Text",
                               .type = od::DataType::visible_string,
                               .access = od::Access::rw,
                               .mappable = true,
                               .value = std::vector<std::byte>(kBits / 8)};
  auto added = object(kText, {std::move(text)});
  added.name = "Text";
  const auto next =
      std::ranges::upper_bound(device.objects, kText, {}, &od::ObjectDescription::index);
  device.objects.insert(next, std::move(added));
}

// RPDO 1 of a drive also carries 60FFh, which RPDO 2 carries.
constexpr std::pair<od::Address, std::uint64_t> kTwice[] = {{{0x1600, 0}, 3},
                                                            {{0x1600, 3}, 0x60FF'0020}};

void set_serial(od::DeviceDescription& device, std::uint32_t serial) {
  for (od::ObjectDescription& object : device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      if (object.index == 0x1018 && variable.sub == 4) {
        store_le(std::span(variable.value), std::uint64_t{serial});
      }
    }
  }
}

// The sub-index is added to the device file, not to the device: an RPDO does not use it.
void set_inhibit_time(od::DeviceDescription& device, std::uint16_t record, Duration time) {
  const auto it = std::ranges::find(device.objects, record, &od::ObjectDescription::index);
  if (it == device.objects.end()) {
    throw BadStatement("the device file has no such RPDO");
  }
  const auto units = static_cast<std::uint64_t>(time / std::chrono::microseconds(100));
  auto& variables = it->variables;
  const auto place = std::ranges::find_if(variables, [](const auto& v) { return v.sub > 3; });
  variables.insert(place, variable(3, od::DataType::unsigned16, units));
}

// Removes the default values of the COB-IDs of PDO 1 to 4 from the device file (CiA 301 7.5.2.35):
// an empty value for RPDOs, 0 for TPDOs, because both kinds of files exist.
void leave_cob_ids(od::DeviceDescription& device) {
  constexpr std::uint16_t kPredefined = 4;
  for (od::ObjectDescription& object : device.objects) {
    const bool rpdo = object.index >= 0x1400 && object.index < 0x1400 + kPredefined;
    const bool tpdo = object.index >= 0x1800 && object.index < 0x1800 + kPredefined;
    for (od::VariableDescription& variable : object.variables) {
      if ((rpdo || tpdo) && variable.sub == 1) {
        variable.value.assign(tpdo ? sizeof(std::uint32_t) : 0, std::byte{0});
      }
    }
  }
}

// Adds an RPDO or TPDO whose communication record has that index.
void add_mpdo(od::Dictionary& dictionary, std::uint16_t index, std::uint32_t cob_id,
              pdo::MpdoMode mode) {
  using enum od::DataType;
  (void)dictionary
      .add(object(index, {variable(0, unsigned8, 2), variable(1, unsigned32, cob_id),
                          variable(2, unsigned8, pdo::kEventProfile)}))
      .ok();
  (void)dictionary
      .add(object(static_cast<std::uint16_t>(index + 0x200),
                  {variable(0, unsigned8, mode == pdo::MpdoMode::source ? 254 : 255),
                   variable(1, unsigned32, 0)}))
      .ok();
}

// 2F01h is received by MPDO in destination address mode on kMpdoToAll, and sent in source address
// mode whenever its value changes; 2F02h receives 2F01h of node `from`.
void give_mpdos(sim::Device& device, std::uint8_t from) {
  using enum od::DataType;
  constexpr std::uint32_t kExtended = 0x2000'0000;  // in a COB-ID
  constexpr std::uint16_t kRpdo = 0x1407;
  constexpr std::uint16_t kTpdo = 0x1807;
  od::Dictionary& dictionary = device.dictionary();
  for (const std::uint16_t index : {std::uint16_t{0x2F01}, std::uint16_t{0x2F02}}) {
    (void)dictionary.add(object(index, {variable(0, unsigned32, 0)})).ok();
  }
  add_mpdo(dictionary, kRpdo, kMpdoToAll, pdo::MpdoMode::destination);
  add_mpdo(dictionary, kTpdo, kExtended | (kMpdoOfNode + device.options().node_id),
           pdo::MpdoMode::source);
  (void)dictionary
      .add(object(0x1FA0, {variable(0, unsigned8, 1), variable(1, unsigned32, 0x01'2F01'00)}))
      .ok();
  if (from != 0) {
    add_mpdo(dictionary, kRpdo + 1, kExtended | (kMpdoOfNode + from), pdo::MpdoMode::source);
    (void)dictionary
        .add(object(0x1FD0, {variable(0, unsigned8, 1),
                             variable(1, unsigned64, 0x01'2F02'00'2F01'00'00ULL | from)}))
        .ok();
  }
  device.node().pdos().set_auto_notify(kTpdo - 0x1800 + 1, true);
}

ForeignSdo::Blocks blocks_of(const std::string& word) {
  using enum ForeignSdo::Blocks;
  if (word != "blocks" && word != "no-blocks" && word != "silent-blocks") {
    throw BadStatement("foreign-sdo is blocks, no-blocks or silent-blocks");
  }
  return word == "blocks" ? served : word == "no-blocks" ? refused : ignored;
}

void set_lss_fault(const std::string& word, lss::SlaveFaults& faults) {
  bool* const fault = word == "answers-parked"     ? &faults.answers_in_configuration
                      : word == "boots-at-reset"   ? &faults.boots_at_reset
                      : word == "takes-no-node-id" ? &faults.takes_no_node_id
                                                   : nullptr;
  if (fault == nullptr) {
    throw BadStatement("lss-fault is answers-parked, boots-at-reset or takes-no-node-id");
  }
  *fault = true;
}

const od::DeviceDescription& configured_file(const line::LineConfig& config, std::uint8_t node) {
  return std::ranges::find(config.nodes, node, &line::NodeConfig::id)->device;
}

bool is_guarded(const line::LineConfig& config, std::uint8_t node) {
  return std::ranges::any_of(config.nodes, [node](const line::NodeConfig& each) {
    return each.id == node && each.guard_time != Duration::zero();
  });
}

}  // namespace

void Scenario::describe_line(Words& words) {
  NetworkPlan plan;
  plan.config.name = words.take();
  plan.config.heartbeat = std::chrono::milliseconds(500);
  while (!words.done()) {
    const std::string key = words.take();
    if (key == "bitrate") {
      plan.bus.bit_rate = static_cast<std::uint32_t>(words.number());
    } else if (key == "data-bitrate") {
      plan.bus.data_bit_rate = static_cast<std::uint32_t>(words.number());
    } else if (key == "sync") {
      plan.config.sync_period = words.duration();
    } else if (key == "buffers") {
      plan.bus.buffers = words.number();
    } else if (key == "network") {
      plan.config.network_id = static_cast<std::uint16_t>(words.number());
    } else if (key == "interface") {
      plan.config.routing.interface = static_cast<std::uint8_t>(words.number());
    } else if (key == "channels") {
      words.expect("per-node");
      plan.config.routing.channels = routing::ChannelRule::per_node;
    } else if (key == "lss") {
      plan.config.lss.assign = true;
    } else if (key == "lss-period") {
      plan.config.lss.period = words.duration();
    } else if (key == "lss-store") {
      plan.config.lss.store = true;
    } else if (key == "canopen-fd") {
      plan.config.canopen_fd = true;
    } else if (key == "emcy-fd") {
      plan.config.emcy_fd = true;
    } else if (key == "slave") {
      plan.config.role = line::Role::device;
      plan.config.own_start = false;
    } else if (key == "strict-ixxat") {
      plan.config.strict_ixxat = true;
    } else if (key == "started-by-application") {
      plan.config.start_nodes = false;
    } else if (key == "own") {
      plan.config.node_id = words.node();
    } else if (!startup_property(words, key, plan.config)) {
      throw BadStatement("unknown property of a line '" + key + "'");
    }
  }
  plan.config.bit_rate = plan.bus.bit_rate;
  plans_.push_back(std::move(plan));
}

// Properties of the device itself and of its configuration. Returns false for other keys.
bool Scenario::device_property(const std::string& key, Words& words, DeviceStatement& said) {
  sim::DeviceOptions& device = said.device;
  line::NodeConfig& node = said.node;
  if (key == "heartbeat") {
    node.heartbeat = words.duration();
    said.heartbeat = node.heartbeat;
  } else if (key == "consumer") {
    node.heartbeat_consumer = words.duration();
  } else if (key == "guarding") {
    node.heartbeat = Duration::zero();
    node.guard_time = words.duration();
    node.life_time_factor = static_cast<std::uint8_t>(words.number());
  } else if (key == "mandatory") {
    node.mandatory = true;
  } else if (key == "serial") {
    node.serial = static_cast<std::uint32_t>(words.number());
  } else if (key == "boot-timeout") {
    node.boot_timeout = words.duration();
  } else if (key == "deadline") {
    node.pdo_deadline = words.duration();
  } else if (key == "block") {
    words.expect("never");
    node.block_from = sdo::kNoBlocks;
  } else if (key == "unconfigured") {
    device.unconfigured = true;
  } else if (key == "has-node-id") {
    device.has_node_id = words.node();
  } else if (key == "lss-fault") {
    set_lss_fault(words.take(), device.lss_faults);
  } else if (key == "has-serial") {
    device.serial = static_cast<std::uint32_t>(words.number());
  } else if (key == "unlisted") {
    said.listed = false;
  } else if (key == "ours") {
    said.ours = true;
  } else if (key == "absent") {
    said.present = false;
  } else {
    return false;
  }
  return true;
}

// Additional functions of the device, and properties of its device file. Returns false for other
// keys.
bool Scenario::object_property(const std::string& key, Words& words, DeviceStatement& said) {
  NetworkPlan& plan = plans_.back();
  const std::uint8_t id = said.device.node_id;
  if (key == "foreign-sdo") {
    plan.foreign_sdos[id] = blocks_of(words.take());
  } else if (key == "domain") {
    plan.domains.insert(id);
  } else if (key == "mpdo") {
    plan.mpdos.try_emplace(id);
  } else if (key == "mpdo-of") {
    plan.mpdos[id] = words.node();
  } else if (key == "answers-after") {
    plan.answers_after[id] = words.duration();
  } else if (key == "on-request") {
    const std::uint64_t tpdo = words.number();
    said.on_request.emplace_back(static_cast<std::uint16_t>(tpdo), words.number());
    plan.on_request.insert(id);
  } else if (key == "swapped") {
    said.swapped.push_back(static_cast<std::uint16_t>(std::stoul(words.take(), nullptr, 16)));
  } else if (key == "text") {
    said.text = true;
  } else if (key == "twice") {
    said.twice = true;
  } else if (key == "no-cob-ids") {
    said.no_cob_ids = true;
  } else if (key == "reboots-on") {
    plan.reboots_on[id] = static_cast<std::uint16_t>(words.number());
  } else if (key == "inhibit") {
    const auto record = static_cast<std::uint16_t>(std::stoul(words.take(), nullptr, 16));
    said.inhibit_times.emplace_back(record, words.duration());
  } else if (key == "expected") {
    const od::Address address = words.address();
    said.expected.emplace_back(address, words.number());
  } else {
    return false;
  }
  return true;
}

void Scenario::list_device(DeviceStatement& said) {
  sim::DeviceOptions& device = said.device;
  line::NodeConfig& node = said.node;
  NetworkPlan& plan = plans_.back();
  const auto file =
      eds::load(sim::eds_text(device.profile), sim::eds_name(device.profile), node.id);
  if (!file.ok()) {
    throw BadStatement("no device profile '" + device.profile + "'");
  }
  node.device = *file.value;
  for (const auto& [address, value] : said.expected) {
    expect_value(node.device, address, value);
  }
  for (const auto& [record, time] : said.inhibit_times) {
    set_inhibit_time(node.device, record, time);
  }
  if (said.text) {
    map_text(node.device);
  }
  if (said.no_cob_ids) {
    leave_cob_ids(node.device);
  }
  for (const auto& [tpdo, type] : said.on_request) {
    const auto record = static_cast<std::uint16_t>(0x1800 + tpdo - 1);
    const std::pair<od::Address, std::uint64_t> values[] = {
        {{record, 1}, can::default_tpdo_id(tpdo, node.id)}, {{record, 2}, type}};
    for (const auto& [address, value] : values) {
      device.defaults.emplace_back(address, value);
      expect_value(node.device, address, value);
    }
  }
  if (said.twice) {
    for (const auto& [address, value] : kTwice) {
      device.defaults.emplace_back(address, value);
      expect_value(node.device, address, value);
    }
  }
  for (const std::uint16_t record : said.swapped) {
    for (const std::uint8_t sub : {std::uint8_t{1}, std::uint8_t{2}}) {
      const od::Address other{record, static_cast<std::uint8_t>(3 - sub)};
      const od::VariableDescription* const entry = node.device.find(other);
      if (entry == nullptr) {
        throw BadStatement("the record to be swapped has fewer than two entries");
      }
      device.defaults.push_back({{record, sub}, load_le(std::span(entry->value))});
    }
  }
  if (said.ours) {
    plan.ours.push_back(
        {.id = node.id, .name = node.name, .device = node.device, .lss = device.unconfigured});
    if (device.serial) {
      set_serial(plan.ours.back().device, *device.serial);
    }
  }
  plan.config.nodes.push_back(std::move(node));
  std::ranges::sort(plan.config.nodes, {}, &line::NodeConfig::id);
}

void Scenario::describe_device(Words& words) {
  if (plans_.empty() || built_) {
    throw BadStatement("a device comes after its line and before the first 'at'");
  }
  DeviceStatement said{.device = {.node_id = words.node()}, .node = {}};
  said.device.profile = words.take();
  said.device.seed = seed_ * 128 + said.device.node_id;
  said.device.fd = plans_.back().config.canopen_fd;
  said.device.emcy_fd = plans_.back().config.emcy_fd;
  said.node.id = said.device.node_id;
  said.node.name = said.device.profile + std::to_string(said.device.node_id);
  said.node.heartbeat = std::chrono::milliseconds(100);
  while (!words.done()) {
    const std::string key = words.take();
    if (!device_property(key, words, said) && !object_property(key, words, said) &&
        !boot_property(words, key, said.node)) {
      throw BadStatement("unknown property of a device '" + key + "'");
    }
  }
  if (said.listed) {
    list_device(said);
  } else if (said.heartbeat) {
    said.device.heartbeat = said.heartbeat;  // no manager sets it
  }
  if (said.present && !said.ours) {
    plans_.back().devices.push_back(std::move(said.device));
  }
}

// route FIRST LAST over INTERFACE [via NODE] [cost N]
void Scenario::describe_route(Words& words) {
  routing::Route route{.first = static_cast<std::uint16_t>(words.number()),
                       .last = static_cast<std::uint16_t>(words.number())};
  words.expect("over");
  route.interface = static_cast<std::uint8_t>(words.number());
  if (words.accept("via")) {
    route.gateway = words.node();
  }
  if (words.accept("cost")) {
    route.cost = static_cast<std::uint16_t>(words.number());
  }
  plans_.back().config.routing.routes.push_back(route);
}

// admit FIRST LAST read|write|all
void Scenario::describe_access(Words& words) {
  routing::AccessRule rule{.first = static_cast<std::uint16_t>(words.number()),
                           .last = static_cast<std::uint16_t>(words.number())};
  const std::string what = words.take();
  rule.sdo_read = what != "write";
  rule.sdo_write = what != "read";
  plans_.back().config.routing.access.push_back(rule);
}

void Scenario::seat_device(LineSeat& seat, const NetworkPlan& plan,
                           const sim::DeviceOptions& options) {
  auto device = sim::Device::make(options);
  if (!device.ok()) {
    throw BadStatement(to_string(device.diagnostics.front()));
  }
  if (plan.domains.contains(options.node_id)) {
    (void)(*device.value)->dictionary().add(domain_object()).ok();
  }
  DeviceSeat& added = world_.add_device(seat, *std::move(device.value));
  if (const auto on = plan.reboots_on.find(options.node_id); on != plan.reboots_on.end()) {
    added.reboots_on = on->second;
  }
  if (const auto after = plan.answers_after.find(options.node_id);
      after != plan.answers_after.end()) {
    added.answers_after = after->second;
  }
  const auto foreign = plan.foreign_sdos.find(options.node_id);
  if (foreign != plan.foreign_sdos.end()) {
    added.sdo.emplace(options.node_id, foreign->second);
  }
  if (plan.on_request.contains(options.node_id)) {
    added.requests.emplace(configured_file(seat.line->config(), options.node_id));
  }
  const auto mpdos = plan.mpdos.find(options.node_id);
  if (mpdos != plan.mpdos.end()) {
    give_mpdos(*added.device, mpdos->second);
    added.model.emplace(true, mpdos->second);
  } else if (is_guarded(seat.line->config(), options.node_id)) {
    added.model.emplace(false, std::uint8_t{0});
  }
}

void Scenario::build() {
  if (std::exchange(built_, true)) {
    return;
  }
  std::vector<routing::Interface> interfaces;
  for (const NetworkPlan& plan : plans_) {
    if (plan.config.routing.interface != 0) {
      interfaces.push_back(
          {plan.config.routing.interface, plan.config.network_id, plan.config.node_id});
    }
  }
  for (NetworkPlan& plan : plans_) {
    plan.config.routing.interfaces = interfaces;
  }
  plan_forwards();
  for (NetworkPlan& plan : plans_) {
    line::LineConfig below{.name = plan.config.name + "-ours", .role = line::Role::device};
    below.canopen_fd = plan.config.canopen_fd;
    below.emcy_fd = plan.config.emcy_fd;
    below.devices = std::move(plan.ours);
    auto made = line::Line::make(std::move(plan.config));
    if (!made.ok()) {
      throw BadStatement(to_string(made.diagnostics.front()));
    }
    LineSeat& seat = world_.add_line(*std::move(made.value), plan.bus);
    for (const sim::DeviceOptions& options : plan.devices) {
      seat_device(seat, plan, options);
    }
    if (!below.devices.empty()) {
      std::ranges::sort(below.devices, {}, &line::DeviceConfig::id);
      auto devices = line::Line::make(std::move(below));
      if (!devices.ok()) {
        throw BadStatement(to_string(devices.diagnostics.front()));
      }
      world_.add_ours(seat, *std::move(devices.value));
      for (const line::DeviceConfig& device : seat.ours->config().devices) {
        if (plan.on_request.contains(device.id)) {
          seat.requests_of_ours.try_emplace(device.id, device.device);
        }
      }
    }
    current_ = current_ == nullptr ? &seat : current_;
  }
  for (const auto& [ends, what] : followings_) {
    world_.join(*world_.find(ends.first), *world_.find(ends.second), what);
  }
  world_.start();
}

}  // namespace linegate::plant
