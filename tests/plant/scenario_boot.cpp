// SPDX-License-Identifier: Apache-2.0
// Statements about the start-up of the network and about boot processes.
#include <algorithm>

#include "stack/base/byte_order.h"

#include "tests/plant/scenario_run.h"

namespace linegate::plant {

namespace {

// 2100h:1 is sent by MPDO in destination address mode, on the COB-ID on which devices receive
// MPDOs.
void give_own_mpdo(line::LineConfig& config) {
  constexpr std::uint16_t kObject = 0x2100;
  constexpr std::uint16_t kTpdo = 100;
  line::OwnObject object{.index = kObject, .variable = {}};
  object.variable.sub = 1;
  object.variable.type = od::DataType::unsigned32;
  object.variable.access = od::Access::rw;
  object.variable.mappable = true;
  object.variable.value.resize(sizeof(std::uint32_t));
  config.own_objects.push_back(std::move(object));
  pdo::Parameters mpdo;
  mpdo.number = kTpdo;
  mpdo.cob_id = {kMpdoToAll | can::CobId::kNoRtrBit};
  mpdo.mpdo = pdo::MpdoMode::destination;
  mpdo.mapping = {{{kObject, 1}, 32}};
  config.forwarding.tpdos.push_back(std::move(mpdo));
}

// 2101h: outputs. TPDO 101 maps :1 and :2, TPDO 102 sends :3 by MPDO in source address mode, TPDO
// 103 maps :2 and is sent with SYNC, no PDO carries :4.
void give_own_outputs(line::LineConfig& config) {
  constexpr std::uint16_t kIndex = 0x2101;
  constexpr std::uint16_t kTpdo = 101;
  constexpr std::uint32_t kTpdoId = 0x180;  // + node-ID, of the pre-defined connection set
  constexpr std::uint32_t kMpdoId = 0x280;
  constexpr std::uint32_t kSyncId = 0x380;
  for (std::uint8_t sub = 1; sub <= 4; ++sub) {
    line::OwnObject object{.index = kIndex, .variable = {}, .in_image = true};
    object.variable.sub = sub;
    object.variable.name = "Output";
    object.variable.type = od::DataType::unsigned16;
    object.variable.access = od::Access::ro;
    object.variable.mappable = true;
    config.own_objects.push_back(std::move(object));
  }
  pdo::Parameters tpdo;
  tpdo.number = kTpdo;
  tpdo.cob_id = {(kTpdoId + config.node_id) | can::CobId::kNoRtrBit};
  tpdo.mapping = {{{kIndex, 1}, 16}, {{kIndex, 2}, 16}};
  pdo::Parameters mpdo;
  mpdo.number = kTpdo + 1;
  mpdo.cob_id = {(kMpdoId + config.node_id) | can::CobId::kNoRtrBit};
  mpdo.mpdo = pdo::MpdoMode::source;
  pdo::Parameters with_sync;
  with_sync.number = kTpdo + 2;
  with_sync.cob_id = {(kSyncId + config.node_id) | can::CobId::kNoRtrBit};
  with_sync.type = 0;
  with_sync.mapping = {{{kIndex, 2}, 16}};
  config.forwarding.tpdos.push_back(std::move(tpdo));
  config.forwarding.tpdos.push_back(std::move(mpdo));
  config.forwarding.tpdos.push_back(std::move(with_sync));
  config.mpdo_scanner.push_back(0x01'0000'03U | std::uint32_t{kIndex} << 8U);
}

}  // namespace

// Properties of a line.
bool Scenario::startup_property(Words& words, const std::string& key, line::LineConfig& config) {
  if (key == "start-all") {
    config.start_all = true;
  } else if (key == "no-own-start") {
    config.own_start = false;
  } else if (key == "no-start") {
    config.start_nodes = false;
  } else if (key == "no-reset") {
    config.reset_nodes = false;
  } else if (key == "on-error") {
    const std::string what = words.take();
    if (what != "reset-all" && what != "stop-all") {
      throw BadStatement("on-error is reset-all or stop-all");
    }
    config.on_error =
        what == "reset-all" ? manager::ErrorReaction::reset_all : manager::ErrorReaction::stop_all;
  } else if (key == "boot-time") {
    config.boot_time = words.duration();
  } else if (key == "nmt-inhibit") {
    config.nmt_inhibit = words.duration();
  } else if (key == "mpdo") {
    give_own_mpdo(config);
  } else if (key == "own-outputs") {
    give_own_outputs(config);
  } else if (key == "own-value") {
    const od::Address address = words.address();
    config.own_values.push_back({address, words.hex()});
  } else {
    return false;
  }
  return true;
}

// Properties of a device.
bool Scenario::boot_property(Words& words, const std::string& key, line::NodeConfig& node) {
  if (key == "keep-alive") {
    node.keep_alive = true;
  } else if (key == "no-boot") {
    node.boot = false;
  } else if (key == "reset-time") {
    node.reset_time = words.duration();
  } else if (key == "sdo-timeout") {
    node.sdo_timeout = words.duration();
  } else if (key == "write") {
    const od::Address address = words.address();
    node.objects.push_back({address, words.hex()});
  } else {
    return false;
  }
  return true;
}

// Changes the value in the device file only, not in the device.
void Scenario::expect_value(od::DeviceDescription& device, od::Address address,
                            std::uint64_t value) {
  for (od::ObjectDescription& object : device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      if (od::Address{object.index, variable.sub} == address) {
        store_le(std::span(variable.value), value);
        return;
      }
    }
  }
  throw BadStatement("the device file has no such object");
}

// at TIME boot NAME NODE|all
void Scenario::boot_action(Words& words) {
  const std::string name = words.take();
  line::Command request{.request = line::Boot{.node = words.node()}};
  if (words.accept("timeout")) {
    request.timeout = words.duration();
  }
  command(std::move(request), name);
}

// expect boot NODE LETTER|booted|unfinished [object INDEX:SUB] [abort CODE] [expected N] [found N]
std::function<bool()> Scenario::boot_condition(Words& words) {
  const std::uint8_t id = words.node();
  const std::string how = words.take();
  const char letter = how == "booted"       ? manager::kBooted
                      : how == "unfinished" ? manager::kBootUnfinished
                                            : how.front();
  if (how.size() != 1 && manager::describe_boot(letter) == "unknown boot status") {
    throw BadStatement("a boot process ends with a letter, booted or unfinished");
  }
  manager::BootFinding wanted;
  if (words.accept("object")) {
    wanted.object = words.address();
  }
  if (words.accept("last")) {
    wanted.object = words.address();
    wanted.kind = manager::BootFinding::Kind::last;
  }
  if (words.accept("abort")) {
    wanted.kind = manager::BootFinding::Kind::abort;
    wanted.abort = static_cast<AbortCode>(words.number());
  }
  if (words.accept("expected")) {
    wanted.kind = manager::BootFinding::Kind::value;
    wanted.expected = static_cast<std::uint32_t>(words.number());
    words.expect("found");
    wanted.found = static_cast<std::uint32_t>(words.number());
  }
  return [this, id, letter, wanted] {
    const line::NodeState node = seat().line->node_state(id);
    return node.boot == letter && node.finding == wanted;
  };
}

}  // namespace linegate::plant
