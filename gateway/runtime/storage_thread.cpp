// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/storage_thread.h"

#include <utility>

#include <poll.h>
#include <pthread.h>

namespace linegate::gateway {

StoredParameters::StoredParameters(std::string path, exchange::Wakeup& storage,
                                   exchange::Wakeup& line, FileCalls& calls)
    : file_(std::move(path), calls), storage_(storage), line_(line) {
}

bool StoredParameters::keep(std::span<const std::byte> image) {
  if (busy_ || !images_.push(std::vector<std::byte>(image.begin(), image.end()))) {
    return false;
  }
  busy_ = true;
  storage_.signal();
  return true;
}

std::optional<bool> StoredParameters::pop_result() {
  char good = 0;
  if (!busy_ || !results_.pop(good)) {
    return std::nullopt;
  }
  busy_ = false;
  return good != 0;
}

void StoredParameters::write_pending() {
  for (std::vector<std::byte> image; images_.pop(image);) {
    (void)results_.push(
        // There is room: only one write is pending at a time
        static_cast<char>(file_.keep(image)));
    line_.signal();
  }
}

StoredParameters& StorageThread::add(const std::string& path, exchange::Wakeup& line,
                                     FileCalls& calls) {
  files_.push_back(std::make_unique<StoredParameters>(path, wakeup_, line, calls));
  return *files_.back();
}

void StorageThread::remove(const StoredParameters& file) {
  std::erase_if(files_, [&](const auto& other) { return other.get() == &file; });
}

void StorageThread::start() {
  stop_.lower();
  if (!files_.empty()) {
    thread_ = std::thread([this] { run(); });
  }
}

void StorageThread::stop() {
  stop_.raise();
  wakeup_.signal();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void StorageThread::run() {
  pthread_setname_np(pthread_self(), "parameters");
  for (;;) {
    wakeup_.clear();
    const bool last = stop_.raised();
    for (const auto& file : files_) {
      file->write_pending();
    }
    if (last) {
      return;
    }
    pollfd waiting{wakeup_.descriptor(), POLLIN, 0};
    poll(&waiting, 1, -1);
  }
}

}  // namespace linegate::gateway
