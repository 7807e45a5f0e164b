// SPDX-License-Identifier: Apache-2.0
// Parsing and writing of candump logs.
#include "bridges/can/candump.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "bridges/can/error_frame.h"
#include "bridges/can/log_file.h"

namespace linegate::can_bridge {
namespace {

using can::BusEvent;
using can::BusState;
using can::Frame;
using testing::ElementsAre;
using testing::HasSubstr;

LogEntry parsed(std::string_view line) {
  LogEntry entry;
  LogProblem problem;
  EXPECT_TRUE(parse_log_line(line, entry, problem)) << line << ": " << problem.text;
  return entry;
}

std::string wrong(std::string_view line) {
  LogEntry entry;
  LogProblem problem;
  EXPECT_FALSE(parse_log_line(line, entry, problem)) << line;
  return std::to_string(problem.column) + ": " + std::string(problem.text);
}

std::string written(const Frame& frame, std::int64_t stamp = 1'436'509'052'249'713'000) {
  std::array<char, kLogLine> out{};
  return {out.data(), format_log_line(out, stamp, "can0", frame)};
}

TEST(CandumpLine, DataFrame) {
  const LogEntry entry = parsed("(1436509052.249713) vcan0 044#2A366C2BBA");
  EXPECT_EQ(entry.kind, LogEntry::Kind::frame);
  EXPECT_EQ(entry.stamp_ns, 1'436'509'052'249'713'000);
  EXPECT_EQ(entry.interface, "vcan0");
  EXPECT_TRUE(
      can::same_content(entry.frame, can::make_frame(0x044, {0x2A, 0x36, 0x6C, 0x2B, 0xBA})));
}

TEST(CandumpLine, OtherFrames) {
  EXPECT_EQ(parsed("(0.5) c 7FF#").frame.length, 0);
  EXPECT_EQ(parsed("(0.5) c 7FF#").stamp_ns, 500'000'000);
  EXPECT_EQ(parsed("(1.123456789) c 7FF#").stamp_ns, 1'123'456'789);
  const Frame extended = parsed("(1.0) c 00000181#01").frame;
  EXPECT_EQ(extended.id, 0x181U);
  EXPECT_TRUE(extended.extended());
  const Frame remote = parsed("(1.0) c 705#R1").frame;
  EXPECT_TRUE(remote.remote());
  EXPECT_EQ(remote.length, 1);
  EXPECT_EQ(parsed("(1.0) c 705#R").frame.length, 0);
  const Frame fd = parsed("(1.0) c 181##511223344").frame;
  EXPECT_EQ(fd.flags, Frame::kFd | Frame::kBitRateSwitch);
  EXPECT_EQ(fd.length, 4);
  EXPECT_EQ(parsed("(1.0) c 181##2").frame.flags, Frame::kFd | Frame::kErrorStateIndicator);
  EXPECT_EQ(parsed("(1.0) c 181#1122334455667788_F R").frame.length, 8);
  EXPECT_EQ(parsed("(1.0) c 181#11.22 T\r").frame.length, 2);
}

TEST(CandumpLine, RemarksAndLosses) {
  EXPECT_EQ(parsed("").kind, LogEntry::Kind::remark);
  EXPECT_EQ(parsed("# a remark").kind, LogEntry::Kind::remark);
  const LogEntry lost = parsed("DROPCOUNT: dropped 3 CAN frames on 'can7' socket (total drops 5)");
  EXPECT_EQ(lost.kind, LogEntry::Kind::frames_lost);
  EXPECT_EQ(lost.lost, 3U);
  EXPECT_EQ(lost.interface, "can7");
  std::array<char, kLogLine> out{};
  EXPECT_EQ(std::string(out.data(), format_lost(out, "can7", 3, 5)),
            "DROPCOUNT: dropped 3 CAN frames on 'can7' socket (total drops 5)\n");
}

TEST(CandumpLine, WhatIsWrongIsToldWithItsColumn) {
  EXPECT_EQ(wrong("vcan0  181   [2]  11 22"),
            "1: expected a line of candump -L: (seconds.microseconds) can0 181#01");
  EXPECT_EQ(wrong("(2015-07-10 08:17:32.249713) vcan0 044#2A"),
            "6: expected a time as (seconds.microseconds)");
  EXPECT_EQ(wrong("(1.0) can0"), "11: expected an interface and a frame after the time");
  EXPECT_EQ(wrong("(1.0) can0 1810#01"),
            "12: expected an identifier of 3 or 8 hexadecimal digits and #");
  EXPECT_EQ(wrong("(1.0) can0 800#01"), "12: there is no such identifier");
  EXPECT_EQ(wrong("(1.0) can0 40000000#01"), "12: there is no such identifier");
  EXPECT_EQ(wrong("(1.0) can0 181#1"), "17: expected the second hexadecimal digit of a byte");
  EXPECT_EQ(wrong("(1.0) can0 181#112233445566778899"), "32: more data than such a frame has");
  EXPECT_EQ(wrong("(1.0) can0 181#R9"), "17: a remote frame requests 8 bytes at most");
  EXPECT_EQ(wrong("(1.0) can0 181##5112233445566778899"), "18: a length that CAN FD does not have");
  EXPECT_EQ(wrong("(1.0) can0 181##"), "17: expected a digit of flags after ##");
  EXPECT_EQ(wrong("(1.0) can0 181#01 02"), "19: nothing is expected after the frame");
  EXPECT_EQ(wrong("(1.0) can0 20000004#00"), "12: an error frame has 8 bytes");
  EXPECT_EQ(wrong("DROPCOUNT: dropped many"), "1: expected how many frames were dropped");
  EXPECT_EQ(wrong("(99999999999.0) can0 181#"), "13: expected a time as (seconds.microseconds)");
}

TEST(CandumpLine, IsWrittenAsCandumpWritesIt) {
  EXPECT_EQ(written(can::make_frame(0x44, {0x2A, 0xBA})), "(1436509052.249713) can0 044#2ABA\n");
  EXPECT_EQ(written(can::make_frame(0), 1'000), "(0000000000.000001) can0 000#\n");
  Frame fd = can::make_frame(0x181, {1, 2});
  fd.flags = Frame::kFd | Frame::kBitRateSwitch;
  EXPECT_EQ(written(fd, 0), "(0000000000.000000) can0 181##50102\n");
  Frame remote = can::make_frame(0x705);
  remote.flags = Frame::kRemote;
  remote.length = 1;
  EXPECT_EQ(written(remote, 0), "(0000000000.000000) can0 705#R1\n");
}

Frame random_frame(std::mt19937& random) {
  Frame frame;
  frame.flags = static_cast<std::uint8_t>(random() & 1U);  // kExtended
  frame.id = static_cast<std::uint32_t>(random()) & (frame.extended() ? 0x1FFF'FFFFU : 0x7FFU);
  const auto kind = random() % 3;
  if (kind == 0) {
    frame.flags |= Frame::kFd;
    frame.flags |= static_cast<std::uint8_t>(random() & 0x18U);  // BRS, ESI
    frame.length = can::fd_length(random() % 65);
  } else {
    frame.flags = static_cast<std::uint8_t>(frame.flags | (kind == 1 ? Frame::kRemote : 0));
    frame.length = static_cast<std::uint8_t>(random() % 9);
  }
  if (!frame.remote()) {
    std::generate_n(frame.data.begin(), frame.length,
                    [&] { return static_cast<std::byte>(random()); });
  }
  return frame;
}

TEST(CandumpLine, WhatIsWrittenIsReadAgain) {
  std::mt19937 random(4);
  for (int i = 0; i < 2000; ++i) {
    const Frame frame = random_frame(random);
    const std::int64_t stamp = static_cast<std::int64_t>(random()) * 1'000'000;
    std::string line = written(frame, stamp);
    ASSERT_EQ(line.back(), '\n');
    line.pop_back();
    const LogEntry entry = parsed(line);
    ASSERT_EQ(entry.kind, LogEntry::Kind::frame) << line;
    ASSERT_EQ(entry.stamp_ns, stamp) << line;
    ASSERT_TRUE(can::same_content(entry.frame, frame)) << line;
  }
}

TEST(CandumpLine, AnyTextIsHarmless) {
  constexpr std::string_view kLetters = "(0123456789.) canAF#R_x\r'";
  std::mt19937 random(7);
  LogEntry entry;
  LogProblem problem;
  std::size_t good = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string line = "(1.0) can0 181#1122334455667788";
    for (auto changes = random() % 4; changes > 0; --changes) {
      line[random() % line.size()] = kLetters[random() % kLetters.size()];
    }
    line.resize(random() % (line.size() + 1));
    if (parse_log_line(line, entry, problem)) {
      ++good;
    } else {
      ASSERT_GE(problem.column, 1U) << line;
      ASSERT_LE(problem.column, line.size() + 1) << line;
      ASSERT_FALSE(problem.text.empty());
    }
  }
  EXPECT_GT(good, 100U);
}

// A replay reports the same controller states and errors as those recorded.
TEST(CandumpLine, ErrorFramesTellTheSameAgain) {
  ErrorDecoder decoder;
  for (const BusState state : {BusState::error_warning, BusState::error_passive, BusState::bus_off,
                               BusState::error_active}) {
    BusEvent event;
    event.state = state;
    event.transmit_errors = 130;
    event.receive_errors = 7;
    std::array<char, kLogLine> out{};
    std::string line(out.data(), format_log_line(out, 0, "can0", event));
    line.pop_back();
    const LogEntry entry = parsed(line);
    ASSERT_EQ(entry.kind, LogEntry::Kind::error_frame) << line;
    BusEvents events;
    decoder.decode(entry.error, Instant{}, events);
    ASSERT_EQ(events.view().size(), 1U) << line;
    EXPECT_EQ(events.view()[0].state, state);
    EXPECT_EQ(events.view()[0].transmit_errors, 130);
    EXPECT_EQ(events.view()[0].receive_errors, 7);
  }
  BusEvent errors;
  errors.kind = BusEvent::Kind::error;
  errors.errors = can::kTxTimeout | can::kLostArbitration | can::kController | can::kProtocol |
                  can::kTransceiver | can::kNoAcknowledge;
  canfd_frame raw{};
  ASSERT_TRUE(encode_error(errors, raw));
  BusEvents events;
  decoder.decode(raw, Instant{}, events);
  ASSERT_EQ(events.view().size(), 1U);
  EXPECT_EQ(events.view()[0].kind, BusEvent::Kind::error);
  EXPECT_EQ(events.view()[0].errors, errors.errors);
  BusEvent ready;
  ready.kind = BusEvent::Kind::interface_ready;
  EXPECT_FALSE(encode_error(ready, raw)) << "the kernel has no error frame for that";
}

// --- files --------------------------------------------------------------------------------------

class LogFileTest : public testing::Test {
 protected:
  LogFileTest() { std::filesystem::create_directories(folder_); }
  ~LogFileTest() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& text) const {
    const std::string path = (folder_ / "a.log").string();
    std::ofstream(path) << text;
    return path;
  }
  std::vector<std::string> findings(const std::string& text, std::string_view interface = {}) {
    std::vector<std::string> out;
    for (Diagnostic& diagnostic : check_log(write(text), interface)) {
      diagnostic.file = "a.log";
      out.push_back(to_string(diagnostic));
    }
    return out;
  }

 private:
  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("linegate-log-" + std::to_string(::getpid()));
};

TEST_F(LogFileTest, BadLinesAreToldWithTheirPlace) {
  EXPECT_THAT(findings("# log\n(1.0) can0 181#01\n(1.0) can0 181#0\n\nnonsense\n"),
              ElementsAre("a.log:3:17: error: expected the second hexadecimal digit of a byte",
                          "a.log:5:1: error: expected a line of candump -L: "
                          "(seconds.microseconds) can0 181#01"));
  EXPECT_THAT(findings("(1.0) can0 181#01\n"), ElementsAre());
  EXPECT_THAT(findings(""), ElementsAre("a.log: error: there is no frame in the log"));
  EXPECT_THAT(findings("(1.0) can0 181#01\n(2.0) can0 18"),
              ElementsAre("a.log:2:12: warning: the log ends within a line: expected an identifier "
                          "of 3 or 8 hexadecimal digits and #"));
}

TEST_F(LogFileTest, AFileThatIsNoLogDoesNotFloodTheTerminal) {
  std::string text = "(1.0) can0 181#01\n";
  for (int i = 0; i < 1000; ++i) {
    text += "x\n";
  }
  const auto told = findings(text);
  ASSERT_EQ(told.size(), 21U);
  EXPECT_EQ(told.back(), "a.log: error: 980 more lines are not of a log");
}

TEST_F(LogFileTest, InterfacesOfALog) {
  const std::string text = "(1.0) can0 181#01\n(1.0) can1 181#01\n";
  EXPECT_THAT(findings(text), ElementsAre(HasSubstr("warning: the log has frames of can0, can1")));
  EXPECT_THAT(findings(text, "can1"), ElementsAre());
  EXPECT_THAT(findings(text, "can2"),
              ElementsAre("a.log: error: the log has no frame of can2, but of can0, can1"));
  EXPECT_THAT(check_log("/nowhere/a.log", {}),
              ElementsAre(testing::Field(&Diagnostic::text, HasSubstr("No such file"))));
  EXPECT_TRUE(has_errors(check_log("/", {})));
  EXPECT_TRUE(has_errors(check_log("/dev/zero", {}))) << "the file is endless";
}

TEST_F(LogFileTest, LinesMayLieAcrossWhatIsReadAtOnce) {
  std::string text;
  for (int i = 0; i < 20'000; ++i) {
    text += "(" + std::to_string(i) + ".000000) can0 181#0102030405060708\n";
  }
  text += std::string(200'000, '(') + "\n(1.0) can0 182#\n";
  LogFile file;
  ASSERT_EQ(file.open(write(text)), 0);
  LogEntry entry;
  LogProblem problem;
  for (int i = 0; i < 20'000; ++i) {
    ASSERT_EQ(file.next(entry, problem), LogFile::Next::entry) << file.text();
    ASSERT_EQ(entry.stamp_ns, std::int64_t{i} * 1'000'000'000);
    ASSERT_EQ(file.line(), static_cast<std::uint32_t>(i + 1));
  }
  EXPECT_EQ(file.next(entry, problem), LogFile::Next::bad) << "a line that is far too long";
  EXPECT_EQ(file.next(entry, problem), LogFile::Next::entry);
  EXPECT_EQ(entry.frame.id, 0x182U);
  EXPECT_EQ(file.line(), 20'002U);
  EXPECT_EQ(file.next(entry, problem), LogFile::Next::end);
}

}  // namespace
}  // namespace linegate::can_bridge
