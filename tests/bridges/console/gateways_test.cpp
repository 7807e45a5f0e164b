// SPDX-License-Identifier: Apache-2.0
// The output of `linegate gateways`.
#include <cstdlib>
#include <ctime>

#include <gmock/gmock.h>

#include "tests/bridges/console/command_test.h"
#include "tests/bridges/console/plant.h"

namespace linegate::console {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// A gateway that started 10 s after 1970-01-01 and was configured an hour later.
class OneGateway : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    GatewayView view{.version = "1.0"};
    view.started = Instant(std::chrono::seconds(10));
    view.configured = Instant(std::chrono::hours(1));
    listener.on_gateway("plant", view);
    listener.on_line(test::kPress, test::line_view(3));
  }
  Answer call(const LineId& /*id*/, const line::Command& /*command*/, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    return {};
  }
};

class GatewaysTest : public test::CommandTest<OneGateway> {
 protected:
  GatewaysTest() {
    EXPECT_EQ(::setenv("TZ", "EET-2", 1), 0);
    ::tzset();
  }
  ~GatewaysTest() override {
    EXPECT_EQ(::unsetenv("TZ"), 0);
    ::tzset();
  }
};

TEST_F(GatewaysTest, TimesAreLocal) {
  EXPECT_EQ(gateways(context_), kDone) << err_.str();
  EXPECT_THAT(out_.str(), AllOf(HasSubstr("started 1970-01-01 02:00:10.000\n"),
                                HasSubstr("since 1970-01-01 03:00:00.000,")));
}

TEST_F(GatewaysTest, TimesAreUtcWhereThatIsSaidAndInJson) {
  context_.utc = true;
  EXPECT_EQ(gateways(context_), kDone);
  EXPECT_THAT(out_.str(), AllOf(HasSubstr("started 1970-01-01T00:00:10.000Z\n"),
                                HasSubstr("since 1970-01-01T01:00:00.000Z,")));
  out_.str("");
  context_.utc = false;
  context_.json = true;
  EXPECT_EQ(gateways(context_), kDone);
  EXPECT_THAT(out_.str(),
              AllOf(HasSubstr("1970-01-01T00:00:10.000Z"), HasSubstr("1970-01-01T01:00:00.000Z")));
}

}  // namespace
}  // namespace linegate::console
