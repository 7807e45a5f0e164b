// SPDX-License-Identifier: Apache-2.0
// `linegate sdo` against a simulated gateway with device files.
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/console/commands.h"
#include "stack/base/abort_code.h"
#include "stack/line/own_objects.h"

#include "tests/bridges/console/command_test.h"

namespace linegate::console {
namespace {

using test::as;

using testing::HasSubstr;

const LineId kLine{"plant", "press"};

od::DeviceDescription device_file() {
  od::DeviceDescription out;
  out.objects = {
      {.index = 0x1017,
       .name = "Producer heartbeat time",
       .variables = {{.name = "Producer heartbeat time", .type = od::DataType::unsigned16}}},
      {.index = 0x1008,
       .name = "Device name",
       .variables = {{.name = "Device name", .type = od::DataType::visible_string}}},
      {.index = 0x1018,
       .name = "Identity",
       .type = od::ObjectType::record,
       .variables = {{.sub = 0, .name = "Entries", .type = od::DataType::unsigned8},
                     {.sub = 1, .name = "Vendor-ID", .type = od::DataType::unsigned32},
                     {.sub = 2,
                      .name = "Secret",
                      .type = od::DataType::unsigned32,
                      .access = od::Access::wo}}}};
  return out;
}

// Nodes 5 (ram) and 6 (feeder) have a device file. Node 9 is present but not configured.
class GatewayWithFiles : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    LineView view{.interface_uri = "virtual:press", .access = "all"};
    view.state.network_id = 3;
    view.state.node_id = 127;
    view.state.nodes_configured = configured;
    listener.on_line(kLine, view);
    listener.on_node(kLine, {.name = "ram", .state = {.node = 5, .configured = true}});
    listener.on_node(kLine, {.name = "feeder", .state = {.node = 6, .configured = true}});
    listener.on_node(kLine, {.state = {.node = 9, .presence = line::Presence::present}});
    listener.on_node(kLine, {.state = {.node = 11}});
    polls_after_answer += asked.empty() ? 0U : 1U;
    if (sends_meanings && (!layouts_come_late || !asked.empty())) {
      image::Layout inputs{.direction = image::Direction::inputs, .id = 4, .byte_size = 2};
      inputs.entries.push_back({.bit_length = 16,
                                .type = od::DataType::unsigned16,
                                .node = 5,
                                .index = 0x1017,
                                .name = "ram.Period",
                                .scaling = {.unit = "s", .scale = 0.001}});
      listener.on_layout(kLine, inputs);
      image::Layout outputs{.direction = image::Direction::outputs, .id = 5, .byte_size = 1};
      outputs.entries.push_back({.bit_length = 8,
                                 .type = od::DataType::unsigned32,
                                 .node = 5,
                                 .index = 0x1018,
                                 .sub = 1,
                                 .name = "ram.Maker [kg]"});
      listener.on_layout(kLine, outputs);
    }
    if (sends_layout && !asked.empty()) {
      image::Layout layout{.direction = image::Direction::outputs, .id = 3, .byte_size = 1};
      layout.entries.push_back({.bit_length = 8, .node = 6, .name = "feeder.Mode"});
      listener.on_layout(kLine, layout);
    }
  }
  Answer call(const LineId& /*id*/, const line::Command& command, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    Answer out;
    if (const auto* const read = std::get_if<line::LocalRead>(&command.request)) {
      if (read->node == silent) {
        out.reply.error = line::to_error(line::Refusal::timed_out);
        out.text = "no answer";
        return out;
      }
      if (forbidden) {
        out.reply.error = line::to_error(line::Refusal::not_permitted);
        out.text = "not permitted";
        return out;
      }
      if (read->node == 9) {
        out.reply.error = line::to_error(line::Refusal::bad_request);
        return out;
      }
      out.reply.data = line::list_objects(device_file(), std::get<line::ObjectRange>(read->what));
      return out;
    }
    asked.push_back(command);
    if (line::node_of(command) == silent) {
      out.reply.error = to_error(AbortCode::timeout);
      out.text = "SDO protocol timed out";
      return out;
    }
    const auto* const write = std::get_if<line::ObjectWrite>(&command.request);
    const auto* const read = std::get_if<line::SdoRead>(&command.request);
    const auto found = read != nullptr    ? values.find(read->address)
                       : write != nullptr ? values.find(write->address)
                                          : values.end();
    out.reply.data = found == values.end() ? line::ReplyData{} : found->second;
    out.bytes = out.reply.bytes();
    return out;
  }

