// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/lss.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <ostream>
#include <span>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "bridges/console/event_progress.h"
#include "bridges/console/lookup.h"
#include "bridges/console/model.h"
#include "bridges/console/one_line.h"
#include "bridges/console/table.h"
#include "stack/lss/assigner.h"
#include "stack/lss/procedure.h"

namespace linegate::console {
namespace {

using lss::Address;
using lss::Outcome;
using lss::Procedure;
using Bytes = std::vector<std::byte>;
using Json = nlohmann::ordered_json;

// A fastscan of 128 bits at 100 ms each, restarted several times on a bad bus.
constexpr Duration kLongestService = std::chrono::minutes(3);
constexpr std::size_t kAddressSize = 16;
constexpr std::size_t kRecordSize = 4 + kAddressSize;  // of `assign`
constexpr std::size_t kMostDevices = 127;

std::string hex_part(std::uint32_t number) {
  std::array<char, 8> text{};
  const auto end = std::to_chars(text.begin(), text.end(), number, 16).ptr;
  std::string out(text.begin(), end);
  std::ranges::transform(out, out.begin(),
                         [](char c) { return c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c; });
  return out;
}

Json address_json(const Address& address) {
  return {{"vendor", address[lss::kVendor]},
          {"product", address[lss::kProduct]},
          {"revision", address[lss::kRevision]},
          {"serial", address[lss::kSerial]}};
}

// The progress of a fastscan, and its result.
std::string fastscan_words(const EventView& view) {
  if (view.kind == EventKind::lss_result) {
    return view.text;
  }
  const auto* const progress = view.get<event::CommandProgress>();
  const bool is_fastscan = progress != nullptr && progress->command == line::CommandKind::lss;
  return is_fastscan ? "fastscan: " + std::to_string(progress->done) + " of 4 parts of an address"
                     : "";
}

struct LssAnswer {
  Outcome outcome = Outcome::done;
  unsigned error = 0;
  unsigned specific = 0;
  Bytes data;
};

class Session {
 public:
  Session(Context& context, const LssRequest& request) : context_(context), request_(request) {}

  int run() {
    const Line* const line = find_line(context_, model_, request_.line);
    if (line == nullptr) {
      return kFailed;
    }
    id_ = line->id;
    const int code = carry_out();
    if (in_configuration_) {
      (void)ask(Procedure::switch_global, {std::byte{0}});
    }
    return code;
  }

 private:
  int carry_out() {
    if (request_.what == "scan") {
      return scan_all();
    }
    if (request_.what == "assign") {
      return assign();
    }
    if (request_.what == "identify") {
      return identify();
    }
    if (request_.what == "activate") {
      return activate();
    }
    return with_one_device();
  }

  // Returns nothing, after an error message, if the request was refused.
  std::optional<LssAnswer> ask(Procedure procedure, Bytes arguments) {
    const line::Command command{
        .timeout = std::max(context_.timeout, kLongestService),
        .request = line::LssRequest{.procedure = procedure, .arguments = std::move(arguments)}};
    EventProgress progress(model_, id_, context_.err, fastscan_words);
    const Client::Answer answer = context_.client.call(id_, command, command.timeout, 0, progress);
    const Bytes& data = answer.reply.bytes();
    if (!answer.reply.ok() || data.size() < lss::kReplyHead) {
      context_.err << (answer.reply.ok() ? "the gateway's answer cannot be read"
                                         : printable(answer.text))
                   << '\n';
      return std::nullopt;
    }
    return LssAnswer{.outcome = static_cast<Outcome>(data[0]),
                     .error = std::to_integer<unsigned>(data[1]),
                     .specific = std::to_integer<unsigned>(data[2]),
                     .data = Bytes(data.begin() + lss::kReplyHead, data.end())};
  }

  // The same, with an error message if the procedure did not succeed.
  std::optional<LssAnswer> must(Procedure procedure, Bytes arguments, const char* what) {
    auto answer = ask(procedure, std::move(arguments));
    return answer && is_done(*answer, what) ? answer : std::nullopt;
  }

  // Returns false after an error message.
  bool is_done(const LssAnswer& answer, const char* what) {
    switch (answer.outcome) {
      case Outcome::done:
        return true;
      case Outcome::refused:
        context_.err << what << ": the device refuses it, error " << answer.error << "/"
                     << answer.specific << '\n';
        return false;
      case Outcome::several:
        context_.err << what
                     << ": several devices answer; --only is for a line with one: name the device "
                        "by its LSS address (linegate lss LINE scan)\n";
        return false;
      default:
        context_.err << what << ": no device answered\n";
        return false;
    }
  }

