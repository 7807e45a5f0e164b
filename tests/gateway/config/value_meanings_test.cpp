// SPDX-License-Identifier: Apache-2.0
// `values:`: name, unit, scaling and limits of objects, as the layout of the line has them.
#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/config/plant.h"
#include "stack/line/line.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::string kAnalogEds = paths::in_repository("bridges/sim/eds/analog-io.eds");

Loaded<Plant> plant_of_values(const std::string& values, const std::string& line = "") {
  return read("schema: 1\nlines:\n  - name: press\n    interface: \"simulated:\"\n" + line +
                  "    nodes:\n      - id: 5\n        name: hydraulics\n        eds: " +
                  kAnalogEds + "\n" + values,
              "plant.yaml");
}

std::vector<std::string> meaning_messages(const Loaded<Plant>& loaded) {
  std::vector<std::string> out;
  for (const auto& diagnostic : loaded.diagnostics) {
    out.push_back(std::to_string(diagnostic.line) + ": " + diagnostic.text);
  }
  return out;
}

// The layout of the line once it is made as at the start.
image::Layout direction_of_line(const Loaded<Plant>& loaded, image::Direction direction) {
  EXPECT_THAT(meaning_messages(loaded), IsEmpty());
  const auto made = line::Line::make(loaded.value.value().lines.at(0).config);
  return (*made.value)->layout(direction);
}

image::Entry entry_at(const image::Layout& layout, std::uint16_t index, std::uint8_t sub) {
  const auto found = std::ranges::find_if(layout.entries, [&](const image::Entry& entry) {
    return entry.index == index && entry.sub == sub;
  });
  EXPECT_NE(found, layout.entries.end());
  return found == layout.entries.end() ? image::Entry{} : *found;
}

TEST(ValueMeanings, AreInTheLayout) {
  const auto loaded = plant_of_values(
      "        values:\n"
      "          6401:1: {alias: Pressure, unit: bar, scale: 0.1, offset: -40, low: 0, high: 250}\n"
      "          6411:1: {scale: 0.01, unit: \"%\"}\n",
      "    outputs:\n      defaults: {\"hydraulics.6411:1\": 12.5}\n");
  const image::Layout inputs = direction_of_line(loaded, image::Direction::inputs);
  const image::Entry pressure = entry_at(inputs, 0x6401, 1);
  EXPECT_EQ(pressure.name, "hydraulics.Pressure");
  EXPECT_EQ(pressure.scaling, (od::Scaling{.unit = "bar", .scale = 0.1, .offset = -40}));
  EXPECT_EQ(pressure.low, 0);
  EXPECT_EQ(pressure.high, 250);
  EXPECT_EQ(pressure.access, od::Access::ro);
  EXPECT_EQ(pressure.initial, std::nullopt);
  EXPECT_EQ(pressure.group, std::nullopt);
  const image::Layout outputs = direction_of_line(loaded, image::Direction::outputs);
  const image::Entry valve = entry_at(outputs, 0x6411, 1);
  EXPECT_EQ(valve.scaling, (od::Scaling{.unit = "%", .scale = 0.01, .offset = 0}));
  EXPECT_EQ(valve.initial, 12.5);
  EXPECT_EQ(valve.group, 0);
  EXPECT_EQ(loaded.value->lines.at(0).config.defaults.at(0).value, 1250U);
  const auto plain = plant_of_values("");
  EXPECT_NE(inputs.id, direction_of_line(plain, image::Direction::inputs).id);
  EXPECT_EQ(entry_at(direction_of_line(plain, image::Direction::inputs), 0x6401, 1).scaling,
            od::Scaling{});
}

TEST(ValueMeanings, GroupsAndTimingAreInTheLayout) {
  const auto loaded = plant_of_values(
      "        pdos:\n          tpdo2: {type: event, inhibit: 10ms, event_timer: 500ms}\n",
      "    outputs:\n      groups:\n        - {name: valves, number: 7, entries: "
      "[\"hydraulics.6411:2\"]}\n");
  const image::Entry input = direction_of_line(loaded, image::Direction::inputs).entries.at(0);
  EXPECT_EQ(input.transmission_type, 255);
  EXPECT_EQ(input.inhibit, std::chrono::milliseconds(10));
  EXPECT_EQ(input.event_timer, std::chrono::milliseconds(500));
  const image::Layout outputs = direction_of_line(loaded, image::Direction::outputs);
  EXPECT_EQ(entry_at(outputs, 0x6411, 1).group, std::nullopt);
  EXPECT_EQ(entry_at(outputs, 0x6411, 2).group, 7);
}

