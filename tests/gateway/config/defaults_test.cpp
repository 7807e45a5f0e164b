// SPDX-License-Identifier: Apache-2.0
// The defaults in the descriptions of the JSON Schema (and of plant.yaml(5), which is made from
// them) are those of the loader.
#include <algorithm>
#include <concepts>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include "gateway/config/plant.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

const std::string kDriveFile = paths::in_repository("bridges/sim/eds/drive.eds");

std::string value_text(const std::string& value) {
  return value;
}
std::string value_text(Duration value) {
  return std::to_string(value.count()) + " ns";
}
template <class Value>
requires std::integral<Value> || std::is_enum_v<Value> std::string value_text(Value value) {
  return std::to_string(static_cast<std::int64_t>(value));
}
template <class Value>
std::string value_text(const std::vector<Value>& values) {
  std::string out;
  for (const Value& value : values)
    out += value_text(value) + ' ';
  return out;
}

// A key whose default is a value. The text of a plant has `@` in place of the key.
struct DefaultCase {
  std::string plant;
  std::string other;  // a value that is not the default; empty: there is none
  std::function<std::string(const Plant&)> value;  // that the loader set
};

// get: of the plant, the line, its first node or its first device.
template <class Get>
DefaultCase default_of(const std::string& plant, const std::string& other, Get get) {
  return {plant, other, [get](const Plant& loaded) {
            if constexpr (std::is_invocable_v<Get, const Plant&>) {
              return value_text(get(loaded));
            } else if constexpr (std::is_invocable_v<Get, const LinePlan&>) {
              return value_text(get(loaded.lines.at(0)));
            } else if constexpr (std::is_invocable_v<Get, const line::LineConfig&>) {
              return value_text(get(loaded.lines.at(0).config));
            } else {
              return value_text(get(loaded.lines.at(0).config.nodes.at(0)));
            }
          }};
}

using DefaultCases = std::map<std::string, DefaultCase>;

std::string with_line(const std::string& keys, const std::string& top = "") {
  return "schema: 1\n" + top + "lines: [{name: a, interface: 'simulated:', " + keys + "}]\n";
}

void add_gateway(DefaultCases& to) {
  const auto top = [](const std::string& keys) { return with_line("", keys + "\n"); };
  to["gateway/name"] =
      default_of(top("gateway: {@}"), "hall", [](const Plant& p) { return p.gateway; });
  to["gateway/log"] =
      default_of(top("gateway: {@}"), "error", [](const Plant& p) { return p.log; });
  to["dds/domain"] = default_of(top("dds: {@}"), "3", [](const Plant& p) { return p.dds_domain; });
  to["dds/partitions"] =
      default_of(top("dds: {@}"), "true", [](const Plant& p) { return p.dds_partitions; });
  to["dds/fan_out"] =
      default_of(top("dds: {@}"), "multicast", [](const Plant& p) { return p.dds_multicast; });
  to["dds/guard"] = default_of(top("dds: {@}"), "off", [](const Plant& p) { return p.dds_guard; });
  to["dds/process"] =
      default_of(top("dds: {@}"), "same", [](const Plant& p) { return p.dds_own_process; });
  to["dds/memory"] =
      default_of(top("dds: {@}"), "600MB", [](const Plant& p) { return p.dds_memory; });
  to["journal/max_size"] = default_of(top("journal: {file: j.db, @}"), "100MB",
                                      [](const Plant& p) { return p.journal->max_size; });
  to["journal/values_size"] = default_of(top("journal: {file: j.db, @}"), "60MB",
                                         [](const Plant& p) { return p.journal->values_size; });
  const std::string executor = with_line("executor: x", "executors: [{name: x, @}]\n");
  to["executor/priority"] =
      default_of(executor, "5", [](const Plant& p) { return p.executors.at(0).priority; });
  to["executor/lock_memory"] =
      default_of(executor, "true", [](const Plant& p) { return p.executors.at(0).lock_memory; });
}