  int scan_all() {
    std::vector<Address> found;
    while (found.size() < kMostDevices) {
      const auto answer = ask(Procedure::fastscan, {});
      if (!answer) {
        return kFailed;
      }
      if (answer->outcome != Outcome::done || answer->data.size() != kAddressSize) {
        break;
      }
      in_configuration_ = true;
      const Address address = lss::read_address(answer->data);
      if (address == Address{} || std::ranges::find(found, address) != found.end()) {
        context_.err << "a device answers fastscan in configuration state: the search ends here\n";
        break;
      }
      found.push_back(address);
      if (!context_.json) {
        context_.out << lss_address_text(found.back()) << std::endl;
      }
    }
    if (context_.json) {
      Json devices = Json::array();
      for (const Address& address : found) {
        devices.push_back(address_json(address));
      }
      print({{"line", id_.line}, {"devices", std::move(devices)}});
    } else if (found.empty()) {
      context_.out << "no device without a node-ID\n";
    }
    return kDone;
  }

  int assign() {
    const auto answer = must(Procedure::assign, {}, "assign");
    if (!answer) {
      return kFailed;
    }
    Json devices = Json::array();
    bool all = true;
    for (std::size_t at = 0; at + kRecordSize <= answer->data.size(); at += kRecordSize) {
      const std::span<const std::byte> record = std::span(answer->data).subspan(at, kRecordSize);
      const auto verdict = static_cast<lss::Verdict>(record[0]);
      const auto node = std::to_integer<unsigned>(record[1]);
      const Address address = lss::read_address(record.subspan(4));
      all = all && verdict == lss::Verdict::given;
      Json one = address_json(address);
      one["node"] = node;
      one["result"] = static_cast<unsigned>(verdict);
      one["text"] = lss::describe(verdict);
      devices.push_back(std::move(one));
      if (!context_.json) {
        context_.out << lss_address_text(address)
                     << (node == 0 ? std::string() : " node " + std::to_string(node)) << ": "
                     << lss::describe(verdict) << '\n';
      }
    }
    if (context_.json) {
      print({{"line", id_.line}, {"devices", std::move(devices)}});
    } else if (answer->data.empty()) {
      context_.out << "no device without a node-ID\n";
    }
    return all ? kDone : kFailed;
  }

  int identify() {
    const auto answer = ask(Procedure::identify_unconfigured, {});
    if (!answer) {
      return kFailed;
    }
    const bool any = answer->outcome == Outcome::done;
    if (context_.json) {
      print({{"line", id_.line}, {"unconfigured", any}});
    } else {
      context_.out << (any ? "there is a device without a node-ID\n"
                           : "no device without a node-ID\n");
    }
    return kDone;
  }

  int activate() {
    const auto delay = parse_number(request_.value, 0xFFFF, false);
    if (!delay) {
      context_.err << "'" << request_.value << "' is not a delay in ms, 0..65535\n";
      return kUsage;
    }
    if (!select_all()) {
      return kFailed;
    }
    const Bytes data{static_cast<std::byte>(*delay), static_cast<std::byte>(*delay >> 8U)};
    return must(Procedure::activate_bit_timing, data, "activate") ? kDone : kFailed;
  }

  bool select_all() {
    in_configuration_ = ask(Procedure::switch_global, {std::byte{1}}).has_value();
    return in_configuration_;
  }

  int with_one_device() {
    const auto address = parse_lss_address(request_.address);
    if (!address && !request_.only) {
      context_.err << "which device? VENDOR:PRODUCT:REVISION:SERIAL, hexadecimal, or --only if it "
                      "is the only one on the line\n";
      return kUsage;
    }
    const auto arguments = arguments_of();
    if (!arguments) {
      return kUsage;
    }
    if (address) {
      Bytes data;
      lss::put(*address, data);
      in_configuration_ = true;  // set first: the answer may be lost
      if (!must(Procedure::switch_selective, data, request_.address.c_str())) {
        return kFailed;
      }
    } else if (!select_all() || !is_alone()) {
      return kFailed;
    }
    return configure_device(*arguments);
  }

  // Whether exactly one device answers; an inquiry detects that by itself.
  bool is_alone() {
    return request_.what == "inquire" || must(Procedure::inquire_address, {}, "--only");
  }

  // Parses --value; nothing, after an error message, if it is invalid.
  std::optional<Bytes> arguments_of() {
    if (request_.what == "set-node-id") {
      const auto id = request_.value == "none" ? std::optional<std::uint64_t>(lss::kNoNodeId)
                                               : parse_number(request_.value, 127, false);
      if (id && *id != 0) {
        return Bytes{static_cast<std::byte>(*id)};
      }
      context_.err << "'" << request_.value << "' is not a node-ID 1..127, nor none\n";
      return std::nullopt;
    }
    if (request_.what == "bit-timing") {
      const std::string_view unit = "kbit";
      const std::string number = request_.value.ends_with(unit)
                                     ? request_.value.substr(0, request_.value.size() - unit.size())
                                     : request_.value;
      const auto rate = parse_number(number, 1000, false);
      const auto index =
          rate ? lss::bit_timing_index(static_cast<std::uint32_t>(*rate * 1000)) : std::nullopt;
      if (index) {
        return Bytes{std::byte{0}, std::byte{*index}};
      }
      context_.err << "'" << request_.value
                   << "' is none of 10, 20, 50, 125, 250, 500, 800, 1000 kbit/s\n";
      return std::nullopt;
    }
    return Bytes{};
  }