TEST(ValueMeanings, ErrorsNameTheirPlace) {
  const auto wrong = [](const std::string& values) {
    return meaning_messages(plant_of_values("        values:\n" + values));
  };
  EXPECT_THAT(wrong("          6401:1: {scale: 0}\n"),
              ElementsAre("10: scale is 0: the value in the unit is raw * scale + offset"));
  EXPECT_THAT(wrong("          6401:1: {scale: .nan}\n"),
              ElementsAre("10: scale: \".nan\" is no finite number such as 0.1"));
  EXPECT_THAT(wrong("          6401:1: {offset: 1e999}\n"),
              ElementsAre("10: offset: \"1e999\" is no finite number such as 0.1"));
  EXPECT_THAT(wrong("          6401:1: {unit: \"\"}\n"),
              ElementsAre("10: expected a value, got \"\""));
  EXPECT_THAT(wrong("          6401:1: {scale: 0.1, low: 5, high: 4}\n"),
              ElementsAre("10: low is above high"));
  EXPECT_THAT(wrong("          6401:1: {scale: 0.1, high: 3276.8}\n"),
              ElementsAre(HasSubstr("high of object 6401:1")));
  EXPECT_THAT(wrong("          1008:0: {unit: bar}\n"),
              ElementsAre(HasSubstr("is VISIBLE_STRING: unit is for integers and reals")));
  EXPECT_THAT(wrong("          6401:99: {unit: bar}\n"),
              ElementsAre(HasSubstr("has no object 6401:99")));
  EXPECT_THAT(wrong("          Pressure: {unit: bar}\n"),
              ElementsAre(HasSubstr("10: expected an object such as 6401:1")));
  EXPECT_THAT(wrong("          6401:1: {units: bar}\n"), ElementsAre(HasSubstr("\"units\"")));
  EXPECT_THAT(wrong("          6401:1: {alias: P}\n          6401:2: {alias: P}\n"),
              ElementsAre("11: \"P\" is the alias of 6401:1 already"));
  EXPECT_THAT(wrong("          6401:1: {alias: \"\"}\n"),
              ElementsAre("10: expected a value, got \"\""));
  EXPECT_THAT(wrong("          6401:1: {unit: bar}\n          6401:01: {unit: mm}\n"),
              testing::Contains(HasSubstr("11: object 6401:01 is there twice")));
  EXPECT_THAT(wrong("          6401:1: {unit: \"" + std::string(33, 'x') + "\"}\n"),
              ElementsAre("10: a unit has 1 to 32 bytes and no control characters"));
  EXPECT_THAT(wrong("          6401:1: {alias: \"" + std::string(65, 'x') + "\"}\n"),
              ElementsAre("10: an alias has 1 to 64 bytes and no control characters"));
  EXPECT_THAT(wrong("          6401:1: {alias: \"a\\tb\"}\n"),
              ElementsAre("10: an alias has 1 to 64 bytes and no control characters"));
}

