// SPDX-License-Identifier: Apache-2.0
// A reader of samples from untrusted writers: no writer can exhaust its instances permanently.
//
// Fast DDS 2.9 keeps an instance for every key of a writer that is alive, read or not, and rejects
// samples of other instances at the limit. When that happens, a new reader replaces this one;
// writers whose samples were rejected repeat them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/waiting.h"

namespace linegate::dds {

// The QoS policy in which a writer discovered since the last call is incompatible; 0: none.
inline std::uint32_t misfit_of(eprosima::fastdds::dds::DataReader& reader) {
  eprosima::fastdds::dds::RequestedIncompatibleQosStatus status;
  reader.get_requested_incompatible_qos_status(status);
  return status.total_count_change == 0 ? 0U : static_cast<std::uint32_t>(status.last_policy_id);
}

// Whether the reader has rejected samples since the last call because it had too many instances.
inline bool rejects_instances(eprosima::fastdds::dds::DataReader& reader) {
  eprosima::fastdds::dds::SampleRejectedStatus status;
  reader.get_sample_rejected_status(status);
  return status.total_count_change != 0 &&
         status.last_reason == eprosima::fastdds::dds::REJECTED_BY_INSTANCES_LIMIT;
}

template <class PubSubType>
class InboundReader {
 public:
  // endpoints and waiting must outlive the reader. endpoints reports whether it could be created.
  // partition: see Endpoints::reader_in(); nothing: that of all readers.
  InboundReader(Endpoints& endpoints, Waiting& waiting, std::string topic,
                std::optional<std::string> partition = {})
      : endpoints_(endpoints),
        waiting_(waiting),
        topic_(std::move(topic)),
        partition_(std::move(partition)) {
    create();
  }

  ~InboundReader() {
    if (reader_ == nullptr)
      return;
    waiting_.forget(reader_);
    endpoints_.remove(reader_);
  }
  InboundReader(const InboundReader&) = delete;
  InboundReader& operator=(const InboundReader&) = delete;

  bool exists() const { return reader_ != nullptr; }

  // Returns false if there is no sample. Callers ignore samples without valid data.
  bool take(typename PubSubType::type& sample, eprosima::fastdds::dds::SampleInfo& info) {
    return reader_ != nullptr && reader_->take_next_sample(&sample, &info) ==
                                     eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK;
  }

  // The QoS policy in which a writer discovered since the last call is incompatible, so that none
  // of its samples are received; 0: none.
  std::uint32_t misfit() { return reader_ == nullptr ? 0U : misfit_of(*reader_); }

  // Call it periodically, after all available samples were taken.
  void renew_if_full() {
    if (reader_ != nullptr && !rejects_instances(*reader_))
      return;
    if (reader_ != nullptr) {
      waiting_.forget(reader_);
      endpoints_.remove(reader_);
    }
    create();
  }

 private:
  void create() {
    reader_ = partition_ ? endpoints_.reader_in<PubSubType>(*partition_, topic_)
                         : endpoints_.reader<PubSubType>(topic_);
    if (reader_ != nullptr)
      waiting_.watch(reader_);
  }

  Endpoints& endpoints_;
  Waiting& waiting_;
  std::string topic_;
  std::optional<std::string> partition_;
  eprosima::fastdds::dds::DataReader* reader_ = nullptr;
};

}  // namespace linegate::dds
