// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/named_writers.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include <fastdds/dds/publisher/DataWriter.hpp>
#include <linegate.h>

#include "bridges/dds/type_description.h"
#include "bridges/dds/waiting.h"

namespace linegate::dds {
namespace {

void wait_for_readers_of(eprosima::fastdds::dds::DataWriter* writer,
                         std::chrono::steady_clock::time_point deadline) {
  const auto left =
      std::max(Duration::zero(), Duration{deadline - std::chrono::steady_clock::now()});
  writer->wait_for_acknowledgments(to_dds(left));
}

}  // namespace

bool NamedWriters::add(const NamedTopic& topic, const std::string& partition) {
  if (topics_.contains(topic.topic))
    return false;
  Topic made;
  made.has_instances = !topic.key.empty();
  const bool described = !topic.members.empty() && describe_type(topic.type, topic.members);
  made.topic = endpoints_.add_own_topic(
      topic.topic,
      eprosima::fastdds::dds::TypeSupport(new NamedType(topic.type, topic.max_size, topic.key)),
      described);
  if (made.topic == nullptr)
    return false;
  made.writer = std::make_unique<RenewedWriter>(
      endpoints_, renew_after_, RenewedWriter::Keep::until_received,
      [this, partition, own = made.topic] {
        return endpoints_.writer_of(own, v1::TOPIC_PROCESS_IMAGE, partition, &readers_);
      });
  if (made.writer->writer() == nullptr) {
    remove(made);
    return false;
  }
  topics_.emplace(topic.topic, std::move(made));
  return true;
}

void NamedWriters::remove(Topic& topic) {
  if (topic.writer)
    topic.writer->remove();
  endpoints_.remove_own_topic(topic.topic);
}

// A topic has one type in a participant, so a topic of another type can follow only when its writer
// is removed. The end of an instance would be lost with its writer.
void NamedWriters::remove(std::span<const std::string> topics) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  std::vector<decltype(topics_)::node_type> ending;
  for (const std::string& topic : topics) {
    if (auto node = topics_.extract(topic))
      ending.push_back(std::move(node));
  }
  NamedData any;
  for (const auto& node : ending) {
    if (!node.mapped().has_instances)
      continue;
    node.mapped().writer->each([&](auto* writer) {
      writer->unregister_instance(&any, eprosima::fastdds::dds::HANDLE_NIL);
    });
  }
  for (auto& node : ending) {
    node.mapped().writer->each([&](auto* writer) { wait_for_readers_of(writer, deadline); });
    remove(node.mapped());
  }
}

bool NamedWriters::has_readers(std::string_view topic) {
  const auto found = topics_.find(topic);
  if (found == topics_.end())
    return false;
  RenewedWriter& writer = *found->second.writer;
  eprosima::fastdds::dds::PublicationMatchedStatus status;
  writer.writer()->get_publication_matched_status(status);
  if (status.current_count != 0)
    return true;
  writer.each([](auto* one) {
    std::size_t removed = 0;
    one->clear_history(&removed);
  });
  return false;
}

bool NamedWriters::write(std::string_view topic, std::span<const std::byte> sample) {
  const auto found = topics_.find(topic);
  if (found == topics_.end())
    return false;
  NamedData data{sample};
  return found->second.writer->next()->write(&data);
}

void NamedWriters::wait_for_acknowledgments(Duration most) {
  const auto deadline = std::chrono::steady_clock::now() + most;
  for (const auto& [name, topic] : topics_)
    topic.writer->each([&](auto* writer) { wait_for_readers_of(writer, deadline); });
}

}  // namespace linegate::dds
