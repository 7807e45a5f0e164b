// SPDX-License-Identifier: Apache-2.0
// `linegate od` against a simulated gateway.
#include "bridges/console/dictionary.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/base/abort_code.h"

#include "tests/bridges/console/command_test.h"

namespace linegate::console {
namespace {

using test::as;

using test::raw;
using testing::HasSubstr;

const LineId kMill{"plant", "mill"};

const line::ReplyData kList = std::vector{line::ListedObject{.address = {0x2100, 1},
                                                             .type = od::DataType::unsigned16,
                                                             .access = od::Access::rww,
                                                             .mappable = true,
                                                             .application = true,
                                                             .name = "Rec",
                                                             .value = raw({5, 0})}};

// A line whose list has one variable.
class Mill : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    listener.on_line(kMill, {.interface_uri = "virtual:mill", .access = "all"});
  }
  Answer call(const LineId& /*id*/, const line::Command& command, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    const auto* const read = std::get_if<line::LocalRead>(&command.request);
    if (read != nullptr && std::holds_alternative<line::ObjectRange>(read->what)) {
      listed = std::get<line::ObjectRange>(read->what);
      Answer out;
      out.reply.data = list;
      return out;
    }
    last = command;
    return answer;
  }

  line::ReplyData list = kList;
  Answer answer;
  line::Command last;
  line::ObjectRange listed;
};

using OwnDictionary = test::CommandTest<Mill>;

TEST_F(OwnDictionary, IsListed) {
  EXPECT_EQ(od_list(context_, "mill", ""), kDone) << err_.str();
  EXPECT_EQ(gateway_.listed.first, 0);
  EXPECT_EQ(gateway_.listed.last, 0xFFFFU);
  EXPECT_THAT(out_.str(), HasSubstr("2100:01"));
  EXPECT_THAT(out_.str(), HasSubstr("UNSIGNED16"));
  EXPECT_THAT(out_.str(), HasSubstr("rww"));
  out_.str("");
  context_.json = true;
  EXPECT_EQ(od_list(context_, "mill", "2100"), kDone);
  EXPECT_EQ(gateway_.listed.first, 0x2100);
  EXPECT_EQ(gateway_.listed.last, 0x2100U);
  EXPECT_EQ(out_.str(),
            R"([{"index":8448,"sub":1,"name":"Rec","type":"UNSIGNED16","access":"rww",)"
            R"("mappable":true,"stored":false,"application":true,"data":"0500","value":"5"}])"
            "\n");
  gateway_.list = raw({0x00, 0x21, 1});  // a reply that does not match the request
  EXPECT_EQ(od_list(context_, "mill", ""), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("the list of objects is damaged"));
  EXPECT_EQ(od_list(context_, "mill", "xyz"), kUsage);
}

TEST_F(OwnDictionary, IsReadAndWrittenByItsTypes) {
  gateway_.answer.reply.data = raw({7, 0});
  EXPECT_EQ(od_read(context_, "mill", "2100", "1"), kDone);
  EXPECT_EQ(out_.str(), "7\n");
  EXPECT_EQ(od_write(context_, "mill", "2100", "1", "300"), kDone);
  EXPECT_EQ(as<line::LocalWrite>(gateway_.last).data, raw({0x2C, 1}));
  EXPECT_FALSE(as<line::LocalWrite>(gateway_.last).as_owner);
  EXPECT_EQ(od_write(context_, "mill", "2100", "1", "301", true), kDone);
  EXPECT_TRUE(as<line::LocalWrite>(gateway_.last).as_owner);
  EXPECT_EQ(od_write(context_, "mill:own", "2100", "1", "302"), kDone) << err_.str();
  EXPECT_EQ(od_write(context_, "mill:all", "2100", "1", "302"), kUsage);
  EXPECT_EQ(od_write(context_, "mill", "2100", "1", "70000"), kUsage);
  EXPECT_EQ(od_write(context_, "mill", "2100", "2", "1"), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("there is no object 2100:02"));
}

TEST_F(OwnDictionary, ObjectsAreCreatedAndRemoved) {
  NewObject object{.index = "2200", .sub = "1", .type = "i16", .name = "Up", .value = "-2"};
  object.high = "9";
  object.offset = "6";
  object.mappable = true;
  EXPECT_EQ(od_create(context_, "mill", object), kDone) << err_.str();
  const auto created = std::get<line::OwnObject>(as<line::ObjectCreate>(gateway_.last).what);
  EXPECT_EQ(created.index, 0x2200);
  EXPECT_TRUE(created.in_image);
  EXPECT_EQ(created.offset, 6U);
  EXPECT_EQ(created.variable, (od::VariableDescription{.sub = 1,
                                                       .name = "Up",
                                                       .type = od::DataType::integer16,
                                                       .access = od::Access::rw,
                                                       .mappable = true,
                                                       .value = raw({0xFE, 0xFF}),
                                                       .low_limit = {},
                                                       .high_limit = raw({9, 0})}));
  object.value = "40000";
  EXPECT_EQ(od_create(context_, "mill", object), kUsage);
  object.value = "";
  object.access = "all";
  EXPECT_EQ(od_create(context_, "mill", object), kUsage);
  EXPECT_EQ(od_remove(context_, "mill", "2200"), kDone);
  const auto removed = std::get<line::ObjectRemoval>(as<line::ObjectCreate>(gateway_.last).what);
  EXPECT_EQ(removed.index, 0x2200);
  gateway_.answer.reply.error = line::to_error(line::Refusal::unknown_entry);
  gateway_.answer.text = "no such output entry";
  EXPECT_EQ(od_remove(context_, "mill", "2200"), kFailed);
}

TEST_F(OwnDictionary, ANameThatReadsAsAnAddressIsRefused) {
  NewObject object{.index = "2200", .sub = "1", .type = "i16", .name = "6200:1"};
  for (const char* const name : {"6200:1", "0x2000", "0X2000:0x01", "*"}) {
    object.name = name;
    EXPECT_EQ(od_create(context_, "mill", object), kUsage) << name;
    EXPECT_THAT(err_.str(), HasSubstr("reads as")) << name;
    err_.str("");
  }
  object.name = "2100";
  EXPECT_EQ(od_create(context_, "mill", object), kFailed) << "there is that object";
  EXPECT_THAT(err_.str(), HasSubstr("'2100' reads as object 2100:00 in commands"));
  object.name = "2200";
  EXPECT_EQ(od_create(context_, "mill", object), kFailed) << "it is created";
  EXPECT_FALSE(std::holds_alternative<line::ObjectCreate>(gateway_.last.request));
  gateway_.list = std::vector<line::ListedObject>{};
  object.name = "Feed";
  EXPECT_EQ(od_create(context_, "mill", object), kDone) << err_.str();
  EXPECT_EQ(gateway_.listed.first, 0xFEED);
}

}  // namespace
}  // namespace linegate::console
