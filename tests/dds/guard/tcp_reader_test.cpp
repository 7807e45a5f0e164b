// SPDX-License-Identifier: Apache-2.0
// A receiving thread of Fast DDS reads from one connection, and only RTCP messages.
#include "bridges/dds/guard/tcp_reader.h"

#include <array>
#include <cerrno>

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

namespace linegate::dds::guard {
namespace {

using Event = TcpReader::Event;

// The sockets of the library and of its peer.
class Connection {
 public:
  Connection() {
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends_.data()),
              0);
  }
  ~Connection() {
    ::close(ends_[0]);
    ::close(ends_[1]);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  int socket() const { return ends_[0]; }
  void send_message() const { send({"RTCP\x0f\0\0\0\0\0\0\0\x07\x07!", 15}); }
  void send(std::string_view octets) const {
    EXPECT_EQ(::send(ends_[1], octets.data(), octets.size(), 0),
              static_cast<ssize_t>(octets.size()));
  }
  void end() const { ::shutdown(ends_[1], SHUT_RDWR); }
  bool has_ended() const {
    char octet = 0;
    return ::recv(ends_[1], &octet, 1, 0) == 0;
  }

 private:
  std::array<int, 2> ends_{};
};

class Reader : public testing::Test {
 protected:
  TcpReader::Result receive(TcpReader& from, const Connection& on) {
    return from.receive(on.socket(), buffer.data(), buffer.size(), 0, ::recv);
  }
  void expect(TcpReader& from, const Connection& on, ssize_t received, Event event) {
    const TcpReader::Result result = receive(from, on);
    EXPECT_EQ(result.received, received);
    EXPECT_EQ(result.event, event);
  }

  std::array<char, 100> buffer{};
  TcpReader reader{65'500};
  Connection first, second;
};

TEST_F(Reader, MessagesPass) {
  first.send_message();
  expect(reader, first, 15, Event::begun);
  first.send_message();
  expect(reader, first, 15, Event::none);
  EXPECT_EQ(buffer[14], '!');
  EXPECT_FALSE(first.has_ended());
}

TEST_F(Reader, NothingToReadIsNoEnd) {
  expect(reader, first, -1, Event::none);
  EXPECT_EQ(errno, EAGAIN);
  first.send_message();
  expect(reader, first, 15, Event::begun);
  expect(reader, first, -1, Event::none);
  EXPECT_EQ(errno, EAGAIN);
  first.send_message();
  expect(reader, first, 15, Event::none);
}

TEST_F(Reader, TheEndOfTheConnectionIsPassedOnAsOftenAsItIsRead) {
  first.send_message();
  expect(reader, first, 15, Event::begun);
  first.end();
  expect(reader, first, 0, Event::none);
  expect(reader, first, 0, Event::none);
}

TEST_F(Reader, AConnectionWithOtherOctetsIsEndedAndNothingOfThemPasses) {
  first.send("GET / HTTP/1.1\r\n\r\n");
  expect(reader, first, 0, Event::malformed);
  EXPECT_TRUE(first.has_ended());
  expect(reader, first, 0, Event::none);
}

// What happens when Fast DDS has opened the connection again before its thread ended.
TEST_F(Reader, AThreadThatLostItsConnectionFindsTheNextOneEnded) {
  first.send_message();
  expect(reader, first, 15, Event::begun);
  first.end();
  expect(reader, first, 0, Event::none);
  second.send_message();
  expect(reader, second, 0, Event::shared);

  TcpReader next{65'500};
  expect(next, second, 15, Event::begun);
}

TEST_F(Reader, AlsoIfTheNextOneHasTheSameDescriptor) {
  first.send_message();
  expect(reader, first, 15, Event::begun);
  first.end();
  expect(reader, first, 0, Event::none);
  ASSERT_EQ(::dup2(second.socket(), first.socket()), first.socket());
  expect(reader, first, 0, Event::shared);  // it is open, and has nothing to read
  second.send_message();
  expect(reader, first, 0, Event::shared);
}

TEST_F(Reader, AThreadWhoseConnectionNeverAnsweredReadsNoOtherOne) {
  first.end();
  expect(reader, first, 0, Event::none);
  second.send_message();
  expect(reader, second, 0, Event::shared);
}

TEST_F(Reader, AThreadThatDidNotFindTheEndReadsNoOtherOne) {
  first.send_message();
  expect(reader, first, 15, Event::begun);
  second.send_message();
  expect(reader, second, 0, Event::shared);
  expect(reader, first, 0, Event::shared);  // and none from there on
}

TEST_F(Reader, NorOneThatHasTheDescriptorOfItsOwn) {
  first.send_message();
  expect(reader, first, 15, Event::begun);
  ASSERT_EQ(::dup2(second.socket(), first.socket()), first.socket());
  second.send_message();
  expect(reader, first, 0, Event::shared);
  TcpReader next{65'500};
  expect(next, second, 15, Event::begun);
}

TEST_F(Reader, AnErrorIsPassedOnAndIsTheEnd) {
  const auto reset = [](int, void*, std::size_t, int) -> ssize_t {
    errno = ECONNRESET;
    return -1;
  };
  const TcpReader::Result result = reader.receive(first.socket(), buffer.data(), 4, 0, reset);
  EXPECT_EQ(result.received, -1);
  EXPECT_EQ(errno, ECONNRESET);
  second.send_message();
  expect(reader, second, 0, Event::shared);
}

}  // namespace
}  // namespace linegate::dds::guard