void add_line(DefaultCases& to) {
  using Line = line::LineConfig;
  const auto add = [&](const std::string& key, const std::string& other, auto get) {
    to["line/" + key] = default_of(with_line("@"), other, get);
  };
  add("node_id", "5", [](const Line& l) { return l.node_id; });
  add("heartbeat", "1s", [](const Line& l) { return l.heartbeat; });
  add("sync", "100ms", [](const Line& l) { return l.sync_period; });
  add("time", "1s", [](const Line& l) { return l.time_period; });
  add("sdo_timeout", "1s", [](const Line& l) { return l.sdo_timeout; });
  add("pdo_update_time", "100ms", [](const Line& l) { return l.pdo_update_time; });
  add("request_share", "40%", [](const Line& l) { return l.request_share; });
  add("client_share", "20%", [](const Line& l) { return l.client_share; });
  add("save_timeout", "20s", [](const Line& l) { return l.save_timeout; });
  add("load_timeout", "20s", [](const Line& l) { return l.load_timeout; });
  add("strict_ixxat", "true", [](const Line& l) { return l.strict_ixxat; });
  add("keep_operational", "true", [](const Line& l) { return l.keep_operational; });
  add("canopenia_base", "0x5F60", [](const Line& l) { return l.canopen_ia_base; });
  add("emcy_bytes", "temporary_and_sticky", [](const Line& l) { return l.error_scheme; });
  add("canopen_fd", "true", [](const Line& l) { return l.canopen_fd; });
  to["line/usdo_abort"] = default_of(with_line("canopen_fd: true, @"), "four-bytes",
                                     [](const Line& l) { return l.usdo_abort; });
  to["line/emcy_fd"] =
      default_of(with_line("canopen_fd: true, @"), "true", [](const Line& l) { return l.emcy_fd; });
  add("reset_nodes", "false", [](const Line& l) { return l.reset_nodes; });
  add("start_nodes", "false", [](const Line& l) { return l.start_nodes; });
  add("access", "all",
      [](const LinePlan& l) { return value_text(l.commands) + value_text(l.outputs); });
  add("publish", "on_sync", [](const LinePlan& l) { return l.publish.rule; });
  to["line/publish"].plant = with_line("sync: 100ms, @");
}