  int configure_device(const Bytes& arguments) {
    if (request_.what == "inquire") {
      return inquire();
    }
    if (request_.what == "set-node-id" && !set_node_id(arguments)) {
      return kFailed;
    }
    if (request_.what == "bit-timing" &&
        !must(Procedure::configure_bit_timing, arguments, "bit timing")) {
      return kFailed;
    }
    const bool store = request_.store || request_.what == "store";
    if (store && !must(Procedure::store, {}, "store")) {
      return kFailed;
    }
    if (context_.json) {
      print({{"line", id_.line}, {"ok", true}});
    }
    return kDone;
  }

  // The present device that uses the node-ID; empty if there is none.
  std::string owner_of(std::uint8_t node) {
    const auto found = model_.lines().find(id_);
    if (found == model_.lines().end()) {
      return {};
    }
    const Line& line = found->second;
    // NodeState arrives after LineState.
    if (!line.nodes.contains(node)) {
      (void)know_nodes(context_, model_, line);
    }
    if (line.view->state.node_id == node) {
      return "the gateway's own node";
    }
    const auto known = line.nodes.find(node);
    // Without error control it is unknown whether a node is still present.
    const bool there = known != line.nodes.end() && known->second.state.heartbeat_monitored &&
                       known->second.state.presence == manager::Presence::present;
    return !there ? "" : known->second.name.empty() ? "a node" : known->second.name;
  }

  // The gateway checks that no other device uses the node-ID.
  bool set_node_id(Bytes arguments) {
    const auto node = std::to_integer<std::uint8_t>(arguments.front());
    if (request_.force) {
      arguments.push_back(std::byte{1});
    }
    const auto answer = ask(Procedure::configure_node_id, std::move(arguments));
    if (!answer) {
      return false;
    }
    if (answer->outcome == Outcome::node_id_in_use) {
      const std::string owner = owner_of(node);
      context_.err << "node-ID " << unsigned{node} << " is used by "
                   << (owner.empty() ? "another device" : printable(owner))
                   << ": the device keeps its node-ID. Choose another node-ID, or use this one "
                      "off the line; --force gives it all the same\n";
      return false;
    }
    return is_done(*answer, "node-ID");
  }

  int inquire() {
    const auto address = must(Procedure::inquire_address, {}, "inquire");
    const auto node = address ? must(Procedure::inquire_node_id, {}, "inquire") : std::nullopt;
    if (!address || !node || address->data.size() != kAddressSize || node->data.size() != 1) {
      return kFailed;
    }
    const Address is = lss::read_address(address->data);
    const auto id = std::to_integer<unsigned>(node->data[0]);
    if (context_.json) {
      Json out = address_json(is);
      out["line"] = id_.line;
      out["node"] = id == lss::kNoNodeId ? Json(nullptr) : Json(id);
      print(out);
    } else {
      context_.out << lss_address_text(is) << ' '
                   << (id == lss::kNoNodeId ? "without a node-ID" : "node " + std::to_string(id))
                   << '\n';
    }
    return kDone;
  }

  void print(const Json& json) { context_.out << one_line(json) << '\n'; }

  Context& context_;
  const LssRequest& request_;
  Model model_;
  LineId id_;
  bool in_configuration_ = false;
};

}  // namespace

std::optional<lss::Address> parse_lss_address(const std::string& text) {
  Address out{};
  std::size_t begin = 0;
  for (std::size_t part = 0; part < out.size(); ++part) {
    const std::size_t colon = text.find(':', begin);
    if ((colon == std::string::npos) != (part + 1 == out.size())) {
      return std::nullopt;
    }
    const auto number = parse_number(text.substr(begin, colon - begin), 0xFFFF'FFFF, true);
    if (!number) {
      return std::nullopt;
    }
    out[part] = static_cast<std::uint32_t>(*number);
    begin = colon + 1;
  }
  return out;
}

std::string lss_address_text(const lss::Address& address) {
  std::string out;
  for (const std::uint32_t part : address) {
    out += (out.empty() ? "" : ":") + hex_part(part);
  }
  return out;
}

int lss(Context& context, const LssRequest& request) {
  return Session(context, request).run();
}

}  // namespace linegate::console
