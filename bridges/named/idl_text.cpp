// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/idl_text.h"

#include <string_view>
#include <utility>

namespace linegate::named {
namespace {

constexpr std::string_view kHead =
    R"(// Named topics of a Linegate plant, written by `linegate idl`.
//
// One topic for each device and direction, keyed by gateway and line. All times are UTC in
// nanoseconds since 1970-01-01, 0 = never. A type has a hash of its layout in its name: after a
// change of the device's objects, PDOs or names, its samples have another type, and this document
// must be made anew. Linegate's idl/README.md has the rules for readers (chapter Named topics).
//
// fastddsgen -cs FILE (without -typeobject); idlc -l c FILE.
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

std::string_view meaning_of(Reading reading) {
  switch (reading) {
    case Reading::time_of_day:
      return ", as time";
    case Reading::duration:
      return ", in nanoseconds";
    case Reading::bits:
    case Reading::signed_bits:
    case Reading::characters:
    case Reading::utf16:
      break;
  }
  return "";
}

// No character that ends or continues the comment.
std::string in_comment(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += c >= ' ' && c <= '~' && c != '\\' ? c : '?';
  }
  return out;
}

std::string comment_of(const Member& member) {
  std::string out = od::to_text(member.object) + ' ' + std::string(od::name(member.type));
  if (od::bit_size(member.type) != member.bit_length) {
    out += ", " + std::to_string(member.bit_length) + (member.bit_length == 1 ? " bit" : " bits");
  }
  out += meaning_of(member.reading);
  if (member.pdo != 0) {
    out += ", PDO " + std::to_string(member.pdo);
  }
  return out + ": " + in_comment(member.object_name);
}

class Text {
 public:
  std::string take() { return std::move(out_); }

  void module(std::span<const DeviceType> types) {
    out_ = kHead;
    if (types.empty()) {
      return;
    }
    out_ += "\nmodule " + std::string(kModule) + " {\n";
    for (const DeviceType& type : types) {
      add(type);
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
    values(type);
    marks(type, "valid");
    if (type.direction == image::Direction::outputs) {
      marks(type, "known");
    }
    times(type);
    sample(type);
  }

  void values(const DeviceType& type) {
    begin(type.name + "_values");
    for (const Member& one : type.members) {
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

  void marks(const DeviceType& type, std::string_view mark) {
    begin(type.name + '_' + std::string(mark));
    for (const Member& one : type.members) {
      member("boolean", one.identifier);
    }
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
      member("long long", "pdo" + std::to_string(pdo));
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
    }
    member(type.name + "_values", "values",
           is_input ? "0 or empty unless valid" : "0 or empty unless known");
    end();
  }

  std::string out_;
};

}  // namespace

std::string idl_text(std::span<const DeviceType> types) {
  Text text;
  text.module(types);
  return text.take();
}

}  // namespace linegate::named