void add_parts_of_a_line(DefaultCases& to) {
  using Line = line::LineConfig;
  const auto add = [&](const std::string& section, const std::string& key, const std::string& other,
                       auto get) {
    to["line/" + section + "/" + key] = default_of(with_line(section + ": {@}"), other, get);
  };
  add("lss", "assign", "true", [](const Line& l) { return l.lss.assign; });
  add("lss", "timeout", "200ms", [](const Line& l) { return l.lss.timeout; });
  add("lss", "period", "6s", [](const Line& l) { return l.lss.period; });
  add("lss", "store", "true", [](const Line& l) { return l.lss.store; });
  const auto flies = [&](const std::string& key, const std::string& other, auto member) {
    add("flying_master", key, other, [member](const Line& l) {
      return l.flying_master.value_or(line::FlyingMasterConfig{}).*member;
    });
  };
  flies("priority", "1", &line::FlyingMasterConfig::priority);
  flies("master_timeout", "200ms", &line::FlyingMasterConfig::master_timeout);
  flies("negotiation_delay", "200ms", &line::FlyingMasterConfig::negotiation_delay);
  flies("priority_slot", "2s", &line::FlyingMasterConfig::priority_slot);
  flies("device_slot", "5ms", &line::FlyingMasterConfig::device_slot);
  flies("detection", "force", &line::FlyingMasterConfig::forces_each_cycle);
  const auto add_sleep = [&](const std::string& key, const std::string& other, auto get) {
    to["line/sleep/" + key] =
        default_of(with_line("sleep: {request: 0x690, objection: 0x691, @}"), other, get);
  };
  add_sleep("check_byte", "9", [](const Line& l) { return l.sleep.check_byte; });
  add_sleep("prepare_byte", "9", [](const Line& l) { return l.sleep.prepare_byte; });
  add_sleep("wake_byte", "9", [](const Line& l) { return l.sleep.wake_byte; });
  add_sleep("objection_byte", "9", [](const Line& l) { return l.sleep.objection_byte; });
  add_sleep("check_time", "2s", [](const Line& l) { return l.sleep.check_time; });
  add_sleep("prepare_time", "2s", [](const Line& l) { return l.sleep.prepare_time; });
  add_sleep("silent_time", "2s", [](const Line& l) { return l.sleep.silent_time; });
  add("startup", "start_all", "true", [](const Line& l) { return l.start_all; });
  add("startup", "own_start", "false", [](const Line& l) { return l.own_start; });
  add("startup", "on_error", "stop_all", [](const Line& l) { return l.on_error; });
  add("startup", "nmt_inhibit", "1ms", [](const Line& l) { return l.nmt_inhibit; });
  add("pdo_update", "min_period", "200ms", [](const LinePlan& l) { return l.pdo_min_period; });
  add("pdo_update", "every", "true", [](const Line& l) { return l.pdo_queue != 0; });
  add("pdo_update", "queue", "32", [](const Line& l) { return l.pdo_queue; });
  to["line/pdo_update/queue"].plant = with_line("pdo_update: {every: true, @}");
  add("auto", "at_start", "false", [](const LinePlan& l) { return l.auto_scan->at_start; });
  add("auto", "set_up", "true", [](const LinePlan& l) { return l.auto_scan->set_up; });
  add("auto", "heartbeat", "1s", [](const Line& l) { return l.found_heartbeat; });
  add("record", "max_size", "1MB", [](const LinePlan& l) { return l.record->max_size; });
  add("record", "files", "3", [](const LinePlan& l) { return l.record->files; });
  for (const char* key : {"max_size", "files"})
    to[std::string("line/record/") + key].plant = with_line("record: {file: a.log, @}");
  to["line/publish/on_change/min_separation"] =
      default_of(with_line("publish: {on_change: {@}}"), "20ms",
                 [](const LinePlan& l) { return l.publish.time; });
  to["line/named/min_separation"] = default_of(
      with_line("named: {@}"), "20ms", [](const LinePlan& l) { return l.named.min_separation; });
  to["line/named/type_information"] = default_of(
      with_line("named: {@}"), "true", [](const LinePlan& l) { return l.named.type_information; });
  to["line/named/ros2"] =
      default_of(with_line("named: {@}"), "true", [](const LinePlan& l) { return l.named.ros2; });
  to["line/simulate/unconfigured"] =
      default_of(with_line("simulate: [{node: 5, profile: drive, @}]"), "true",
                 [](const LinePlan& l) { return l.simulated.at(0).unconfigured; });
  to["line/node_list/network"] =
      default_of(with_line("node_list: {file: plant.cpj, @}"), "2",
                 [](const Line& l) { return value_text(l.nodes.at(0).id); });
}

