// SPDX-License-Identifier: Apache-2.0
// The events and objects of a whole managed line that the tables of the READMEs list.
#include <array>
#include <cstdint>
#include <string_view>

#include "stack/base/abort_code.h"
#include "stack/base/result.h"
#include "stack/od/dictionary.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

class LineIndicationsTest : public LineTest {
 protected:
  std::uint64_t own(std::uint16_t index, std::uint8_t sub) {
    return line_->dictionary().number({index, sub}).value_or(0xDEAD);
  }
  std::vector<EventKind> kinds() {
    std::vector<EventKind> out;
    for (const Event& event : events()) {
      out.push_back(event.kind());
    }
    return out;
  }
  void happens(std::string_view cause) {
    using Kind = can::BusEvent::Kind;
    if (cause == "bus-off") {
      line_->bus_event({.kind = Kind::state, .state = can::BusState::bus_off, .time = now_});
    } else if (cause == "frames lost") {
      line_->bus_event({.kind = Kind::frames_lost, .count = 1, .time = now_});
    } else if (cause == "short PDO") {
      hear(0x185, {0x01});
    } else {
      line_->execute(Command{.request = Scan{}}, now_);
      hear(0x707, {0x00});
    }
  }
  void read_by_sdo(od::Address object) {
    line_->execute({.request = SdoRead{.node = 5, .address = object}}, now_);
  }
};

// COMM_EVENT, CAN_STATE of the emotas manual.
TEST_F(LineIndicationsTest, EachChangeOfTheBusIsAnEventOfItsKind) {
  using Kind = can::BusEvent::Kind;
  using can::BusState;
  make(config_with_axis());
  boot();
  events();
  const std::pair<can::BusEvent, EventKind> table[] = {
      {{.kind = Kind::state, .state = BusState::error_warning}, EventKind::bus_state},
      {{.kind = Kind::state, .state = BusState::error_passive}, EventKind::bus_state},
      {{.kind = Kind::error, .errors = 1}, EventKind::bus_error},
      {{.kind = Kind::frames_lost, .count = 3}, EventKind::frames_lost},
      {{.kind = Kind::state, .state = BusState::bus_off}, EventKind::bus_state},
      {{.kind = Kind::interface_failed, .code = 100}, EventKind::interface_failed},
      {{.kind = Kind::interface_ready}, EventKind::interface_ready}};
  for (const auto& [event, kind] : table) {
    can::BusEvent timed = event;
    timed.time = now_;
    line_->bus_event(timed);
    EXPECT_THAT(kinds(), testing::Contains(kind));
  }
  line_->bus_event({.kind = Kind::state, .state = BusState::error_active, .time = now_});
  EXPECT_THAT(kinds(), testing::Not(testing::Contains(EventKind::bus_state))) << "no change";
}

TEST_F(LineIndicationsTest, AnSdoTransferThatFailsIsAReplyAndTheEventSdoAbort) {
  make(config_with_axis());
  boot();
  events();
  read_by_sdo({0x2000, 1});
  hear(0x585, {0x80, 0x00, 0x20, 0x01, 0x00, 0x00, 0x02, 0x06});
  EXPECT_EQ(answer().error, (Error{Domain::sdo, static_cast<std::uint32_t>(AbortCode::no_object)}));
  EXPECT_TRUE(emitted(EventKind::sdo_abort, 5));
}