  std::map<od::Address, line::ReplyData> values{
      {{0x1017, 0}, test::raw({0xF4, 1})},
      {{0x1018, 0}, test::raw({2})},
      {{0x1018, 1}, test::raw({0x47, 0x4C, 0, 0})},
  };
  bool may_receive_layouts() const override { return sends_meanings; }

  std::uint8_t silent = 0;
  bool forbidden = false;
  std::uint8_t configured = 2;
  bool sends_meanings = false;     // publishes layouts in which two objects have a unit
  bool sends_layout = false;       // publishes a layout of the outputs after the first answer
  bool layouts_come_late = false;  // those layouts come after the first answer
  unsigned polls_after_answer = 0;
  std::vector<line::Command> asked;  // the received commands except requests of lists
};

class SdoCommand : public test::CommandTest<GatewayWithFiles> {
 protected:
  int read(const std::string& node, const std::string& index, const std::string& type = "") {
    return sdo_read(context_, node, index, "", type);
  }
  int write(const std::string& node, const std::string& index, const std::string& value,
            const std::string& type = "") {
    return sdo_write(context_, node, index, "", type, value);
  }
};

TEST_F(SdoCommand, ReadTakesTheTypeFromTheDeviceFile) {
  EXPECT_EQ(read("press:ram", "1017:00"), kDone) << err_.str();
  EXPECT_EQ(out_.str(), "500\n");
  out_.str("");
  EXPECT_EQ(read("press:ram", "1017"), kDone);
  EXPECT_EQ(out_.str(), "500\n");
  out_.str("");
  EXPECT_EQ(read("press:ram", "1017", "i8"), kDone) << "a given type takes precedence";
  EXPECT_EQ(out_.str(), "F4 01\n");
  out_.str("");
  EXPECT_EQ(read("press:9", "1017:00"), kDone) << "no device file";
  EXPECT_EQ(out_.str(), "F4 01  (500)\n");
}

TEST_F(SdoCommand, ReadPrintsTheValueOfAnImageEntryInItsUnit) {
  gateway_.sends_meanings = true;
  EXPECT_EQ(read("press:ram", "1017:00"), kDone) << err_.str();
  EXPECT_EQ(out_.str(), "0.5 s  (500)\n");
  out_.str("");
  EXPECT_EQ(read("press:ram", "1017:00", "u16"), kDone);
  EXPECT_EQ(out_.str(), "500\n") << "with a type the value of the object itself";
  out_.str("");
  EXPECT_EQ(read("press:feeder", "1017:00"), kDone);
  EXPECT_EQ(out_.str(), "500\n") << "no PDO carries the object of this node";
  out_.str("");
  EXPECT_EQ(read("press:ram", "1018"), kDone);
  EXPECT_EQ(out_.str(), "1018:00  Entries: 2\n1018:01  Vendor-ID: 19527 kg\n")
      << "a PDO carries a part of its bits, and the unit is in its name";
  context_.json = true;
  out_.str("");
  EXPECT_EQ(read("press:ram", "1017:00"), kDone);
  EXPECT_EQ(
      out_.str(),
      R"({"ok":true,"data":"F401","value":"0.5","raw":"500","unit":"s","image_name":"ram.Period"})"
      "\n");
  out_.str("");
  EXPECT_EQ(read("press:all", "1017:00"), kDone);
  EXPECT_THAT(out_.str(), HasSubstr(R"("value":"0.5","raw":"500","unit":"s")"));
  EXPECT_THAT(out_.str(),
              HasSubstr(R"("node_name":"feeder","ok":true,"data":"F401","value":"500"})"));
  gateway_.silent = 5;
  out_.str("");
  EXPECT_EQ(read("press:ram", "1017:00"), kFailed);
  EXPECT_THAT(out_.str(), HasSubstr(R"("ok":false)"));
}

TEST_F(SdoCommand, AReadWaitsForLayoutsOnlyAfterItsAnswerAndIfTheyCanCome) {
  const auto polls_of = [&](const std::string& node, const std::string& type) {
    gateway_.asked.clear();
    gateway_.polls_after_answer = 0;
    out_.str("");
    EXPECT_EQ(read(node, "1017:00", type), kDone) << err_.str();
    return gateway_.polls_after_answer;
  };
  EXPECT_EQ(polls_of("press:ram", ""), 0U) << "nobody sends layouts";
  EXPECT_EQ(out_.str(), "500\n");
  gateway_.sends_meanings = true;
  gateway_.layouts_come_late = true;
  EXPECT_EQ(polls_of("press:ram", "u16"), 0U) << "the type was given";
  EXPECT_EQ(out_.str(), "500\n");
  EXPECT_EQ(polls_of("press:ram", ""), 1U) << "until they are there";
  EXPECT_EQ(out_.str(), "0.5 s  (500)\n");
  EXPECT_EQ(polls_of("press:all", ""), 1U) << "once for all nodes";
  gateway_.layouts_come_late = false;
  EXPECT_EQ(polls_of("press:ram", ""), 0U) << "they were there before the answer";
  EXPECT_EQ(out_.str(), "0.5 s  (500)\n");
}