void add_own_objects(DefaultCases& to) {
  using Line = line::LineConfig;
  const std::string objects =
      "own_objects: {'2100:1': {type: u16, map: true}, '2100:2': "
      "{type: u16, map: true}, '2100:3': {type: u16, @}}";
  const auto object = [&](const std::string& key, const std::string& other, auto get) {
    to["own_object/" + key] =
        default_of(with_line("storage: var, " + objects), other, [get](const Line& l) {
          return value_text(get(*std::ranges::find(
              l.own_objects, 3, [](const auto& one) { return one.variable.sub; })));
        });
  };
  object("access", "ro", [](const line::OwnObject& o) { return o.variable.access; });
  object("default", "7", [](const line::OwnObject& o) {
    const auto is_set = [](std::byte byte) { return byte != std::byte{0}; };
    return std::ranges::any_of(o.variable.value, is_set);  // no bytes: 0
  });
  object("map", "true", [](const line::OwnObject& o) { return o.variable.mappable; });
  object("store", "true", [](const line::OwnObject& o) { return o.variable.store; });
  object("image", "true", [](const line::OwnObject& o) { return o.in_image; });
  std::string plain = objects;
  plain.replace(plain.find("@"), 1, "access: rw");
  const auto pdo = [&](const std::string& key, const std::string& other, auto get) {
    to["own_pdo/" + key] =
        default_of(with_line(plain + ", own_pdos: {rpdo100: {cob_id: 0x1F0, map: ['2100:1'], @}}"),
                   other, [get](const Line& l) { return get(l.forwarding.rpdos.at(0)); });
  };
  pdo("rtr", "true", [](const pdo::Parameters& p) { return p.cob_id.raw; });
  pdo("enabled", "false", [](const pdo::Parameters& p) { return p.cob_id.raw; });
  pdo("type", "sync", [](const pdo::Parameters& p) { return p.type; });
  const std::string mpdo = plain +
                           ", own_pdos: {tpdo101: {cob_id: 0x1F1, mpdo: source}, rpdo100: "
                           "{cob_id: 0x1F2, mpdo: source}}, ";
  to["line/mpdo_scanner/count"] =
      default_of(with_line(mpdo + "mpdo_scanner: [{object: '2100:1', @}]"), "2",
                 [](const Line& l) { return l.mpdo_scanner; });
  to["line/mpdo_dispatcher/count"] = default_of(
      with_line(mpdo + "mpdo_dispatcher: [{node: 5, object: '6000:1', own: '2100:1', @}]"), "2",
      [](const Line& l) { return l.mpdo_dispatcher; });
  to["line/feeds_every_tpdo"] =
      default_of(with_line(plain + ", own_pdos: {rpdo100: {cob_id: 0x1F0, map: ['2100:1']}}, @"),
                 "true", [](const Line& l) { return l.forwarding.feeds_every_tpdo; });
}

void add_nodes(DefaultCases& to) {
  using Node = line::NodeConfig;
  const std::string eds = "eds: '" + kDriveFile + "', ";
  const auto nodes = [&](const std::string& keys, const std::string& others = "",
                         const std::string& top = "") {
    return with_line(others + "nodes: [{id: 5, name: n, " + eds + keys + "}]", top);
  };
  const auto add = [&](const std::string& key, const std::string& other, auto get) {
    to["node/" + key] = default_of(nodes("@"), other, get);
  };
  add("mandatory", "true", [](const Node& n) { return n.mandatory; });
  add("check_identity", "false", [](const Node& n) { return n.check.vendor; });
  add("boot_timeout", "20s", [](const Node& n) { return n.boot_timeout; });
  add("boot", "false", [](const Node& n) { return n.boot; });
  add("keep_alive", "true", [](const Node& n) { return n.keep_alive; });
  add("reset_time", "2s", [](const Node& n) { return n.reset_time; });
  to["node/sdo/block"] =
      default_of(nodes("sdo: {@}"), "64", [](const Node& n) { return n.block_from; });
  to["node/program/update"] = default_of(nodes("program: {identification: 1, file: x.bin, @}"),
                                         "true", [](const Node& n) { return n.update_software; });
  to["pdo/queue"] = default_of(nodes("pdos: {tpdo1: {every: true, @}}"), "32",
                               [](const Node& n) { return n.tpdo_queue.at(1); });
  to["pdo/enabled"] = default_of(nodes("pdos: {tpdo1: {@}}"), "false", [](const Node& n) {
    std::string out;
    for (const auto& object : n.objects)
      out += std::to_string(object.address.index) + ' ';
    for (const auto& variable : n.device.find(0x1800)->variables)
      for (const std::byte byte : variable.value)
        out += value_text(byte);
    return out;
  });
  to["line/history/min_interval"] =
      default_of(nodes("", "history: {entries: ['n.*'], @}, ", "journal: {file: j.db}\n"), "2s",
                 [](const LinePlan& l) { return l.history.min_interval; });
  to["group/send"] =
      default_of(nodes("", "outputs: {groups: [{name: g, entries: [n.Controlword], @}]}, "),
                 "always", [](const line::LineConfig& l) { return l.groups.at(0).send_always; });
  to["group/written_by"] =
      default_of(nodes("", "outputs: {groups: [{name: g, entries: [n.Controlword], @}]}, "),
                 "named", [](const LinePlan& l) { return l.named.has_group(1); });
}

