// SPDX-License-Identifier: Apache-2.0
// The readers of named topics that applications write (bridges/named), one for each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/named_read_type.h"
#include "bridges/dds/named_topic.h"
#include "bridges/dds/sample_port.h"
#include "bridges/dds/waiting.h"

namespace linegate::dds {

// Used by the thread that receives samples; add() and remove() while it does not.
class NamedReaders {
 public:
  // Both must outlive it.
  NamedReaders(Endpoints& endpoints, Waiting& waiting) : endpoints_(endpoints), waiting_(waiting) {}

  // The QoS is that of OutputWrite. Returns false if there is such a topic already, or it could not
  // be created.
  bool add(const NamedTopic& topic);
  void remove(std::span<const std::string> topics);
  // The next sample of any topic, of each in turn. Returns the line of its topic; nullptr if there
  // is no sample.
  const std::string* take(NamedReceived& sample, eprosima::fastdds::dds::SampleInfo& info);
  // As InboundReader::renew_if_full(), for all readers.
  void renew_if_full();
  // As InboundReader::misfit(): of the first topic that has one.
  SamplePort::Misfit misfit(std::string_view (*name)(std::uint32_t policy));

 private:
  struct Reader {
    NamedTopic topic;
    eprosima::fastdds::dds::Topic* made = nullptr;
    eprosima::fastdds::dds::DataReader* reader = nullptr;
  };
  void open(Reader& reader);
  void close(Reader& reader);

  Endpoints& endpoints_;
  Waiting& waiting_;
  std::vector<Reader> readers_;
  std::size_t next_ = 0;  // to take from
};

}  // namespace linegate::dds
