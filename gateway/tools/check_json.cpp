// SPDX-License-Identifier: Apache-2.0
// to_json(): what would be run, for programs.
#include <algorithm>
#include <array>
#include <string>

#include "gateway/config/value.h"
#include "gateway/publish/routing_text.h"
#include "gateway/tools/check.h"
#include "gateway/tools/check_parts.h"
#include "gateway/tools/json_writer.h"
#include "stack/line/line.h"
#include "stack/pdo/parameters.h"

namespace linegate::gateway {
namespace {

class Json {
 public:
  std::string take() { return out_.text(); }

  void document(const Loaded<config::Plant>& loaded) {
    out_.begin_object().member("ok", loaded.ok());
    out_.key("diagnostics").begin_array();
    for (const auto& d : loaded.diagnostics) {
      constexpr std::array<const char*, 3> kSeverities{"note", "warning", "error"};
      out_.begin_object()
          .member("severity", std::string(kSeverities[static_cast<std::size_t>(d.severity)]))
          .member("file", d.file)
          .member("line", d.line)
          .member("column", d.column)
          .member("text", d.text)
          .end_object();
    }
    out_.end_array();
    if (loaded.value)
      plant(*loaded.value);
    out_.end_object();
  }

 private:
  void plant(const config::Plant& plant) {
    out_.member("gateway", plant.gateway)
        .member("dds_domain", plant.dds_domain)
        .member("dds_profile", plant.dds_profile)
        .member("dds_guard", plant.dds_guard)
        .member("log", config::name(plant.log));
    const InterfaceNames names = interface_names(plant);
    out_.key("routes").begin_array();
    for (const auto& route : routes_of(plant)) {
      const auto line = std::find_if(names.begin(), names.end(), [&](const auto& name) {
        return name.first == route.interface;
      });
      out_.begin_object()
          .member("first", route.first)
          .member("last", route.last)
          .member("line", line == names.end() ? std::string() : line->second)
          .member("node", route.gateway)
          .member("cost", route.cost)
          .end_object();
    }
    out_.end_array();
    out_.key("lines").begin_array();
    for (const auto& line : plant.lines) {
      this->line(line);
    }
    out_.end_array().key("bindings").begin_array();
    for (const auto& b : plant.bindings) {
      out_.begin_object()
          .member("from", b.from)
          .member("input", b.input_name)
          .member("to", b.to)
          .member("output", b.output_name)
          .member("when_lost", line::name(b.when_lost))
          .member("forwarded", b.forwarded)
          .member("object", b.object ? config::format_address(*b.object) : "")
          .end_object();
    }
    out_.end_array();
  }

  void line(const config::LinePlan& plan) {
    const line::LineConfig c = as_started(plan.config);
    out_.begin_object()
        .member("name", c.name)
        .member("interface", plan.interface.uri)
        .member("role", name(plan.config.role))
        .member("role_at_start", name(c.role))
        .member("node_id", c.node_id)
        .member("network_id", c.network_id)
        .member("bit_rate", c.bit_rate)
        .member("heartbeat_ns", c.heartbeat.count())
        .member("sync_ns", c.sync_period.count())
        .member("emcy_bytes", node::name(c.error_scheme))
        .member("commands", config::name(plan.commands))
        .member("outputs", config::name(plan.outputs))
        .member("publish", config::name(plan.publish.rule))
        .member("publish_ns", plan.publish.time.count())
        .member("pdo_min_period_ns", plan.pdo_min_period.count())
        .member("start_nodes", c.start_nodes)
        .member("start_all", c.start_all)
        .member("own_start", c.own_start)
        .member("on_error", lost_text(c.on_error))
        .member("boot_time_ns", c.boot_time.count())
        .member("nmt_inhibit_ns", c.nmt_inhibit.count())
        .member("executor", plan.executor)
        .member("storage", plan.storage);
    out_.key("enter").begin_array();
    for (const auto& rule : c.routing.access) {
      out_.begin_object()
          .member("first", rule.first)
          .member("last", rule.last)
          .member("services", services_text(rule))
          .end_object();
    }
    out_.end_array();
    out_.key("nodes").begin_array();
    for (const auto& node : c.nodes) {
      this->node(node, c.role);
    }
    out_.end_array().key("devices").begin_array();
    for (const auto& device : c.devices) {
      out_.begin_object()
          .member("id", device.id)
          .member("name", device.name)
          .member("file", device.device.file)
          .member("product", device.device.product_name);
      pdos(device.device);
      out_.end_object();
    }
    out_.end_array();
    if (const auto made = line::Line::make(c); made.value) {
      const auto& outputs = (*made.value)->layout(image::Direction::outputs);
      layout((*made.value)->layout(image::Direction::inputs));
      layout(outputs);
      groups(c, outputs);
    }
    out_.end_object();
  }

