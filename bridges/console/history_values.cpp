// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/history_values.h"

#include <cstddef>
#include <vector>

#include <nlohmann/json.hpp>

#include "bridges/console/json_text.h"
#include "bridges/console/tables.h"
#include "bridges/console/value_text.h"
#include "stack/image/layout.h"
#include "stack/od/data_type.h"

namespace linegate::console {
namespace {

using request::JournalValue;

std::vector<std::byte> value_bytes(const JournalValue& value) {
  std::vector<std::byte> out((value.series.bits + 7U) / 8U);
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = static_cast<std::byte>(value.value.value_or(0) >> (8 * i));
  }
  return out;
}

// As its layout had it when the value was stored.
image::Entry entry_of(const JournalValue& value) {
  image::Entry out;
  out.name = value.series.name;
  out.type = static_cast<od::DataType>(value.series.type);
  out.bit_length = value.series.bits;
  out.scaling = {value.series.unit, value.series.scale, value.series.offset};
  return out;
}

std::string_view value_direction(const JournalValue& value) {
  return image::name(static_cast<image::Direction>(value.series.direction));
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) {
    return text;
  }
  std::string out = "\"";
  for (const char c : text) {
    out += c == '"' ? std::string("\"\"") : std::string(1, c);
  }
  return out + '"';
}

}  // namespace

std::string_view clock_name(std::uint8_t quality) {
  return quality == 2 ? "synchronised" : quality == 1 ? "free-running" : "unknown";
}

std::string value_history_text(const JournalValue& value, const std::string& gateway, bool utc) {
  return (utc ? date_text(value.time) : local_text(value.time)) + ' ' +
         (gateway.empty() ? "" : printable(gateway) + '/') + printable(value.series.line) + ' ' +
         printable(value.series.name) + ": " +
         (value.value ? printable(text_with_unit(entry_of(value), value_bytes(value)))
                      : "not valid");
}

std::string value_history_json(const JournalValue& value, const std::string& gateway) {
  using Json = nlohmann::ordered_json;
  Json out{{"time", date_text(value.time)}};
  if (!gateway.empty()) {
    out["gateway"] = gateway;
  }
  out["clock"] = clock_name(value.clock);
  out["line"] = value.series.line;
  out["direction"] = value_direction(value);
  out["node"] = value.series.node;
  out["entry"] = value.series.name;
  image::Entry entry = entry_of(value);
  const auto value_json = [&] {
    return value.value ? Json::parse(json_of_value(entry, value_bytes(value))) : Json();
  };
  out["type"] = od::name(entry.type);
  out["valid"] = value.value.has_value();
  out["value"] = value_json();
  if (const std::string unit = unit_of(entry); !unit.empty()) {
    out["unit"] = unit;
  }
  if (entry.scaling.is_scaled()) {
    entry.scaling = {};
    out["raw"] = value_json();
  }
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string value_history_csv(const JournalValue& value, const std::string& gateway) {
  return date_text(value.time) + ',' + csv_field(gateway) + ',' + csv_field(value.series.line) +
         ',' + std::string(value_direction(value)) + ',' + csv_field(value.series.name) + ',' +
         (value.value ? csv_field(to_text(entry_of(value), value_bytes(value))) : "") + ',' +
         csv_field(unit_of(entry_of(value)));
}

}  // namespace linegate::console
