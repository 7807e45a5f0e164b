// SPDX-License-Identifier: Apache-2.0
// Passes received datagrams on in a thread of its own.
//
// Fast DDS 2.9.1 has one receiving thread for each TCP connection. When a participant connects
// again, TCPTransportInterface::OpenOutputChannel() joins the thread of the old connection while
// it holds the lock that every sending thread takes. If that thread processes a datagram, or waits
// until it may, it waits for this lock, or for another thread that does: then nothing is sent any
// more, to nobody. So a receiving thread must never process a datagram.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace linegate::dds::guard {

template <class Item>
class DeliveryThread {
 public:
  // Octets that may wait. A sender that is faster is slowed down by its connection.
  static constexpr std::size_t kRoom = std::size_t{1} << 20;

  // deliver: called for each item, in their order, by one thread.
  explicit DeliveryThread(std::function<void(Item&)> deliver)
      : deliver_(std::move(deliver)), thread_([this] { run(); }) {}
  // Drops what waits.
  ~DeliveryThread() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  DeliveryThread(const DeliveryThread&) = delete;
  DeliveryThread& operator=(const DeliveryThread&) = delete;

  // From any thread. While kRoom is used, waits, but never if must_not_wait() is true: then the
  // item is dropped. Returns whether it will be delivered.
  template <class MustNotWait>
  bool add(Item item, std::size_t octets, MustNotWait must_not_wait) {
    std::unique_lock lock(mutex_);
    while (waiting_ != 0 && waiting_ + octets > kRoom && !ends_) {
      if (must_not_wait())
        return false;
      changed_.wait_for(lock, kLook);
    }
    waiting_ += octets;
    items_.emplace_back(std::move(item), octets);
    changed_.notify_all();
    return true;
  }

  // Drops what waits, and returns when nothing is being delivered: what the items refer to may end
  // then.
  void drop_all() {
    std::unique_lock lock(mutex_);
    items_.clear();
    waiting_ = 0;
    changed_.notify_all();
    if (std::this_thread::get_id() != thread_.get_id())
      changed_.wait(lock, [this] { return !delivers_; });
  }

 private:
  static constexpr std::chrono::milliseconds kLook{20};

  void run() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [this] { return ends_ || !items_.empty(); });
      if (ends_)
        return;
      auto [item, octets] = std::move(items_.front());
      items_.pop_front();
      waiting_ -= octets;
      delivers_ = true;
      lock.unlock();
      changed_.notify_all();
      deliver_(item);
      lock.lock();
      delivers_ = false;
      changed_.notify_all();
    }
  }

  const std::function<void(Item&)> deliver_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::pair<Item, std::size_t>> items_;
  std::size_t waiting_ = 0;  // octets
  bool delivers_ = false;
  bool ends_ = false;
  std::thread thread_;  // the last member: it uses the others
};

}  // namespace linegate::dds::guard
