// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/decode.h"

#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "bridges/can/error_frame.h"
#include "bridges/can/log_file.h"
#include "bridges/console/explain.h"
#include "bridges/console/value_text.h"
#include "gateway/config/plant.h"
#include "gateway/publish/event_text.h"
#include "gateway/runtime/channels.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/log.h"
#include "gateway/tools/json_text.h"

namespace linegate::gateway {
namespace {

using can_bridge::LogEntry;
using can_bridge::LogFile;

constexpr std::int64_t kSecond = 1'000'000'000;

// State of one interface in the log.
struct Bus {
  std::unique_ptr<console::Explainer> frames = std::make_unique<console::Explainer>();
  can_bridge::ErrorDecoder errors;
};

std::string errors_text(const can::BusEvent& event) {
  if (event.kind == can::BusEvent::Kind::state) {
    return fmt::format("controller {}, TEC {}, REC {}", name(event.state), event.transmit_errors,
                       event.receive_errors);
  }
  return event.kind == can::BusEvent::Kind::frames_lost
             ? fmt::format("the controller lost {} frames", event.count)
             : "error frame: " + describe_bus_errors(event.errors);
}

class Decoding {
 public:
  Decoding(const config::Plant* plant, const DecodeOptions& options)
      : plant_(plant), options_(options) {}

  void entry(const LogEntry& entry) {
    Bus& bus = bus_of(entry.interface);
    switch (entry.kind) {
      case LogEntry::Kind::frame:
        frame(entry, bus.frames->explain(stamped(entry)));
        return;
      case LogEntry::Kind::error_frame:
        print(entry, "error", errors_of(entry, bus));
        return;
      case LogEntry::Kind::frames_lost:
        print(entry, "lost", fmt::format("{} frames are missing here", entry.lost));
        return;
      case LogEntry::Kind::remark:
        return;
    }
  }

 private:
  Bus& bus_of(std::string_view interface) {
    const auto found = buses_.find(interface);
    if (found != buses_.end()) {
      return found->second;
    }
    Bus& bus = buses_[std::string(interface)];
    if (const auto* line = line_of(interface)) {
      bus.frames->add_own_node(line->config);
      for (const auto& node : line->config.nodes) {
        bus.frames->add(node);
      }
      for (const auto& device : line->config.devices) {
        bus.frames->add({.id = device.id, .name = device.name, .device = device.device});
      }
    }
    return bus;
  }

  const config::LinePlan* line_of(std::string_view interface) const {
    if (plant_ == nullptr) {
      return nullptr;
    }
    const auto& lines = plant_->lines;
    const auto found = std::find_if(lines.begin(), lines.end(), [&](const auto& line) {
      return options_.line.empty() ? name_in_log(line.interface, line.config.name) == interface
                                   : line.config.name == options_.line;
    });
    if (found != lines.end()) {
      return &*found;
    }
    return lines.size() == 1 ? &lines.front() : nullptr;
  }

  // With the time of the entry, because SDO transfers time out.
  static can::Frame stamped(const LogEntry& entry) {
    can::Frame out = entry.frame;
    out.time = Instant(Duration(entry.stamp_ns));
    return out;
  }

  static std::string errors_of(const LogEntry& entry, Bus& bus) {
    can_bridge::BusEvents events;
    bus.errors.decode(entry.error, Instant(Duration(entry.stamp_ns)), events);
    std::string out;
    for (const can::BusEvent& event : events.view()) {
      out += (out.empty() ? "" : "; ") + errors_text(event);
    }
    return out.empty() ? "error frame without a change" : out;
  }

  void frame(const LogEntry& entry, const std::string& text) {
    const can::Frame& frame = entry.frame;
    const std::string id = fmt::format("{:0{}X}", frame.id, frame.extended() ? 8 : 3);
    std::string data = frame.remote() ? "remote" : console::to_hex(frame.bytes());
    if (options_.json) {
      const Json out{{"time_ns", entry.stamp_ns},
                     {"interface", entry.interface},
                     {"id", frame.id},
                     {"extended", frame.extended()},
                     {"remote", frame.remote()},
                     {"fd", frame.fd()},
                     {"length", frame.length},
                     {"data", data},
                     {"text", text}};
      std::cout << json_text(out) << '\n';
      return;
    }
    if (frame.remote()) {
      data += ' ' + std::to_string(frame.length);
    }
    print_day(entry.stamp_ns);
    std::cout << fmt::format("{} {:<8} {:>8}  {:<23}  {}\n", clock(entry.stamp_ns), entry.interface,
                             id, data, text);
  }

  // Prints an entry that is not a frame.
  void print(const LogEntry& entry, std::string_view kind, const std::string& text) {
    if (options_.json) {
      const Json out{{"time_ns", entry.stamp_ns},
                     {"interface", entry.interface},
                     {"kind", kind},
                     {"text", text}};
      std::cout << json_text(out) << '\n';
      return;
    }
    print_day(entry.stamp_ns);
    std::cout << fmt::format("{} {:<8} {:>8}  {:<23}  {}\n", clock(entry.stamp_ns), entry.interface,
                             kind, "", text);
  }

  // Blank for lost frames, which have no time stamp.
  std::string clock(std::int64_t stamp_ns) const {
    return stamp_ns == 0 ? std::string(15, ' ')
                         : fmt::format("{:%H:%M:%S}.{:06}", fmt::gmtime(stamp_ns / kSecond),
                                       stamp_ns % kSecond / 1000);
  }

  void print_day(std::int64_t stamp_ns) {
    constexpr std::int64_t kDay = 86'400;
    const std::int64_t day = stamp_ns / kSecond / kDay;
    if (stamp_ns != 0 && day_ != day) {
      day_ = day;
      std::cout << fmt::format("# {:%Y-%m-%d}, UTC\n", fmt::gmtime(stamp_ns / kSecond));
    }
  }

  const config::Plant* plant_;
  const DecodeOptions& options_;
  std::map<std::string, Bus, std::less<>> buses_;
  std::int64_t day_ = -1;
};

bool has_line(const config::Plant& plant, const std::string& name) {
  return name.empty() || std::any_of(plant.lines.begin(), plant.lines.end(),
                                     [&](const auto& line) { return line.config.name == name; });
}

}  // namespace

int decode(const DecodeOptions& options) {
  Loaded<config::Plant> plant;
  if (!options.plant.empty()) {
    plant = config::load(options.plant);
    print(plant.diagnostics);
    if (!plant.value || !has_line(*plant.value, options.line)) {
      print({{Severity::error, options.plant, 0, 0,
              plant.value ? "there is no line " + options.line : "the plant cannot be used"}});
      return kExitUsage;
    }
  }
  LogFile file;
  const bool live = options.file == "-";
  if (const int error = live ? file.open_standard_input() : file.open(options.file)) {
    print({{Severity::error, options.file, 0, 0,
            "the log cannot be read: " + std::generic_category().message(error)}});
    return kExitUsage;
  }
  Decoding decoding(plant.value ? &*plant.value : nullptr, options);
  int exit_code = kExitOk;
  LogEntry entry;
  can_bridge::LogProblem problem;
  for (auto next = file.next(entry, problem); next != LogFile::Next::end;
       next = file.next(entry, problem)) {
    if (next == LogFile::Next::entry) {
      decoding.entry(entry);
      live ? void(std::cout.flush()) : void();
      continue;
    }
    std::cout.flush();
    print(
        {{Severity::error, options.file, file.line(), problem.column, std::string(problem.text)}});
    exit_code = kExitFailed;
  }
  return exit_code;
}

}  // namespace linegate::gateway