void add_devices(DefaultCases& to) {
  const auto device = [&](const std::string& key, const std::string& other, auto get) {
    to["device/" + key] =
        default_of(with_line("role: device, devices: [{id: 5, profile: 401, @}]"), other,
                   [get](const line::LineConfig& l) { return get(l.devices.at(0)); });
  };
  device("lss", "true", [](const line::DeviceConfig& d) { return d.lss; });
  auto& of_lss = to["device/lss"].plant;
  of_lss.replace(of_lss.find("@"), 1, "digital_inputs: 8, @");
  for (const char* key :
       {"digital_inputs", "digital_outputs", "analogue_inputs", "analogue_outputs"}) {
    device(key, "8", [](const line::DeviceConfig& d) { return d.device.objects.size(); });
  }
  for (const char* key : {"digital_inputs", "analogue_inputs"}) {
    auto& with_outputs = to[std::string("device/") + key].plant;
    with_outputs.replace(with_outputs.find("@"), 1, "digital_outputs: 8, @");
  }
  for (const char* key : {"digital_outputs", "analogue_outputs"}) {
    auto& with_inputs = to[std::string("device/") + key].plant;
    with_inputs.replace(with_inputs.find("@"), 1, "digital_inputs: 8, @");
  }
}

void add_joins(DefaultCases& to) {
  const std::string two =
      "schema: 1\n%lines: [{name: a, interface: 'virtual:a', nodes: [{id: 5, "
      "name: n, eds: '" +
      kDriveFile + "'}]}, {name: b, interface: 'virtual:b'";
  const std::string node = ", nodes: [{id: 5, name: n, eds: '" + kDriveFile + "'}]";
  const auto plant = [&](const std::string& top, const std::string& keys) {
    std::string out = two + keys + "}]\n";
    return out.replace(out.find('%'), 1, top);
  };
  const auto of_first = [](const Plant& p) { return p.bindings.at(0).when_lost; };
  to["forwarding/when_lost"] =
      default_of(plant("forward: [{from: a.n.6064, to: b.n.607A, @}]\n", node), "stop", of_first);
  to["forwarding/timeout"] =
      default_of(plant("forward: [{from: h/p.n.6064, to: b.n.607A, @}]\n", node), "10s",
                 [](const Plant& p) { return p.lines.at(1).remote_inputs.at(0).timeout; });
  to["binding/when_lost"] =
      default_of(plant("", ", role: device, devices: [{id: 6, name: d, eds: '" + kDriveFile +
                               "', bind: {'6041:0': {entry: a/n.Statusword, @}}}]"),
                 "zero", of_first);
  const auto of_b = [](auto get) {
    return [get](const Plant& p) { return get(p.lines.at(1).config.routing); };
  };
  to["route/cost"] =
      default_of(plant("routes: [{to: 9, via: 'b:5', @}]\n", node), "5",
                 of_b([](const routing::Config& r) { return r.routes.back().cost; }));
  to["route/timeout"] =
      default_of(plant("routes: [{to: 9, via: x/y, @}]\n", node), "5s",
                 of_b([](const routing::Config& r) { return r.interfaces.back().way->timeout; }));
  to["route/emcy"] = default_of(
      plant("routes: [{to: 9, via: x/y, @}]\n", node + ", enter: [{from: 9, services: [emcy]}]"),
      "true", [](const Plant& p) { return p.lines.at(1).remote_emcys.size(); });
  const auto rule = [](const routing::Config& r) {
    const routing::AccessRule& only = r.access.at(0);
    return value_text(only.sdo_read) + value_text(only.sdo_write) + value_text(only.emcy) +
           value_text(only.pdo);
  };
  to["enter/services"] =
      default_of(plant("", node + ", enter: [{from: a, @}]"), "emcy", of_b(rule));
  to["enter/access"] = default_of(plant("", node + ", enter: [{from: a, @}]"), "all", of_b(rule));
  const auto add = [&](const std::string& key, const std::string& other, auto get) {
    to["routing/" + key] =
        default_of(plant("routing: {@}\n", ", enter: [{from: a}]"), other, of_b(get));
  };
  add("network_indication", "", [](const routing::Config& r) { return r.network_indication; });
  add("routing_table", "", [](const routing::Config& r) { return r.routing_table; });
  add("forwarded_emcy", "", [](const routing::Config& r) { return r.forwarded_emcy; });
  add("channels", "per_node", [](const routing::Config& r) { return r.channels; });
  add("hop_limit", "3", [](const routing::Config& r) { return r.hop_limit; });
  add("arm_timeout", "6s", [](const routing::Config& r) { return r.arm_timeout; });
  add("additional_servers", "2", [](const routing::Config& r) { return r.additional_servers; });
}

