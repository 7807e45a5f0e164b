// SPDX-License-Identifier: Apache-2.0
// Recording of a line: the contents of the file, a full disk, and a replay that produces the same
// image.
#include "gateway/runtime/recorder.h"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <deque>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "bridges/can/replay.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/line_runner.h"
#include "gateway/runtime/signals.h"
#include "gateway/tools/record.h"

#include "tests/gateway/plans.h"
#include "tests/gateway/runtime/fake_channel.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

// Files in memory, on a disk of limited size.
class SmallDisk final : public FileCalls {
 public:
  int append(const std::string& path, std::uint64_t& size) override {
    if (broken != 0) {
      errno = broken;
      return -1;
    }
    open_.push_back(path);
    size = files[path].size();
    return static_cast<int>(open_.size()) + 99;
  }
  int truncate(int descriptor, std::uint64_t size) override {
    files[name(descriptor)].resize(size);
    return 0;
  }
  std::ptrdiff_t write(int descriptor, std::span<const std::byte> bytes) override {
    std::size_t used = 0;
    for (const auto& [path, text] : files) {
      used += text.size();
    }
    const std::size_t taken = std::min(bytes.size(), used < capacity ? capacity - used : 0);
    if (taken == 0) {
      errno = ENOSPC;
      return -1;
    }
    files[name(descriptor)].append(reinterpret_cast<const char*>(bytes.data()), taken);
    return static_cast<std::ptrdiff_t>(taken);
  }
  int close(int /*descriptor*/) override { return 0; }
  int rename(const std::string& from, const std::string& to) override {
    if (!files.contains(from)) {
      errno = ENOENT;
      return -1;
    }
    files[to] = std::move(files[from]);
    files.erase(from);
    return 0;
  }
  int remove(const std::string& path) override {
    errno = ENOENT;
    return files.erase(path) > 0 ? 0 : -1;
  }

  std::map<std::string, std::string> files;
  std::size_t capacity = SIZE_MAX;
  int broken = 0;

 private:
  const std::string& name(int descriptor) const {
    return open_.at(static_cast<std::size_t>(descriptor - 100));
  }
  std::vector<std::string> open_;
};

config::Record plan(std::uint64_t max_size = 1'000'000, unsigned files = 3) {
  return {"a.log", max_size, files};
}

TEST(RecordFile, KeepsSoManyFilesOfSuchASize) {
  SmallDisk disk;
  RecordFile file(plan(10, 3), disk);
  for (const char* line :
       {"1234\n", "5678\n", "9\n", "abcdefgh\n", "i\n", "jklmnopqrst\n", "u\n"}) {
    EXPECT_EQ(file.append(line), 0);
  }
  EXPECT_THAT(disk.files,
              ElementsAre(std::pair("a.log", "u\n"), std::pair("a.log.1", "jklmnopqrst\n"),
                          std::pair("a.log.2", "i\n")))
      << "abcdefgh and i together would have been too long, and what is older than two files is "
         "gone";
}

TEST(RecordFile, OneFileBeginsAgain) {
  SmallDisk disk;
  RecordFile file(plan(4, 1), disk);
  EXPECT_EQ(file.append("123\n"), 0);
  EXPECT_EQ(file.append("456\n"), 0);
  EXPECT_THAT(disk.files, ElementsAre(std::pair("a.log", "456\n")));
}

TEST(RecordFile, AFullDiskLeavesNoHalfLine) {
  SmallDisk disk;
  disk.capacity = 8;
  RecordFile file(plan(), disk);
  EXPECT_EQ(file.append("12345\n"), 0);
  EXPECT_EQ(file.append("67890\n"), ENOSPC);
  EXPECT_EQ(disk.files["a.log"], "12345\n");
  disk.capacity = 100;
  EXPECT_EQ(file.append("abc\n"), 0);
  EXPECT_EQ(disk.files["a.log"], "12345\nabc\n");
}

class RecordFolderTest : public testing::Test {
 protected:
  RecordFolderTest() { std::filesystem::create_directories(folder); }
  ~RecordFolderTest() override { std::filesystem::remove_all(folder); }

  std::string path(const char* name) const { return (folder / name).string(); }
  static std::string content(const std::string& file) {
    std::ostringstream out;
    out << std::ifstream(file).rdbuf();
    return out.str();
  }

  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("linegate-record-" + std::to_string(::getpid()));
};

