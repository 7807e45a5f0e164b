// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>

#include "stack/eds/object.h"
#include "stack/eds/text.h"
#include "stack/eds/value.h"
#include "stack/od/data_type.h"

namespace linegate::eds {
namespace {

using od::Access;
using od::DataType;
using od::VariableDescription;

void report_missing(const Section& section, const char* key, const char* consequence,
                    Context& context, Severity severity = Severity::warning) {
  context.report.add(severity, section.place, quote(section.name) + " has no " + key + consequence);
}

}  // namespace

std::string read_name(const Fields& fields, Context& context) {
  std::string name = fields.text("ParameterName");
  if (name.empty()) {
    report_missing(fields.section(), "ParameterName", "; its section's name is used", context);
    name = to_utf8(fields.section().name);
  }
  return name;
}

namespace {

DataType read_data_type(const Fields& fields, Context& context) {
  const bool is_domain = fields.number("ObjectType", 0xFF).value_or(0) ==
                         static_cast<std::uint8_t>(od::ObjectType::domain);
  const Severity severity =
      fields.find("ParameterValue") != nullptr ? Severity::error : Severity::warning;
  const auto type = static_cast<DataType>(fields.number("DataType", 0xFFFF, severity).value_or(0));
  if (type == DataType::none && is_domain) {
    return DataType::domain;
  }
  if (type == DataType::none) {
    report_missing(fields.section(), "DataType", "; it is left out", context, severity);
  } else if (od::name(type) == od::name(DataType::none)) {
    context.report.warning(
        fields.find("DataType")->value_place,
        "DataType: " + hex(static_cast<std::uint16_t>(type), 4) + " is not known; taken as bytes");
  }
  return type;
}

Access access_of(const Fields& fields, DataType type, Context& context) {
  const Entry* entry = fields.find("AccessType");
  if (entry != nullptr) {
    return read_access(*entry, context.report);
  }
  if (type != DataType::domain) {
    report_missing(fields.section(), "AccessType", "; taken as ro", context);
  }
  return type == DataType::domain ? Access::rw : Access::ro;
}

// The entry's value for the type, or nothing after a message of the given severity.
std::optional<Value> read_bytes(const Entry& entry, std::string_view what, DataType type,
                                Severity severity, Context& context) {
  Value value = parse_value(type, entry.value, context.node_id);
  if (!value.problem.empty()) {
    context.report.add(severity, entry.value_place,
                       std::string(what) + ": " + value.problem +
                           (severity == Severity::error ? "" : "; ignored"));
    return std::nullopt;
  }
  if (!value.remark.empty()) {
    context.report.warning(entry.value_place, std::string(what) + ": " + value.remark);
  }
  if (value.uses_node_id && context.node_id == 0 && !context.missing_node_id_reported) {
    context.missing_node_id_reported = true;
    context.report.error(entry.value_place, std::string(what) + ": " + quote(entry.value) +
                                                " depends on the node-ID, but none is given");
  }
  return value;
}

Value read_limit(const Fields& fields, std::string_view key, DataType type, Context& context) {
  const Entry* entry = fields.find(key);
  if (entry == nullptr) {
    return {};
  }
  return read_bytes(*entry, key, type, Severity::warning, context).value_or(Value{});
}

void read_limits(const Fields& fields, VariableDescription& variable, Context& context) {
  if (!od::is_integer(variable.type) && !od::is_real(variable.type)) {
    return;
  }
  Value low = read_limit(fields, "LowLimit", variable.type, context);
  Value high = read_limit(fields, "HighLimit", variable.type, context);
  variable.low_limit = std::move(low.bytes);
  variable.high_limit = std::move(high.bytes);
  variable.notes.low_formula = low.uses_node_id;
  variable.notes.high_formula = high.uses_node_id;
  if (od::check_limits(variable.type, variable.high_limit, variable.low_limit, {}) ==
      AbortCode::value_too_low) {
    context.report.warning(fields.find("LowLimit")->value_place,
                           "LowLimit is more than HighLimit; both are ignored");
    variable.low_limit.clear();
    variable.high_limit.clear();
    variable.notes.low_formula = variable.notes.high_formula = false;
  }
}

std::optional<double> read_real(const Fields& fields, std::string_view key, Context& context) {
  const Entry* const entry = fields.find(key);
  if (entry == nullptr) {
    return std::nullopt;
  }
  const std::string_view text = trim(entry->value);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) {
    context.report.warning(entry->value_place, std::string(key) + ": " + quote(entry->value) +
                                                   " is no number; ignored");
    return std::nullopt;
  }
  return value;
}

// Keys that an XDD is converted to (bridges/xdd); CiA 306 has none for it. CiA 311: the value for
// people is (value + offset) * multiplier.
void read_scaling(const Fields& fields, VariableDescription& variable, Context& context) {
  const bool is_number = od::is_integer(variable.type) || od::is_real(variable.type);
  if (!is_number || variable.type == DataType::boolean) {
    return;
  }
  std::string unit = fields.text("XddUnit");
  if (unit.size() <= od::kLongestUnit) {
    variable.scaling.unit = std::move(unit);
  } else {
    context.report.warning(
        fields.find("XddUnit")->value_place,
        "XddUnit is longer than " + std::to_string(od::kLongestUnit) + " bytes; ignored");
  }
  const double scale = read_real(fields, "XddMultiplier", context).value_or(1.0);
  const double offset = scale * read_real(fields, "XddOffset", context).value_or(0.0);
  if (std::abs(scale) > 0 && std::isfinite(offset)) {
    variable.scaling.scale = scale;
    variable.scaling.offset = offset;
  } else {
    context.report.warning(fields.section().place,
                           "multiplier and offset make no scaling; ignored");
  }
}

}  // namespace

