// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/tcp_input.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <optional>
#include <set>
#include <vector>

#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "bridges/dds/guard/imports.h"
#include "bridges/dds/guard/stalled_connections.h"
#include "bridges/dds/guard/tcp_reader.h"

namespace linegate::dds::guard {
namespace {

// Opening a channel does not wait for a peer. Limited, because it may wait for a receiving thread
// of the channel that it replaces.
constexpr std::chrono::seconds kOpening{1};

struct Process {
  std::mutex mutex;
  std::condition_variable opened;
  int opening = 0;
  std::vector<std::weak_ptr<Guard>> guards;
  LostPeers::Connection last = 0;
  std::set<LostPeers::Connection> open;  // those whose octets are checked
  TcpTransport all{std::numeric_limits<std::size_t>::max(), false};
  bool replaced = false;  // recv() of the library
};

// Never destroyed: receiving threads may outlive static objects.
Process& process() {
  static auto* const it = new Process;
  return *it;
}

TcpTransport all_transports() {
  const std::lock_guard lock(process().mutex);
  return process().all;
}

void count(Reason reason) {
  const std::lock_guard lock(process().mutex);
  for (const auto& each : process().guards) {
    if (const auto guard = each.lock())
      guard->connection_ended(reason);
  }
}

// See OpeningChannel.
void await_opened() {
  std::unique_lock lock(process().mutex);
  process().opened.wait_for(lock, kOpening, [] { return process().opening == 0; });
}

bool has_begun_with(int socket, ssize_t received) {
  tcp_info info{};
  socklen_t size = sizeof info;
  return received > 0 && ::getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size) == 0 &&
         info.tcpi_bytes_received <= static_cast<std::uint64_t>(received);
}

ssize_t receive_unchecked(int socket, void* buffer, std::size_t size, int flags) {
  const ssize_t received = ::recv(socket, buffer, size, flags);
  const int error = errno;
  if (has_begun_with(socket, received))
    limit_stalls(socket);
  if (received > 0)
    await_opened();
  errno = error;
  return received;
}

// The connection of a receiving thread.
class Connection {
 public:
  Connection() : transport_(all_transports()), reader_(transport_.largest) {
    const std::lock_guard lock(process().mutex);
    number_ = ++process().last;
    process().open.insert(number_);
  }
  ~Connection() { close(); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  bool is_checked() const { return !transport_.tls; }
  LostPeers::Connection number() const { return reader_.is_accepted() ? number_ : 0; }
  TcpReader::Result receive(int socket, void* buffer, std::size_t size, int flags) {
    const TcpReader::Result result = reader_.receive(socket, buffer, size, flags, ::recv);
    if (reader_.has_ended()) {
      const int error = errno;
      close();
      errno = error;
    }
    return result;
  }

 private:
  void close() const {
    const std::lock_guard lock(process().mutex);
    process().open.erase(number_);
  }

  const TcpTransport transport_;
  TcpReader reader_;
  LostPeers::Connection number_ = 0;
};

thread_local std::optional<Connection> connection;

// In place of recv(2).
ssize_t receive(int socket, void* buffer, std::size_t size, int flags) {
  if (!connection)
    connection.emplace();
  if (!connection->is_checked())
    return receive_unchecked(socket, buffer, size, flags);
  const TcpReader::Result result = connection->receive(socket, buffer, size, flags);
  const int error = errno;
  switch (result.event) {
    case TcpReader::Event::none:
      break;
    case TcpReader::Event::begun:
      limit_stalls(socket);
      break;
    case TcpReader::Event::malformed:
      count(Reason::stream);
      break;
    case TcpReader::Event::shared:
      count(Reason::reader);
      break;
  }
  if (result.received > 0)
    await_opened();
  errno = error;
  return result.received;
}

}  // namespace

bool check_tcp_input(const TcpTransport& transport, const std::shared_ptr<Guard>& guard) {
  Process& it = process();
  const std::lock_guard lock(it.mutex);
  it.guards.erase(std::remove_if(it.guards.begin(), it.guards.end(),
                                 [](const auto& each) { return each.expired(); }),
                  it.guards.end());
  it.guards.push_back(guard);
  it.all.largest = std::min(it.all.largest, transport.largest);
  it.all.tls = it.all.tls || transport.tls;
  it.replaced =
      it.replaced || replace_import("libfastrtps.so", "recv", reinterpret_cast<void*>(receive));
  return it.replaced;
}

LostPeers::Connection receiving_connection() {
  return connection ? connection->number() : 0;
}

bool has_ended(LostPeers::Connection which) {
  const std::lock_guard lock(process().mutex);
  return !process().open.contains(which);
}

bool is_opening_channel() {
  const std::lock_guard lock(process().mutex);
  return process().opening != 0;
}

OpeningChannel::OpeningChannel() {
  const std::lock_guard lock(process().mutex);
  ++process().opening;
}

OpeningChannel::~OpeningChannel() {
  {
    const std::lock_guard lock(process().mutex);
    --process().opening;
  }
  process().opened.notify_all();
}

}  // namespace linegate::dds::guard
