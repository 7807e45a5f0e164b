// SPDX-License-Identifier: Apache-2.0
// The JSON Schema for editors and the loader accept the same keys.
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "gateway/config/plant.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

const std::string kRepository = paths::in_repository("");

YAML::Node load_schema() {
  return YAML::LoadFile(kRepository + "deploy/plant.schema.json");  // JSON is YAML
}

// Returns an undefined node if there is no such key. A plain operator[] would add the key.
YAML::Node member(const YAML::Node& node, const std::string& key) {
  if (node.IsMap()) {
    for (const auto& pair : node) {
      if (pair.first.Scalar() == key) {
        return pair.second;
      }
    }
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

class Walker {
 public:
  explicit Walker(const YAML::Node& schema) : root_(schema) {}

  // Collects the keys of the document that the schema does not have.
  void walk(const YAML::Node& document, const YAML::Node& schema, const std::string& path) {
    if (document.IsSequence()) {
      for (const auto& element : document) {
        walk(element, resolve(member(schema, "items"), element), path + "[]");
      }
    } else if (document.IsMap()) {
      for (const auto& pair : document) {
        const std::string key = pair.first.Scalar();
        const YAML::Node known = find(schema, key);
        if (!known.IsDefined()) {
          unknown.push_back(path + "/" + key);
          continue;
        }
        walk(pair.second, resolve(known, pair.second), path + "/" + key);
      }
    }
  }

  std::vector<std::string> unknown;

 private:
  YAML::Node find(const YAML::Node& schema, const std::string& key) const {
    const YAML::Node property = member(member(schema, "properties"), key);
    if (property.IsDefined()) {
      return property;
    }
    const YAML::Node patterns = member(schema, "patternProperties");
    if (patterns.IsMap()) {
      return patterns.begin()->second;
    }
    const YAML::Node others = member(schema, "additionalProperties");
    return others.IsMap() ? others : YAML::Node(YAML::NodeType::Undefined);
  }

  // Follows $ref. Of several forms, takes the one for mappings if the document is a mapping.
  YAML::Node resolve(const YAML::Node& schema, const YAML::Node& document) const {
    const YAML::Node reference = member(schema, "$ref");
    if (reference.IsDefined()) {
      const std::string text = reference.Scalar();
      return resolve(member(member(root_, "$defs"), text.substr(text.rfind('/') + 1)), document);
    }
    const YAML::Node forms = member(schema, "anyOf");
    if (forms.IsSequence() && document.IsMap()) {
      for (const auto& form : forms) {
        const YAML::Node resolved = resolve(form, document);
        if (member(resolved, "properties").IsDefined()) {
          return resolved;
        }
      }
    }
    return schema;
  }

  YAML::Node root_;
};

TEST(Schema, KnowsEveryKeyOfTheSamplePlants) {
  const YAML::Node schema = load_schema();
  for (const char* name :
       {"below-a-plc.yaml", "demo.yaml", "demo-fd.yaml", "slave.yaml", "vcan.yaml"}) {
    Walker walker(schema);
    walker.walk(YAML::LoadFile(kRepository + "deploy/plants/" + name), schema, "");
    EXPECT_EQ(walker.unknown, std::vector<std::string>{}) << name;
  }
}

// The mapping among the forms of a key, or an undefined node.
YAML::Node mapping_of(const YAML::Node& key) {
  if (member(key, "properties").IsDefined()) {
    return key;
  }
  for (const auto& form : member(key, "anyOf")) {
    if (member(form, "properties").IsDefined()) {
      return form;
    }
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

// Each key of the definition with a value of a wrong type. mappings: a key that may be a mapping
// has one with each of its keys, the others are left out.
std::string keys_of(const YAML::Node& definition, bool mappings = false) {
  std::string text;
  for (const auto& pair : member(definition, "properties")) {
    const YAML::Node mapping = mapping_of(pair.second);
    if (mappings && !mapping.IsDefined()) {
      continue;
    }
    text += (text.empty() ? "" : ", ") + pair.first.Scalar() + ": " +
            (mappings ? keys_of(mapping) : "[1]");
  }
  return "{" + text + "}";
}

// The loader reports a key that only the schema has as "unknown key", and a value of a wrong type
// with another message.
void expect_known(const std::string& plant, std::size_t findings) {
  const auto loaded = read(plant, kRepository + "plant.yaml");
  EXPECT_FALSE(loaded.ok());
  EXPECT_GE(loaded.diagnostics.size(), findings) << "every key is reported";
  for (const auto& diagnostic : loaded.diagnostics) {
    EXPECT_EQ(diagnostic.text.find("unknown key"), std::string::npos) << to_string(diagnostic);
  }
}

TEST(Schema, HasNoKeyTheLoaderDoesNotKnow) {
  const YAML::Node definitions = member(load_schema(), "$defs");
  const std::string line = keys_of(member(definitions, "line"));
  const std::string node = keys_of(member(definitions, "node"));
  const std::string device = keys_of(member(definitions, "device"));
  const std::string binding = keys_of(member(definitions, "binding"));
  const std::string pdo = keys_of(member(definitions, "pdo"));
  const std::string group = keys_of(member(definitions, "group"));
  const std::string executor = keys_of(member(definitions, "executor"));
  const std::string routing = keys_of(member(definitions, "routing"));
  const std::string route = keys_of(member(definitions, "route"));
  const std::string enter = keys_of(member(definitions, "enter"));
  const std::string forwarding = keys_of(member(definitions, "forwarding"));
  const std::string own_pdo = keys_of(member(definitions, "own_pdo"));
  const std::string text =
      "schema: 1\nexecutors: [" + executor + "]\nforward: [" + forwarding +
      "]\nrouting: " + routing + "\nroutes: [" + route + "]\nlines:\n  - " + line +
      "\n  - name: b\n    interface: 'simulated:'\n    enter: [" + enter +
      "]\n    own_pdos: {tpdo9: " + own_pdo + "}\n    outputs: {groups: [" + group +
      "]}\n    nodes:\n      - " + node +
      "\n      - {id: 5, eds: bridges/sim/eds/drive.eds, pdos: {tpdo1: " + pdo + "}}\n" +
      "  - name: c\n    interface: 'simulated:'\n    role: device\n    devices:\n      - " +
      device + "\n      - {id: 5, bind: {\"6000:1\": " + binding + "}}\n";
  expect_known(text, 21);
}

TEST(Schema, HasNoKeyOfAMappingTheLoaderDoesNotKnow) {
  const YAML::Node schema = load_schema();
  const YAML::Node definitions = member(schema, "$defs");
  const YAML::Node top = member(schema, "properties");
  const std::string own_object = keys_of(member(definitions, "own_object"));
  expect_known("schema: 1\ngateway: " + keys_of(member(top, "gateway")) + "\ndds: " +
                   keys_of(member(top, "dds")) + "\njournal: " + keys_of(member(top, "journal")) +
                   "\nlines:\n  - " + keys_of(member(definitions, "line"), true) +
                   "\n  - name: b\n    interface: 'simulated:'\n    own_objects: {\"2000:1\": " +
                   own_object + "}\n    nodes:\n      - " +
                   keys_of(member(definitions, "node"), true) + "\n",
               21);
}

// Whether the loader refuses the value of a key in this plant because of its range, "1 to 127" or
// "1..127".
bool refuses_beyond_range(const std::string& plant, const std::string& lowest,
                          const std::string& highest, std::string& report) {
  bool found = false;
  for (const Diagnostic& diagnostic : read(plant, kRepository + "plant.yaml").diagnostics) {
    found = found ||
            diagnostic.text.find(" " + lowest + " to " + highest + ",") != std::string::npos ||
            diagnostic.text.ends_with(" " + lowest + ".." + highest);
    report += to_string(diagnostic) + '\n';
  }
  return found;
}

// before and after: a plant around a key of the definition.
void expect_ranges(const YAML::Node& definition, const std::string& before,
                   const std::string& after) {
  for (const auto& pair : member(definition, "properties")) {
    const std::string key = pair.first.Scalar();
    const YAML::Node mapping = mapping_of(pair.second);
    const YAML::Node highest = member(pair.second, "maximum");
    if (mapping.IsDefined()) {
      expect_ranges(mapping, before + key + ": {", "}" + after);
    }
    if (!highest.IsDefined()) {
      continue;
    }
    std::string head = before;
    if (const std::size_t given = head.find(key + ": 5, "); given != std::string::npos) {
      head.erase(given, (key + ": 5, ").size());
    }
    const std::string beyond = std::to_string(highest.as<std::uint64_t>() + 1);
    const std::string lowest = member(pair.second, "minimum").Scalar();
    std::string report;
    EXPECT_TRUE(
        refuses_beyond_range(head + key + ": " + beyond + after, lowest, highest.Scalar(), report))
        << key << " has the range " << lowest << ".." << highest.Scalar()
        << " in the schema, so the loader must refuse " << beyond
        << " with this range. It reports:\n"
        << report;
  }
}

// The loader refuses the number above the highest one of each key, and names the same range.
TEST(Schema, HasTheRangesOfTheLoader) {
  const YAML::Node schema = load_schema();
  const std::string lines = "schema: 1\nlines: []\n";
  const std::string line = "schema: 1\nlines: [{name: a, interface: 'simulated:', ";
  const std::string eds = "eds: bridges/sim/eds/drive.eds, ";
  const std::vector<std::array<std::string, 3>> places{
      {"line", line, "}]\n"},
      {"node", line + "nodes: [{id: 5, " + eds, "}]}]\n"},
      {"pdo", line + "nodes: [{id: 5, " + eds + "pdos: {tpdo1: {", "}}}]}]\n"},
      {"own_pdo", line + "own_pdos: {tpdo9: {", "}}}]\n"},
      {"group", line + "outputs: {groups: [{name: g, ", "}]}}]\n"},
      {"device", line + "role: device, devices: [{id: 5, profile: 401, ", "}]}]\n"},
      {"executor", lines + "executors: [{name: x, ", "}]\n"},
      {"route", lines + "routes: [{", "}]\n"},
      {"routing", lines + "routing: {", "}\n"}};
  for (const auto& [name, before, after] : places) {
    const YAML::Node definition = member(member(schema, "$defs"), name);
    ASSERT_TRUE(definition.IsDefined()) << name;
    expect_ranges(definition, before, after);
  }
  expect_ranges(schema, lines, "\n");
}

}  // namespace
}  // namespace linegate::config