// `linegate write press hydraulics.6411:2 50` must not write another output.
TEST(ValueMeanings, AnAliasIsNoAddressAndNoNameOfAnotherObject) {
  const auto wrong = [](const std::string& values) {
    return meaning_messages(plant_of_values("        values:\n" + values));
  };
  for (const char* const address : {"6411:2", "6411", "0x6411:02", "face:1", "1:2"}) {
    EXPECT_THAT(wrong("          6411:1: {alias: \"" + std::string(address) + "\"}\n"),
                ElementsAre("10: \"" + std::string(address) +
                            "\" reads as an object, INDEX:SUB in commands: give 6411:1 another "
                            "alias"));
  }
  EXPECT_THAT(wrong("          6411:1: {alias: \"*\"}\n"),
              ElementsAre(HasSubstr("10: \"*\" reads as all objects")));
  for (const char* const name : {"A1", "face"})
    EXPECT_THAT(wrong("          6411:1: {alias: " + std::string(name) + "}\n"), IsEmpty());
  const image::Layout outputs = direction_of_line(plant_of_values(""), image::Direction::outputs);
  const auto name = [&](std::uint8_t sub) {
    return entry_at(outputs, 0x6411, sub).name.substr(std::string("hydraulics.").size());
  };
  const auto loaded =
      plant_of_values("        values:\n          6411:1: {alias: \"" + name(2) + "\"}\n");
  EXPECT_THAT(meaning_messages(loaded),
              ElementsAre("10: \"" + name(2) + "\" is the name of object 6411:02 already"));
  EXPECT_EQ(loaded.diagnostics.at(0).column, 27U);
  EXPECT_THAT(wrong("          6411:1: {alias: \"" + name(1) + "\"}\n"), IsEmpty());
  EXPECT_THAT(wrong("          6411:1: {alias: \"" + name(2) + "\"}\n          6411:2: {alias: \"" +
                    name(1) + "\"}\n"),
              IsEmpty())
      << "they exchange their names";
}

TEST(ValueMeanings, AnOutputHasOneDefault) {
  EXPECT_THAT(meaning_messages(
                  plant_of_values("        values:\n          6411:1: {alias: V, scale: 0.01}\n",
                                  "    outputs:\n      defaults:\n        hydraulics.V: 12.5\n"
                                  "        \"hydraulics.6411:1\": 30\n")),
              ElementsAre("8: \"hydraulics.6411:1\" has a default already, as \"hydraulics.V\""));
}

TEST(ValueMeanings, ADefaultIsInTheUnitAndWithinTheLimits) {
  const std::string values =
      "        values:\n          6411:1: {unit: \"%\", scale: 0.01, low: 0, high: 100}\n";
  const auto with_default = [&](const std::string& value) {
    return meaning_messages(plant_of_values(
        values, "    outputs:\n      defaults: {\"hydraulics.6411:1\": " + value + "}\n"));
  };
  EXPECT_THAT(with_default("99.5"), IsEmpty());
  EXPECT_THAT(with_default("100.5"), ElementsAre(HasSubstr("in its unit and within its limits")));
  EXPECT_THAT(with_default("400"), ElementsAre(HasSubstr("in its unit and within its limits")));
}

TEST(ValueMeanings, ObjectsOfTheOwnNodeHaveThem) {
  const auto loaded =
      plant_of_values("",
                      "    own_objects:\n      2100:1: {name: Level, type: i16, image: "
                      "true, access: rww, unit: mm, scale: 0.5, default: 1.5, low: -10, "
                      "high: 10}\n");
  const image::Entry level =
      entry_at(direction_of_line(loaded, image::Direction::inputs), 0x2100, 1);
  EXPECT_EQ(level.scaling, (od::Scaling{.unit = "mm", .scale = 0.5, .offset = 0}));
  EXPECT_EQ(level.low, -10);
  EXPECT_EQ(level.high, 10);
  EXPECT_EQ(loaded.value->lines.at(0).config.own_objects.at(0).variable.value,
            (std::vector{std::byte{3}, std::byte{0}}));
}

// `linegate write l own.6411:2 50` would write the output with that name, and not the object.
TEST(ValueMeanings, NamesOfOwnObjectsAreNoAddresses) {
  const auto named = [](const std::string& name) {
    return meaning_messages(plant_of_values(
        "", "    own_objects:\n      2100:1: {name: \"" + name + "\", type: i16, image: true}\n"));
  };
  for (const std::string name : {"6411:2", "0x6411:0x02", "2100:1", "2100"}) {
    EXPECT_THAT(named(name), ElementsAre(HasSubstr("\"" + name +
                                                   "\" reads as an object, INDEX:SUB in commands: "
                                                   "give 2100:01 another name")))
        << name;
  }
  EXPECT_THAT(named("*"), ElementsAre(HasSubstr("\"*\" reads as all objects in commands")));
  for (const std::string name : {"Feed", "2101", "Level:1", "a*"}) {
    EXPECT_THAT(named(name), IsEmpty()) << name;
  }
}

}  // namespace
}  // namespace linegate::config
