// SPDX-License-Identifier: Apache-2.0
// The system ends TCP connections whose peer reads nothing any more.
#include "bridges/dds/guard/stalled_connections.h"

#include <cerrno>
#include <vector>

#include <gtest/gtest.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace linegate::test {
namespace {

class StalledConnections : public testing::Test {
 protected:
  void SetUp() override {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    auto* const address = reinterpret_cast<sockaddr*>(&to);
    socklen_t size = sizeof to;
    ASSERT_EQ(::bind(listener_, address, size), 0);
    ASSERT_EQ(::listen(listener_, 1), 0);
    ASSERT_EQ(::getsockname(listener_, address, &size), 0);
    ASSERT_GE(dds::guard::limit_stalls_of_listeners(), 1U);
    ASSERT_EQ(::connect(client_, address, size), 0);
    accepted_ = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    ASSERT_GE(accepted_, 0);
  }
  ~StalledConnections() override {
    for (const int socket : {listener_, client_, accepted_})
      ::close(socket);
  }

  const int listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int client_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  int accepted_ = -1;
};

TEST_F(StalledConnections, AcceptedOnesInheritTheLimit) {
  unsigned limit = 0;
  socklen_t size = sizeof limit;
  ASSERT_EQ(::getsockopt(accepted_, IPPROTO_TCP, TCP_USER_TIMEOUT, &limit, &size), 0);
  EXPECT_EQ(limit, dds::guard::kStalled.count());
}

TEST_F(StalledConnections, ABlockedSendEnds) {
  const std::vector<char> data(1U << 20U);
  ssize_t sent = 0;
  while (sent >= 0)  // blocks when the buffers are full, because the peer does not read
    sent = ::send(accepted_, data.data(), data.size(), MSG_NOSIGNAL);
  EXPECT_TRUE(errno == ETIMEDOUT || errno == EPIPE || errno == ECONNRESET) << errno;
}

TEST(StalledConnectionsOfOthers, AreRefused) {
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  EXPECT_FALSE(dds::guard::limit_stalls(socket));
  ::close(socket);
}

}  // namespace
}  // namespace linegate::test