TEST_F(SdoCommand, ReadOfAnObjectWithSubIndicesPrintsAllThatCanBeRead) {
  EXPECT_EQ(read("press:ram", "1018"), kDone) << err_.str();
  EXPECT_EQ(out_.str(), "1018:00  Entries: 2\n1018:01  Vendor-ID: 19527\n");
  context_.json = true;
  out_.str("");
  EXPECT_EQ(read("press:ram", "1018"), kDone);
  EXPECT_THAT(out_.str(), HasSubstr(R"("object":"1018:01","name":"Vendor-ID","type":"UNSIGNED32",)"
                                    R"("ok":true,"data":"474C0000","value":"19527"})"));
  EXPECT_EQ(read("press:ram", "1018", "u32"), kUsage);
  EXPECT_THAT(err_.str(), HasSubstr("1018:01  Vendor-ID"));
}

TEST_F(SdoCommand, WriteTakesTheTypeFromTheDeviceFileAndRefusesWhatDoesNotFit) {
  EXPECT_EQ(write("press:ram", "1017:00", "500"), kDone) << err_.str();
  ASSERT_EQ(gateway_.asked.size(), 1U);
  EXPECT_EQ(as<line::SdoWrite>(gateway_.asked[0]).data, test::raw({0xF4, 1}));
  EXPECT_EQ(write("press:ram", "1017", "70000"), kUsage);
  EXPECT_THAT(err_.str(), HasSubstr("'70000' is not a value of 1017:00 Producer heartbeat time, "
                                    "which is UNSIGNED16"));
  err_.str("");
  EXPECT_EQ(write("press:9", "1017:00", "500"), kUsage);
  EXPECT_THAT(err_.str(), HasSubstr("give it, as in 1017:00 u16 500"));
  err_.str("");
  EXPECT_EQ(write("press:ram", "1018", "1"), kUsage);
  EXPECT_THAT(err_.str(), HasSubstr("object 1018h has sub-indices"));
  EXPECT_EQ(gateway_.asked.size(), 1U) << "nothing more was written";
  gateway_.values[{0x1017, 0}] = line::WrittenBySdo{};
  EXPECT_EQ(object_write(context_, "press:ram", "1017:00", "", "", "500", false), kDone);
  EXPECT_EQ(as<line::ObjectWrite>(gateway_.asked.back()).data, test::raw({0xF4, 1}));
}

TEST_F(SdoCommand, AllIsEachNodeWithOneResultEach) {
  gateway_.silent = 6;
  EXPECT_EQ(read("press:all", "1017:00"), kFailed) << "one node did not answer";
  EXPECT_EQ(out_.str(), "5 (ram): 500\n9: F4 01  (500)\n");
  EXPECT_EQ(err_.str(), "6 (feeder): SDO protocol timed out\n");
  gateway_.silent = 0;
  context_.json = true;
  out_.str("");
  EXPECT_EQ(read("press:all", "1017:00"), kDone);
  EXPECT_THAT(out_.str(),
              HasSubstr(R"([{"object":"1017:00","node":5,"node_name":"ram","ok":true)"));
  EXPECT_THAT(out_.str(), HasSubstr(R"("node":9)"));
  gateway_.asked.clear();
  context_.json = false;
  out_.str("");
  EXPECT_EQ(write("press:all", "1017:00", "500", "u16"), kDone);
  ASSERT_EQ(gateway_.asked.size(), 3U);
  EXPECT_EQ(line::node_of(gateway_.asked[1]), 6);
  EXPECT_EQ(out_.str(), "5 (ram): done\n6 (feeder): done\n9: done\n");
}

TEST_F(SdoCommand, AValueThatAPdoWaitsForHasItsNameThoughTheLayoutComesLate) {
  gateway_.values[{0x1017, 0}] = line::WrittenByPdo{3, line::PdoWait::values, {0}};
  gateway_.sends_layout = true;
  for (const bool json : {false, true}) {
    gateway_.asked.clear();
    context_.json = json;
    out_.str("");
    EXPECT_EQ(object_write(context_, "press:6", "1017:00", "", "u16", "500", false), kHeldBack);
    EXPECT_THAT(out_.str(), HasSubstr("values that were never written: feeder.Mode"));
  }
}