  // observed: another master boots it, and what is configured of its boot process has no effect.
  void node(const line::NodeConfig& node, line::Role role) {
    out_.begin_object()
        .member("id", node.id)
        .member("observed", role != line::Role::manager)
        .member("name", node.name)
        .member("file", node.device.file)
        .member("product", node.device.product_name)
        .member("mandatory", node.mandatory)
        .member("boot", node.boot)
        .member("keep_alive", node.keep_alive)
        .member("boot_timeout_ns", node.boot_timeout.count())
        .member("reset_time_ns", node.reset_time.count())
        .member("sdo_timeout_ns", node.sdo_timeout.count())
        .member("sdo_block_from", node.block_from == sdo::kNoBlocks ? 0U : node.block_from)
        .member("heartbeat_ns", node.heartbeat.count());
    pdos(node.device);
    out_.end_object();
  }

  void pdos(const od::DeviceDescription& device) {
    const auto described = pdo::describe_pdos(device);
    out_.key("tpdos").begin_array();
    if (described.value) {
      for (const auto& p : described.value->tpdos) {
        pdo(p);
      }
    }
    out_.end_array().key("rpdos").begin_array();
    if (described.value) {
      for (const auto& p : described.value->rpdos) {
        pdo(p);
      }
    }
    out_.end_array();
  }

  void pdo(const pdo::Parameters& p) {
    out_.begin_object()
        .member("number", p.number)
        .member("cob_id", p.cob_id.id())
        .member("type", p.type)
        .member("inhibit_ns", p.inhibit.count())
        .member("event_timer_ns", p.event_timer.count());
    out_.key("mapping").begin_array();
    for (const auto& mapped : p.mapping) {
      out_.begin_object()
          .member("index", mapped.address.index)
          .member("sub", mapped.address.sub)
          .member("bits", mapped.bits)
          .end_object();
    }
    out_.end_array().end_object();
  }

  void layout(const image::Layout& layout) {
    out_.key(std::string(name(layout.direction)) + "_layout").begin_object();
    out_.member("id", hex64(layout.id)).member("bytes", layout.byte_size);
    out_.key("entries").begin_array();
    for (const auto& e : layout.entries) {
      out_.begin_object()
          .member("name", e.name)
          .member("bit_offset", e.bit_offset)
          .member("bit_length", e.bit_length)
          .member("type", od::name(e.type))
          .member("node", e.node)
          .member("index", e.index)
          .member("sub", e.sub)
          .member("remote_pdo", e.remote_pdo)
          .member("local_pdo", e.local_pdo)
          .member("variable_index", e.variable_index)
          .member("variable_sub", e.variable_sub)
          .end_object();
    }
    out_.end_array().end_object();
  }

  void groups(const line::LineConfig& config, const image::Layout& outputs) {
    out_.key("groups").begin_array();
    for (const auto& group : config.groups) {
      out_.begin_object()
          .member("number", group.number)
          .member("name", group.name)
          .member("send", group.send_always ? "always" : "on_change");
      out_.key("entries").begin_array();
      for (const auto entry : group.entries) {
        out_.value(outputs.entries[entry].name);
      }
      out_.end_array().end_object();
    }
    out_.end_array();
  }

  JsonWriter out_;
};

}  // namespace

std::string to_json(const Loaded<config::Plant>& loaded) {
  Json json;
  json.document(loaded);
  return json.take();
}

}  // namespace linegate::gateway
