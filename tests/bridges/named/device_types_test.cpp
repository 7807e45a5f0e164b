// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/device_types.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/named/idl_text.h"

#include "tests/bridges/named/layouts.h"

namespace linegate::named {
namespace {

using image::Direction;
using od::DataType;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

DeviceType only_type(const image::Layout& layout) {
  DeviceTypes made = device_types("press", layout);
  EXPECT_THAT(made.collisions, IsEmpty());
  EXPECT_EQ(made.types.size(), 1U);
  return made.types.empty() ? DeviceType{} : made.types[0];
}

struct FormRow {
  DataType type;
  std::uint16_t bits;
  Form form;
  Reading reading;
  std::uint16_t length;
};

// Each CiA type with its own size, and with other numbers of bits in the PDO.
constexpr FormRow kForms[] = {
    {DataType::boolean, 1, Form::boolean, Reading::bits, 0},
    {DataType::boolean, 8, Form::uint8, Reading::bits, 0},
    {DataType::integer8, 8, Form::int8, Reading::signed_bits, 0},
    {DataType::integer16, 16, Form::int16, Reading::signed_bits, 0},
    {DataType::integer24, 24, Form::int32, Reading::signed_bits, 0},
    {DataType::integer32, 32, Form::int32, Reading::signed_bits, 0},
    {DataType::integer40, 40, Form::int64, Reading::signed_bits, 0},
    {DataType::integer48, 48, Form::int64, Reading::signed_bits, 0},
    {DataType::integer56, 56, Form::int64, Reading::signed_bits, 0},
    {DataType::integer64, 64, Form::int64, Reading::signed_bits, 0},
    {DataType::integer16, 12, Form::int16, Reading::signed_bits, 0},
    {DataType::integer16, 32, Form::uint32, Reading::bits, 0},
    {DataType::unsigned8, 8, Form::uint8, Reading::bits, 0},
    {DataType::unsigned8, 3, Form::uint8, Reading::bits, 0},
    {DataType::unsigned16, 16, Form::uint16, Reading::bits, 0},
    {DataType::unsigned24, 24, Form::uint32, Reading::bits, 0},
    {DataType::unsigned32, 32, Form::uint32, Reading::bits, 0},
    {DataType::unsigned40, 40, Form::uint64, Reading::bits, 0},
    {DataType::unsigned48, 48, Form::uint64, Reading::bits, 0},
    {DataType::unsigned56, 56, Form::uint64, Reading::bits, 0},
    {DataType::unsigned64, 64, Form::uint64, Reading::bits, 0},
    {DataType::real32, 32, Form::float32, Reading::bits, 0},
    {DataType::real32, 16, Form::uint16, Reading::bits, 0},
    {DataType::real64, 64, Form::float64, Reading::bits, 0},
    {DataType::visible_string, 64, Form::text, Reading::characters, 16},
    {DataType::visible_string, 12, Form::octets, Reading::bits, 2},
    {DataType::octet_string, 64, Form::octets, Reading::bits, 8},
    {DataType::octet_string, 8, Form::octets, Reading::bits, 1},
    {DataType::unicode_string, 64, Form::text, Reading::utf16, 12},
    {DataType::unicode_string, 8, Form::octets, Reading::bits, 1},
    {DataType::time_of_day, 48, Form::int64, Reading::time_of_day, 0},
    {DataType::time_difference, 48, Form::int64, Reading::duration, 0},
    {DataType::time_of_day, 32, Form::uint32, Reading::bits, 0},
    {DataType::domain, 64, Form::octets, Reading::bits, 8},
    {DataType::none, 16, Form::uint16, Reading::bits, 0},
    {DataType::none, 40, Form::uint64, Reading::bits, 0},
    {DataType::none, 128, Form::octets, Reading::bits, 16},
};

TEST(DeviceTypes, EachCiaTypeHasItsForm) {
  for (const FormRow& row : kForms) {
    const DeviceType type = only_type(layout_of({{"ram.A", row.type, row.bits}}));
    ASSERT_EQ(type.members.size(), 1U);
    const Member& member = type.members[0];
    const std::string of = std::string(od::name(row.type)) + ' ' + std::to_string(row.bits);
    EXPECT_EQ(member.form, row.form) << of;
    EXPECT_EQ(member.reading, row.reading) << of;
    EXPECT_EQ(member.length, row.length) << of;
  }
}

TEST(DeviceTypes, EachDeviceHasAType) {
  image::Layout layout = layout_of({{"ram.Status", DataType::unsigned16, 16, 5, 1},
                                    {"axis-2.Position", DataType::integer32, 32, 6, 1},
                                    {"ram.Level 1", DataType::integer8, 8, 5, 3}});
  const DeviceTypes made = device_types("press", layout);
  EXPECT_THAT(made.collisions, IsEmpty());
  ASSERT_EQ(made.types.size(), 2U);
  const DeviceType& ram = made.types[0];
  EXPECT_EQ(ram.device, "ram");
  EXPECT_EQ(ram.node, 5);
  EXPECT_EQ(ram.topic(), "plant/press/ram/inputs");
  EXPECT_THAT(ram.type_name(), testing::MatchesRegex("plant::press_ram_inputs_[0-9a-f]+"));
  EXPECT_EQ(ram.name.size(), std::string("press_ram_inputs_0123456789abcdef").size());
  EXPECT_THAT(ram.pdos, ElementsAre(1, 3));
  ASSERT_EQ(ram.members.size(), 2U);
  EXPECT_EQ(ram.members[1].identifier, "Level_1");
  EXPECT_EQ(ram.members[1].entry, 2U);
  EXPECT_EQ(made.types[1].topic(), "plant/press/axis-2/inputs");
  EXPECT_THAT(made.types[1].name, testing::StartsWith("press_axis_2_inputs_"));
}

TEST(DeviceTypes, NamesOfLinesAndDevicesMakeIdentifiers) {
  const auto name_of = [](const std::string& line, const std::string& device) {
    auto made = device_types(line, layout_of({{device + ".A", DataType::boolean, 1}}));
    EXPECT_EQ(made.types.size(), 1U);
    const std::string& name = made.types.at(0).name;
    return name.substr(0, name.size() - 16);
  };
  EXPECT_EQ(name_of("2", "class"), "n2_class_inputs_");
  EXPECT_EQ(name_of("long", "--"), "long_n_inputs_");
  EXPECT_EQ(name_of("a_b", "c-d_"), "a_b_c_d_inputs_");
}

// Members have the values of PDOs. A reader that knows another scale must not match.
TEST(DeviceTypes, AMemberSaysWhatItsValueMeans) {
  const auto type_with = [](const od::Scaling& scaling, std::optional<double> high) {
    image::Layout layout = layout_of({{"ram.Pressure", DataType::unsigned16, 16, 5, 1}});
    layout.entries[0].scaling = scaling;
    layout.entries[0].low = 0;
    layout.entries[0].high = high;
    return only_type(layout);
  };
  const od::Scaling bar{.unit = "bar", .scale = 0.1, .offset = -40};
  const DeviceType type = type_with(bar, 250);
  EXPECT_EQ(type.members[0].form, Form::uint16);
  EXPECT_THAT(idl_text(std::span(&type, 1)),
              HasSubstr("  unsigned short Pressure;  // 2000:00 UNSIGNED16, PDO 1: Pressure; raw * "
                        "0.1 - 40, in bar, 0 to 250\n"));
  EXPECT_EQ(type_with(bar, 240).name, type.name) << "limits do not change the meaning";
  EXPECT_NE(type_with({.unit = "bar", .scale = 0.2, .offset = -40}, 250).name, type.name);
  EXPECT_NE(type_with({.unit = "bar", .scale = 0.1, .offset = -41}, 250).name, type.name);
  EXPECT_NE(type_with({.unit = "psi", .scale = 0.1, .offset = -40}, 250).name, type.name);
  EXPECT_NE(type_with({}, 250).name, type.name);
}

// The hash is that of everything a reader must know, and of nothing else.
TEST(DeviceTypes, TheNameOfATypeChangesWithItsLayoutAlone) {
  const std::vector<TestEntry> entries = {{"ram.Status", DataType::unsigned16, 16, 5, 1},
                                          {"ram.Level", DataType::integer8, 8, 5, 2}};
  const std::string name = only_type(layout_of(entries)).name;

  std::vector<TestEntry> other = entries;
  other.insert(other.begin(), {"axis.Position", DataType::integer32, 32, 4, 1});
  other.push_back({"valve.Open", DataType::boolean, 1, 7, 1});
  const DeviceTypes beside = device_types("press", layout_of(other));
  ASSERT_EQ(beside.types.size(), 3U);
  EXPECT_EQ(beside.types[1].name, name);

  const auto changed = [&](auto change) {
    std::vector<TestEntry> now = entries;
    change(now);
    return only_type(layout_of(now)).name;
  };
  EXPECT_NE(changed([](auto& e) { e[0].name = "ram.State"; }), name);
  EXPECT_NE(changed([](auto& e) { e[0].type = DataType::integer16; }), name);
  EXPECT_NE(changed([](auto& e) { e[0].bits = 15; }), name);
  EXPECT_NE(changed([](auto& e) { e[0].pdo = 2; }), name);
  EXPECT_NE(changed([](auto& e) { e[0].index = 0x2001; }), name);
  EXPECT_NE(changed([](auto& e) { e[0].sub = 1; }), name);
  EXPECT_NE(changed([](auto& e) { e.pop_back(); }), name);
  EXPECT_NE(changed([](auto& e) { std::swap(e[0], e[1]); }), name);
  EXPECT_EQ(changed([](auto& e) { e[0].name = "ram.Status!"; }), name);
  EXPECT_NE(device_types("hall", layout_of(entries)).types.at(0).name.substr(5), name.substr(6));
  image::Layout outputs = layout_of(entries);
  outputs.direction = Direction::outputs;
  EXPECT_THAT(only_type(outputs).name, HasSubstr("_outputs_"));
}

TEST(DeviceTypes, ACollisionIsReportedAndHasAWayOut) {
  const image::Layout layout = layout_of({{"ram.Level 1", DataType::integer8, 8},
                                          {"ram.LEVEL-1", DataType::integer8, 8},
                                          {"ram.\xC3\xBC", DataType::integer8, 8},
                                          {"axis.Level 1", DataType::integer8, 8, 6}});
  const DeviceTypes made = device_types("press", layout);
  EXPECT_THAT(
      made.collisions,
      ElementsAre("inputs of line press: \"ram.LEVEL-1\" and \"ram.Level 1\" make the same "
                  "identifier LEVEL_1: give one of them an alias",
                  "inputs of line press: \"ram.\xC3\xBC\" makes no identifier: give it an alias"));
  ASSERT_EQ(made.types.size(), 1U);
  EXPECT_EQ(made.types[0].device, "axis");

  const std::vector<Alias> aliases = {{Direction::inputs, "ram.LEVEL-1", "Level_2"},
                                      {Direction::outputs, "ram.Level 1", "Wrong"},
                                      {Direction::inputs, "ram.\xC3\xBC", "ue"}};
  const DeviceTypes named = device_types("press", layout, aliases);
  EXPECT_THAT(named.collisions, IsEmpty());
  ASSERT_EQ(named.types.size(), 2U);
  EXPECT_EQ(named.types[0].members[0].identifier, "Level_1");
  EXPECT_EQ(named.types[0].members[1].identifier, "Level_2");
  EXPECT_EQ(named.types[0].members[2].identifier, "ue");
}

TEST(DeviceTypes, ACollisionNamesAnEntryAsItIsWritten) {
  const auto complaint = [](const std::string& name) {
    const DeviceTypes made = device_types("press", layout_of({{name, DataType::integer8, 8}}));
    return made.collisions.empty() ? std::string() : made.collisions.front();
  };
  EXPECT_THAT(complaint("ram.\xCF\x80 \xE2\x82\xAC \xF0\x9D\x84\x9E"),
              HasSubstr("\"ram.\xCF\x80 \xE2\x82\xAC \xF0\x9D\x84\x9E\" makes no"));
  // Escape, DEL, CSI (C1); an octet that continues nothing, an overlong form, an end that is cut
  EXPECT_THAT(complaint("ram.\x1B\x7F\xC2\x9B"), HasSubstr("\"ram.???\" makes no"));
  EXPECT_THAT(complaint("ram.\x80\xC0\xAF\xE2\x82"), HasSubstr("\"ram.?????\" makes no"));
}

// An object of the own node is "own.NAME"; a device may be called so, too.
TEST(DeviceTypes, TwoNodesWithOneNameCollide) {
  const image::Layout layout =
      layout_of({{"own.A", DataType::boolean, 1, 5, 1}, {"own.B", DataType::boolean, 1, 127, 0}});
  EXPECT_THAT(device_types("press", layout).collisions,
              ElementsAre("inputs of line press: \"own.B\" is of node 127, and node 5 has the name "
                          "own, too: give it another name"));
}

TEST(IdlText, OfNoTypesHasNoModule) {
  EXPECT_THAT(idl_text({}), Not(HasSubstr("module")));
}

// With INPUTS and OUTPUTS for the names of the types.
constexpr const char* kInputsAndOutputs = R"(
// plant/press/ram/inputs

@final struct INPUTS_values {
  unsigned short Status;  // 6041:00 UNSIGNED16, PDO 1: Status
  string<8> Text;  // 2000:01 VISIBLE_STRING, 32 bits, PDO 2: Text ?
  octet Own[3];  // 2000:02 OCTET_STRING, 24 bits: Own
};

@final struct INPUTS_valid {
  boolean Status;
  boolean Text;
  boolean Own;
};

@final struct INPUTS_received {
  long long pdo1;
  long long pdo2;
};

@final struct INPUTS {
  @key string<64> gateway;
  @key string<64> line;
  unsigned long long incarnation;  // random for each start of the gateway
  unsigned long long sequence_number;  // 1, 2, ...: a gap means lost samples
  long long time;  // acquisition of the process image
  octet clock;  // ClockQuality of linegate.idl
  INPUTS_received received;  // last reception of each PDO of the device
  INPUTS_valid valid;  // received from a device that is present
  INPUTS_values values;  // 0 or empty unless valid
};

// plant/press/ram/outputs

@final struct OUTPUTS_values {
  unsigned short Status;  // 6041:00 UNSIGNED16, PDO 1: Status
};

@final struct OUTPUTS_valid {
  boolean Status;
};

@final struct OUTPUTS_known {
  boolean Status;
};

@final struct OUTPUTS_waits {
  octet Status;
};

@final struct OUTPUTS_sent {
  long long pdo1;
};

@final struct OUTPUTS {
  @key string<64> gateway;
  @key string<64> line;
  unsigned long long incarnation;  // random for each start of the gateway
  unsigned long long sequence_number;  // 1, 2, ...: a gap means lost samples
  long long time;  // acquisition of the process image
  octet clock;  // ClockQuality of linegate.idl
  OUTPUTS_sent sent;  // last transmission of each PDO to the device
  OUTPUTS_valid valid;  // transmitted since the device was started
  OUTPUTS_known known;  // written, or has a default
  OUTPUTS_waits waits;  // 0 if valid, else OutputWait of linegate.idl + 1
  OUTPUTS_values values;  // 0 or empty unless known
};

};
)";

TEST(IdlText, OfAnInputAndAnOutput) {
  image::Layout layout = layout_of({{"ram.Status", DataType::unsigned16, 16, 5, 1, 0x6041, 0},
                                    {"ram.Text \\", DataType::visible_string, 32, 5, 2, 0x2000, 1},
                                    {"ram.Own", DataType::octet_string, 24, 5, 0, 0x2000, 2}});
  const DeviceType inputs = only_type(layout);
  layout.direction = Direction::outputs;
  layout.entries.resize(1);
  const DeviceType outputs = only_type(layout);
  const std::string text = idl_text(std::vector{inputs, outputs});
  const std::string begin = "\nmodule plant {\n";
  ASSERT_THAT(text, HasSubstr(begin));
  std::string expected = kInputsAndOutputs;
  const auto put = [&expected](const std::string& word, const std::string& name) {
    for (std::size_t at = 0; (at = expected.find(word, at)) != std::string::npos;) {
      expected.replace(at, word.size(), name);
      at += name.size();
    }
  };
  put("INPUTS", inputs.name);
  put("OUTPUTS", outputs.name);
  EXPECT_EQ(text.substr(text.find(begin) + begin.size()), expected);
}

}  // namespace
}  // namespace linegate::named