TEST_F(LineIndicationsTest, AnotherClientOfTheServerIsTheEventForeignSdo) {
  make(config_with_axis());
  boot();
  events();
  hear(0x605, {0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_TRUE(emitted(EventKind::foreign_sdo, 5));
}

// 7.1.4 of the IXXAT manual.
TEST_F(LineIndicationsTest, ConfigurationBitsAreThoseOf1F80hAnd1005hAnd1006h) {
  LineConfig config = config_with_axis();
  make(config);
  EXPECT_EQ(own(0x1F80, 0), 0x01U);
  EXPECT_EQ(own(0x1005, 0), 0x80U) << "no SYNC producer";
  EXPECT_EQ(own(0x1006, 0), 0U);
  EXPECT_EQ(own(0x1001, 0), 0U);
  config.start_nodes = false;
  config.start_all = true;
  config.own_start = false;
  config.on_error = manager::ErrorReaction::stop_all;
  config.sync_period = milliseconds(10);
  make(config);
  line_->start(now_);
  pass(milliseconds(1));
  EXPECT_EQ(own(0x1F80, 0), 0x4FU) << "bits 0 manager, 1 start all, 2 no own start, 3, 6 stop all";
  EXPECT_EQ(own(0x1005, 0), 0x4000'0080U) << "bit 30: SYNC producer";
  EXPECT_EQ(own(0x1006, 0), 10'000U);
}

// CiA 302: 1F20h, 1F21h, 1F23h, 1F24h; and 1F52h to 1F54h, which 1F55h and 1F56h replaced.
TEST_F(LineIndicationsTest, StoredDcfsAndEdsAndDatesOfTheSoftwareAreNotThere) {  // 1F55h, 1F56h
  make(config_with_axis());
  constexpr std::array<std::uint16_t, 7> kAbsent{0x1F20, 0x1F21, 0x1F23, 0x1F24,
                                                 0x1F52, 0x1F53, 0x1F54};
  for (const std::uint16_t index : kAbsent) {
    EXPECT_FALSE(line_->dictionary().read({index, 5}).ok()) << index;
  }
  EXPECT_TRUE(line_->dictionary().read({0x1F22, 5}).ok()) << "1F22h exists";
}

// Each cause of a fatal error that only strict_ixxat has (8.1.12 of the IXXAT manual): the state of
// the network becomes 90h. Without the key the network continues.
TEST_F(LineIndicationsTest, StrictIxxatHasEachCauseOfTheManual) {
  for (const char* const cause :
       {"bus-off", "frames lost", "short PDO", "boot-up message during a scan"}) {
    for (const bool strict : {false, true}) {
      LineConfig config = config_with_axis();
      config.strict_ixxat = strict;
      make(config);
      boot();
      happens(cause);
      pass(milliseconds(1));
      EXPECT_EQ(line_->state().network == 0x90, strict) << cause << (strict ? ", strictly" : "");
    }
  }
}

TEST_F(LineIndicationsTest, StrictIxxatStopsForAConfigurationThatAnOptionalNodeRefuses) {
  for (const bool strict : {false, true}) {
    LineConfig config = config_with_axis();
    config.strict_ixxat = strict;
    make(config);
    line_->start(now_);
    hear(0x705, {0x00});
    hear(0x585, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00});
    hear(0x585, {0x43, 0x18, 0x10, 0x01, 0x23, 0x01, 0x00, 0x00});
    hear(0x585, {0x43, 0x18, 0x10, 0x02, 0x42, 0x00, 0x00, 0x00});
    hear_no_serial_number();
    hear_no_pdo_records();
    hear(0x585, {0x80, 0x17, 0x10, 0x00, 0x30, 0x00, 0x09, 0x06});
    pass(milliseconds(1));
    EXPECT_TRUE(emitted(EventKind::configuration_error, 5));
    EXPECT_EQ(line_->state().network == 0x90, strict);
  }
}

// CMM_FormPILUT of the IXXAT manual: an event reports the layouts that result from a scan.
TEST_F(LineIndicationsTest, ALineThatIsMadeOfAScanBeginsWithLayoutChanged) {
  LineConfig config = config_with_axis();
  make(config);
  line_->start(now_);
  EXPECT_THAT(kinds(), testing::Not(testing::Contains(EventKind::layout_changed)));
  config.scanned = {{.id = 5, .values = {}}};
  make(config);
  line_->start(now_);
  const std::vector<Event> all = events();
  const auto changed = std::ranges::find(all, EventKind::layout_changed, &Event::kind);
  ASSERT_NE(changed, all.end());
  EXPECT_EQ(changed->data,
            EventData(event::LayoutChanged{.inputs = line_->layout(Direction::inputs).id,
                                           .outputs = line_->layout(Direction::outputs).id}));
}

}  // namespace
}  // namespace linegate::line
