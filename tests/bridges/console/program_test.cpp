// SPDX-License-Identifier: Apache-2.0
// `linegate program` against a simulated gateway.
#include "bridges/console/program.h"

#include <gtest/gtest.h>

#include "bridges/console/lookup.h"

#include "tests/bridges/console/command_test.h"

namespace linegate::console {
namespace {

const LineId kProgrammedLine{"plant", "hall"};

class ProgrammingGateway : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    listener.on_line(kProgrammedLine, {.interface_uri = "virtual:hall", .access = "all"});
  }
  Answer call(const LineId& /*id*/, const line::Command& /*command*/, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    return answer;
  }

  Answer answer;
};

class Program : public test::CommandTest<ProgrammingGateway> {
 protected:
  std::string failure(AbortCode error, line::ProgramFault fault) {
    gateway_.answer.reply.error = to_error(error);
    gateway_.answer.reply.data = fault;
    gateway_.answer.text = describe(error);
    err_.str({});
    EXPECT_EQ(load_program(context_, "hall:5", 1, test::raw({1, 2, 3})), kFailed);
    return err_.str();
  }
};

TEST_F(Program, AnAbortOfTheDeviceIsNotAValue) {
  EXPECT_EQ(failure(AbortCode::hardware, {{0x1F50, 1}, 0}),
            std::string(describe(AbortCode::hardware)) + ": 1F50:01\n");
  EXPECT_EQ(failure(AbortCode::hardware, {{0x1F57, 1}, 0}),
            std::string(describe(AbortCode::hardware)) + ": 1F57:01\n");
  EXPECT_EQ(failure(AbortCode::no_object, {{0x1F50, 1}, 0}),
            std::string(describe(AbortCode::no_object)) + ": 1F50:01\n");
  EXPECT_EQ(failure(AbortCode::hardware, {{0x1F51, 1}, 0}),
            std::string(describe(AbortCode::hardware)) + ": 1F51:01 is 0, or was refused\n");
}

TEST_F(Program, AValueThatReportsAFailureIsExplained) {
  EXPECT_EQ(failure(AbortCode::hardware, {{0x1F57, 1}, 4}),
            std::string(describe(AbortCode::hardware)) +
                ": 1F57:01 is 00000004h, format of the program is unknown\n");
  EXPECT_EQ(failure(AbortCode::hardware, {{0x1F51, 1}, 1}),
            std::string(describe(AbortCode::hardware)) + ": 1F51:01 is 00000001h\n");
}

TEST_F(Program, ADeviceThatRestartedIsReported) {
  EXPECT_EQ(failure(AbortCode::device_state, {{0x1F50, 1}, line::kProgramRestarted}),
            std::string(describe(AbortCode::device_state)) +
                ": 1F50:01, the device restarted while the program was written\n");
  EXPECT_EQ(failure(AbortCode::device_state, {{0x1F50, 1}, 0}),
            std::string(describe(AbortCode::device_state)) + ": 1F50:01\n");
}

}  // namespace
}  // namespace linegate::console
