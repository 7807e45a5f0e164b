// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/output_readers.h"

#include <utility>

#include "bridges/dds/security.h"

namespace linegate::dds {

OutputReaders::OutputReaders(Endpoints& endpoints, Waiting& waiting, std::string gateway)
    : endpoints_(endpoints), waiting_(waiting), gateway_(std::move(gateway)) {
  if (gateway_.empty())
    readers_[""] = std::make_unique<Reader>(endpoints_, waiting_, v1::TOPIC_OUTPUT_WRITE);
}

bool OutputReaders::add(const std::string& line) {
  {
    const std::lock_guard lock(mutex_);
    if (gateway_.empty() || readers_.contains(line))
      return true;
  }
  // Without the mutex: discovery takes time.
  auto made = std::make_unique<Reader>(endpoints_, waiting_, v1::TOPIC_OUTPUT_WRITE,
                                       request_partition(gateway_, line, "*"));
  const bool exists = made->exists();
  const std::lock_guard lock(mutex_);
  readers_[line] = std::move(made);
  return exists;
}

void OutputReaders::remove(const std::string& line) {
  std::unique_ptr<Reader> removed;
  const std::lock_guard lock(mutex_);
  if (const auto found = readers_.find(line); !gateway_.empty() && found != readers_.end()) {
    removed = std::move(found->second);
    readers_.erase(found);
  }
}

bool OutputReaders::take(v1::OutputWrite& sample, eprosima::fastdds::dds::SampleInfo& info) {
  const std::lock_guard lock(mutex_);
  auto next = readers_.upper_bound(last_);
  for (std::size_t tried = 0; tried < readers_.size(); ++tried) {
    if (next == readers_.end())
      next = readers_.begin();
    if (next->second->take(sample, info)) {
      last_ = next->first;
      return true;
    }
    ++next;
  }
  return false;
}

std::uint32_t OutputReaders::misfit() {
  const std::lock_guard lock(mutex_);
  for (const auto& [line, reader] : readers_) {
    if (const std::uint32_t policy = reader->misfit(); policy != 0)
      return policy;
  }
  return 0;
}

void OutputReaders::renew_if_full() {
  const std::lock_guard lock(mutex_);
  for (const auto& [line, reader] : readers_)
    reader->renew_if_full();
}

}  // namespace linegate::dds
