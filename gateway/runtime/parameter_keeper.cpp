// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/parameter_keeper.h"

#include <utility>

#include <poll.h>
#include <pthread.h>

namespace linegate::gateway {

KeptFile::KeptFile(std::string path, exchange::Wakeup& keeper, exchange::Wakeup& line,
                   FileCalls& calls)
    : file_(std::move(path), calls), keeper_(keeper), line_(line) {
}

bool KeptFile::keep(std::span<const std::byte> image) {
  if (busy_ || !images_.push(std::vector<std::byte>(image.begin(), image.end()))) {
    return false;
  }
  busy_ = true;
  keeper_.signal();
  return true;
}

std::optional<bool> KeptFile::take_result() {
  char good = 0;
  if (!busy_ || !results_.pop(good)) {
    return std::nullopt;
  }
  busy_ = false;
  return good != 0;
}

void KeptFile::work() {
  for (std::vector<std::byte> image; images_.pop(image);) {
    (void)results_.push(
        static_cast<char>(file_.keep(image)));  // there is room: one is given at a time
    line_.signal();
  }
}

KeptFile& ParameterKeeper::add(const std::string& path, exchange::Wakeup& line, FileCalls& calls) {
  files_.push_back(std::make_unique<KeptFile>(path, wakeup_, line, calls));
  return *files_.back();
}

void ParameterKeeper::remove(const KeptFile& file) {
  std::erase_if(files_, [&](const auto& other) { return other.get() == &file; });
}

void ParameterKeeper::start() {
  stop_.lower();
  if (!files_.empty()) {
    thread_ = std::thread([this] { run(); });
  }
}

void ParameterKeeper::stop() {
  stop_.raise();
  wakeup_.signal();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void ParameterKeeper::run() {
  pthread_setname_np(pthread_self(), "parameters");
  for (;;) {
    wakeup_.clear();
    const bool last = stop_.raised();
    for (const auto& file : files_) {
      file->work();
    }
    if (last) {
      return;
    }
    pollfd waiting{wakeup_.descriptor(), POLLIN, 0};
    poll(&waiting, 1, -1);
  }
}

}  // namespace linegate::gateway
