// SPDX-License-Identifier: Apache-2.0
// The system ends TCP connections whose peer reads nothing any more.
#include "bridges/dds/guard/stalled_connections.h"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <linux/sockios.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
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

  static unsigned limit_of(int socket) {
    unsigned limit = 0;
    socklen_t size = sizeof limit;
    EXPECT_EQ(::getsockopt(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, &limit, &size), 0);
    return limit;
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

TEST_F(StalledConnections, OpenedOnesGetTheLimitPeriodically) {
  EXPECT_EQ(limit_of(client_), 0U) << "the system sets none";
  dds::guard::StallLimits limits;
  const std::chrono::seconds now(7);
  EXPECT_GE(limits.advance(now), 1U);
  EXPECT_EQ(limit_of(client_), dds::guard::kStalled.count());

  const unsigned none = 0;  // as if it had been opened again
  ASSERT_EQ(::setsockopt(client_, IPPROTO_TCP, TCP_USER_TIMEOUT, &none, sizeof none), 0);
  EXPECT_EQ(limits.advance(now + dds::guard::StallLimits::kPeriod - std::chrono::nanoseconds(1)),
            0U);
  EXPECT_EQ(limit_of(client_), 0U);
  EXPECT_EQ(limits.advance(now + dds::guard::StallLimits::kPeriod), 1U);
  EXPECT_EQ(limit_of(client_), dds::guard::kStalled.count());
}

TEST_F(StalledConnections, AnotherLimitIsKept) {
  const unsigned own = 9000;
  ASSERT_EQ(::setsockopt(client_, IPPROTO_TCP, TCP_USER_TIMEOUT, &own, sizeof own), 0);
  dds::guard::limit_stalls_of_all();
  EXPECT_EQ(limit_of(client_), own);
}

// The send blocks first; another thread sets the limit afterwards.
TEST_F(StalledConnections, TheLimitEndsASendThatAlreadyBlocks) {
  std::atomic<bool> ended = false;
  std::thread sender([&] {
    const std::vector<char> data(1U << 20U);
    while (::send(client_, data.data(), data.size(), MSG_NOSIGNAL) >= 0) {
    }
    ended = true;
  });
  const auto queued = [&] {
    int octets = 0;
    return ::ioctl(client_, SIOCOUTQ, &octets) == 0 ? octets : -1;
  };
  for (int before = 0, now = queued(); now == 0 || now != before;) {  // until it blocks
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    before = std::exchange(now, queued());
  }
  EXPECT_FALSE(ended);
  EXPECT_GE(dds::guard::limit_stalls_of_all(), 1U);
  sender.join();
  EXPECT_TRUE(ended);
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
