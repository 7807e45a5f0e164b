// SPDX-License-Identifier: Apache-2.0
// A line of CANopen FD beside a foreign master: PDOs of up to 64 bytes, and USDO transfers.
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/emcy/message.h"
#include "stack/line/following.h"
#include "stack/usdo/protocol.h"

#include "tests/stack/line/observer_fixture.h"

namespace linegate::line {
namespace {

constexpr std::uint8_t kMaster = 1;
constexpr std::uint8_t kFdFlags = can::Frame::kFd | can::Frame::kBitRateSwitch;

class FdObserverTest : public ObserverTest {
 protected:
  static LineConfig fd_config() {
    LineConfig config = config_with_axis();
    config.canopen_fd = true;
    return config;
  }
  void hear_frame(can::Frame frame) {
    frame.time = now_;
    line_->receive(std::span(&frame, 1), now_);
  }
  void hear_fd(std::uint32_t id, const std::vector<std::uint8_t>& data) {
    can::Frame frame;
    frame.id = id;
    frame.flags = kFdFlags;
    frame.length = static_cast<std::uint8_t>(data.size());
    for (std::size_t i = 0; i < data.size(); ++i) {
      frame.data[i] = std::byte{data[i]};
    }
    hear_frame(frame);
  }
  // By the foreign master.
  void request_write(od::Address place, std::uint32_t value, std::size_t bytes) {
    std::array<std::byte, 4> data{};
    store_le(data.data(), value);
    hear_frame(usdo::expedited_frame({can::kSdoRequestBase + kMaster, 5, ++session_},
                                     usdo::Command::download, place, od::DataType::unsigned32,
                                     std::span(data).first(bytes)));
  }
  // Confirmed by node 5.
  void write(od::Address place, std::uint32_t value, std::size_t bytes) {
    request_write(place, value, bytes);
    confirm(place);
  }
  void confirm(od::Address place) {
    hear_frame(usdo::object_frame({can::kSdoResponseBase + 5, kMaster, session_},
                                  usdo::Command::download_response, place));
  }
  void refuse(od::Address place) {
    hear_frame(usdo::abort_frame({can::kSdoResponseBase + 5, kMaster, session_}, place,
                                 AbortCode::not_mappable, usdo::AbortForm::one_byte));
  }
  // TPDO 1 of node 5 has the object 2000h with that number of bits, and no other.
  void map_alone(std::uint8_t bits) {
    write({0x1800, 1}, 0x8000'0185, 4);
    write({0x1A00, 0}, 0, 1);
    write({0x1A00, 1}, 0x2000'0000U | bits, 4);
    write({0x1A00, 0}, 1, 1);
    write({0x1800, 1}, 0x0000'0185, 4);
    hear(0x000, {0x01, 0x05});
  }
  Line::Input value_of(od::Address place) {
    const auto& entries = line_->layout(Direction::inputs).entries;
    for (std::uint32_t i = 0; i < entries.size(); ++i) {
      if (od::Address{entries[i].index, entries[i].sub} == place) {
        return line_->input(i);
      }
    }
    return {};
  }

  std::uint8_t session_ = 0;
};

TEST_F(FdObserverTest, PdosOfTheDeviceFileAreShown) {
  observe(fd_config());
  hear_fd(0x185, {0x34, 0x12, 0x78, 0x56, 0x34, 0x12});
  EXPECT_EQ(value_of({0x2000, 0}).value, 0x1234U);
  EXPECT_TRUE(value_of({0x2001, 0}).valid);
  EXPECT_EQ(line_->state().counters.frames_malformed, 0U);
  expect_silence();
}

TEST_F(FdObserverTest, TransfersAndAbortsAreReportedForTheServer) {
  observe(fd_config());
  events();
  write({0x1017, 0}, 250, 2);
  const std::vector<Event> reported = of(EventKind::sdo_transfer);
  ASSERT_EQ(reported.size(), 1U);
  EXPECT_EQ(reported[0].node, 5)
      << "not the client, whose node-ID is in the identifier of the request";
  EXPECT_EQ(std::get<event::SdoTransfer>(reported[0].data).index, 0x1017U);
  EXPECT_EQ(std::get<event::SdoTransfer>(reported[0].data).size, 2U);
  hear_frame(usdo::object_frame({can::kSdoRequestBase + kMaster, 5, 77}, usdo::Command::upload,
                                {0x3000, 0}));
  hear_frame(usdo::abort_frame({can::kSdoResponseBase + 5, kMaster, 77}, {0x3000, 0},
                               AbortCode::no_object, usdo::AbortForm::one_byte));
  const std::vector<Event> aborted = of(EventKind::sdo_abort);
  ASSERT_EQ(aborted.size(), 1U);
  EXPECT_EQ(aborted[0].node, 5);
  EXPECT_EQ(std::get<event::SdoAbort>(aborted[0].data).abort, AbortCode::no_object);
}

TEST_F(FdObserverTest, IdentitiesThatAMasterReadsAreKnown) {
  observe(fd_config());
  const std::array<std::byte, 4> serial{std::byte{77}};
  hear_frame(usdo::object_frame({can::kSdoRequestBase + kMaster, 5, 1}, usdo::Command::upload,
                                {0x1018, 4}));
  hear_frame(usdo::expedited_frame({can::kSdoResponseBase + 5, kMaster, 1},
                                   usdo::Command::upload_response, {0x1018, 4},
                                   od::DataType::unsigned32, serial));
  EXPECT_EQ(line_->node_state(5).serial, 77U);
}

// 42 bytes, in a frame of 48.
TEST_F(FdObserverTest, AMappingThatAMasterWritesIsFollowed) {
  observe(fd_config());
  const std::uint64_t before = line_->layout(Direction::inputs).id;
  write({0x1800, 1}, 0x8000'0185, 4);
  write({0x1A00, 0}, 0, 1);
  write({0x1A00, 1}, 0x2001'0020, 4);
  for (std::uint8_t sub = 2; sub <= 20; ++sub) {
    write({0x1A00, sub}, 0x2000'0010, 4);
  }
  write({0x1A00, 0}, 20, 1);
  write({0x1800, 1}, 0x0000'0285, 4);
  hear(0x000, {0x01, 0x05});
  EXPECT_NE(line_->layout(Direction::inputs).id, before);
  std::vector<std::uint8_t> data(48);
  data[0] = 0x44;
  data[4] = 0x37;
  data[5] = 0x12;
  hear_fd(0x285, data);
  EXPECT_EQ(value_of({0x2001, 0}).value, 0x44U);
  EXPECT_EQ(value_of({0x2000, 0}).value, 0x1237U);
  EXPECT_TRUE(value_of({0x2000, 0}).valid);
  EXPECT_FALSE(of(EventKind::pdo_mapping).empty());
  EXPECT_EQ(line_->layout(Direction::inputs).entries.size(), 20U);
}

// A master may use the session-ID of the write before again, whose answer is late.
TEST_F(FdObserverTest, AMappingThatTheDeviceRefusedIsNotFollowed) {
  for (const bool late_answer : {false, true}) {
    observe(fd_config());
    write({0x1800, 1}, 0x8000'0185, 4);
    write({0x1A00, 0}, 0, 1);
    request_write({0x1A00, 1}, 0x2001'0020, 4);
    if (late_answer) {
      confirm({0x1A00, 0});
    }
    refuse({0x1A00, 1});
    write({0x1A00, 0}, 1, 1);
    write({0x1800, 1}, 0x0000'0285, 4);
    hear(0x000, {0x01, 0x05});
    hear_fd(0x285, {0x44, 0x33, 0x22, 0x11});
    EXPECT_FALSE(value_of({0x2001, 0}).valid) << late_answer;
  }
}

TEST_F(FdObserverTest, AnAnswerFromBeforeAResetIsIgnored) {
  const std::array<std::byte, 4> serial{std::byte{77}};
  for (const bool boot_up : {false, true}) {
    observe(fd_config());
    hear_frame(usdo::object_frame({can::kSdoRequestBase + kMaster, 5, 1}, usdo::Command::upload,
                                  {0x1018, 4}));
    if (boot_up) {
      hear(0x705, {0x00});
    } else {
      hear(0x000, {0x81, 0x00});
    }
    hear_frame(usdo::expedited_frame({can::kSdoResponseBase + 5, kMaster, 1},
                                     usdo::Command::upload_response, {0x1018, 4},
                                     od::DataType::unsigned32, serial));
    EXPECT_EQ(line_->node_state(5).serial, 0U) << boot_up;
  }
}

TEST_F(FdObserverTest, FramesThatAreNoUsdoFramesAreMalformed) {
  observe(fd_config());
  events();
  hear(0x605, {0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0});
  hear_fd(0x601, {5, 0x11, 1});
  hear_fd(0x601, {5});
  EXPECT_EQ(line_->state().counters.frames_malformed, 3U);
  EXPECT_TRUE(of(EventKind::sdo_transfer).empty());
}

// Those of CiA 1301 that Linegate does not use.
TEST_F(FdObserverTest, UsdoFramesWithOtherCommandsAreNotMalformed) {
  observe(fd_config());
  const std::uint64_t unused = line_->state().counters.frames_unused;
  hear_fd(0x601, {5, 0x05, 1, 0, 0, 0x20, 0, 0});
  hear_fd(0x585, {1, 0x25, 1});
  EXPECT_EQ(line_->state().counters.frames_malformed, 0U);
  EXPECT_EQ(line_->state().counters.frames_unused, unused + 2);
  EXPECT_TRUE(of(EventKind::malformed_frame).empty());
}

// A foreign master may map a string with another length than the device file; then no part of the
// value is forwarded.
TEST_F(FdObserverTest, AValueOfAnotherLengthIsLostAsAWhole) {
  LineConfig config = fd_config();
  od::VariableDescription& value = *config.nodes[0].device.find({0x2000, 0});
  value.type = od::DataType::octet_string;
  value.value.assign(16, std::byte{0});
  observe(config);
  std::vector<Following> parts;
  add_parts({.input = {5, {0x2000, 0}}, .forwarded = true}, 128, parts);
  ASSERT_EQ(parts.size(), 2U);
  FollowedInputs inputs(parts);
  const auto valid_parts = [&](std::uint8_t bits) {
    map_alone(bits);
    hear_fd(0x185, std::vector<std::uint8_t>(bits / 8, 0x11));
    EXPECT_TRUE(value_of({0x2000, 0}).valid) << int{bits};
    inputs.look(*line_);
    return std::ranges::count(inputs.values(), true, &Line::Input::valid);
  };
  EXPECT_EQ(valid_parts(128), 2);
  EXPECT_EQ(valid_parts(64), 0);
  EXPECT_EQ(valid_parts(96), 0) << "as many parts";
  EXPECT_EQ(valid_parts(128), 2);
  EXPECT_EQ(valid_parts(192), 0);
}

TEST_F(FdObserverTest, EmcysOfTwentyBytesAreEventsIfTheyAreExpected) {
  LineConfig config = fd_config();
  config.emcy_fd = true;
  observe(config);
  events();
  emcy::Message message{.code = 0x8130, .error_register = 0x11};
  message.fd = {.any = true, .logical_device = 2, .status = 1, .profile = 402};
  hear_frame(emcy::encode(message, can::CobId{0x85}));
  const std::vector<Event> reported = of(EventKind::emcy);
  ASSERT_EQ(reported.size(), 1U);
  EXPECT_EQ(std::get<event::Emcy>(reported[0].data).fd, message.fd);
}

TEST_F(FdObserverTest, AnUnknownPdoIsShownAsItWasReceived) {
  LineConfig config = fd_config();
  config.nodes[0].device.objects.clear();
  observe(config);
  for (int i = 0; i < 3; ++i) {
    pass(milliseconds(5));
    hear_fd(0x185, std::vector<std::uint8_t>(16, 0x11));
  }
  ASSERT_EQ(line_->layout(Direction::inputs).entries.size(), 1U);
  EXPECT_EQ(line_->layout(Direction::inputs).entries[0].bit_length, 128);
  EXPECT_EQ(line_->input(0, 1).value, 0x1111'1111'1111'1111U);
}

}  // namespace
}  // namespace linegate::line
