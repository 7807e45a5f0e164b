// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/idl_text.h"

#include <string_view>
#include <utility>

#include "bridges/named/member_text.h"

namespace linegate::named {
namespace {

constexpr std::string_view kHead =
    R"(// Named topics of a Linegate plant, written by `linegate idl`.
//
// One topic for each device and direction, keyed by gateway and line. All times are UTC in
// nanoseconds since 1970-01-01, 0 = never. A type has a hash of its layout in its name: after a
// change of the device's objects, PDOs, names, units or scaling, its samples have another type, and
// this document must be made anew. Members have the values of PDOs: "raw * 0.1 - 40, in bar" behind
// one says how to scale it. Linegate's idl/README.md has the rules (chapter Named topics).
//
// fastddsgen -cs FILE (without -typeobject); idlc -l c FILE.
)";

constexpr std::string_view kGroupHead =
    R"(
// A topic .../outputs/set is written by applications: one for each group of outputs that is written
// by name, keyed by gateway, line and group. A member of `values` has an effect only if the member of
// `given` with its name is true. Linegate's idl/README.md has the rules (chapter Outputs by name).
)";

std::string_view idl_of(Form form) {
  switch (form) {
    case Form::boolean:
      return "boolean";
    case Form::int8:
      return "int8";
    case Form::uint8:
    case Form::octets:
      return "octet";
    case Form::int16:
      return "short";
    case Form::uint16:
      return "unsigned short";
    case Form::int32:
      return "long";
    case Form::uint32:
      return "unsigned long";
    case Form::int64:
      return "long long";
    case Form::uint64:
      return "unsigned long long";
    case Form::float32:
      return "float";
    case Form::float64:
      return "double";
    case Form::text:
      break;
  }
  return "string";
}

class Text {
 public:
  std::string take() { return std::move(out_); }

  void module(std::span<const DeviceType> types, std::span<const GroupType> groups) {
    out_ = kHead;
    if (types.empty() && groups.empty()) {
      return;
    }
    out_ += groups.empty() ? std::string_view() : kGroupHead;
    out_ += "\nmodule " + std::string(kModule) + " {\n";
    for (const DeviceType& type : types) {
      add(type);
    }
    for (const GroupType& group : groups) {
      add(group);
    }
    out_ += "\n};\n";
  }

 private:
  void begin(const std::string& name) { out_ += "\n@final struct " + name + " {\n"; }
  void member(const std::string& type, const std::string& name, const std::string& comment = {}) {
    out_ += "  " + type + ' ' + name + ';' + (comment.empty() ? "" : "  // " + comment) + '\n';
  }
  void end() { out_ += "};\n"; }

  void add(const DeviceType& type) {
    out_ += "\n// " + type.topic() + '\n';
    values(type.name, type.members);
    marks(type.name, type.members, "valid");
    if (type.direction == image::Direction::outputs) {
      marks(type.name, type.members, "known");
      marks(type.name, type.members, "waits", "octet");
    }
    times(type);
    sample(type);
  }

  void values(const std::string& name_of_type, std::span<const Member> members) {
    begin(name_of_type + "_values");
    for (const Member& one : members) {
      std::string kind(idl_of(one.form));
      std::string name = one.identifier;
      if (one.form == Form::text) {
        kind += '<' + std::to_string(one.length) + '>';
      } else if (one.form == Form::octets) {
        name += '[' + std::to_string(one.length) + ']';
      }
      member(kind, name, comment_of(one));
    }
    end();
  }

  void marks(const std::string& name_of_type, std::span<const Member> members,
             std::string_view mark, const std::string& kind = "boolean") {
    begin(name_of_type + '_' + std::string(mark));
    for (const Member& one : members) {
      member(kind, one.identifier);
    }
    end();
  }

  // The members before the values are those of OutputWrite, except layout_id.
  void add(const GroupType& type) {
    out_ += "\n// " + type.topic() + ": group " + std::to_string(type.number) + '\n';
    values(type.name, type.members);
    marks(type.name, type.members, "given");
    begin(type.name);
    member("@key string<64>", "gateway");
    member("@key string<64>", "line");
    member("@key unsigned short", "group", std::to_string(type.number));
    member("unsigned long long", "incarnation", "of the gateway it is meant for; 0 = any");
    member("string<64>", "client", "name of the writer, for people");
    member("unsigned long long", "arming", "after a watchdog reaction another number than before");
    member("long long", "watchdog_ns", "time without a sample; 0 = no watchdog");
    member("octet", "reactions", "WATCHDOG_ bits of linegate.idl");
    member(type.name + "_given", "given", "which values have an effect");
    member(type.name + "_values", "values");
    end();
  }

  static std::string time_name(const DeviceType& type) {
    return type.direction == image::Direction::inputs ? "received" : "sent";
  }

  void times(const DeviceType& type) {
    if (type.pdos.empty()) {
      return;
    }
    begin(type.name + '_' + time_name(type));
    for (const std::uint16_t pdo : type.pdos) {
      member("long long", time_member(pdo));
    }
    end();
  }

  void sample(const DeviceType& type) {
    const bool is_input = type.direction == image::Direction::inputs;
    begin(type.name);
    member("@key string<64>", "gateway");
    member("@key string<64>", "line");
    member("unsigned long long", "incarnation", "random for each start of the gateway");
    member("unsigned long long", "sequence_number", "1, 2, ...: a gap means lost samples");
    member("long long", "time", "acquisition of the process image");
    member("octet", "clock", "ClockQuality of linegate.idl");
    if (!type.pdos.empty()) {
      member(type.name + '_' + time_name(type), time_name(type),
             is_input ? "last reception of each PDO of the device"
                      : "last transmission of each PDO to the device");
    }
    member(type.name + "_valid", "valid",
           is_input ? "received from a device that is present"
                    : "transmitted since the device was started");
    if (!is_input) {
      member(type.name + "_known", "known", "written, or has a default");
      member(type.name + "_waits", "waits", "0 if valid, else OutputWait of linegate.idl + 1");
    }
    member(type.name + "_values", "values",
           is_input ? "0 or empty unless valid" : "0 or empty unless known");
    end();
  }

  std::string out_;
};

}  // namespace

std::string idl_text(std::span<const DeviceType> types, std::span<const GroupType> groups) {
  Text text;
  text.module(types, groups);
  return text.take();
}

}  // namespace linegate::named