TEST_F(RecordFolderTest, ARealFileIsContinuedAfterItsLastWholeLine) {
  std::ofstream(path("a.log")) << "whole\nha";
  RecordFile file({path("a.log"), 20, 2});
  EXPECT_EQ(file.append("next\n"), 0);
  EXPECT_EQ(content(path("a.log")), "whole\nnext\n");
  EXPECT_EQ(file.append("0123456789\n"), 0);
  EXPECT_EQ(content(path("a.log")), "0123456789\n");
  EXPECT_EQ(content(path("a.log.1")), "whole\nnext\n");
  RecordFile nowhere({path("no/a.log"), 20, 2});
  EXPECT_EQ(nowhere.append("x\n"), ENOENT);
}

class RecordingTest : public testing::Test {
 protected:
  can::Frame frame(std::uint32_t id, Duration at) {
    can::Frame out = can::make_frame(id, {1});
    out.time = Instant(at);
    return out;
  }
  std::string& text() { return disk.files["a.log"]; }

  SmallDisk disk;
  exchange::Wakeup wakeup;
  Recording recording{"press", "can0", plan(), wakeup, disk};
};

TEST_F(RecordingTest, IsACandumpLog) {
  recording.add(frame(0x181, 1s));
  can::BusEvent event;
  event.state = can::BusState::error_active;
  recording.add(event);  // not a change
  event.state = can::BusState::error_passive;
  event.time = Instant(1500ms);
  recording.add(event);
  event.kind = can::BusEvent::Kind::frames_lost;
  event.count = 2;
  recording.add(event);
  event.kind = can::BusEvent::Kind::interface_failed;
  recording.add(event);
  recording.work(Instant(2s), 100s);
  EXPECT_EQ(text(),
            "(0000000101.000000) can0 181#01\n"
            "(0000000101.500000) can0 20000204#0030000000000000\n"
            "DROPCOUNT: dropped 2 CAN frames on 'can0' socket (total drops 2)\n");
  EXPECT_EQ(recording.outcome().missing, 0U) << "the interface has lost them";
}

TEST_F(RecordingTest, GoesOnWhenTheDiskHasRoomAgain) {
  recording.add(frame(0x181, 1s));
  recording.work(Instant(1s), 0s);
  const std::string before = text();
  disk.capacity = before.size() + 10;
  recording.add(frame(0x182, 1s));
  recording.add(frame(0x183, 1s));
  recording.work(Instant(1100ms), 0s);
  recording.add(frame(0x184, 1s));
  recording.work(Instant(1200ms), 0s);  // writing is retried only a second later
  disk.capacity = 10'000;
  recording.work(Instant(1300ms), 0s);
  EXPECT_EQ(recording.outcome().error, ENOSPC);
  EXPECT_EQ(recording.outcome().missing, 3U);
  EXPECT_EQ(text(), before) << "neither a partial line nor an unreported gap";
  recording.add(frame(0x185, 2s));
  recording.work(Instant(2500ms), 0s);
  EXPECT_EQ(text(), before +
                        "DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3)\n"
                        "(0000000002.000000) can0 185#01\n");
  EXPECT_EQ(recording.outcome().error, 0);
  EXPECT_EQ(recording.outcome().missing, 3U);
}

TEST_F(RecordingTest, WhatTheWriterIsTooSlowForIsCounted) {
  constexpr std::size_t kMany = 20'000;  // the ring has 16384 places
  for (std::size_t i = 0; i < kMany; ++i) {
    recording.add(frame(0x181, 1s));
  }
  recording.work(Instant(1s), 0s);
  EXPECT_THAT(text(), EndsWith("dropped 3616 CAN frames on 'can0' socket (total drops 3616)\n"));
  recording.add(frame(0x182, 2s));
  recording.work(Instant(2s), 0s);
  EXPECT_THAT(text(), EndsWith("(0000000002.000000) can0 182#01\n"));
  EXPECT_EQ(recording.outcome().missing, 3616U);
}

TEST_F(RecordingTest, AFolderThatIsMissingIsAsAFullDisk) {
  disk.broken = ENOENT;
  recording.add(frame(0x181, 1s));
  recording.work(Instant(1s), 0s);
  disk.broken = 0;
  recording.add(frame(0x182, 2s));
  recording.work(Instant(3s), 0s);
  EXPECT_THAT(text(), StartsWith("DROPCOUNT: dropped 1 CAN frame on 'can0'"));
  EXPECT_THAT(text(), HasSubstr("182#01"));
}