// The keys whose default is no value: that of another key or file, or the absence of something.
const std::set<std::string> kDefaultsInWords{"dds/participants",
                                             "dds/interfaces",
                                             "dds/peers",
                                             "dds/discovery_servers",
                                             "dds/profile",
                                             "dds/security",
                                             "dds/routes_security",
                                             "journal",
                                             "journal/max_age",
                                             "executor/processor",
                                             "line/network_id",
                                             "line/lss/bit_rate",
                                             "line/sdo_connections",
                                             "line/flying_master/detect_cycle",
                                             "line/flying_master/master_heartbeat",
                                             "line/startup/boot_time",
                                             "line/access/clients",
                                             "line/emcy_to",
                                             "line/enter",
                                             "line/history",
                                             "line/named",
                                             "line/executor",
                                             "line/record",
                                             "line/storage",
                                             "line/auto/eds",
                                             "line/simulate/serial",
                                             "line/outputs/groups",
                                             "group/number",
                                             "node/name",
                                             "node/heartbeat",
                                             "node/heartbeat/consumer",
                                             "node/pdo_deadline",
                                             "node/sdo_timeout",
                                             "device/name",
                                             "device/serial",
                                             "device/heartbeat",
                                             "own_object/name",
                                             "pdo/every",
                                             "pdo/rtr",
                                             "pdo/cob_id",
                                             "srdo/direction",
                                             "srdo/refresh",
                                             "srdo/sct",
                                             "srdo/srvt",
                                             "srdo/cob_id",
                                             "srdo/map",
                                             "route/enter",
                                             "routing/frame_timeout",
                                             "routing/channel_wait",
                                             "routing/gateway_timeout",
                                             "value_meaning/alias",
                                             "value_meaning/low"};

