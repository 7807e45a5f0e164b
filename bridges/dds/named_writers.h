// SPDX-License-Identifier: Apache-2.0
// The writers of named topics (bridges/named), one for each. They come and go with the layouts of
// the lines.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/named_topic.h"
#include "bridges/dds/named_type.h"
#include "bridges/dds/reader_watch.h"
#include "bridges/dds/renewed_writer.h"
#include "stack/base/time.h"

namespace linegate::dds {

// Used by the thread that writes samples.
class NamedWriters {
 public:
  // endpoints must outlive it, and `readers` must outlive endpoints. renew_after: samples, see
  // RenewedWriter.
  NamedWriters(Endpoints& endpoints, std::uint64_t renew_after, ReaderWatch& readers)
      : endpoints_(endpoints), renew_after_(renew_after), readers_(readers) {}

  // The QoS is that of ProcessImage. partition: see Endpoints::writer_beside(). Returns false if
  // there is such a topic already, or it could not be created.
  bool add(const NamedTopic& topic, const std::string& partition);
  // Ends their instances, if they have a key, which readers receive, and removes their writers.
  // Waits for readers that do not acknowledge, kPatience at most for all together.
  void remove(std::span<const std::string> topics);
  // Whether the topic has readers. If it has none, its last sample is removed: samples are not
  // written then, and a later reader would take it for the current one. ReaderWatch reports when to
  // call it again.
  bool has_readers(std::string_view topic);
  // Returns false if there is no such topic, or DDS refused the sample.
  bool write(std::string_view topic, std::span<const std::byte> sample);
  // Waits until all readers have received all samples.
  void wait_for_acknowledgments(Duration most);

 private:
  static constexpr std::chrono::milliseconds kPatience{200};

  struct Topic {
    eprosima::fastdds::dds::Topic* topic = nullptr;
    std::unique_ptr<RenewedWriter> writer;
    bool has_instances = true;  // false: the topic has no key
  };
  void remove(Topic& topic);

  Endpoints& endpoints_;
  std::uint64_t renew_after_;
  ReaderWatch& readers_;
  std::map<std::string, Topic, std::less<>> topics_;
};

}  // namespace linegate::dds
