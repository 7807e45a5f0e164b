// The network boots when its devices have their node-IDs.
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/lss/slave.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Not;
using testing::StartsWith;

constexpr const char* kResetAll = "000#8200";
constexpr const char* kUpload = "605#40001000";
constexpr const char* kGive = "7E5#1105";

class LssAssignTest : public LineTest {
 protected:
  LssAssignTest() { slave.power_on({}); }

  // What is sent until the line waits for its clock; the slave answers.
  std::vector<std::string> exchange() {
    std::vector<std::string> out;
    can::Frame frame;
    while (line_->next_frame(frame, now_)) {
      if (frame.id == lss::kMasterId) {
        frame.time = now_;
        (void)slave.receive(frame, answers);
      }
      out.push_back(text(frame));
      while (answers.pop(frame)) {
        frame.time = now_;
        line_->receive(std::span(&frame, 1), now_);
      }
    }
    return out;
  }
  // Until a frame that begins so is sent.
  void until(const char* begin) {
    for (int i = 0; i < 200; ++i) {
      if (testing::Matches(Contains(StartsWith(begin)))(exchange())) {
        return;
      }
      now_ = std::max(now_, line_->next_wake());
      line_->advance(now_);
    }
    FAIL() << begin;
  }
  // A wake-up that comes late: all that was due before is done now.
  std::vector<std::string> wake_after(Duration time) {
    now_ += time;
    line_->advance(now_);
    return exchange();
  }

  lss::Slave slave{{0x123, 0x42, 1, 1}, nullptr};
  can::TransmitQueue answers{8};
};

TEST_F(LssAssignTest, ALateWakeUpAfterTheCheckOfTheNodeIdStartsNoBoot) {
  LineConfig config = config_with_axis();
  config.lss.assign = true;
  config.sdo_timeout = milliseconds(500);
  make(std::move(config));
  line_->start(now_);
  until(kUpload);
  EXPECT_THAT(wake_after(milliseconds(700)), Contains(StartsWith(kUpload)));
  EXPECT_THAT(wake_after(milliseconds(900)),
              AllOf(Contains(StartsWith(kGive)), Not(Contains(kResetAll))));
  until(kResetAll);
}

}  // namespace
}  // namespace linegate::line