class Defaults : public testing::Test {
 protected:
  Defaults() {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "x.bin") << "four";
    std::ofstream(folder_ / "plant.cpj")
        << "[Topology]\nNodes=1\nNode5Present=1\nNode5Name=n\nNode5DCFName=x.dcf\n"
           "[Topology2]\nNodes=1\nNode6Present=1\nNode6Name=n\nNode6DCFName=x.dcf\n";
    std::filesystem::copy_file(kDriveFile, folder_ / "x.dcf",
                               std::filesystem::copy_options::overwrite_existing);
  }
  ~Defaults() override { std::filesystem::remove_all(folder_); }

  // The value that the loader sets for this text in place of the key.
  std::string loaded(const DefaultCase& of, const std::string& key_and_value) const {
    std::string text = of.plant;
    text.replace(text.find('@'), 1, key_and_value);
    const auto plant = read(text, (folder_ / "plant.yaml").string());
    if (!plant.ok() || !plant.value) {
      ADD_FAILURE() << text << to_string(plant.diagnostics.at(0));
      return {};
    }
    return of.value(*plant.value);
  }

  // Collects the keys with a default in their description, and this default.
  void collect(const YAML::Node& definition, const std::string& path) {
    if (!definition.IsMap())
      return;
    for (const auto& pair : definition) {
      const std::string name = pair.first.Scalar();
      if (name == "properties") {
        for (const auto& key : pair.second)
          note(key.second, path.empty() ? key.first.Scalar() : path + "/" + key.first.Scalar());
      } else if (name == "anyOf" || name == "oneOf") {
        for (const auto& form : pair.second)
          collect(form, path);
      } else if (name == "items" || name == "additionalProperties") {
        collect(pair.second, path);
      }
    }
  }

  std::map<std::string, std::string> described_;

 private:
  void note(const YAML::Node& key, const std::string& path) {
    const auto description = key["description"];
    const std::string text = description.IsDefined() ? description.Scalar() : std::string();
    const std::string mark = "Default: ";
    if (const std::size_t at = text.find(mark); at != std::string::npos) {
      const std::string rest = text.substr(at + mark.size());
      std::size_t end = 0;  // a point within a number is none of a sentence
      while (end < rest.size() && rest[end] != ',' && rest[end] != ';' &&
             rest.compare(end, 2, ". ") != 0)
        ++end;
      described_[path] = rest.substr(0, end);
    }
    collect(key, path);
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("plant-defaults-" + std::to_string(::getpid()));
};

// "5F40h", as CiA writes it, for plant.yaml.
std::string as_written(const std::string& value) {
  const bool is_hex = value.size() > 1 && value.back() == 'h' &&
                      value.find_first_not_of("0123456789ABCDEF") == value.size() - 1;
  return is_hex ? "0x" + value.substr(0, value.size() - 1) : value;
}

// For each key: its absence and its default have the same effect, and another value has another
// one, so that the comparison is of the key.
TEST_F(Defaults, OfTheSchemaAreThoseOfTheLoader) {
  const YAML::Node schema = YAML::LoadFile(paths::in_repository("deploy/plant.schema.json"));
  collect(schema, "");
  for (const auto& definition : schema["$defs"])
    collect(definition.second, definition.first.Scalar());
  DefaultCases cases;
  add_gateway(cases);
  add_line(cases);
  add_parts_of_a_line(cases);
  add_own_objects(cases);
  add_nodes(cases);
  add_devices(cases);
  add_joins(cases);
  for (const auto& [path, value] : described_) {
    EXPECT_NE(cases.contains(path), kDefaultsInWords.contains(path))
        << path << ", default " << value << ": needs a case, or is in words";
  }
  for (const auto& [path, of] : cases) {
    SCOPED_TRACE(path);
    const auto found = described_.find(path);
    if (found == described_.end()) {
      ADD_FAILURE() << "has no default in the schema";
      continue;
    }
    const std::string key = path.substr(path.rfind('/') + 1) + ": ";
    const std::string omitted = loaded(of, "");
    EXPECT_EQ(loaded(of, key + as_written(found->second)), omitted)
        << "the schema says " << found->second;
    if (!of.other.empty()) {
      EXPECT_NE(loaded(of, key + of.other), omitted) << "another value has no effect";
    }
  }
  for (const std::string& path : kDefaultsInWords)
    EXPECT_TRUE(described_.contains(path)) << path << " has no default in the schema";
}

}  // namespace
}  // namespace linegate::config