TEST_F(RecordingTest, WhatAnInterfaceCanNeverSendIsNotInTheLog) {
  auto owned = std::make_unique<FakeChannel>();
  FakeChannel& classical = *owned;
  RecordingChannel channel(std::move(owned), recording);
  std::array<can::Frame, 4> frames{frame(0x201, 0s), frame(0x202, 0s), frame(0x800, 0s),
                                   frame(0x204, 0s)};
  frames[1].flags = can::Frame::kFd;
  classical.fd = false;
  classical.accepts = 4;
  EXPECT_EQ(channel.write(frames, Instant(1s)), 4U);
  EXPECT_EQ(classical.counted.refused, 2U);
  classical.fd = true;
  classical.accepts = 2;
  EXPECT_EQ(channel.write(frames, Instant(2s)), 2U) << "the others stay with the caller";
  recording.work(Instant(3s), 0s);
  EXPECT_EQ(text(),
            "(0000000001.000000) can0 201#01\n"
            "(0000000001.000000) can0 204#01\n"
            "(0000000002.000000) can0 201#01\n"
            "(0000000002.000000) can0 202##401\n");
}

// --- a line, recorded and replayed --------------------------------------------------------------

// Plays frames at the times they have, and answers every SDO request of node 5 within 1 ms: uploads
// with 4 zero bytes, downloads with success.
class PlayedChannel final : public can_bridge::Channel {
 public:
  int descriptor() const override { return -1; }
  std::size_t read(std::span<can::Frame> out, can_bridge::BusEvents& events, Instant now) override {
    if (!std::exchange(ready_, true)) {
      can::BusEvent event;
      event.kind = can::BusEvent::Kind::interface_ready;
      event.time = now;
      events.push(event);
    }
    std::size_t count = 0;
    while (count < out.size() && !coming.empty() && coming.front().time <= now) {
      out[count++] = coming.front();
      coming.pop_front();
    }
    events.frames_given(count);
    return count;
  }
  std::size_t write(std::span<const can::Frame> frames, Instant now) override {
    for (const can::Frame& frame : frames) {
      if (frame.id == 0x605) {
        can::Frame answer = frame;
        answer.id = 0x585;
        answer.data[0] =
            std::byte{frame.data[0] == std::byte{0x40} ? std::uint8_t{0x43} : std::uint8_t{0x60}};
        std::fill(answer.data.begin() + 4, answer.data.end(), std::byte{0});
        answer.time = now + 1ms;
        coming.push_front(answer);
      }
    }
    return frames.size();
  }
  std::size_t room(Instant) const override { return 1; }
  bool wants_writable() const override { return false; }
  Instant next_wake() const override { return kNever; }
  const can_bridge::ChannelCounters& counters() const override { return counters_; }

  std::deque<can::Frame> coming;

 private:
  bool ready_ = false;
  can_bridge::ChannelCounters counters_;
};

constexpr const char* kRecordedPlant = R"(schema: 1
lines:
  - name: a
    interface: virtual:a
    reset_nodes: false
    nodes:
      - {id: 5, name: io, eds: bridges/sim/eds/digital-io.eds, check_identity: false}
)";

class RoundTripTest : public RecordFolderTest {
 protected:
  // The inputs of a line after it has run on the channel for `time`.
  std::vector<std::byte> inputs_after(std::unique_ptr<can_bridge::Channel> channel, Instant from,
                                      Duration time) {
    LinePort port;
    exchange::Wakeup consumer;
    LineRunner runner(make_line(plant_.lines.at(0)), std::move(channel), plant_.lines.at(0), port,
                      consumer);
    for (Instant now = from; now <= from + time; now += 1ms) {
      runner.service(now);
    }
    frames_ = runner.line().state().counters.rpdos;
    auto* snapshot = port.image(image::Direction::inputs).fetch();
    return snapshot == nullptr ? std::vector<std::byte>{} : snapshot->bytes;
  }

  config::Plant plant_ = make_plant(kRecordedPlant);
  std::uint64_t frames_ = 0;
};