TEST_F(SdoCommand, AWriteToAllBeginsWhenTheValueOfEachNodeIsKnown) {
  for (const bool by_pdo : {false, true}) {
    context_.json = by_pdo;
    err_.str("");
    EXPECT_EQ(by_pdo ? object_write(context_, "press:all", "1017:00", "", "", "500", false)
                     : write("press:all", "1017:00", "500"),
              kUsage);
    EXPECT_TRUE(gateway_.asked.empty()) << "node 9 has no device file to take a type from";
    EXPECT_EQ(out_.str(), "");
    EXPECT_EQ(err_.str(),
              "9: the data type of 1017:00 is in no device file that the gateway has: give it, as "
              "in 1017:00 u16 500\nnothing was written to any node\n");
  }
}

TEST_F(SdoCommand, AReadOfAllNamesTheNodeWhoseObjectNeedsASubIndex) {
  context_.json = true;
  EXPECT_EQ(read("press:all", "1018", "u32"), kUsage);
  EXPECT_TRUE(gateway_.asked.empty());
  EXPECT_THAT(err_.str(), HasSubstr("5 (ram): object 1018h has sub-indices"));
}

TEST_F(SdoCommand, AllAreNotTheNodesThatHappenToBeReceived) {
  gateway_.configured = 12;
  EXPECT_EQ(write("press:all", "1017:00", "500", "u16"), kFailed);
  EXPECT_TRUE(gateway_.asked.empty());
  EXPECT_EQ(err_.str(),
            "nothing was written: 2 of 12 nodes of press were received; use a longer --wait, or "
            "name a node\n");
  err_.str("");
  EXPECT_EQ(read("press:all", "1017:00"), kIncomplete);
  EXPECT_EQ(out_.str(), "5 (ram): 500\n6 (feeder): 500\n9: F4 01  (500)\n");
  EXPECT_EQ(err_.str(), "incomplete: 2 of 12 nodes of press were received\n");
  gateway_.silent = 6;
  EXPECT_EQ(read("press:all", "1017:00"), kFailed)
      << "a node that refused outweighs one that is silent";
}

TEST_F(SdoCommand, AGatewayThatDoesNotAnswerIsNotADeviceFileWithoutTheObject) {
  gateway_.silent = 6;
  EXPECT_EQ(write("press:6", "1017:00", "500"), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("is not known, no answer: give it"));
}

TEST_F(SdoCommand, ARefusalOfTheQuestionForTheTypeIsThatOfTheWrite) {
  gateway_.forbidden = true;
  EXPECT_EQ(write("press:6", "1017:00", "500"), kFailed);
  EXPECT_EQ(err_.str(), "not permitted\n");
}

TEST_F(SdoCommand, AnEmptyValueIsRefusedWithAReason) {
  for (const std::string type : {"vs", "os", ""}) {
    err_.str("");
    EXPECT_EQ(write("press:5", "1008:00", "", type), kUsage);
    EXPECT_EQ(err_.str(), "there is no value to write\n") << type;
    EXPECT_EQ(object_write(context_, "press:5", "1008:00", "", type, "", false), kUsage);
  }
  EXPECT_TRUE(gateway_.asked.empty());
}

TEST_F(SdoCommand, AllOfANetworkThatIsNoLineIsRefused) {
  EXPECT_EQ(sdo_read(context_, "12:all", "1017:00", "", "", "press"), kFailed);
  EXPECT_TRUE(gateway_.asked.empty());
}

TEST_F(SdoCommand, AWriteByPdoThatSendsNothingHasAStatusOfItsOwn) {
  const auto held = [&](line::PdoWait wait) {
    gateway_.values[{0x1017, 0}] = line::WrittenByPdo{3, wait};
    return object_write(context_, "press:ram", "1017:00", "", "u16", "5", false);
  };
  EXPECT_EQ(held(line::PdoWait::values), kHeldBack);
  EXPECT_EQ(held(line::PdoWait::operational), kHeldBack);
  EXPECT_EQ(held(line::PdoWait::update_time), kDone) << "it is sent when the update time expires";
  EXPECT_EQ(held(line::PdoWait::trigger), kDone) << "expected with --keep";
  EXPECT_EQ(held(line::PdoWait::turn), kHeldBack);
  EXPECT_EQ(held(line::PdoWait::bus), kHeldBack);
  EXPECT_EQ(held(line::PdoWait::none), kDone);
}

}  // namespace
}  // namespace linegate::console
