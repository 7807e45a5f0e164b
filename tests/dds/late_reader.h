// SPDX-License-Identifier: Apache-2.0
// A reader of requests that joins after they were sent, and asks for what was sent before.
#pragma once

#include <cstdint>
#include <set>
#include <thread>

#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/request_tracker.h"

#include "tests/dds/fixtures.h"

namespace linegate::test {

class LateReader {
 public:
  // endpoints: a participant that may read requests; it must outlive this object.
  explicit LateReader(dds::Endpoints& endpoints)
      : known_(endpoints.reader<v1::CommandRequestPubSubType>(v1::TOPIC_COMMAND_REQUEST)) {}

  // A request of a gateway is sent, and later the reader joins: it receives the next ones alone.
  void expect_fresh_requests_only(dds::Client& client, const dds::Target& target) {
    ASSERT_NE(known_, nullptr);
    const std::uint64_t old = send(client, target);
    std::this_thread::sleep_for(5 * dds::kSampleLifetime);  // without poll() it is not repeated
    client.cancel(old);
    ASSERT_NO_FATAL_FAILURE(join());
    std::set<std::uint64_t> fresh;
    EXPECT_TRUE(eventually([&] {
      fresh.insert(send(client, target));
      client.poll(std::chrono::milliseconds(20), nobody_);
      take();
      return !received_.empty();
    }));
    EXPECT_FALSE(received_.contains(old)) << "it is older than its lifetime";
  }

 private:
  static std::uint64_t send(dds::Client& client, const dds::Target& target) {
    return client.send(target, line::Command{.request = line::NetworkRead{.network = 7, .node = 5}},
                       std::chrono::seconds(30));
  }
  // Not volatile: a writer that keeps samples sends them.
  void join() {
    auto* const subscriber =
        const_cast<eprosima::fastdds::dds::Subscriber*>(known_->get_subscriber());
    eprosima::fastdds::dds::DataReaderQos qos = known_->get_qos();
    qos.durability().kind = eprosima::fastdds::dds::TRANSIENT_LOCAL_DURABILITY_QOS;
    auto* const topic =
        const_cast<eprosima::fastdds::dds::TopicDescription*>(known_->get_topicdescription());
    late_ = subscriber->create_datareader(topic, qos);
    ASSERT_NE(late_, nullptr);
  }
  void take() {
    v1::CommandRequest sample;
    eprosima::fastdds::dds::SampleInfo info;
    while (late_->take_next_sample(&sample, &info) ==
           eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      if (info.valid_data)
        received_.insert(sample.id());
    }
  }

  // Is there before the request, so that the participants know each other.
  eprosima::fastdds::dds::DataReader* const known_;
  eprosima::fastdds::dds::DataReader* late_ = nullptr;
  dds::ClientListener nobody_;
  std::set<std::uint64_t> received_;
};

}  // namespace linegate::test
