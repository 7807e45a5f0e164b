// SPDX-License-Identifier: Apache-2.0
// The sentences of `linegate decode` for frames.
#include "bridges/console/explain.h"

#include <array>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/console/explain_words.h"
#include "bridges/sim/eds_files.h"
#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"
#include "stack/emcy/message.h"
#include "stack/pdo/parameters.h"
#include "stack/routing/forward.h"
#include "stack/usdo/protocol.h"

namespace linegate::console {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

class ExplainTest : public testing::Test {
 protected:
  ExplainTest() {
    line::NodeConfig device;
    device.id = 5;
    device.name = "inlet";
    auto loaded = eds::load(sim::kDigitalIoEds, "digital-io.eds", 5);
    if (loaded.value) {
      device.device = std::move(*loaded.value);
    }
    known.add(device);
  }

  std::string say(std::uint32_t id, std::initializer_list<std::uint8_t> bytes) {
    return known.explain(can::make_frame(id, bytes));
  }
  std::string sdo(std::uint32_t id, std::initializer_list<std::uint8_t> bytes) {
    const std::string text = say(id, bytes);
    const std::size_t colon = text.find(": ");
    return colon == std::string::npos ? text : text.substr(colon + 2);
  }

  Explainer known;
};

TEST_F(ExplainTest, Nmt) {
  EXPECT_EQ(say(0x000, {0x01, 5}), "NMT: start node 5 (inlet)");
  EXPECT_EQ(say(0x000, {0x82, 0}), "NMT: reset-communication all nodes");
  EXPECT_EQ(say(0x000, {0x80, 7}), "NMT: enter-pre-operational node 7");
  EXPECT_EQ(say(0x000, {0x55, 7}), "NMT: no command there is: 55h to node 7");
  EXPECT_EQ(say(0x000, {0x01}), "no NMT command: 1 bytes");
}

TEST_F(ExplainTest, UsdoFramesOfOneFrameHaveTheirObjectAndValue) {
  const usdo::Route to_server{0x67F, 5, 1};
  const usdo::Route to_client{0x585, 127, 1};
  const od::Address object{0x2345, 1};
  const std::array<std::byte, 2> value{std::byte{0x34}, std::byte{0x12}};
  using usdo::Command;
  EXPECT_EQ(known.explain(usdo::object_frame(to_server, Command::upload, object)),
            "USDO request of node 127 to node 5 (inlet): read 2345:01");
  EXPECT_EQ(known.explain(usdo::expedited_frame(to_client, Command::upload_response, object,
                                                od::DataType::unsigned16, value)),
            "USDO answer of node 5 (inlet) to node 127: 2345:01 = 4660");
  EXPECT_EQ(known.explain(usdo::expedited_frame(to_server, Command::download, object,
                                                od::DataType::domain, value)),
            "USDO request of node 127 to node 5 (inlet): write 2345:01 = 34 12");
  EXPECT_EQ(known.explain(usdo::object_frame(to_client, Command::download_response, object)),
            "USDO answer of node 5 (inlet) to node 127: written: 2345:01");
  EXPECT_EQ(known.explain(usdo::abort_frame(to_client, object, AbortCode::no_object,
                                            usdo::AbortForm::one_byte)),
            "USDO answer of node 5 (inlet) to node 127: aborted: 2345:01: " +
                std::string(usdo::describe(usdo::Code::no_object)) + " (33h)");
  EXPECT_EQ(known.explain(usdo::abort_frame(to_server, object, AbortCode::no_object,
                                            usdo::AbortForm::four_bytes)),
            "USDO request of node 127 to node 5 (inlet): aborted: 2345:01: " +
                std::string(describe(AbortCode::no_object)) + " (06020000h)");
  can::Frame frame = usdo::object_frame(to_server, Command::upload, object);
  frame.length = 4;
  EXPECT_EQ(known.explain(frame), "USDO request of node 127, but it is no USDO frame: 4 bytes");
  frame.data[1] = std::byte{0x05};
  EXPECT_EQ(known.explain(frame),
            "USDO request of node 127 to node 5 (inlet): a command that there is not");
}

TEST_F(ExplainTest, UsdoSegmentsAreCountedAndTheirValueIsNamedAtTheEnd) {
  const usdo::Route to_server{0x67F, 5, 1};
  const usdo::Route to_client{0x585, 127, 1};
  const od::Address object{0x2345, 1};
  const std::vector<std::byte> value(62, std::byte{0x41});
  using usdo::Command;
  const auto answer = [this](const can::Frame& frame) {
    const std::string text = known.explain(frame);
    return text.substr(text.find(": ") + 2);
  };
  EXPECT_EQ(answer(usdo::initiate_frame(to_server, Command::download_initiate, object,
                                        od::DataType::domain, 62)),
            "write 2345:01 in segments, 62 bytes");
  EXPECT_EQ(answer(usdo::object_frame(to_client, Command::initiate_response, object)),
            "takes segments of 2345:01");
  EXPECT_EQ(answer(usdo::segment_frame(to_server, Command::download_segment, 0,
                                       std::span(value).first(60))),
            "write 2345:01: segment 0, 60 bytes");
  EXPECT_EQ(answer(usdo::counted_frame(to_client, Command::segment_response, 0)),
            "taken: segment 0 of 2345:01");
  EXPECT_EQ(answer(usdo::end_frame(to_server, Command::download_end, std::span(value).last(2))),
            "write 2345:01: the last 2 bytes");
  const std::string written = answer(usdo::plain_frame(to_client, Command::end_response));
  EXPECT_TRUE(written.starts_with("written: 2345:01; all of it = 41 41 ")) << written;
  EXPECT_EQ(answer(usdo::counted_frame(to_server, Command::upload_segment, 7)),
            "read on in an object of an earlier request: segment 7");
}

// The device file has TPDO 1 on 185h.
TEST_F(ExplainTest, UsdoTransfersThatRemapAPdoAreFollowed) {
  const auto write = [this](od::Address object, std::uint32_t value, std::size_t size) {
    std::array<std::byte, 4> data{};
    store_le(data.data(), value);
    known.explain(usdo::expedited_frame({0x67F, 5, 1}, usdo::Command::download, object,
                                        od::DataType::unsigned32, std::span(data).first(size)));
    return known.explain(
        usdo::object_frame({0x585, 127, 1}, usdo::Command::download_response, object));
  };
  EXPECT_NE(write({0x1800, 1}, 0x8000'0185, 4).find("TPDO 1 is not in use now"), std::string::npos);
  EXPECT_NE(write({0x1800, 1}, 0x1A5, 4).find("TPDO 1 is now on 1A5h"), std::string::npos);
  can::Frame pdo = can::make_frame(0x1A5, {1, 0, 0, 0, 0, 0, 0, 0});
  pdo.flags = can::Frame::kFd;
  EXPECT_TRUE(known.explain(pdo).starts_with("TPDO 1 of node 5 (inlet): ")) << known.explain(pdo);
}

TEST_F(ExplainTest, EmcysOfCanopenFdHaveTheirFields) {
  emcy::Message message{.code = 0x8130, .error_register = 0x11};
  message.fd = {.any = true, .logical_device = 2, .status = emcy::kStatusActive, .profile = 402};
  EXPECT_EQ(known.explain(emcy::encode(message, can::CobId{0x85})),
            "EMCY of node 5 (inlet): heartbeat or life guarding error (8130h), error register: "
            "generic, communication, logical device 2, profile 402, active");
}

TEST_F(ExplainTest, SyncAndTime) {
  EXPECT_EQ(say(0x080, {}), "SYNC");
  EXPECT_EQ(say(0x080, {17}), "SYNC 17");
  // 15340 days after 1984-01-01, 45'296'789 ms after midnight.
  EXPECT_EQ(say(0x100, {0x95, 0x2C, 0xB3, 0x02, 0xEC, 0x3B}), "TIME: 2025-12-31 12:34:56.789");
  EXPECT_EQ(say(0x100, {1, 2, 3}), "no TIME message: 3 bytes");
}

TEST_F(ExplainTest, ErrorControl) {
  EXPECT_EQ(say(0x705, {0x00}), "node 5 (inlet) booted up");
  EXPECT_EQ(say(0x705, {0x05}), "node 5 (inlet) is operational");
  EXPECT_EQ(say(0x706, {0xFF}),
            "node 6 is pre-operational (answer to node guarding, toggle bit 1)");
  can::Frame guarding = can::make_frame(0x705);
  guarding.flags = can::Frame::kRemote;
  guarding.length = 1;
  EXPECT_EQ(known.explain(guarding), "node guarding: requests the state of node 5 (inlet)");
}

TEST_F(ExplainTest, Emcy) {
  EXPECT_EQ(say(0x085, {0x30, 0x81, 0x11, 5, 0, 0, 0, 1}),
            "EMCY of node 5 (inlet): heartbeat or life guarding error (8130h), error register: "
            "generic, communication, manufacturer's bytes 05 00 00 00 01");
  EXPECT_EQ(say(0x081, {0, 0, 0, 0, 0, 0, 0, 0}),
            "EMCY of node 1, if identifiers are the pre-defined ones: no error any more (0000h)")
      << "no device file";
  EXPECT_EQ(describe_error_code(0x3211), "voltage inside the device");
  EXPECT_EQ(describe_error_code(0x3999), "voltage");
  EXPECT_EQ(describe_error_code(0xFF01), "device-specific error");
  EXPECT_EQ(describe_error_code(0xA000), "an error class that CiA 301 does not define");
}

// Definition C of stack/routing/README.md: code 8130h of node 5 in network 1.
TEST_F(ExplainTest, EmcysOfGatewaysMayBeForwardedOnes) {
  line::LineConfig line;
  line.node_id = 127;
  line.routing.interface = 2;
  line.routing.routes = {{.first = 1, .last = 1, .interface = 2, .gateway = 9},
                         {.first = 3, .last = 3, .interface = 3, .gateway = 10}};
  line.routing.gateways = {11};
  known.add_own_node(line);
  const auto said = [&](std::uint32_t node) {
    return say(0x080 + node, {0x30, 0x81, 0x11, 1, 0, 5, 1, 0});
  };
  for (const std::uint32_t gateway : {127U, 9U, 11U}) {
    EXPECT_THAT(said(gateway), HasSubstr(", forwarded, unless it is of the gateway itself: of node "
                                         "5 in network 1, hop 1, manufacturer's bytes"))
        << gateway;
  }
  EXPECT_THAT(said(10), testing::Not(HasSubstr("forwarded"))) << "a gateway of another line";
  EXPECT_THAT(say(0x089, {0x30, 0x81, 0x11, 0, 0, 0, 0, 0}), testing::Not(HasSubstr("forwarded")));
}

// 1014h in the device file, in the configuration, and as seen on the bus.
TEST_F(ExplainTest, EmcysAreThoseOfTheCobIdOfTheDevice) {
  const std::initializer_list<std::uint8_t> none{0, 0, 0, 0, 0, 0, 0, 0};
  line::NodeConfig moved{.id = 7, .name = "valve"};
  moved.objects = {{{0x1014, 0}, {std::byte{0xC5}, {}, {}, {}}}};
  known.add(moved);
  EXPECT_EQ(say(0x0C5, none), "EMCY of node 7 (valve): no error any more (0000h)");
  EXPECT_EQ(say(0x087, none),
            "EMCY of node 7 (valve), if identifiers are the pre-defined ones: no error any more "
            "(0000h)");
  say(0x605, {0x23, 0x14, 0x10, 0, 0xC6, 0, 0, 0});
  EXPECT_THAT(say(0x0C6, none), HasSubstr("EMCY of node 70, if")) << "not yet confirmed";
  say(0x585, {0x60, 0x14, 0x10, 0, 0, 0, 0, 0});
  EXPECT_EQ(say(0x0C6, none), "EMCY of node 5 (inlet): no error any more (0000h)");
  EXPECT_THAT(say(0x085, none), HasSubstr("if identifiers are the pre-defined ones"));
  say(0x605, {0x23, 0x14, 0x10, 0, 0xC5, 0, 0, 0});
  say(0x585, {0x60, 0x14, 0x10, 0, 0, 0, 0, 0});
  EXPECT_EQ(say(0x0C5, none),
            "EMCY of node 5 (inlet): no error any more (0000h) | EMCY of node 7 (valve): no error "
            "any more (0000h)");
  say(0x000, {0x82, 5});
  EXPECT_EQ(say(0x085, none), "EMCY of node 5 (inlet): no error any more (0000h)");
  say(0x605, {0x23, 0x14, 0x10, 0, 0x85, 0, 0, 0x80});
  say(0x585, {0x60, 0x14, 0x10, 0, 0, 0, 0, 0});
  EXPECT_THAT(say(0x085, none), HasSubstr("if identifiers are the pre-defined ones"))
      << "the device sends none";
  say(0x609, {0x40, 0x14, 0x10, 0, 0, 0, 0, 0});
  say(0x589, {0x43, 0x14, 0x10, 0, 0x89, 0, 0, 0});
  EXPECT_EQ(say(0x089, none), "EMCY of node 9: no error any more (0000h)") << "no device file";
}

TEST_F(ExplainTest, PdosByName) {
  EXPECT_EQ(say(0x185, {1, 2, 3, 255}),
            "TPDO 1 of node 5 (inlet): 6000:01 Read input 8-bit, Inputs 1 to 8 = 1; "
            "6000:02 Read input 8-bit, Inputs 9 to 16 = 2; 6000:03 Read input 8-bit, Inputs 17 to "
            "24 = 3; 6000:04 Read input 8-bit, Inputs 25 to 32 = 255");
  EXPECT_THAT(say(0x185, {1}), HasSubstr("but 1 bytes are too short for 6000:02"));
  EXPECT_THAT(
      say(0x205, {9, 0, 0, 0}),
      HasSubstr("RPDO 1 to node 5 (inlet): 6200:01 Write output 8-bit, Outputs 1 to 8 = 9"));
  EXPECT_EQ(say(0x289, {1}), "TPDO 2 of node 9, if identifiers are the pre-defined ones");
  EXPECT_EQ(say(0x509, {1}), "RPDO 4 to node 9, if identifiers are the pre-defined ones");
  EXPECT_EQ(say(0x770, {1}), "node 112 is unknown");
  EXPECT_EQ(say(0x680, {1}), "no identifier of CANopen's pre-defined ones");
  can::Frame extended = can::make_frame(0x185, {1});
  extended.flags = can::Frame::kExtended;
  EXPECT_EQ(known.explain(extended), "not one of the known 29-bit identifiers");
}

TEST_F(ExplainTest, APdoThatIsMappedAnewIsExplainedAsItIsThen) {
  const std::initializer_list<std::uint8_t> inputs{1, 2, 3, 4};
  const auto write = [this](std::initializer_list<std::uint8_t> request) {
    say(0x605, request);
    const auto* at = request.begin();
    return say(0x585, {0x60, at[1], at[2], at[3], 0, 0, 0, 0});
  };
  EXPECT_THAT(write({0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0x80}),
              EndsWith("COB-ID used by TPDO; TPDO 1 is not in use now"));
  EXPECT_THAT(say(0x185, inputs), HasSubstr("if identifiers are the pre-defined ones"));
  write({0x2F, 0x00, 0x1A, 0, 0, 0, 0, 0});
  write({0x23, 0x00, 0x1A, 1, 8, 2, 0x00, 0x60});
  write({0x23, 0x00, 0x1A, 2, 16, 0, 0x17, 0x10});
  write({0x2F, 0x00, 0x1A, 0, 2, 0, 0, 0});
  EXPECT_THAT(write({0x23, 0x00, 0x18, 1, 0x91, 0x01, 0, 0}),
              EndsWith("; TPDO 1 is now on 191h: 6000:02 Read input 8-bit, Inputs 9 to 16, 1017:00 "
                       "Producer heartbeat time"));
  EXPECT_EQ(say(0x191, {7, 0xE8, 3}),
            "TPDO 1 of node 5 (inlet): 6000:02 Read input 8-bit, Inputs 9 to 16 = 7; 1017:00 "
            "Producer heartbeat time = 1000");
  EXPECT_THAT(say(0x185, inputs), HasSubstr("if identifiers are the pre-defined ones"));
  EXPECT_THAT(say(0x205, {9, 0, 0, 0}), HasSubstr("RPDO 1 to node 5 (inlet): 6200:01"))
      << "other PDOs are unchanged";
}

TEST_F(ExplainTest, TwoTpdosOnOneCobIdAreReported) {
  say(0x609, {0x40, 0x00, 0x18, 1, 0, 0, 0, 0});
  say(0x589, {0x43, 0x00, 0x18, 1, 0x85, 0x01, 0, 0});
  say(0x609, {0x40, 0x00, 0x1A, 1, 0, 0, 0, 0});
  say(0x589, {0x43, 0x00, 0x1A, 1, 16, 0, 0x41, 0x60});
  say(0x609, {0x40, 0x00, 0x1A, 0, 0, 0, 0, 0});
  say(0x589, {0x4F, 0x00, 0x1A, 0, 1, 0, 0, 0});
  EXPECT_EQ(say(0x185, {1, 2, 3, 255}),
            "TPDO 1 of node 5 (inlet): 6000:01 Read input 8-bit, Inputs 1 to 8 = 1; "
            "6000:02 Read input 8-bit, Inputs 9 to 16 = 2; 6000:03 Read input 8-bit, Inputs 17 to "
            "24 = 3; 6000:04 Read input 8-bit, Inputs 25 to 32 = 255 | TPDO 1 of node 9: 6041:00 = "
            "01 02; these TPDOs have the same COB-ID: the frame is one of them");
  EXPECT_THAT(say(0x205, {9, 0, 0, 0}), testing::Not(HasSubstr("same COB-ID")));
}

// The device may have carried it out, though its answer is missing.
TEST_F(ExplainTest, AWriteWithoutAnAnswerLeavesThePdoUnknown) {
  const std::initializer_list<std::uint8_t> inputs{1, 2, 3, 4};
  const std::initializer_list<std::uint8_t> maps_second{0x23, 0x00, 0x1A, 1, 8, 2, 0x00, 0x60};
  const std::initializer_list<std::uint8_t> gives_up{0x80, 0x00, 0x1A, 1, 0, 0, 4, 5};
  say(0x605, maps_second);
  EXPECT_THAT(say(0x605, gives_up),
              EndsWith("; whether 1A00:01 TPDO 1 mapping parameter, Mapped object 1 was written is "
                       "not known; TPDO 1 is not known now"));
  EXPECT_THAT(say(0x185, inputs), HasSubstr("if identifiers are the pre-defined ones"));
  say(0x605, {0x40, 0x00, 0x1A, 1, 0, 0, 0, 0});
  EXPECT_THAT(say(0x585, {0x43, 0x00, 0x1A, 1, 8, 1, 0x00, 0x60}), HasSubstr("TPDO 1 is now on"));
  EXPECT_THAT(say(0x185, inputs), HasSubstr("6000:01"));

  say(0x605, maps_second);
  EXPECT_THAT(say(0x605, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0}), EndsWith("TPDO 1 is not known now"))
      << "the client gave up without an abort";
  EXPECT_THAT(say(0x000, {0x82, 5}), testing::Not(HasSubstr("is now on")));
  EXPECT_THAT(say(0x705, {0}), EndsWith("Inputs 25 to 32")) << "it was not stored";

  say(0x605, maps_second);
  EXPECT_THAT(say(0x585, {0x80, 0x00, 0x1A, 1, 0x30, 0, 9, 6}),
              testing::Not(HasSubstr("not known")));
  say(0x605, {0x21, 0x00, 0x1A, 1, 4, 0, 0, 0});
  say(0x585, {0x60, 0x00, 0x1A, 1, 0, 0, 0, 0});
  EXPECT_THAT(say(0x605, gives_up), testing::Not(HasSubstr("not known"))) << "nothing was sent";
  EXPECT_THAT(say(0x185, inputs), HasSubstr("6000:01"));
}

// 1010h:1 of the device file: bit 1.
TEST_F(ExplainTest, AWriteWithoutAnAnswerMayHaveBeenStored) {
  line::NodeConfig device{.id = 6};
  device.device = *eds::load(sim::kDigitalIoEds, "digital-io.eds", 6).value;
  for (od::ObjectDescription& object : device.device.objects) {
    if (object.index == 0x1010) {
      object.variables.at(1).value = {std::byte{2}, {}, {}, {}};
    }
  }
  known.add(device);
  say(0x606, {0x23, 0x00, 0x1A, 1, 8, 2, 0x00, 0x60});
  say(0x606, {0x80, 0x00, 0x1A, 1, 0, 0, 4, 5});
  say(0x606, {0x23, 0x14, 0x10, 0, 0xC6, 0, 0, 0});
  say(0x606, {0x80, 0x14, 0x10, 0, 0, 0, 4, 5});
  EXPECT_EQ(say(0x706, {0}), "node 6 booted up");
  EXPECT_THAT(say(0x186, {1, 2, 3, 4}), HasSubstr("if identifiers are the pre-defined ones"));
  EXPECT_THAT(say(0x086, {0, 0, 0, 0, 0, 0, 0, 0}),
              HasSubstr("if identifiers are the pre-defined ones"));
  say(0x606, {0x40, 0x00, 0x1A, 1, 0, 0, 0, 0});
  say(0x586, {0x43, 0x00, 0x1A, 1, 8, 1, 0x00, 0x60});
  EXPECT_THAT(say(0x186, {1, 2, 3, 4}), HasSubstr("6000:01"));
}

TEST_F(ExplainTest, AWriteOf1014hWithoutAnAnswerLeavesItUnknown) {
  say(0x605, {0x23, 0x14, 0x10, 0, 0xC6, 0, 0, 0});
  EXPECT_THAT(say(0x605, {0x80, 0x14, 0x10, 0, 0, 0, 4, 5}), EndsWith("was written is not known"));
  EXPECT_THAT(say(0x085, {0, 0, 0, 0, 0, 0, 0, 0}),
              HasSubstr("if identifiers are the pre-defined ones"));
  say(0x705, {0});
  EXPECT_EQ(say(0x085, {0, 0, 0, 0, 0, 0, 0, 0}),
            "EMCY of node 5 (inlet): no error any more (0000h)");
}

TEST_F(ExplainTest, AMappingThatTheDeviceRefusesIsNone) {
  say(0x605, {0x23, 0x00, 0x18, 1, 0x91, 0x01, 0, 0});
  EXPECT_THAT(say(0x585, {0x80, 0x00, 0x18, 1, 0x30, 0, 9, 6}), HasSubstr("refused"));
  EXPECT_THAT(say(0x185, {1, 2, 3, 255}), HasSubstr("6000:01"));
}

TEST_F(ExplainTest, PdosOfADeviceWithoutAFileAreLearntFromTheLog) {
  const auto read = [this](std::initializer_list<std::uint8_t> answer) {
    const auto* at = answer.begin();
    say(0x609, {0x40, at[1], at[2], at[3], 0, 0, 0, 0});
    return say(0x589, answer);
  };
  read({0x43, 0x00, 0x18, 1, 0x89, 0x01, 0, 0});
  read({0x43, 0x00, 0x1A, 1, 16, 0, 0x41, 0x60});
  EXPECT_THAT(read({0x4F, 0x00, 0x1A, 0, 1, 0, 0, 0}),
              EndsWith("; TPDO 1 is now on 189h: 6041:00"));
  EXPECT_EQ(say(0x189, {0x37, 0x06}), "TPDO 1 of node 9: 6041:00 = 37 06");
}

class ExplainedResets : public ExplainTest {
 protected:
  void write(std::initializer_list<std::uint8_t> request) {
    const auto* at = request.begin();
    say(0x605, request);
    say(0x585, {0x60, at[1], at[2], at[3], 0, 0, 0, 0});
  }
  void map_first_byte() {
    write({0x2F, 0x00, 0x1A, 0, 0, 0, 0, 0});
    write({0x23, 0x00, 0x1A, 1, 8, 1, 0x00, 0x60});
    write({0x2F, 0x00, 0x1A, 0, 1, 0, 0, 0});
  }
  // TPDO 1 maps 6000:02 alone.
  void map_second_byte() {
    write({0x2F, 0x00, 0x1A, 0, 0, 0, 0, 0});
    write({0x23, 0x00, 0x1A, 1, 8, 2, 0x00, 0x60});
    write({0x2F, 0x00, 0x1A, 0, 1, 0, 0, 0});
    EXPECT_THAT(say(0x185, {7}), EndsWith(": 6000:02 Read input 8-bit, Inputs 9 to 16 = 7"));
  }
};

TEST_F(ExplainedResets, AMappingThatWasWrittenEndsWithTheReset) {
  map_second_byte();
  EXPECT_EQ(say(0x000, {0x82, 5}),
            "NMT: reset-communication node 5 (inlet); TPDO 1 is not known now");
  EXPECT_THAT(say(0x185, {7}), HasSubstr("if identifiers are the pre-defined ones"))
      << "it may be from before the reset";
  EXPECT_THAT(say(0x205, {9, 0, 0, 0}), HasSubstr("6200:01")) << "its mapping is the same";
  EXPECT_THAT(say(0x705, {0}), testing::StartsWith("node 5 (inlet) booted up; TPDO 1 is now on "
                                                   "185h: 6000:01 Read input 8-bit"));
  EXPECT_THAT(say(0x185, {1, 2, 3, 255}), HasSubstr("6000:04"));
  map_second_byte();
  EXPECT_THAT(say(0x705, {0}), HasSubstr("TPDO 1 is now on 185h"));
  EXPECT_THAT(say(0x185, {1, 2, 3, 255}), HasSubstr("6000:04"));
}

TEST_F(ExplainedResets, ThoseOfAllNodesAreNamed) {
  map_second_byte();
  EXPECT_EQ(say(0x000, {0x81, 0}),
            "NMT: reset-node all nodes; node 5 (inlet): TPDO 1 is not known now");
  EXPECT_THAT(say(0x000, {0x01, 0}), HasSubstr("node 5 (inlet): TPDO 1 is now on 185h"));
  EXPECT_THAT(say(0x185, {1, 2, 3, 255}), HasSubstr("6000:04"));
}

TEST_F(ExplainedResets, AMappingThatWasStoredStays) {
  map_second_byte();
  write({0x23, 0x10, 0x10, 1, 's', 'a', 'v', 'e'});
  EXPECT_EQ(say(0x000, {0x82, 5}), "NMT: reset-communication node 5 (inlet)");
  EXPECT_EQ(say(0x705, {0}), "node 5 (inlet) booted up");
  EXPECT_THAT(say(0x185, {7}), EndsWith("Inputs 9 to 16 = 7"));
}

// The manager reads the first entry, which is not that of the device file, and writes the mapping.
TEST_F(ExplainedResets, AStoredMappingThatWasReadInPartIsNotKnownAfterTheReset) {
  say(0x705, {0});
  say(0x605, {0x40, 0x00, 0x1A, 1, 0, 0, 0, 0});
  EXPECT_THAT(say(0x585, {0x43, 0x00, 0x1A, 1, 8, 2, 0x00, 0x60}),
              EndsWith("; TPDO 1 is not known now"));
  write({0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0x80});
  map_first_byte();
  write({0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0});
  EXPECT_THAT(say(0x185, {7}), EndsWith(": 6000:01 Read input 8-bit, Inputs 1 to 8 = 7"));
  EXPECT_THAT(say(0x000, {0x81, 5}), EndsWith("; TPDO 1 is not known now"));
  EXPECT_EQ(say(0x705, {0}), "node 5 (inlet) booted up");
  EXPECT_THAT(say(0x185, {1, 2, 3, 255}), HasSubstr("if identifiers are the pre-defined ones"));
}

TEST_F(ExplainedResets, WithoutADeviceFileNothingIsKnownAfterTheReset) {
  const auto learn = [this](std::initializer_list<std::uint8_t> request) {
    const auto* at = request.begin();
    say(0x609, request);
    say(0x589, {0x60, at[1], at[2], at[3], 0, 0, 0, 0});
  };
  learn({0x23, 0x00, 0x18, 1, 0x89, 0x01, 0, 0});
  learn({0x23, 0x00, 0x1A, 1, 16, 0, 0x41, 0x60});
  learn({0x2F, 0x00, 0x1A, 0, 1, 0, 0, 0});
  EXPECT_EQ(say(0x189, {0x37, 0x06}), "TPDO 1 of node 9: 6041:00 = 37 06");
  EXPECT_EQ(say(0x709, {0}), "node 9 booted up; TPDO 1 is not known now");
  EXPECT_EQ(say(0x189, {0x37, 0x06}), "TPDO 1 of node 9, if identifiers are the pre-defined ones");
}

// own_objects, own_pdos and shared_objects of a plant.yaml.
class ExplainedOwnNode : public ExplainTest {
 protected:
  ExplainedOwnNode() {
    line::LineConfig line;
    line.node_id = 127;
    line::OwnObject level{.index = 0x2100};
    level.variable = od::number_variable(1, "Level", od::DataType::integer16, od::Access::rw);
    level.variable.mappable = true;
    line.own_objects = {level};
    line.forwarding.objects = {{{0xB100, 1}, "Speed", {}}};
    line.forwarding.tpdos = {{.number = 9, .cob_id = {0x1F1}, .mapping = {{{0x2100, 1}, 16}}},
                             {.number = 10,
                              .cob_id = {0x1F2},
                              .mpdo = pdo::MpdoMode::destination,
                              .mapping = {{{0x2100, 1}, 16}}},
                             {.number = 11, .cob_id = {0x1F3}, .mpdo = pdo::MpdoMode::source}};
    const auto bits = od::bit_size(*routing::forward_type({0xB100, 1}));
    line.forwarding.rpdos = {{.number = 9,
                              .cob_id = {0x1F4},
                              .mapping = {{{0xB100, 1}, static_cast<std::uint8_t>(bits)}}}};
    known.add_own_node(line);
  }
};

TEST_F(ExplainedOwnNode, ItsPdosAreThoseOfTheConfiguration) {
  EXPECT_EQ(say(0x1F1, {0xFE, 0xFF}), "TPDO 9 of node 127 (own node): 2100:01 Level = -2");
  EXPECT_EQ(say(0x1F4, {7, 0, 0, 0}), "RPDO 9 to node 127 (own node): B100:01 Speed = 7");
  EXPECT_EQ(say(0x67F, {0x40, 0x00, 0x21, 1, 0, 0, 0, 0}),
            "SDO to node 127 (own node): read 2100:01 Level");
}

TEST_F(ExplainedOwnNode, MultiplexedPdosNameTheObject) {
  EXPECT_EQ(say(0x1F2, {0x85, 0x17, 0x10, 0, 0xE8, 3, 0, 0}),
            "TPDO 10 of node 127 (own node), MPDO: to node 5 (inlet), 1017:00 Producer heartbeat "
            "time = 1000");
  EXPECT_EQ(say(0x1F2, {0x80, 0x17, 0x10, 0, 0xE8, 3, 0, 0}),
            "TPDO 10 of node 127 (own node), MPDO: to all nodes, 1017:00 = E8 03 00 00");
  EXPECT_EQ(say(0x1F3, {0x7F, 0x00, 0x21, 1, 0xFE, 0xFF, 0, 0}),
            "TPDO 11 of node 127 (own node), MPDO: of node 127 (own node), 2100:01 Level = -2");
  EXPECT_EQ(say(0x1F3, {0x7F, 0x00}), "TPDO 11 of node 127 (own node), but it is no MPDO");
}

TEST_F(ExplainedOwnNode, ALineWithoutThemAddsNone) {
  Explainer plain;
  plain.add_own_node({});
  EXPECT_EQ(plain.explain(can::make_frame(0x77F, {5})), "node 127 is operational");
}

TEST_F(ExplainTest, ExpeditedSdo) {
  EXPECT_EQ(say(0x605, {0x2B, 0x17, 0x10, 0, 0xC8, 0, 0, 0}),
            "SDO to node 5 (inlet): write 1017:00 Producer heartbeat time = 200");
  EXPECT_EQ(say(0x585, {0x60, 0x17, 0x10, 0, 0, 0, 0, 0}),
            "SDO of node 5 (inlet): written: 1017:00 Producer heartbeat time");
  EXPECT_EQ(sdo(0x605, {0x40, 0x17, 0x10, 0, 0, 0, 0, 0}), "read 1017:00 Producer heartbeat time");
  EXPECT_EQ(sdo(0x585, {0x4B, 0x17, 0x10, 0, 0xE8, 3, 0, 0}),
            "1017:00 Producer heartbeat time = 1000");
  EXPECT_EQ(sdo(0x585, {0x42, 0x17, 0x10, 0, 0xE8, 3, 0, 0}),
            "1017:00 Producer heartbeat time = 1000")
      << "without a size indication, the size of the type";
  EXPECT_EQ(sdo(0x585, {0x80, 0x00, 0x20, 3, 0, 0, 2, 6}),
            "refused: 2000:03: " + std::string(describe(AbortCode::no_object)) + " (06020000)");
  EXPECT_EQ(sdo(0x585, {0x80, 0x00, 0x20, 3, 0, 0, 0, 0}),
            "refused: 2000:03: no abort code (00000000)");
  EXPECT_EQ(say(0x609, {0x22, 0x00, 0x20, 1, 1, 2, 3, 4}),
            "SDO to node 9: write 2000:01 = 01 02 03 04");
  EXPECT_EQ(say(0x605, {0x40}), "SDO to node 5 (inlet): no SDO frame: it does not have 8 bytes");
}

TEST_F(ExplainTest, SegmentedSdo) {
  sdo(0x605, {0x40, 0x08, 0x10, 0, 0, 0, 0, 0});
  EXPECT_EQ(sdo(0x585, {0x41, 0x08, 0x10, 0, 10, 0, 0, 0}),
            "1008:00 Manufacturer device name is uploaded in segments, 10 bytes");
  EXPECT_EQ(sdo(0x605, {0x60, 0, 0, 0, 0, 0, 0, 0}), "read on in 1008:00 Manufacturer device name");
  EXPECT_EQ(sdo(0x585, {0x00, 'L', 'i', 'n', 'e', 'g', 'a', 't'}),
            "1008:00 Manufacturer device name: 7 bytes more, 7 so far");
  sdo(0x605, {0x70, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(sdo(0x585, {0x19, 'e', ' ', '1', 0, 0, 0, 0}),
            "1008:00 Manufacturer device name: the last 3 bytes; = \"Linegate 1\"");
  EXPECT_EQ(sdo(0x609, {0x00, 1, 2, 3, 4, 5, 6, 7}),
            "write an object of an earlier request: 7 bytes more, 7 so far")
      << "the log begins within a transfer";
}

TEST_F(ExplainTest, BlockDownload) {
  EXPECT_EQ(sdo(0x605, {0xC6, 0x08, 0x10, 0, 9, 0, 0, 0}),
            "write 1008:00 Manufacturer device name in blocks, 9 bytes");
  EXPECT_EQ(sdo(0x585, {0xA4, 0x08, 0x10, 0, 127, 0, 0, 0}), "ready for blocks of 127 segments");
  EXPECT_EQ(sdo(0x605, {0x01, 'A', 'B', 'C', 'D', 'E', 'F', 'G'}),
            "1008:00 Manufacturer device name: segment 1 of a block");
  EXPECT_THAT(sdo(0x605, {0x82, 'x', 'x', 0, 0, 0, 0, 0}),
              EndsWith("segment 2 of a block, the last"));
  EXPECT_EQ(sdo(0x585, {0xA2, 1, 127, 0, 0, 0, 0, 0}),
            "segments up to 1 have come, the next block has 127");
  EXPECT_THAT(sdo(0x605, {0x81, 'H', 'I', 0, 0, 0, 0, 0}),
              EndsWith("segment 1 of a block, the last"))
      << "a repeated segment that was lost";
  sdo(0x585, {0xA2, 1, 127, 0, 0, 0, 0, 0});
  EXPECT_EQ(sdo(0x605, {0xD5, 0x12, 0x34, 0, 0, 0, 0, 0}),
            "1008:00 Manufacturer device name: end of the blocks; = \"ABCDEFGHI\"");
  EXPECT_EQ(sdo(0x585, {0xA1, 0, 0, 0, 0, 0, 0, 0}),
            "all of 1008:00 Manufacturer device name has come");
}

TEST_F(ExplainTest, BlockUpload) {
  EXPECT_EQ(sdo(0x605, {0xA4, 0x08, 0x10, 0, 127, 0, 0, 0}),
            "read 1008:00 Manufacturer device name in blocks of 127 segments");
  EXPECT_EQ(sdo(0x585, {0xC6, 0x08, 0x10, 0, 2, 0, 0, 0}),
            "1008:00 Manufacturer device name is uploaded in blocks, 2 bytes");
  EXPECT_EQ(sdo(0x605, {0xA3, 0, 0, 0, 0, 0, 0, 0}),
            "let the blocks of 1008:00 Manufacturer device name come");
  EXPECT_THAT(sdo(0x585, {0x81, 'H', 'I', 0, 0, 0, 0, 0}),
              EndsWith("segment 1 of a block, the last"));
  sdo(0x605, {0xA2, 1, 127, 0, 0, 0, 0, 0});
  EXPECT_THAT(sdo(0x585, {0xD5, 0, 0, 0, 0, 0, 0, 0}), EndsWith("= \"HI\""));
  EXPECT_THAT(sdo(0x605, {0xA1, 0, 0, 0, 0, 0, 0, 0}), EndsWith("has come"));
}

TEST_F(ExplainTest, Lss) {
  EXPECT_EQ(say(0x7E5, {0x04, 1, 0, 0, 0, 0, 0, 0}),
            "LSS: switch all devices to state configuration");
  EXPECT_EQ(say(0x7E5, {0x11, 9, 0, 0, 0, 0, 0, 0}), "LSS: node-ID shall be 9h");
  EXPECT_EQ(say(0x7E4, {0x11, 0, 0, 0, 0, 0, 0, 0}), "LSS: node-ID set, error 0h");
  EXPECT_EQ(say(0x7E5, {0x5A, 0, 0, 0, 0, 0, 0, 0}), "LSS: which vendor-ID?");
  EXPECT_EQ(say(0x7E4, {0x5A, 0x78, 0x56, 0x34, 0x12, 0, 0, 0}), "LSS: vendor-ID 12345678h");
  EXPECT_EQ(say(0x7E4, {0x99, 0, 0, 0, 0, 0, 0, 0}), "LSS: no command that CiA 305 has: 99h");
  EXPECT_EQ(say(0x7E5, {}), "no LSS command: 0 bytes");
}

// Random frames, in any order.
TEST_F(ExplainTest, AnythingIsExplainedSomehow) {
  std::uint32_t seed = 1;
  const auto random = [&] { return seed = seed * 1'664'525U + 1'013'904'223U; };
  for (int i = 0; i < 100'000; ++i) {
    can::Frame frame = can::make_frame(random() >> 8U & 0x7FFU);
    if (i % 3 == 0) {
      frame.id = (random() & 1U) != 0 ? 0x605 : 0x585;  // transfers of one device
    }
    frame.length = static_cast<std::uint8_t>((random() >> 8U) % 9);
    for (std::byte& byte : frame.data) {
      byte = static_cast<std::byte>(random() >> 16U);
    }
    ASSERT_FALSE(known.explain(frame).empty());
  }
}

}  // namespace
}  // namespace linegate::console