TEST_F(RoundTripTest, WhatIsRecordedAndReplayedGivesTheSameImage) {
  auto played = std::make_unique<PlayedChannel>();
  std::mt19937 random(5);
  const Instant start(1000s);
  const auto comes = [&](Duration after, std::uint32_t id,
                         std::initializer_list<std::uint8_t> bytes) {
    can::Frame frame = can::make_frame(id, bytes);
    frame.time = start + after;
    played->coming.push_back(frame);
  };
  comes(0ms, 0x7FF, {0});  // start of the log
  comes(1ms, 0x705, {0});
  for (int i = 0; i < 100; ++i) {
    comes(500ms + i * 1ms, 0x185, {static_cast<std::uint8_t>(random()), 7, 8, 9});
  }
  SmallDisk disk;
  exchange::Wakeup wakeup;
  Recording recording("a", "a", plan(), wakeup, disk);
  const auto live =
      inputs_after(std::make_unique<RecordingChannel>(std::move(played), recording), start, 700ms);
  const std::uint64_t received = frames_;
  recording.work(start + 1s, 1'700'000'000s);
  ASSERT_EQ(received, 100U);
  ASSERT_FALSE(live.empty());

  // Without the frames that the line sent: the replaying line sends them itself.
  std::istringstream lines(disk.files["a.log"]);
  std::ofstream log(path("a.log"));
  for (std::string line; std::getline(lines, line);) {
    for (const char* received_id : {" 7FF#", " 705#", " 585#", " 185#"}) {
      log << (line.find(received_id) != std::string::npos ? line + '\n' : std::string());
    }
  }
  // The bus stays silent until then, rather than the log ending.
  log << "(1700001010.000000) a 7FF#\n";
  log.close();
  const auto replayed =
      inputs_after(can_bridge::open_replay(path("a.log"), {}), Instant(5000s), 700ms);
  EXPECT_EQ(frames_, received);
  EXPECT_EQ(replayed, live);
}

// With the storage thread and real files: replaying a log and recording it yields the same log.
TEST_F(RecordFolderTest, ALogReplayedAndRecordedIsTheSameLog) {
  std::string log;
  for (int i = 0; i < 5000; ++i) {
    log += "(00000" + std::to_string(10000 + i) + ".250000) a 18" + std::to_string(i % 8) + "#0" +
           std::to_string(i % 10) + "\n";
  }
  std::ofstream(path("in.log")) << log;
  {
    Recorder recorder;
    Recording& recording = recorder.add("a", "a", {path("out.log"), 1'000'000, 2});
    RecordingChannel channel(can_bridge::open_replay(path("in.log"), {}), recording);
    recorder.start();
    std::array<can::Frame, 64> frames;
    can_bridge::BusEvents events;
    for (Instant now(10000s); channel.next_wake() != kNever; now += 1s) {
      events.clear();
      channel.read(frames, events, now);
    }
  }
  std::istringstream in(log);
  std::istringstream out(content(path("out.log")));
  std::size_t count = 0;
  for (std::string a, b; std::getline(in, a); ++count) {
    ASSERT_TRUE(std::getline(out, b)) << count;
    ASSERT_EQ(a.substr(a.find(')')), b.substr(b.find(')')));
  }
  EXPECT_EQ(count, 5000U);
}

// The command linegate record.
TEST_F(RecordFolderTest, ACommandWhoseFileCannotBeWrittenFailsAtOnce) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(record({"virtual:a", {path("no-folder/out.log"), 1'000'000, 2}}), kExitFailed);
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              HasSubstr("no-folder/out.log: cannot be written: No such file or directory"));
}

TEST_F(RecordFolderTest, ACommandWhoseFramesCannotBeWrittenFails) {
  std::ofstream(path("in.log")) << "(0000010000.000000) a 181#01\n(0000010000.010000) a 182#\n";
  const auto recorded = [&](const std::string& file) {
    return record({"replay:" + path("in.log"), {file, 1'000'000, 2}});
  };
  sigset_t before;
  pthread_sigmask(SIG_BLOCK, nullptr, &before);
  block_stop_signals();
  testing::internal::CaptureStderr();
  EXPECT_EQ(recorded(path("out.log")), kExitOk);
  EXPECT_EQ(recorded("/dev/full"), kExitFailed);
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              EndsWith("error: /dev/full: the recording stopped: No space left on device; frames "
                       "that are missing: 2\n"));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

}  // namespace
}  // namespace linegate::gateway
