// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/object_writer.h"

#include <algorithm>
#include <vector>

#include "stack/eds/object.h"
#include "stack/eds/text.h"
#include "stack/eds/value.h"

namespace linegate::eds {
namespace {

using od::ObjectDescription;
using od::VariableDescription;

constexpr std::size_t kFewElements = 3;  // up to this number of variables, each gets a section

std::string_view word(od::Access access) {
  switch (access) {
    case od::Access::wo:
      return "wo";
    case od::Access::rw:
      return "rw";
    case od::Access::rwr:
      return "rwr";
    case od::Access::rww:
      return "rww";
    case od::Access::constant:
      return "const";
    case od::Access::ro:
      break;
  }
  return "ro";
}

// A value and its notation.
struct Written {
  const std::vector<std::byte>& value;
  bool formula;

  bool operator==(const Written& other) const {
    return value == other.value && formula == other.formula;
  }
};

Written default_of(const VariableDescription& variable) {
  return variable.configured ? Written{variable.notes.default_value, variable.notes.default_formula}
                             : Written{variable.value, variable.notes.value_formula};
}

void write_value(SectionText& out, std::string_view key, const VariableDescription& variable,
                 const Written& written, const WriteOptions& options) {
  if (!written.value.empty()) {
    out.text(key, format_value(variable.type, written.value, written.formula, options.node_id));
  }
}

// Compares the attributes that all elements of a CompactSubObj share.
bool equal_but_for_value(const VariableDescription& a, const VariableDescription& b) {
  return a.type == b.type && a.access == b.access && a.mappable == b.mappable &&
         a.low_limit == b.low_limit && a.high_limit == b.high_limit &&
         a.notes.low_formula == b.notes.low_formula && a.notes.high_formula == b.notes.high_formula;
}

bool has_files(const VariableDescription& variable) {
  return !variable.notes.reference.empty() || !variable.notes.upload_file.empty() ||
         !variable.notes.download_file.empty();
}

bool is_compact(const ObjectDescription& object, const WriteOptions& options) {
  const auto& variables = object.variables;
  if (object.type != od::ObjectType::array || variables.size() <= kFewElements) {
    return false;
  }
  const auto count = static_cast<std::uint8_t>(variables.size() - 1);
  VariableDescription zero = count_variable(count, variables[0].line);
  if (variables[0] != zero) {
    return false;
  }
  const VariableDescription& first = variables[1];
  for (std::size_t i = 1; i < variables.size(); ++i) {
    const VariableDescription& variable = variables[i];
    // In a DCF only configured elements have individual values.
    const bool same_default = default_of(variable) == default_of(first);
    const bool has_value_to_write = options.dcf || !default_of(variable).value.empty();
    if (variable.sub != i || has_files(variable) || !equal_but_for_value(variable, first) ||
        (!same_default && (options.dcf || !has_value_to_write))) {
      return false;
    }
  }
  return true;
}

void write_list(SectionText& out, std::string_view section, const ObjectDescription& object,
                const std::vector<std::string>& texts) {
  const auto count = std::count_if(texts.begin(), texts.end(),
                                   [](const std::string& text) { return !text.empty(); });
  if (count == 0) {
    return;
  }
  out.section(section);
  out.entry("NrOfEntries", static_cast<std::uint64_t>(count));
  for (std::size_t i = 0; i < texts.size(); ++i) {
    out.text(std::to_string(object.variables[i].sub), texts[i]);
  }
}

void write_compact(SectionText& out, const std::string& name, const ObjectDescription& object,
                   const WriteOptions& options) {
  VariableDescription pattern = object.variables[1];
  pattern.name = object.name;
  pattern.notes.denotation = object.denotation;
  pattern.value = default_of(object.variables[1]).value;
  pattern.notes.value_formula = default_of(object.variables[1]).formula;
  pattern.configured = false;
  write_variable(out, pattern, options);
  out.entry("CompactSubObj", object.variables.size() - 1);

  std::vector<std::string> names(object.variables.size());
  std::vector<std::string> values(object.variables.size());
  std::vector<std::string> denotations(object.variables.size());
  for (std::size_t i = 1; i < object.variables.size(); ++i) {
    const VariableDescription& variable = object.variables[i];
    if (variable.name != object.name + std::to_string(variable.sub)) {
      names[i] = one_line(variable.name);
    }
    const Written written =
        options.dcf ? Written{variable.value, variable.notes.value_formula} : default_of(variable);
    if (options.dcf ? variable.configured : !(written == default_of(object.variables[1]))) {
      values[i] = format_value(variable.type, written.value, written.formula, options.node_id);
    }
    if (options.dcf) {
      denotations[i] = one_line(variable.notes.denotation);
    }
  }
  write_list(out, name + "Name", object, names);
  write_list(out, name + "Value", object, values);
  write_list(out, name + "Denotation", object, denotations);
}

std::string plain_hex(std::uint64_t value, unsigned digits) {
  return format_hex(value, digits).substr(2);
}

}  // namespace

void SectionText::section(std::string_view name) {
  out_ += out_.empty() ? "[" : "\n[";
  out_ += name;
  out_ += "]\n";
}

void SectionText::entry(std::string_view key, std::string_view value) {
  out_ += key;
  out_ += '=';
  out_ += one_line(value);
  out_ += '\n';
}

void SectionText::entry(std::string_view key, std::uint64_t value) {
  entry(key, std::to_string(value));
}

void SectionText::flag(std::string_view key, bool value) {
  entry(key, value ? "1" : "0");
}

void SectionText::text(std::string_view key, std::string_view value) {
  if (!value.empty()) {
    entry(key, value);
  }
}

void write_variable(SectionText& out, const VariableDescription& variable,
                    const WriteOptions& options) {
  out.text("ParameterName", variable.name);
  out.entry("DataType", format_hex(static_cast<std::uint16_t>(variable.type), 4));
  out.entry("AccessType", word(variable.access));
  write_value(out, "DefaultValue", variable, default_of(variable), options);
  write_value(out, "LowLimit", variable, {variable.low_limit, variable.notes.low_formula}, options);
  write_value(out, "HighLimit", variable, {variable.high_limit, variable.notes.high_formula},
              options);
  out.flag("PDOMapping", variable.mappable);
  if (!options.dcf) {
    return;
  }
  if (variable.configured) {
    write_value(out, "ParameterValue", variable, {variable.value, variable.notes.value_formula},
                options);
  }
  out.text("Denotation", variable.notes.denotation);
  out.text("ParamRefd", variable.notes.reference);
  out.text("UploadFile", variable.notes.upload_file);
  out.text("DownloadFile", variable.notes.download_file);
}

void write_object(SectionText& out, std::string_view prefix, const ObjectDescription& object,
                  const WriteOptions& options) {
  const std::string name = std::string(prefix) + plain_hex(object.index, 4);
  out.section(name);
  out.entry("ObjectType", static_cast<std::uint64_t>(object.type));
  if (object.flags != 0) {
    out.entry("ObjFlags", object.flags);
  }
  if (!has_subs(object.type)) {
    write_variable(out, object.variables.front(), options);
    return;
  }
  if (is_compact(object, options)) {
    write_compact(out, name, object, options);
    return;
  }
  out.text("ParameterName", object.name);
  out.entry("SubNumber", object.variables.size());
  if (options.dcf) {
    out.text("Denotation", object.denotation);
  }
  for (const VariableDescription& variable : object.variables) {
    out.section(name + "sub" + plain_hex(variable.sub, 1));
    write_variable(out, variable, options);
  }
}

}  // namespace linegate::eds
