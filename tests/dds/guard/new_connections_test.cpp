// SPDX-License-Identifier: Apache-2.0
// The guard ends TCP connections that are new and have been answered, and no others.
#include "bridges/dds/guard/new_connections.h"

#include <array>

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace linegate::test {
namespace {

using dds::guard::NewConnections;

class Socket {
 public:
  explicit Socket(int descriptor) : descriptor_(descriptor) { EXPECT_GE(descriptor, 0); }
  ~Socket() { ::close(descriptor_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  int get() const { return descriptor_; }
  void send_one() const { EXPECT_EQ(::send(descriptor_, "x", 1, MSG_NOSIGNAL), 1); }
  void await_input() const {
    pollfd input{descriptor_, POLLIN, 0};
    EXPECT_EQ(::poll(&input, 1, 20'000), 1);
  }
  // Waits for data and returns whether the peer has closed the connection.
  bool has_ended() const {
    std::array<char, 8> octets{};
    return ::recv(descriptor_, octets.data(), octets.size(), 0) == 0;
  }

 private:
  const int descriptor_;
};

class Connections : public testing::Test {
 protected:
  static constexpr int kNew = SOCK_STREAM | SOCK_CLOEXEC;

  void SetUp() override {
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    auto* const address = reinterpret_cast<sockaddr*>(&to);
    socklen_t size = sizeof to;
    ASSERT_EQ(::bind(listener.get(), address, size), 0);
    ASSERT_EQ(::listen(listener.get(), 8), 0);
    ASSERT_EQ(::getsockname(listener.get(), address, &size), 0);
  }
  void connect(const Socket& socket) const {
    ASSERT_EQ(::connect(socket.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  }
  int accept() const { return ::accept4(listener.get(), nullptr, nullptr, SOCK_CLOEXEC); }

  sockaddr_in to{};
  Socket listener{::socket(AF_INET, kNew, 0)};
  Socket one{::socket(AF_INET, kNew, 0)};
};

TEST_F(Connections, ANewOneThatWasAnsweredIsEnded) {
  const NewConnections connections(to);
  connect(one);
  const Socket peer(accept());
  peer.send_one();
  one.await_input();
  EXPECT_EQ(connections.end_answered(), 1U);
  EXPECT_TRUE(peer.has_ended());
}

TEST_F(Connections, ANewOneThatWasNotAnsweredStays) {
  const NewConnections connections(to);
  connect(one);
  const Socket peer(accept());
  EXPECT_EQ(connections.end_answered(), 0U);
  one.send_one();
  EXPECT_FALSE(peer.has_ended());
}

TEST_F(Connections, OnesThatWereThereBeforeStay) {
  connect(one);
  const Socket peer(accept());
  peer.send_one();
  one.await_input();
  const NewConnections connections(to);
  EXPECT_EQ(connections.end_answered(), 0U);
  one.send_one();
  EXPECT_FALSE(peer.has_ended());
}

TEST_F(Connections, OnesToAnotherAddressStay) {
  sockaddr_in other = to;
  other.sin_port = 9;
  const NewConnections connections(other);
  connect(one);
  const Socket peer(accept());
  peer.send_one();
  one.await_input();
  EXPECT_EQ(connections.end_answered(), 0U);
  one.send_one();
  EXPECT_FALSE(peer.has_ended());
}

}  // namespace
}  // namespace linegate::test