Access read_access(const Entry& entry, Report& report) {
  static constexpr std::pair<std::string_view, Access> kWords[] = {
      {"ro", Access::ro},   {"wo", Access::wo},   {"rw", Access::rw},
      {"rwr", Access::rwr}, {"rww", Access::rww}, {"const", Access::constant}};
  for (const auto& [word, access] : kWords) {
    if (equal_ignoring_case(without_comment(entry.value), word)) {
      return access;
    }
  }
  report.warning(entry.value_place,
                 "AccessType: " + quote(entry.value) + " is not known; taken as ro");
  return Access::ro;
}

void read_value(const Entry& entry, bool configured, VariableDescription& variable,
                Context& context) {
  const Severity severity = configured ? Severity::error : Severity::warning;
  auto value = read_bytes(entry, entry.key, variable.type, severity, context);
  if (!value) {
    return;
  }
  if (configured && !variable.configured) {
    variable.notes.default_value = std::move(variable.value);
    variable.notes.default_formula = variable.notes.value_formula;
  }
  variable.value = std::move(value->bytes);
  variable.notes.value_formula = value->uses_node_id;
  variable.configured = configured;
  const AbortCode outside =
      od::check_limits(variable.type, variable.value, variable.low_limit, variable.high_limit);
  if (outside != AbortCode::none) {
    context.report.warning(entry.value_place, std::string(entry.key) + ": " + quote(entry.value) +
                                                  " is outside LowLimit and HighLimit");
  }
}

std::optional<VariableDescription> read_variable(const Section& section, std::uint8_t sub,
                                                 Context& context) {
  const Fields fields(section, context.report);
  VariableDescription variable;
  variable.sub = sub;
  variable.line = section.place.line;
  variable.name = read_name(fields, context);
  variable.type = read_data_type(fields, context);
  if (variable.type == DataType::none) {
    return std::nullopt;
  }
  variable.access = access_of(fields, variable.type, context);
  variable.mappable = fields.flag("PDOMapping");
  read_limits(fields, variable, context);
  read_scaling(fields, variable, context);
  if (const Entry* entry = fields.find("DefaultValue")) {
    read_value(*entry, false, variable, context);
  }
  if (const Entry* entry = fields.find("ParameterValue")) {
    read_value(*entry, true, variable, context);
  }
  variable.notes.denotation = fields.text("Denotation");
  variable.notes.reference = fields.text("ParamRefd");
  variable.notes.upload_file = fields.text("UploadFile");
  variable.notes.download_file = fields.text("DownloadFile");
  return variable;
}

}  // namespace linegate::eds
