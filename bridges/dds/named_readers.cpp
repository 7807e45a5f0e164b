// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/named_readers.h"

#include <algorithm>
#include <utility>

#include <linegate.h>

#include "bridges/dds/inbound_reader.h"

namespace linegate::dds {

bool NamedReaders::add(const NamedTopic& topic) {
  const auto is_known = [&](const Reader& known) { return known.topic.topic == topic.topic; };
  if (std::ranges::any_of(readers_, is_known))
    return false;
  Reader reader{.topic = topic};
  reader.made = endpoints_.add_own_topic(
      topic.topic, eprosima::fastdds::dds::TypeSupport(
                       new NamedReadType(topic.type, topic.max_size, endpoints_.unreadable())));
  if (reader.made == nullptr)
    return false;
  open(reader);
  if (reader.reader == nullptr) {
    endpoints_.remove_own_topic(reader.made);
    return false;
  }
  readers_.push_back(std::move(reader));
  return true;
}

void NamedReaders::remove(std::span<const std::string> topics) {
  std::erase_if(readers_, [&](Reader& reader) {
    if (std::ranges::find(topics, reader.topic.topic) == topics.end())
      return false;
    close(reader);
    endpoints_.remove_own_topic(reader.made);
    return true;
  });
  next_ = 0;
}

void NamedReaders::open(Reader& reader) {
  reader.reader = endpoints_.reader_of(reader.made, v1::TOPIC_OUTPUT_WRITE);
  if (reader.reader != nullptr)
    waiting_.watch(reader.reader);
}

void NamedReaders::close(Reader& reader) {
  if (reader.reader == nullptr)
    return;
  waiting_.forget(reader.reader);
  endpoints_.remove(std::exchange(reader.reader, nullptr));
}

const std::string* NamedReaders::take(NamedReceived& sample,
                                      eprosima::fastdds::dds::SampleInfo& info) {
  for (std::size_t tried = 0; tried < readers_.size(); ++tried) {
    Reader& reader = readers_[next_];
    next_ = (next_ + 1) % readers_.size();
    if (reader.reader != nullptr && reader.reader->take_next_sample(&sample, &info) ==
                                        eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      sample.topic = reader.topic.topic;
      return &reader.topic.line;
    }
  }
  return nullptr;
}

void NamedReaders::renew_if_full() {
  for (Reader& reader : readers_) {
    if (reader.reader != nullptr && !rejects_instances(*reader.reader))
      continue;
    close(reader);
    open(reader);
  }
}

SamplePort::Misfit NamedReaders::misfit(std::string_view (*name)(std::uint32_t policy)) {
  for (const Reader& reader : readers_) {
    const std::uint32_t policy = reader.reader == nullptr ? 0U : misfit_of(*reader.reader);
    if (policy != 0)
      return {reader.topic.topic, name(policy)};
  }
  return {};
}

}  // namespace linegate::dds
