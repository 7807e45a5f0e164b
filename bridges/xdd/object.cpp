// SPDX-License-Identifier: Apache-2.0
#include "bridges/xdd/object.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "stack/eds/text.h"

namespace linegate::xdd {
namespace {

using eds::equal_ignoring_case;

// CANopen data types of the IEC 61131-3 types that parameters use.
const char* data_type(std::string_view name) {
  static constexpr std::pair<std::string_view, const char*> kTypes[] = {
      {"BOOL", "0x01"},   {"CHAR", "0x02"},    {"SINT", "0x02"},     {"INT", "0x03"},
      {"DINT", "0x04"},   {"LINT", "0x15"},    {"BYTE", "0x05"},     {"USINT", "0x05"},
      {"WORD", "0x06"},   {"UINT", "0x06"},    {"DWORD", "0x07"},    {"UDINT", "0x07"},
      {"LWORD", "0x1B"},  {"ULINT", "0x1B"},   {"REAL", "0x08"},     {"LREAL", "0x11"},
      {"STRING", "0x09"}, {"WSTRING", "0x0B"}, {"BITSTRING", "0x0A"}};
  for (const auto& [type, code] : kTypes) {
    if (name == type) {
      return code;
    }
  }
  return nullptr;
}

constexpr const char* kDefaultAccess = "read";  // of a parameter without the attribute (CiA 311)

std::string access_of_parameter(std::string_view access) {
  static constexpr std::pair<std::string_view, const char*> kWords[] = {
      {"const", "const"},        {"read", "ro"},
      {"write", "wo"},           {"readWrite", "rw"},
      {"readWriteInput", "rwr"}, {"readWriteOutput", "rww"}};
  for (const auto& [word, value] : kWords) {
    if (access == word) {
      return value;
    }
  }
  return std::string(access);
}

const char* attribute(pugi::xml_node node, const char* name) {
  const pugi::xml_attribute found = node.attribute(name);
  return found.empty() ? nullptr : found.value();
}

// Hexadecimal digits. CiA 311 writes them without 0x, some files with it.
std::string_view digits_of(std::string_view hex) {
  hex = eds::trim(hex);
  return hex.starts_with("0x") || hex.starts_with("0X") ? hex.substr(2) : hex;
}

std::string padded(std::string_view digits, std::size_t least) {
  return std::string(least - std::min(least, digits.size()), '0') + std::string(digits);
}

std::string hexadecimal(std::string_view hex) {
  const std::string_view digits = digits_of(hex);
  return digits.empty() ? std::string() : "0x" + std::string(digits);
}

// CiA 306 writes rw objects that only RPDOs may map as rww, and those that only TPDOs may map as
// rwr.
std::string with_direction(std::string access, std::string_view mapping) {
  if (access == "rw" && equal_ignoring_case(mapping, "TPDO")) {
    return "rwr";
  }
  return access == "rw" && equal_ignoring_case(mapping, "RPDO") ? "rww" : access;
}

std::string text_of(pugi::xml_node node) {
  const pugi::xml_node label = child(node, "label");
  return std::string(eds::trim((label ? label : node).text().get()));
}

}  // namespace

std::string ObjectReader::read(pugi::xml_node object) {
  const std::string index = padded(digits_of(object.attribute("index").value()), 4);
  if (object.attribute("index").empty()) {
    report_.warning(document_.place(object), "a CANopenObject without index is ignored");
    return {};
  }
  Sections::Builder section(out_, index, document_.place(object));
  const char* type = attribute(object, "objectType");
  section.add("ObjectType", type, document_.place(object, "objectType"));
  section.add("SubNumber", attribute(object, "subNumber"), document_.place(object, "subNumber"));
  if (const char* flags = attribute(object, "objFlags")) {
    section.add("ObjFlags", hexadecimal(flags), document_.place(object, "objFlags"));
  }
  add_value(section, object);
  finish(section, object);
  for (const pugi::xml_node sub : children(object, "CANopenSubObject")) {
    read_sub(index, sub);
  }
  return index;
}

void ObjectReader::read_sub(const std::string& index, pugi::xml_node object) {
  const char* sub = attribute(object, "subIndex");
  if (sub == nullptr) {
    report_.warning(document_.place(object), "a CANopenSubObject without subIndex is ignored");
    return;
  }
  Sections::Builder section(out_, index + "sub" + padded(digits_of(sub), 1),
                            document_.place(object));
  add_value(section, object);
  finish(section, object);
}

void ObjectReader::finish(Sections::Builder& section, pugi::xml_node object) {
  if (!section.finish()) {
    report_.warning(document_.place(object), "this object is already described; ignored");
  }
}

void ObjectReader::add_value(Sections::Builder& section, pugi::xml_node object) {
  static constexpr std::pair<const char*, const char*> kAttributes[] = {
      {"name", "ParameterName"},  {"defaultValue", "DefaultValue"},  {"lowLimit", "LowLimit"},
      {"highLimit", "HighLimit"}, {"actualValue", "ParameterValue"}, {"denotation", "Denotation"}};
  for (const auto& [name, key] : kAttributes) {
    section.add(key, attribute(object, name), document_.place(object, name));
  }
  if (const char* type = attribute(object, "dataType")) {
    section.add("DataType", hexadecimal(type), document_.place(object, "dataType"));
  }
  static constexpr std::string_view kMappings[] = {"no", "default", "optional", "TPDO", "RPDO"};
  const std::string_view mapping = object.attribute("PDOmapping").as_string("no");
  const auto known =
      std::find_if(std::begin(kMappings), std::end(kMappings),
                   [mapping](std::string_view m) { return equal_ignoring_case(m, mapping); });
  if (known == std::end(kMappings)) {
    report_.warning(document_.place(object, "PDOmapping"),
                    "PDOmapping: " + eds::quote(mapping) + " is not known; taken as no");
  }
  const bool mappable = known != std::end(kMappings) && known != std::begin(kMappings);
  section.add("PDOMapping", mappable ? "1" : "0", document_.place(object, "PDOmapping"));
  const char* access = attribute(object, "accessType");
  const char* reference = attribute(object, "uniqueIDRef");
  const auto parameter = reference == nullptr ? parameters_.end() : parameters_.find(reference);
  if (reference != nullptr && parameter == parameters_.end()) {
    report_.warning(document_.place(object, "uniqueIDRef"),
                    "uniqueIDRef: there is no parameter " + eds::quote(reference));
  }
  if (access == nullptr && parameter != parameters_.end()) {
    const char* of_parameter = attribute(parameter->second, "access");
    section.add(
        "AccessType",
        with_direction(access_of_parameter(of_parameter == nullptr ? kDefaultAccess : of_parameter),
                       mapping),
        document_.place(parameter->second, "access"));
  } else if (access != nullptr) {
    section.add("AccessType", with_direction(eds::lower(access), mapping),
                document_.place(object, "accessType"));
  }
  if (parameter != parameters_.end()) {
    add_parameter(section, parameter->second);
  }
}

void ObjectReader::add_parameter(Sections::Builder& section, pugi::xml_node parameter) {
  const auto value_of = [&](pugi::xml_node node, std::string_view key) {
    section.add(key, attribute(node, "value"), document_.place(node, "value"));
  };
  section.add("ParameterName", text_of(parameter), document_.place(parameter));
  // A value for people is (value + offset) * multiplier (CiA 311).
  section.add("XddOffset", attribute(parameter, "offset"), document_.place(parameter, "offset"));
  section.add("XddMultiplier", attribute(parameter, "multiplier"),
              document_.place(parameter, "multiplier"));
  for (const pugi::xml_node node : parameter.children()) {
    const std::string_view name = local_name(node);
    if (const char* type = data_type(name)) {
      section.add("DataType", type, document_.place(node));
    } else if (name == "defaultValue") {
      value_of(node, "DefaultValue");
    } else if (name == "actualValue") {
      value_of(node, "ParameterValue");
    } else if (name == "unit") {
      section.add("XddUnit", text_of(node), document_.place(node));
    } else if (name == "denotation") {
      section.add("Denotation", text_of(node), document_.place(node));
    } else if (name == "allowedValues") {
      const pugi::xml_node range = child(node, "range");
      value_of(child(range, "minValue"), "LowLimit");
      value_of(child(range, "maxValue"), "HighLimit");
    }
  }
}

}  // namespace linegate::xdd
